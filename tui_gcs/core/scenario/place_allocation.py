"""Allocates take-off places when an edit gives a team more or fewer vehicles."""

import math
from collections.abc import Sequence
from itertools import count

import msgspec
import numpy as np

from tui_gcs.core.geometry.zones import contains
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError
from tui_gcs.core.scenario.model import Limits, Round, Scenario, TakeOffPlace, Team
from tui_gcs.core.scenario.vehicle_conflicts import braking_limits, place_conflicts

Point = tuple[float, float]
LAYER_GAP_M = 2.0
"""The distance between a new layer and the next one beyond the vertical separation, where there is room."""
SPACING_FACTOR = 2.0
"""The spacing of new places as a multiple of the horizontal separation."""
MAX_STEPS = 30
"""How many spacings from the last place a free one is looked for."""


def unused_places(teams: Sequence[Team], places: Sequence[TakeOffPlace]) -> list[int]:
    """Return the indices of places that name a vehicle of no team; none where a team only counts its vehicles."""
    if any(team.count for team in teams):
        return []
    named = {vehicle for team in teams for vehicle in team.vehicles}
    return [i for i, place in enumerate(places) if place.vehicle is not None and place.vehicle not in named]


def vehicles_without_place(teams: Sequence[Team], places: Sequence[TakeOffPlace]) -> list[int | None]:
    """Return the vehicles without a place of their own and without a free one; None stands for a counted vehicle."""
    named = sorted({vehicle for team in teams for vehicle in team.vehicles})
    own = {place.vehicle for place in places}
    without: list[int | None] = [vehicle for vehicle in named if vehicle not in own]
    counted = sum(team.count for team in teams)
    without += [None] * counted
    free = sum(place.vehicle is None or (counted > 0 and place.vehicle not in named) for place in places)
    return without[free:]


def fit_places(
    document: ScenarioDocument, before: Scenario, teams: Sequence[Team], known: Sequence[TakeOffPlace] = ()
) -> None:
    """Give every vehicle in `teams` a place in the text of `before`; places of vehicles that left go to new ones.

    A vehicle that had one of the `known` places gets it back if it is still free. Raises `ScenarioError` where there
    is no room for another place or layer.
    """
    places = list(before.places)
    spare, without = unused_places(teams, places), vehicles_without_place(teams, places)
    staying = [place for i, place in enumerate(places) if i not in spare]
    own = [place for place in known if place.vehicle is not None and place.vehicle in without]
    back = [place for place in own if _is_free(place, staying, before.limits)]
    without = [vehicle for vehicle in without if vehicle not in {place.vehicle for place in back}]
    for i, vehicle in zip(spare, without, strict=False):
        document.set_place(i, msgspec.structs.replace(places[i], vehicle=vehicle))
    for i in reversed(spare[len(without) :]):
        document.remove_place(i)
    for vehicle in without[len(spare) :]:
        limits = braking_limits(before.limits, before.classes)
        places.append(new_place([*places, *back], before.rounds, limits, vehicle, teams))
        document.add_place(places[-1])
    for place in back:
        document.add_place(place)


def same_places(some: Sequence[TakeOffPlace], others: Sequence[TakeOffPlace]) -> bool:
    """Return whether every vehicle has the same place and layer in both. Unnamed places are compared in order."""
    one, other = (
        ({p.vehicle: p for p in each if p.vehicle}, [p for p in each if not p.vehicle]) for each in (some, others)
    )
    return one == other


def new_place(
    places: Sequence[TakeOffPlace],
    rounds: Sequence[Round],
    limits: Limits,
    vehicle: int | None,
    teams: Sequence[Team] = (),
) -> TakeOffPlace:
    """Return a place near the others, inside the area of every round, on a layer of its own.

    With `teams` its layer may be that of vehicles that never come near it. Raises `ScenarioError` where there is no
    room.
    """
    place = TakeOffPlace(_spot(places, rounds, limits), math.nan, vehicle)
    others = list(places)
    if teams:
        near = place_conflicts(rounds, limits, teams, [*places, place])[-1]
        others = [other for i, other in enumerate(places) if near[i]]
    return msgspec.structs.replace(place, layer_m=_layer_m(others, rounds, limits))


def _is_free(place: TakeOffPlace, others: Sequence[TakeOffPlace], limits: Limits) -> bool:
    """Return whether the place and its layer keep the separation from all `others`."""
    return all(
        math.dist(place.place_m, other.place_m) >= limits.separation_horizontal_m
        and abs(place.layer_m - other.layer_m) >= limits.separation_vertical_m
        for other in others
    )


def _spot(places: Sequence[TakeOffPlace], rounds: Sequence[Round], limits: Limits) -> Point:
    """Return the free point nearest to the last place, on a grid around it.

    Of equally near points the one to the north comes first: vehicles are laid out in rows, from a walk along them.
    """
    last = np.array(places[-1].place_m if places else (0.0, 0.0))
    step_m = max(SPACING_FACTOR * limits.separation_horizontal_m, 1.0)
    steps = np.arange(-MAX_STEPS, MAX_STEPS + 1)
    east, north = (axis.ravel() for axis in np.meshgrid(steps, steps))
    order = np.lexsort((east, np.abs(east), -north, np.hypot(east, north)))
    points = last + step_m * np.column_stack([east, north])[order]
    free = np.ones(len(points), dtype=bool)
    for current in rounds:
        free &= contains(current.area.shape, points)
    for place in places:
        free &= np.hypot(*(points - place.place_m).T) >= limits.separation_horizontal_m
    if not free.any():
        raise ScenarioError(["plan: no room for another take-off place in the operating area of every round"])
    east_m, north_m = points[int(np.argmax(free))].tolist()
    return east_m, north_m


def _layer_m(places: Sequence[TakeOffPlace], rounds: Sequence[Round], limits: Limits) -> float:
    """Return a layer above the highest of `places`, else the lowest free one in the altitude band of all rounds."""
    low_m = max(r.area.alt_min_m for r in rounds)
    high_m = min(r.area.alt_max_m for r in rounds)
    taken = [place.layer_m for place in places]
    apart_m = max(limits.separation_vertical_m, 0.1)
    usual_m = max(taken, default=low_m) + apart_m + LAYER_GAP_M
    if usual_m <= high_m:
        return usual_m
    for k in count():
        layer_m = low_m + 0.5 * k
        if layer_m > high_m:
            break
        if layer_m > 0.0 and all(abs(layer_m - other) >= apart_m for other in taken):
            return layer_m
    room = math.floor((high_m - low_m) / apart_m) + 1
    raise ScenarioError(
        [
            f"plan: no altitude layer left for vehicle {len(places) + 1}: {low_m:g} to {high_m:g} m has room for "
            f"{room} at {apart_m:g} m (separation_vertical_m), layers of {len(places)} are there"
        ]
    )
