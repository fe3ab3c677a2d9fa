"""What an order that moves vehicles will meet: distance, time, layers of others, borders. Shown before it is confirmed.

The guard judges the course while it is flown and stops a vehicle that comes too near; here the operator sees it before.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

from tui_gcs.core.geometry.local_frame import from_straight_m
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import CLIMB_M_S, DESCENT_M_S
from tui_gcs.core.motion.course import rest_to_rest_s
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import Phase, Request, Vec3, VehicleRow
from tui_gcs.core.protocol.flight import CircleFlight, Follow, GoTo, Nudge, TakeOff
from tui_gcs.core.scenario.model import Limits, Round

Homes = Mapping[int, tuple[float, float]]
"""East and north of each vehicle's home, metres."""
MAX_WARNINGS = 4
FOLLOWS = ">{}"
"""Slot of a vehicle that follows another, as the station reports it."""


@dataclass(frozen=True)
class OrderForecast:
    """What the dialog of an order shows of its course."""

    way: str = ""
    """Distance and time in words; empty if no vehicle flies to a place."""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Leg:
    """The straight course of one vehicle to a place, or to a circle about it."""

    row: VehicleRow
    goal_m: Vec3
    radius_m: float = 0.0

    @property
    def here_m(self) -> Vec3:
        return self.row.position_m

    @property
    def level_m(self) -> float:
        """Horizontal distance to the place, or to the circle."""
        return abs(math.dist(self.here_m[:2], self.goal_m[:2]) - self.radius_m)

    @property
    def climb_m(self) -> float:
        return self.goal_m[2] - self.here_m[2]

    def seconds(self, speed_m_s: float, accel_m_s2: float) -> float:
        """Time from rest to rest, moving horizontally and vertically at once."""
        level_s = rest_to_rest_s(self.level_m, speed_m_s, accel_m_s2)
        return max(level_s, abs(self.climb_m) / (CLIMB_M_S if self.climb_m > 0 else DESCENT_M_S))

    def away_m(self, place_m: Vec3) -> float:
        """Smallest horizontal distance between the course and a place."""
        if self.radius_m:
            return abs(math.dist(self.goal_m[:2], place_m[:2]) - self.radius_m)
        return from_straight_m(place_m[:2], self.here_m[:2], self.goal_m[:2])


def forecast_order(
    request: Request, rows: Mapping[int, VehicleRow], homes: Homes, limits: Limits, round_: Round | None
) -> OrderForecast:
    """Return what `request` will meet, as far as positions are known; nothing if it moves no vehicle to a place."""
    moved = request.vehicles if isinstance(request, GoTo | CircleFlight | Follow | Nudge) else ()
    parted = (*_leaving(moved, rows), *_behind(moved, rows))
    if isinstance(request, Follow):
        beside = _beside(request, rows, limits)
        return replace(beside, warnings=(*beside.warnings, *parted))
    if isinstance(request, GoTo) and request.from_home and not all(v in homes for v in request.vehicles):
        return OrderForecast("counted from each one's own home: the distance is not known here", parted)
    ways = [way for way in _ways(request, rows, homes) if all(map(math.isfinite, (*way.here_m, *way.goal_m)))]
    if not ways:
        return OrderForecast(warnings=parted)
    # NaN, and orders without a speed, mean the scenario's limit.
    speed_m_s = getattr(request, "speed_m_s", math.nan)
    speed = limits.speed_m_s if math.isnan(speed_m_s) else min(speed_m_s, limits.speed_m_s)
    concerned = {way.row.id for way in ways}
    others = [row for row in rows.values() if row.id not in concerned and _is_up(row)]
    warnings = [*_beyond(ways, limits, round_), *_layers(ways, others, limits), *_meeting(ways, limits)]
    warnings += parted
    listed = warnings[:MAX_WARNINGS]
    if len(warnings) > len(listed):
        listed[-1] = f"and {len(warnings) - len(listed) + 1} more warnings like these"
    return OrderForecast("" if isinstance(request, TakeOff) else _way_words(ways, speed, limits), tuple(listed))


def _leaving(vehicles: Iterable[int], rows: Mapping[int, VehicleRow]) -> Iterable[str]:
    """Warn about vehicles that fly for a planner now, and will not any more."""
    found = [v for v in vehicles if v in rows and rows[v].phase is Phase.FLYING]
    if found:
        yield f"{vehicles_words(found)} will fly for no planner until ordered to: order p"


def _behind(vehicles: Iterable[int], rows: Mapping[int, VehicleRow]) -> Iterable[str]:
    """Warn about vehicles that follow one of these, and move with it."""
    moved = set(vehicles)
    found = [v for v, row in rows.items() if v not in moved and row.slot in {FOLLOWS.format(w) for w in moved}]
    if found:
        yield f"{vehicles_words(found)} will move with it: it is followed"


def _beside(request: Follow, rows: Mapping[int, VehicleRow], limits: Limits) -> OrderForecast:
    """Forecast for following: each vehicle keeps its present distance."""
    far = {v: math.dist(rows[v].position_m[:2], rows[request.leader].position_m[:2]) for v in request.vehicles}
    near = [v for v, far_m in far.items() if far_m < limits.separation_horizontal_m]
    warning = f"{vehicles_words(near)} too near: at least {limits.separation_horizontal_m:g} m" if near else ""
    return OrderForecast(f"{_span(list(far.values()))} from it, and stays so", (warning,) if near else ())


def _span(far_m: list[float]) -> str:
    return f"{min(far_m):.0f}-{max(far_m):.0f} m" if max(far_m) - min(far_m) >= 1.0 else f"{max(far_m):.0f} m"


def _ways(request: Request, rows: Mapping[int, VehicleRow], homes: Homes) -> Iterable[_Leg]:
    if isinstance(request, GoTo):
        for vehicle, (x, y, z) in zip(request.vehicles, request.points_m, strict=True):
            from_x, from_y = homes[vehicle] if request.from_home else (0.0, 0.0)
            if vehicle in rows:
                yield _Leg(rows[vehicle], _known((from_x + x, from_y + y, z), rows[vehicle].position_m))
    elif isinstance(request, CircleFlight):
        for vehicle in request.vehicles:
            if vehicle in rows:
                yield _Leg(rows[vehicle], _known(request.centre_m, rows[vehicle].position_m), request.radius_m)
    elif isinstance(request, TakeOff):
        for vehicle in request.vehicles:
            if vehicle in rows:
                yield _Leg(rows[vehicle], (*rows[vehicle].position_m[:2], request.alt_m))


def _known(point: Vec3, here: Vec3) -> Vec3:
    """Replace NaN coordinates, which mean unchanged, by the present ones."""
    x, y, z = (own if math.isnan(given) else given for given, own in zip(point, here, strict=True))
    return x, y, z


def _is_up(row: VehicleRow) -> bool:
    return row.armed and row.phase not in (Phase.GROUND, Phase.ARMING) and all(map(math.isfinite, row.position_m))


def _way_words(ways: list[_Leg], speed_m_s: float, limits: Limits) -> str:
    far = [way.level_m for way in ways]
    taken_s = max(way.seconds(speed_m_s, limits.accel_m_s2) for way in ways)
    climbs = {round(way.climb_m) for way in ways}
    upright = (
        f", {'up' if max(climbs) > 0 else 'down'} {abs(climbs.pop())} m" if len(climbs) == 1 and any(climbs) else ""
    )
    return f"{_span(far)} away{upright}: about {taken_s:.0f} s"


def _beyond(ways: list[_Leg], limits: Limits, round_: Round | None) -> Iterable[str]:
    """Warn about vehicles that are sent where the guard lets none go."""
    if round_ is None:
        return
    # The guard's own code, so that what is foretold is what it will decide.
    guard, area = Guard(limits, round_.area, round_.no_fly), round_.area
    outside = {way.row.id: out for way in ways if (out := guard.outside_m(way.goal_m)) > 0}
    if outside:
        out_m, names = max(outside.values()), vehicles_words(outside)
        yield f"{out_m:.0f} m outside the area, or in a no-fly zone: the guard stops {names}"
    wrong = [way for way in ways if not area.alt_min_m <= way.goal_m[2] <= area.alt_max_m]
    if wrong:
        band = f"{area.alt_min_m:g}-{area.alt_max_m:g} m"
        names = vehicles_words(way.row.id for way in wrong)
        yield f"{wrong[0].goal_m[2]:.0f} m is outside the band {band}: the guard stops {names}"


def _layers(ways: list[_Leg], others: list[VehicleRow], limits: Limits) -> Iterable[str]:
    """Warn about layers, or present heights, of others that a course ends on or passes; the nearest first."""
    found = []
    for way in ways:
        low, high = sorted((way.here_m[2], way.goal_m[2]))
        for other in others:
            heights = [h for h in (other.layer_m, other.position_m[2]) if math.isfinite(h)]
            ends = any(abs(way.goal_m[2] - h) < limits.separation_vertical_m for h in heights)
            if ends or any(low < h < high for h in heights):
                found.append((not ends, way.away_m(other.position_m), way.row.id, other))
    for passes, away_m, vehicle, other in sorted(found, key=lambda one: one[:3]):
        layer = f"the layer of {other.id} ({other.layer_m:.0f} m)" if math.isfinite(other.layer_m) else ""
        height = layer or f"the height of {other.id}"
        yield f"{vehicle} {'passes' if passes else 'on'} {height}; {other.id} is {away_m:.0f} m from its way"


def _meeting(ways: list[_Leg], limits: Limits) -> Iterable[str]:
    """Warn about vehicles of this order that would come too close to each other."""
    for one, other in combinations(ways, 2):
        apart_m = math.dist(one.goal_m[:2], other.goal_m[:2])
        upright_m = abs(one.goal_m[2] - other.goal_m[2])
        # On one circle they follow each other at a distance that only the moment of the order decides.
        on_circle = bool(one.radius_m)
        if upright_m < limits.separation_vertical_m and (on_circle or apart_m < limits.separation_horizontal_m):
            where = "on one circle" if on_circle else f"{apart_m:.0f} m from each other"
            yield f"{one.row.id} and {other.row.id} would be {where} at one height"
