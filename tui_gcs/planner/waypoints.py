"""Waypoints planner: each vehicle flies the path that the operator drew for it, again and again.

It is also the baseline for better planners: without paths the zone is cut into strips, one per vehicle, flown up and
down as a mission planner's survey would be.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.api import (
    Context,
    Fleet,
    Intent,
    KeepOut,
    Metric,
    Output,
    Param,
    ParamValue,
    Planner,
    PlannerTask,
    at_heights,
    polygon_of,
)
from tui_gcs.planner.patrol.flyable_region import RegionOfTask
from tui_gcs.planner.patrol.patrol_state import array_of, encode_exactly
from tui_gcs.planner.patrol.tour import PATH_STEP_M, Tour, drawing, resampled, timed
from tui_gcs.planner.patrol.transit import Mobility, Transit, plan_transit

Floats = NDArray[np.floating[Any]]

HORIZON_S, SAMPLE_S = 3.0, 0.25
"""Length and spacing of the trajectories that are sent."""
ACCEL_SHARE = 0.9
"""Share of the acceleration limit that is planned with; the rest is the autopilot's for tracking."""
LOST_TRACK_M, JOINED_M = 8.0, 3.0
PATIENCE_S = 2.0
"""Shortest time between two new ways of one vehicle to its path."""
DRAW_AGAIN_S = 5.0
"""Time between two drawings of the paths, and their number of points."""
DRAWN_POINTS = 80
MAX_PATH_POINTS = 500
"""Points of one vehicle's path."""


class Waypoints(Planner):
    """Flies every vehicle along its own path."""

    name = "waypoints"
    ids_matter = True
    metrics = (Metric("period_s", "s", "lower", help="time of one round trip of the longest path"),)
    params = (
        Param(
            "paths",
            str,
            "",
            help="metres east,north of the origin, e.g. 1: 10,20 80,20 80,90; 2: 100,20 180,90 (none: strips)",
        ),
        Param("loop", bool, True, help="after the last point to the first again; else back the way it came"),
        Param("speed_fraction", float, 0.95, 0.1, 0.97, "", "speed as a share of the speed limit"),
    )

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Compute the timing of the paths. Raises ValueError for a bad text and for points outside the area."""
        super().configure(task, params, rng)
        limits = task.limits
        self._regions = RegionOfTask(task)
        self._region = self._regions.whole
        self._mobility = Mobility(limits.speed_m_s * 0.98, limits.accel_m_s2 * ACCEL_SHARE)
        self._speed_m_s = limits.speed_m_s * float(params["speed_fraction"])
        paths = parse_paths(str(params["paths"]))
        for vehicle in paths:
            if vehicle not in task.members:
                raise ValueError(f"paths: vehicle {vehicle} is not in team {task.team}")
        drawn = {v: _closed(points, loop=bool(params["loop"])) for v, points in paths.items()}
        missing = [v for v in sorted(task.members) if v not in drawn]
        if missing and not drawn:
            drawn = dict(
                zip(missing, strips(polygon_of(task.zone.shape), len(missing), task.footprint_radius_m), strict=True)
            )
        self._paths = {v: self._checked(v, path) if v in paths else self._led_round(path) for v, path in drawn.items()}
        self._tours = {vehicle: self._timed(path) for vehicle, path in self._paths.items()}
        self._clear_of: tuple[KeepOut, ...] = ()
        """The volumes that the tours lead round."""
        self._state = _WaypointsState()

    def _checked(self, vehicle: int, path_m: Floats) -> Floats:
        """Return a closed path that an operator drew. Raises ValueError where it may not be flown."""
        inside = self._region.pulled_inside(path_m)
        moved_m = np.hypot(*(inside - path_m).T)
        if moved_m.max() > 1.0:
            x, y = path_m[int(np.argmax(moved_m))]
            raise ValueError(f"paths: vehicle {vehicle}: ({x:g}, {y:g}) is outside of where it may fly")
        for here, there in pairwise(np.vstack([inside, inside[:1]])):
            if not self._region.nearly_clear(here, there):
                leg = f"({here[0]:g}, {here[1]:g}) to ({there[0]:g}, {there[1]:g})"
                raise ValueError(f"paths: vehicle {vehicle}: the way from {leg} leaves where it may fly")
        return inside

    def _led_round(self, path_m: Floats) -> Floats:
        """Return a closed path that was computed, moved inside and led around no-fly zones."""
        inside = self._region.pulled_inside(path_m)
        return self._region.open_inside(np.vstack([inside, inside[:1]]), PATH_STEP_M * 4.0)[:-1]

    def _timed(self, path_m: Floats) -> Tour:
        return timed(resampled(path_m, PATH_STEP_M), self._speed_m_s, self._mobility.accel_m_s2)

    def _keep_clear(self, keep_out: tuple[KeepOut, ...]) -> None:
        """Lead the paths round where lost vehicles may be, and back again; vehicles get ways to those that changed."""
        state = self._state
        if keep_out != self._clear_of:
            self._clear_of, self._region = keep_out, self._regions.clear_of(keep_out)
            paths = {v: self._led_round(path) if keep_out else path for v, path in self._paths.items()}
            self._tours = {vehicle: self._timed(path) for vehicle, path in paths.items()}
        if keep_out != state.keep_out:
            state.keep_out = keep_out
            for place in state.places.values():
                place.planned_s, place.joined = -math.inf, False

    def step(self, ctx: Context) -> Output:
        """Return trajectories for all active vehicles that have a path; the others hold."""
        active = {int(ctx.fleet.id[i]): int(i) for i in np.flatnonzero(ctx.fleet.active)}
        state = self._state
        self._keep_clear(at_heights(ctx.keep_out, ctx.fleet.layer_m[list(active.values())].tolist()))
        state.places = {vehicle: place for vehicle, place in state.places.items() if vehicle in active}
        out = Output(intents=[self._intent(ctx, vehicle, i) for vehicle, i in active.items()])
        if ctx.t_s - state.drawn_s >= DRAW_AGAIN_S:
            state.drawn_s = ctx.t_s
            out.annotations = [drawing(tour.xy_m, DRAWN_POINTS, f"path {v}") for v, tour in self._tours.items()]
        out.metrics = {
            "period_s": max((tour.period_s for tour in self._tours.values()), default=math.nan),
            "slots": len(active),
            "joined": sum(place.joined for place in state.places.values()),
        }
        return out

    def snapshot(self) -> bytes:
        """Return the exact place of each vehicle on its path; b"" if that is too long."""
        return encode_exactly(self._state)

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` gave."""
        self._state = msgspec.msgpack.decode(data, type=_WaypointsState, dec_hook=array_of)

    def _intent(self, ctx: Context, vehicle: int, i: int) -> Intent:
        tour = self._tours.get(vehicle)
        if tour is None:
            return Intent(vehicle, "hold", reason="no path was drawn for it")
        place = self._state.places.setdefault(vehicle, _PathPlace())
        self._follow_up(place, tour, ctx, i)
        if place.stuck or place.planned_s == -math.inf:
            why = "no way to its path inside the operating area" if place.stuck else "its way is being planned"
            return Intent(vehicle, "hold", reason=why)
        times = ctx.t_s + SAMPLE_S * np.arange(round(HORIZON_S / SAMPLE_S) + 1)
        xy, velocity = place.at(tour, times)
        layer = ctx.fleet.layer_m[i]
        z = float(layer if np.isfinite(layer) else ctx.fleet.position_m[i, 2])
        return Intent(
            vehicle,
            "trajectory",
            t0_s=ctx.t_s,
            dt_s=SAMPLE_S,
            positions_m=tuple([(x, y, z) for x, y in xy.tolist()]),
            velocities_m_s=tuple([(vx, vy, 0.0) for vx, vy in velocity.tolist()]),
            slot="path",
            joined=place.joined,
            reason="" if place.transit is None else "on its way to its path",
        )

    def _follow_up(self, place: "_PathPlace", tour: Tour, ctx: Context, i: int) -> None:
        """Begin or end the way to the path, or plan it anew."""
        if place.transit is not None and ctx.t_s >= place.transit.end_s:
            place.transit = None
        xy, velocity = _now(ctx.fleet, i)
        began = math.isfinite(place.planned_s)
        error_m = float(np.hypot(*(place.at(tour, np.array([ctx.t_s]))[0][0] - xy))) if began else math.inf
        place.joined = place.joined or (place.transit is None and error_m <= JOINED_M)
        wanted = error_m > LOST_TRACK_M or place.stuck
        # A search in vain is the dearest: at most one in a step, or the worker is silent for too long.
        if wanted and ctx.t_s - place.planned_s >= PATIENCE_S and self._state.failed_s != ctx.t_s:
            nearest = int(np.argmin(np.hypot(*(tour.xy_m - xy).T)))
            phase_s = nearest * tour.dt_s
            place.origin_s, place.planned_s, place.joined = ctx.t_s - phase_s, ctx.t_s, False
            place.transit = plan_transit(ctx.t_s, xy, velocity, tour, phase_s, self._mobility, self._region)
            place.stuck = place.transit is None
            if place.stuck:
                self._state.failed_s = ctx.t_s


@dataclass
class _PathPlace:
    """A vehicle's place on its path: at time t it is at phase `t - origin_s`, once its way there has ended."""

    origin_s: float = 0.0
    planned_s: float = -math.inf
    transit: Transit | None = None
    joined: bool = False
    stuck: bool = False

    def at(self, tour: Tour, times_s: Floats) -> tuple[Floats, Floats]:
        """Return positions and velocities (k, 2)."""
        xy, velocity = tour.at(times_s - self.origin_s)
        if self.transit is not None:
            under_way = (times_s < self.transit.end_s)[:, None]
            way_xy, way_velocity = self.transit.at(times_s)
            xy, velocity = np.where(under_way, way_xy, xy), np.where(under_way, way_velocity, velocity)
        return xy, velocity


@dataclass
class _WaypointsState:
    """What a step leaves for the next one. Field names are stored in snapshots."""

    places: dict[int, _PathPlace] = field(default_factory=dict)
    drawn_s: float = -math.inf
    failed_s: float = -math.inf
    """The step in which a way was looked for last and not found."""
    keep_out: tuple[KeepOut, ...] = ()
    """Where lost vehicles may be: the paths lead round it."""


def parse_paths(text: str) -> dict[int, Floats]:
    """Return (k, 2) points by vehicle from a text such as `1: 10,20 80,20; 2: 100,20 180,90`.

    Raises:
        ValueError: one line with the wrong part of the text.
    """
    paths: dict[int, Floats] = {}
    for part in filter(str.strip, text.split(";")):
        head, colon, rest = part.partition(":")
        if not colon or not head.strip().isdecimal():
            raise ValueError(f"paths: {part.strip()!r}: must be VEHICLE: EAST,NORTH EAST,NORTH …")
        points = [_point(word) for word in rest.split()]
        if not 2 <= len(points) <= MAX_PATH_POINTS:
            raise ValueError(
                f"paths: vehicle {head.strip()} has {len(points)} points, and needs 2 to {MAX_PATH_POINTS}"
            )
        if points.count(points[0]) == len(points):
            raise ValueError(f"paths: all points of vehicle {head.strip()} are in one place")
        if int(head) in paths:
            raise ValueError(f"paths: vehicle {head.strip()} has two paths")
        paths[int(head)] = np.array(points, dtype=float)
    return paths


def _point(word: str) -> tuple[float, float]:
    try:
        x, y = (float(number) for number in word.split(","))
    except ValueError:
        raise ValueError(f"paths: {word!r} is not EAST,NORTH in metres") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(f"paths: {word!r} is not finite")
    return x, y


def _closed(points: Floats, *, loop: bool) -> Floats:
    return points if loop else np.vstack([points, points[-2:0:-1]])


def strips(zone: shapely.Polygon, count: int, radius_m: float) -> list[Floats]:
    """Return `count` closed paths: the zone in strips from west to east, each flown up and down its lanes and back."""
    left, bottom, right, top = zone.bounds
    width_m = (right - left) / count
    found = []
    for number in range(count):
        west = left + number * width_m
        strip = shapely.intersection(zone, shapely.box(west, bottom - 1.0, west + width_m, top + 1.0))
        lanes = max(1, math.ceil(width_m / (2.0 * radius_m) - 0.05))
        points: list[tuple[float, float]] = []
        for lane in range(lanes):
            x = west + (lane + 0.5) * width_m / lanes
            span = shapely.intersection(strip, shapely.LineString([(x, bottom - 1.0), (x, top + 1.0)]))
            low, high = (bottom, top) if span.is_empty else (span.bounds[1], span.bounds[3])
            ends = [(x, min(low + radius_m / 2, (low + high) / 2)), (x, max(high - radius_m / 2, (low + high) / 2))]
            points += ends if lane % 2 == 0 else ends[::-1]
        path = np.array(points)
        if np.hypot(*np.ptp(path, axis=0)) < 2.0:
            # All points in one place have no direction: stretch them to a short line.
            path = path + np.array([[0.0, -2.0], [0.0, 2.0]] * (len(path) // 2))
        found.append(_closed(path, loop=False))
    return found


def _now(fleet: Fleet, i: int) -> tuple[Floats, Floats]:
    velocity = np.nan_to_num(fleet.velocity_m_s[i, :2])
    age_s = min(max(float(np.nan_to_num(fleet.age_s[i])), 0.0), 1.0)
    return fleet.position_m[i, :2] + velocity * age_s, velocity
