"""Checks whether the parts of a scenario fit together: names, ids, geometry, altitude layers.

A part that could not be read is None; its problem is noted already, and the other parts are still checked.
"""

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from tui_gcs.core.geometry.local_frame import distance_m
from tui_gcs.core.geometry.zones import Polygon, Role, Shape, Zone, area_m2, contains, polygon_of
from tui_gcs.core.scenario.fields import Problems, nearest, one_of, shown
from tui_gcs.core.scenario.model import Limits, OperatingArea, Round, TakeOffPlace, Team, VehicleClass
from tui_gcs.core.scenario.vehicle_conflicts import STAY_OVER_ZONE, braking_limits, place_conflicts, possible_teams
from tui_gcs.core.scenario.vehicle_conflicts import apart_m as reaches_apart_m

MIN_AREA_M2 = 1.0
"""The smallest area of a shape."""
TOUCH_M = 1e-6
"""The tolerance for a zone that touches the border of its operating area: degrees become metres with rounding."""


@dataclass(frozen=True)
class ScenarioParts:
    """The parts of a file, each with its key path; the value is None where it could not be read."""

    limits: Limits
    rounds: list[tuple[str, Round | None]]
    teams: list[tuple[str, Team | None]]
    places: list[tuple[str, TakeOffPlace | None]]

    def sound(self) -> tuple[tuple[Round, ...], tuple[Team, ...], tuple[TakeOffPlace, ...]]:
        """Return all parts that could be read: rounds, teams, places."""
        return (
            tuple(r for _, r in self.rounds if r is not None),
            tuple(t for _, t in self.teams if t is not None),
            tuple(p for _, p in self.places if p is not None),
        )


def check(
    parts: ScenarioParts,
    problems: Problems,
    known_planners: Collection[str] | None,
    classes: Sequence[VehicleClass] = (),
) -> None:
    """Note every problem between the parts. With `known_planners` each team's planner must be among them."""
    rounds = [(path, r) for path, r in parts.rounds if r is not None]
    teams = [(path, t) for path, t in parts.teams if t is not None]
    places = [(path, p) for path, p in parts.places if p is not None]
    _unique(problems, ((f"{path}.name", r.name) for path, r in rounds), "round")
    _unique(problems, ((f"{path}.name", t.name) for path, t in teams), "team")
    _unique(problems, ((f"{path}.vehicle", p.vehicle) for path, p in places if p.vehicle), "take-off place for vehicle")
    ids = ((f"{path}.vehicles[{i + 1}]", v) for path, t in teams for i, v in enumerate(t.vehicles))
    _unique(problems, ids, "use of vehicle")
    for path, round_ in rounds:
        _check_round(problems, path, round_)
    for path, team in teams:
        _check_team(problems, path, team, rounds, known_planners)
    _check_places(problems, places, rounds, parts.limits)
    if len(teams) == len(parts.teams) and len(places) == len(parts.places):
        _check_place_count(problems, teams, places)
    if not problems.lines:  # who meets whom is found from sound shapes and teams only
        limits = braking_limits(parts.limits, classes)
        _check_layers(problems, places, [r for _, r in rounds], [t for _, t in teams], limits)


def check_classes(classes: Iterable[VehicleClass], problems: Problems) -> None:
    """Note classes of one name, and vehicles in two classes."""
    listed = [(f"class[{i + 1}]", kind) for i, kind in enumerate(classes)]
    _unique(problems, ((f"{path}.name", kind.name) for path, kind in listed), "class")
    ids = ((f"{path}.vehicles[{i + 1}]", v) for path, kind in listed for i, v in enumerate(kind.vehicles))
    _unique(problems, ids, "class of vehicle")


def _unique(problems: Problems, items: Iterable[tuple[str, object]], what: str) -> None:
    seen: dict[object, str] = {}
    for path, value in items:
        if value in seen:
            problems.add(path, f"a second {what} {shown(value)}", f"the first is {seen[value]}")
        seen.setdefault(value, path)


def _check_round(problems: Problems, path: str, round_: Round) -> None:
    _unique(problems, ((f"{path}.zone[{i + 1}].name", z.name) for i, z in enumerate(round_.zones)), "zone")
    area_is_sound = _check_shape(problems, f"{path}.area", round_.area.shape)
    area = polygon_of(round_.area.shape).buffer(TOUCH_M) if area_is_sound else None
    for i, zone in enumerate(round_.zones):
        at = f"{path}.zone[{i + 1}]"
        sound = _check_shape(problems, at, zone.shape)
        # A no-fly zone may reach beyond the area: what lies outside is not flown anyway.
        if sound and area is not None and zone.role is not Role.NO_FLY and not area.covers(polygon_of(zone.shape)):
            outside_m2 = polygon_of(zone.shape).difference(area).area
            wrong = f"zone {shown(zone.name)} reaches outside the operating area ({outside_m2:.0f} m2 of it)"
            problems.add(at, wrong, f"must lie within {path}.area")
        _check_band(problems, at, zone, round_.area)


def _check_band(problems: Problems, at: str, zone: Zone, area: OperatingArea) -> None:
    """Check that a zone's own altitude band lies inside that of the operating area."""
    allowed = f"must be {area.alt_min_m:g} to {area.alt_max_m:g} m, the operating area's altitude band"
    for name, value in (("alt_min_m", zone.alt_min_m), ("alt_max_m", zone.alt_max_m)):
        if value is not None and not area.alt_min_m <= value <= area.alt_max_m:
            problems.add(f"{at}.{name}", f"{value:g} m is outside the altitude band of the area", allowed)


def _check_shape(problems: Problems, path: str, shape: Shape) -> bool:
    if isinstance(shape, Polygon):
        polygon = polygon_of(shape)
        if area_m2(shape) < MIN_AREA_M2 and polygon.minimum_rotated_rectangle.area < MIN_AREA_M2:
            problems.add(path, "the polygon has no area", f"must be at least {MIN_AREA_M2:g} m2")
            return False
        if not polygon.is_valid:
            reason = shapely.is_valid_reason(polygon)
            reason = re.sub("(Ring )?Self-intersection", "the border crosses itself near ", reason)
            reason = re.sub(r"-?\d+\.\d+", lambda found: f"{float(found[0]):.1f}", reason)
            problems.add(path, reason, "give the vertices in order around the polygon")
            return False
    if area_m2(shape) < MIN_AREA_M2:
        problems.add(path, f"the area is {area_m2(shape):.3g} m2", f"must be at least {MIN_AREA_M2:g} m2")
        return False
    return True


def _check_team(
    problems: Problems,
    path: str,
    team: Team,
    rounds: list[tuple[str, Round]],
    known_planners: Collection[str] | None,
) -> None:
    for _, round_ in rounds:
        zones = {zone.name: zone for zone in round_.zones}
        if team.zone not in zones:
            wrong = f"zone {shown(team.zone)} is not in round {shown(round_.name)}{nearest(team.zone, zones)}"
            problems.add(f"{path}.zone", wrong, "a team's zone must exist in every round")
        elif zones[team.zone].role is Role.NO_FLY:
            wrong = f"zone {shown(team.zone)} is no-fly in round {shown(round_.name)}"
            problems.add(f"{path}.zone", wrong, "a team serves a defend or attack zone")
    if known_planners is not None and team.planner not in known_planners:
        wrong = f"there is no planner {shown(team.planner)}{nearest(team.planner, known_planners)}"
        in_file = "; one in a file of yours is given to fly, run and rehearse by --planner FILE.py"
        problems.add(f"{path}.planner", wrong, f"must be {one_of(sorted(known_planners))}{in_file}")


def _check_places(
    problems: Problems, places: list[tuple[str, TakeOffPlace]], rounds: list[tuple[str, Round]], limits: Limits
) -> None:
    for path, place in places:
        for _, round_ in rounds:
            band = round_.area
            if not math.isnan(place.layer_m) and not band.alt_min_m <= place.layer_m <= band.alt_max_m:
                wrong = f"layer {place.layer_m:g} m is outside the altitude band of round {shown(round_.name)}"
                problems.add(f"{path}.layer_m", wrong, f"must be {band.alt_min_m:g} to {band.alt_max_m:g} m")
                break
        for _, round_ in rounds:
            if not contains(round_.area.shape, [place.place_m])[0]:
                wrong = f"the place is outside the operating area of round {shown(round_.name)}"
                problems.add(path, wrong, "vehicles start and land inside every round's area")
                break
            over = [zone for zone in round_.no_fly if contains(zone.shape, [place.place_m])[0]]
            if over:
                wrong = f"the place is inside no-fly zone {shown(over[0].name)} of round {shown(round_.name)}"
                problems.add(path, wrong, "vehicles start and land outside of every round's no-fly zones")
                break
    for (a_path, a), (b_path, b) in combinations(places, 2):
        apart_m = distance_m(a.place_m, b.place_m)
        if apart_m < limits.separation_horizontal_m:
            allowed = f"must be at least separation_horizontal_m = {limits.separation_horizontal_m:g} m"
            problems.add(b_path, f"is {apart_m:.1f} m from {a_path}", allowed)


def _check_layers(
    problems: Problems,
    places: list[tuple[str, TakeOffPlace]],
    rounds: Sequence[Round],
    teams: Sequence[Team],
    limits: Limits,
) -> None:
    """Check that places whose vehicles can come near each other have layers far enough apart."""
    layers_m = np.array([place.layer_m for _, place in places])
    apart_m = np.abs(layers_m[:, None] - layers_m[None, :])
    # 28.2 - 23.2 is less than 5.0 in binary numbers: that is not a mistake of the author.
    close = np.triu((apart_m + 1e-9 < limits.separation_vertical_m) | (apart_m <= 1e-9), 1)
    if not close.any():
        return
    close &= place_conflicts(rounds, limits, teams, [place for _, place in places])
    flown_for = [possible_teams(place, teams, [each for _, each in places]) for _, place in places]
    pairs: dict[str, list[tuple[int, int]]] = {}
    for a, b in np.argwhere(close).tolist():
        pairs.setdefault(_why_they_meet(flown_for[a], flown_for[b], limits), []).append((a, b))
    # One mistake of a planner's name or of a speed puts every pair of vehicles too close: that is one line.
    for why, found in pairs.items():
        a, b = found[0]
        wrong = f"is {apart_m[a, b]:.1f} m from the layer of {places[a][0]}, and their vehicles may meet: {why}"
        wrong += f"; so are {len(found) - 1} more pairs of places" if len(found) > 1 else ""
        allowed = f"must be at least separation_vertical_m = {limits.separation_vertical_m:g} m"
        problems.add(f"{places[b][0]}.layer_m", wrong, f"{allowed}; without layer_m one is found")


def _why_they_meet(ones: Sequence[Team], others: Sequence[Team], limits: Limits) -> str:
    """Return why vehicles of these teams can come near each other; each may fly for one of several."""
    wide = sorted({team.planner for team in (*ones, *others)} - STAY_OVER_ZONE)
    if wide:
        return f"planner {shown(wide[0])}{nearest(wide[0], STAY_OVER_ZONE)} may use the whole operating area"
    zones = sorted({team.zone for team in (*ones, *others)})
    if len(zones) == 1:
        return f"they serve one zone, {shown(zones[0])}"
    needed = f"{reaches_apart_m(limits):.0f} m, as braking from {limits.speed_m_s:g} m/s needs"
    return f"zones {' and '.join(map(shown, zones))} or the ways there are not apart by {needed}"


def _check_place_count(
    problems: Problems, teams: list[tuple[str, Team]], places: list[tuple[str, TakeOffPlace]]
) -> None:
    """Check that every vehicle has a take-off place: one that names it, or a free one."""
    if not teams or not places:
        return
    named = {vehicle for _, team in teams for vehicle in team.vehicles}
    counted = sum(team.count for _, team in teams)
    if not counted:
        for path, place in places:
            if place.vehicle is not None and place.vehicle not in named:
                wrong = f"vehicle {place.vehicle} is in no team"
                problems.add(f"{path}.vehicle", wrong, "name a team's vehicle, or leave the key out")
    own = {place.vehicle for _, place in places if place.vehicle in named}
    free = sum(place.vehicle is None or counted > 0 for _, place in places if place.vehicle not in own)
    need = len(named - own) + counted
    if need > free:
        wrong = f"{need} vehicles have no take-off place of their own, and {free} places are free"
        problems.add("place", wrong, "give every vehicle a [[place]]")
