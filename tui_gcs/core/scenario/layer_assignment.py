"""Assigns altitude layers by conflict: as few as possible, and none shared by vehicles that can come near each other.

It colours the graph of `vehicle_conflicts` by DSATUR (Brélaz 1979): next comes the vehicle that has the fewest layers
left, and it takes the lowest one. Then whole layers are dealt out anew (iterated greedy, Culberson 1992), which never
needs more of them and often fewer.
"""

import math
from collections.abc import Iterable, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.scenario.model import Limits, Round, TakeOffPlace, Team, band_m
from tui_gcs.core.scenario.vehicle_conflicts import Matrix, apart_m, place_conflicts, possible_teams

LAYER_GAPS_M = (2.0, 1.0, 0.0)
"""Distances between layers beyond the vertical separation: the largest for which all fit is taken.

Without one the guard holds every vehicle that passes another one a little too high or too low.
"""
BAND_MARGIN_M = 2.0
"""New layers are this far inside the altitude band, if it is high enough: barometers drift."""
LOWEST_LAYER_M = 5.0
ROUNDS_OF_IMPROVEMENT = 10
SAME_M = 1e-6
"""28.2 - 23.2 is less than 5.0 in binary numbers: that is not a mistake of the author."""

Metres = NDArray[np.float64]


class LayerError(ValueError):
    """The altitude band has no room for the layers that are needed; one line with what would help."""


def with_layers(
    rounds: Sequence[Round], limits: Limits, teams: Sequence[Team], places: Sequence[TakeOffPlace]
) -> tuple[TakeOffPlace, ...]:
    """Return the places, each with a layer: those that are given stay, those that are NaN are assigned.

    Raises:
        LayerError: there is no room for them.
    """
    given_m = np.array([place.layer_m for place in places])
    if not np.isnan(given_m).any():
        return tuple(places)
    near = place_conflicts(rounds, limits, teams, places)
    bands_m = [_band_m(rounds, possible_teams(place, teams, places)) for place in places]
    for gap_m in LAYER_GAPS_M:
        spacing_m = max(limits.separation_vertical_m + gap_m, 0.1)
        layers_m = assign(near, given_m, spacing_m, [low for low, _ in bands_m])
        if all(layer <= high + SAME_M for layer, (_, high) in zip(layers_m, bands_m, strict=True)):
            return tuple(
                msgspec.structs.replace(place, layer_m=round(float(layer), 3))
                for place, layer in zip(places, layers_m, strict=True)
            )
    raise LayerError(_what_would_fit(layers_m, bands_m, limits, spacing_m))


def assign(near: Matrix, given_m: Metres, spacing_m: float, lowest_m: Sequence[float]) -> Metres:
    """Return a layer in metres for each of n vehicles; those that are near each other are `spacing_m` apart.

    Args:
        near: (n, n) which vehicles can come near each other.
        given_m: (n,) layers that stay as they are; NaN where one is to be found.
        spacing_m: the distance between two layers.
        lowest_m: (n,) the lowest layer that each vehicle may have.
    """
    best = _dealt(near, given_m, spacing_m, lowest_m, _by_saturation(near, given_m))
    fewest = layers_needed(near)
    trial = best
    for turn in range(ROUNDS_OF_IMPROVEMENT):
        if len(set(best.tolist())) <= fewest:
            break
        # Vehicles of one layer stay together, so that each turn ends with at most as many layers.
        layers = sorted(set(trial[np.isnan(given_m)].tolist()), key=lambda layer: _rank(trial, layer, turn))
        order = [i for layer in layers for i in np.flatnonzero((trial == layer) & np.isnan(given_m)).tolist()]
        trial = _dealt(near, given_m, spacing_m, lowest_m, order)
        if trial.max() < best.max() - SAME_M:
            best = trial
    return best


def layers_needed(near: Matrix) -> int:
    """Return a lower bound of the number of layers: the largest clique that was found in the graph."""
    most, degree = 0, near.sum(axis=1)
    seen = np.zeros(len(near), dtype=bool)
    for first in np.argsort(-degree, kind="stable").tolist():
        if seen[first]:
            continue
        clique, left = [first], near[first].copy()
        while left.any():
            following = int(np.argmax(np.where(left, (near & left).sum(axis=1) * len(near) + degree, -1)))
            clique.append(following)
            left &= near[following]
        seen[clique] = True
        most = max(most, len(clique))
    return most


def _rank(layers_m: Metres, layer_m: float, turn: int) -> tuple[float, float]:
    """Deal layers out from the highest, from the fullest, or from the emptiest: each turn another way."""
    size = float((layers_m == layer_m).sum())
    return ((-layer_m, 0.0), (-size, layer_m), (size, -layer_m))[turn % 3]


def _by_saturation(near: Matrix, given_m: Metres) -> list[int]:
    """Return the vehicles without a layer in the order of DSATUR: by how many layers their neighbours have taken."""
    colour = np.where(np.isnan(given_m), -1, 0)
    degree = near.sum(axis=1)
    taken = np.zeros((len(near), len(near) + 1), dtype=bool)
    order = []
    for _ in range(int(np.isnan(given_m).sum())):
        i = int(np.argmax(np.where(colour < 0, taken.sum(axis=1) * (len(near) + 1) + degree, -1)))
        colour[i] = int(np.argmin(taken[i]))
        taken[near[i], colour[i]] = True
        order.append(i)
    return order


def _dealt(near: Matrix, given_m: Metres, spacing_m: float, lowest_m: Sequence[float], order: Iterable[int]) -> Metres:
    """Give each vehicle in turn the lowest layer that its neighbours leave free."""
    layers_m = given_m.copy()
    for i in order:
        theirs = layers_m[near[i] & ~np.isnan(layers_m)]
        candidates = np.unique([lowest_m[i], *(theirs[theirs + spacing_m >= lowest_m[i]] + spacing_m).tolist()])
        free = (np.abs(candidates[:, None] - theirs[None, :]) >= spacing_m - SAME_M).all(axis=1)
        layers_m[i] = candidates[int(np.argmax(free))]
    return layers_m


def _band_m(rounds: Sequence[Round], teams: Sequence[Team]) -> tuple[float, float]:
    """Return the lowest and highest layer that fits every round and every zone of these teams."""
    bands = [(round_.area.alt_min_m, round_.area.alt_max_m) for round_ in rounds]
    for round_ in rounds:
        names = {team.zone for team in teams}
        bands += [band_m(zone, round_.area) for zone in round_.zones if zone.name in names]
    low_m, high_m = max(low for low, _ in bands), min(high for _, high in bands)
    margin_m = min(BAND_MARGIN_M, max(0.0, (high_m - low_m) / 4))
    return max(low_m + margin_m, min(LOWEST_LAYER_M, high_m)), high_m - margin_m


def _what_would_fit(layers_m: Metres, bands_m: Sequence[tuple[float, float]], limits: Limits, spacing_m: float) -> str:
    """Say in one line how many layers are needed, how many fit, and what would help."""
    over = int(np.argmax(layers_m - np.array([high for _, high in bands_m])))
    low_m, high_m = bands_m[over]
    needed = math.ceil((layers_m[over] - low_m) / spacing_m - SAME_M) + 1
    room = max(0, math.floor((high_m - low_m) / spacing_m + SAME_M) + 1)
    more_m = layers_m[over] - high_m
    helps = [f"raise alt_max_m by {math.ceil(more_m)} m"]
    if room > 0 and needed > 1 and high_m > low_m:
        less_m = math.floor(10.0 * (high_m - low_m) / (needed - 1)) / 10.0
        helps.append(f"lower separation_vertical_m to {less_m:g} m")
    helps.append(
        f"use teams of at most {max(1, room)} whose zones and take-off places are {math.ceil(apart_m(limits))} m apart"
    )
    return (
        f"{needed} altitude layers are needed for vehicles that can come near each other, {low_m:g} to {high_m:g} m "
        f"has room for {room} at {spacing_m:g} m: {', or '.join(helps)}"
    )
