"""Which vehicles can come near each other on the ground plan, whatever height they fly at.

The reach of a vehicle is all of the ground plan that it may fly over in any round: its take-off place, its team's
zones, the transits between them, the ways around no-fly zones, and a straight return by its own failsafe. Vehicles
whose reaches are apart can share an altitude layer, however high a failsafe returns (RTL_ALT, RTL_RETURN_ALT).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.scenario.model import Limits, OperatingArea, Round, TakeOffPlace, Team, VehicleClass

STAY_OVER_ZONE = frozenset({"patrol"})
"""Planners whose vehicles stay over their team's zone. Any other planner may use the whole operating area."""
WANDER_M = 1.0
"""Kept beyond the horizontal separation, as the guard does: holding vehicles wander."""

Point = tuple[float, float]
Matrix = NDArray[np.bool_]


class Member(NamedTuple):
    """A vehicle, as far as its reach depends on it."""

    tasks: tuple[tuple[str, str], ...]
    """Zone and planner of each team that it may fly for."""
    place_m: Point
    """Its take-off place."""


def apart_m(limits: Limits) -> float:
    """Return how far apart two reaches must be for their vehicles to share a layer.

    At the edge of its reach each vehicle may have to brake from full speed, towards the other one. Where vehicles have
    classes, `limits` are those of `braking_limits`.
    """
    return limits.separation_horizontal_m + WANDER_M + 2.0 * limits.speed_m_s**2 / (2.0 * limits.accel_m_s2)


def braking_limits(limits: Limits, classes: Sequence[VehicleClass]) -> Limits:
    """Return the limits with the acceleration of the weakest class: the guard predicts that all brake like it."""
    weakest_m_s2 = min((kind.accel_m_s2 for kind in classes), default=limits.accel_m_s2)
    return msgspec.structs.replace(limits, accel_m_s2=min(weakest_m_s2, limits.accel_m_s2))


def possible_teams(place: TakeOffPlace, teams: Sequence[Team], places: Sequence[TakeOffPlace]) -> tuple[Team, ...]:
    """Return the teams whose vehicle may start at `place`: for a place that names no vehicle there may be several."""
    for team in teams:
        if place.vehicle is not None and place.vehicle in team.vehicles:
            return (team,)
    named = {other.vehicle for other in places}
    return tuple(team for team in teams if team.count or not named.issuperset(team.vehicles))


def member(teams: Sequence[Team], place_m: Point) -> Member:
    """Return what is needed of a vehicle to find its reach: the teams that it may fly for, and where it starts."""
    return Member(tuple((team.zone, team.planner) for team in teams), place_m)


def reaches(rounds: Sequence[Round], crew: Sequence[Member]) -> list[shapely.Geometry]:
    """Return the reach of each vehicle, a convex shape in metres."""
    walls = [wall for round_ in rounds for wall in _walls(round_)]
    flown = {tasks: _flown_over(rounds, tasks) for tasks in {vehicle.tasks for vehicle in crew}}
    return [
        _around(shapely.union(flown[vehicle.tasks], shapely.Point(vehicle.place_m)).convex_hull, walls)
        for vehicle in crew
    ]


@lru_cache(maxsize=8)
def conflicts(rounds: tuple[Round, ...], limits: Limits, crew: tuple[Member, ...]) -> Matrix:
    """Return (n, n) whether each two vehicles can come near each other, read only; False on the diagonal."""
    shapes = np.array(reaches(rounds, crew), dtype=object)
    near = np.zeros((len(shapes), len(shapes)), dtype=bool)
    ones, others = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=apart_m(limits))
    near[ones, others] = True
    np.fill_diagonal(near, val=False)
    near.flags.writeable = False
    return near


def place_conflicts(
    rounds: Sequence[Round], limits: Limits, teams: Sequence[Team], places: Sequence[TakeOffPlace]
) -> Matrix:
    """Return (n, n) whether the vehicles of each two take-off places can come near each other."""
    crew = tuple(member(possible_teams(place, teams, places), place.place_m) for place in places)
    return conflicts(tuple(rounds), limits, crew)


def groups(near: Matrix) -> list[int]:
    """Return for each vehicle the lowest index of its group: no vehicle comes near one of another group, ever."""
    group = list(range(len(near)))
    for first in range(len(near)):
        if group[first] != first:
            continue
        waiting = [first]
        while waiting:
            for other in np.flatnonzero(near[waiting.pop()]).tolist():
                if group[other] > first:
                    group[other] = first
                    waiting.append(other)
    return group


def _flown_over(rounds: Sequence[Round], tasks: Sequence[tuple[str, str]]) -> shapely.Geometry:
    """Return the zones of these tasks in all rounds, or the areas of the rounds for planners that may leave zones."""
    shapes = []
    for round_ in rounds:
        for name, planner in tasks:
            zones = [zone.shape for zone in round_.zones if zone.name == name]
            shapes += zones if planner in STAY_OVER_ZONE else [round_.area.shape]
    return shapely.union_all([polygon_of(shape).convex_hull for shape in shapes])


def _walls(round_: Round) -> list[shapely.Polygon]:
    """Return what ways lead around: no-fly zones, and the bays of an operating area that is not convex."""
    return [polygon_of(zone.shape) for zone in round_.no_fly] + _bays(round_.area)


def _bays(area: OperatingArea) -> list[shapely.Polygon]:
    outline = polygon_of(area.shape)
    return [bay for bay in shapely.get_parts(outline.convex_hull.difference(outline)).tolist() if bay.area > 0.0]


def _around(hull: shapely.Geometry, walls: Sequence[shapely.Polygon]) -> shapely.Geometry:
    """Return the smallest convex shape around `hull` that holds every wall it meets: shortest ways stay inside."""
    left = list(walls)
    while met := [wall for wall in left if hull.intersects(wall)]:
        left = [wall for wall in left if not hull.intersects(wall)]
        hull = shapely.union_all([hull, *met]).convex_hull
    return hull
