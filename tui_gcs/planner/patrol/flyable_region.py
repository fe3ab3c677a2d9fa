"""Where a team's vehicles may be planned to fly: the operating area less its margin, less no-fly zones."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.api import (
    KeepOut,
    Limits,
    OperatingArea,
    PlannerTask,
    Shape,
    Zone,
    ZoneCells,
    as_no_fly,
    permitted_region,
    polygon_of,
    reachable_cells,
)

Floats = NDArray[np.floating[Any]]
Pair = tuple[float, float]

EDGE_M = 0.4
"""Paths lie in the region, stopping points up to this far beyond it: flying along the edge needs no braking."""
CORNER_INSET_M = 6.0
"""Ways turn this far from the edge, so that a vehicle that swings wide stays inside."""
SAME_M = 1e-3
"""Points nearer than this are one point."""
AROUND_M = 30.0
"""Tours leave their zone by less than this, including the braking distance that is looked ahead from there."""
RAY_STEP_M, RAY_HALVINGS = 1.0, 5
"""The room ahead is looked for in steps of so many metres, and then exactly to a 32nd of one."""
# ArduCopters on good links want 0.85 to 1.15 s² (`core/motion/tracking_error.py`). Flown round a no-fly zone at 7 m/s,
# the shift led 2 m into its margin, and each vehicle braked there in every round.
SHIFT_S2 = 1.15
"""Set-points are sent shifted along the course's acceleration by up to this much times it (lead compensation)."""
# Flown at 12 m/s: where v² / 2a with the planner's acceleration ends on the edge of the margin, the guard's braking
# ends 1 to 2 m inside a no-fly zone.
GUARD_DELAY_S, GUARD_SHARE = 0.25, 0.8
"""The guard lets a vehicle brake after this delay with this share of its acceleration (`BRAKE_SHARE` in
`core/guard/motion_prediction.py`); it must come to rest outside no-fly zones, but may use their margin up."""
AT_CORNER_M = 2.0
"""A vehicle this near a corner has reached it."""


class FlyableRegion:
    """One connected flyable polygon and the shortest ways in it."""

    def __init__(self, area: OperatingArea, no_fly: tuple[Zone, ...], limits: Limits, zone: Zone) -> None:
        """Take the flyable part nearest to `zone`. Raises ValueError if margin and no-fly zones leave nothing."""
        self._margin_m = margin_m = limits.geofence_margin_m
        self._accel_m_s2 = limits.accel_m_s2
        self.polygon = permitted_region(area.shape, no_fly, margin_m, zone.shape)
        if self.polygon.is_empty:
            raise ValueError(
                f"zone {zone.name!r}: margin and no-fly zones leave nothing of the operating area to fly in"
            )
        self._walls = area.shape, no_fly, margin_m
        target = polygon_of(zone.shape)
        self._edge = self.polygon.buffer(EDGE_M, join_style="mitre")
        for prepared in (self.polygon, self._edge):
            shapely.prepare(prepared)
        around = shapely.box(*target.buffer(AROUND_M).bounds)
        self._open = around.bounds if self.polygon.covers(around) else (math.inf, math.inf, -math.inf, -math.inf)
        """West, south, east, north of a box without obstacles; empty if there is one."""
        self._closed = shapely.union_all([polygon_of(closed.shape) for closed in no_fly])
        self._boundary = self._edge.boundary
        shapely.prepare(self._boundary)
        hull_m2 = self.polygon.convex_hull.area
        self._convex = hull_m2 - self.polygon.area < 1e-6 * hull_m2
        # In a convex region every straight way is inside.
        self._corners = np.empty((0, 2)) if self._convex else self._turning_points()
        self._between_m = self._shortest_ways()

    def cells_of(self, shape: Shape, footprint_radius_m: float) -> ZoneCells:
        """Return the cells of `shape` that a footprint can see from here; there may be none."""
        return reachable_cells(shape, *self._walls, footprint_radius_m)

    def contains(self, xy_m: Floats) -> NDArray[np.bool_]:
        """Return which of the points (n, 2) may be flown over."""
        return np.asarray(shapely.intersects_xy(self.polygon, xy_m[:, 0], xy_m[:, 1]))

    def within(self, xy_m: Floats, away_m: float) -> NDArray[np.bool_]:
        """Return which of the points (n, 2) are no farther than this from where may be flown."""
        return np.asarray(shapely.dwithin(self.polygon, shapely.points(xy_m), away_m))

    def clear(self, a_m: Floats, b_m: Floats) -> bool:
        """Return whether the straight way from a to b stays inside."""
        return bool(self.polygon.covers(shapely.LineString([a_m, b_m])))

    def nearly_clear(self, a_m: Floats, b_m: Floats) -> bool:
        """Return whether the straight way from a to b stays inside, or at most `EDGE_M` beyond the edge."""
        return bool(self._edge.covers(shapely.LineString([a_m, b_m])))

    def next_leg(self, here_m: Floats, there_m: Floats, onward_m: Floats | None = None) -> tuple[Floats, bool]:
        """Return the next point of the shortest way from here to there, and whether that is a corner on the way.

        Without any way it is `there_m`, too. From outside the way leads back inside first. `onward_m` are the ways from
        all corners to there, if they are known already.
        """
        if self._convex or not len(self._corners) or self.clear(here_m, there_m):
            return there_m, False
        walls = self.polygon
        if not self.contains(here_m[None])[0]:
            # A vehicle that brakes at the edge may come to rest a little beyond it, where no corner is in sight.
            if not shapely.intersects_xy(self._edge, *here_m):
                way_in_m = self.ways_inside_m(here_m[None])[0]
                return here_m + way_in_m * (1.0 + EDGE_M / max(math.hypot(*way_in_m), SAME_M)), True
            walls = self._edge
        first_m = np.where(self._visible(here_m, walls), np.hypot(*(self._corners - here_m).T), np.inf)
        first_m[first_m < AT_CORNER_M] = np.inf
        total = first_m + (self._onward_m(there_m) if onward_m is None else onward_m)
        best = int(np.argmin(total))
        return (self._corners[best], True) if np.isfinite(total[best]) else (there_m, False)

    def _onward_m(self, there_m: Floats) -> Floats:
        """Return (c,) lengths of the shortest ways from all corners to there."""
        last_m = np.where(self._visible(there_m, self.polygon), np.hypot(*(self._corners - there_m).T), np.inf)
        return np.asarray((self._between_m + last_m).min(axis=1))

    def _turning_points(self) -> Floats:
        """Return places to turn at: the corners of the region, kept off its edge as far as its width allows."""
        for inset_m in (CORNER_INSET_M, CORNER_INSET_M / 4.0):
            inner = self.polygon.buffer(-inset_m, join_style="mitre").simplify(inset_m / 4.0)
            if isinstance(inner, shapely.Polygon) and not inner.is_empty:
                break
        return np.unique(np.round(shapely.get_coordinates(inner), 3), axis=0)

    def _shortest_ways(self) -> Floats:
        """Return (c, c) lengths of the shortest ways between corners (Floyd-Warshall), infinite without one."""
        corners = self._corners
        ways = np.full((len(corners), len(corners)), np.inf)
        for i, corner in enumerate(corners):
            ways[i] = np.where(self._visible(corner, self.polygon), np.hypot(*(corners - corner).T), np.inf)
        for i in range(len(corners)):
            ways = np.minimum(ways, ways[:, i, None] + ways[None, i])
        return ways

    def _visible(self, xy_m: Floats, walls: shapely.Polygon) -> NDArray[np.bool_]:
        """Return which corners can be reached in a straight line inside `walls`."""
        ways = np.stack([np.broadcast_to(xy_m, self._corners.shape), self._corners], axis=1)
        return np.asarray(shapely.covers(walls, shapely.linestrings(ways)))

    def are_sendable(
        self, xy_m: Floats, velocity_m_s: Floats, accel_m_s2: Floats, brake_m_s2: float
    ) -> NDArray[np.bool_]:
        """Return which states (n, 2) of a course the guard lets pass when they are sent, with their shift and without.

        `accel_m_s2` is (n, 2), or (s, n, 2) where each state may be sent with any of s accelerations. The vehicle must
        be able to stop inside, straight on with `brake_m_s2`, and the ways there lie inside.
        """
        shifts_m = SHIFT_S2 * (accel_m_s2 if accel_m_s2.ndim == 3 else accel_m_s2[None])
        speed_m_s = np.hypot(*velocity_m_s.T)
        stop_m = velocity_m_s * (self.stopping_m(speed_m_s, brake_m_s2) / np.maximum(speed_m_s, SAME_M))[:, None]
        ways = np.stack([xy_m + stop_m, xy_m], axis=1)
        for shift_m in shifts_m:
            ways = np.concatenate([ways, np.stack([xy_m + shift_m, xy_m + shift_m + stop_m, xy_m], axis=1)], axis=1)
        sendable = np.ones(len(xy_m), dtype=bool)
        if self._in_the_open(ways.reshape(-1, 2)):
            return sendable
        reach_m = float(np.hypot(*(ways - xy_m[:, None]).transpose(2, 0, 1)).max())
        near = np.flatnonzero(shapely.dwithin(self._boundary, shapely.points(xy_m), reach_m) | ~self.contains(xy_m))
        sendable[near] = shapely.covers(self._edge, shapely.linestrings(ways[near]))
        return sendable

    def stopping_m(self, speed_m_s: Floats, brake_m_s2: float) -> Floats:
        """Return how far from the edge a vehicle must begin to brake: for its planner, and for the guard.

        The guard is the stricter one at high speeds.
        """
        planned_m = speed_m_s**2 / (2.0 * brake_m_s2)
        guarded_m = GUARD_DELAY_S * speed_m_s + speed_m_s**2 / (2.0 * GUARD_SHARE * self._accel_m_s2)
        return np.asarray(np.maximum(planned_m, guarded_m - self._margin_m))

    def stopping_speed_m_s(self, room_m: Floats, brake_m_s2: float) -> Floats:
        """Return the highest speed from which a vehicle stops within this room: the inverse of `stopping_m`."""
        guarded_m_s2 = GUARD_SHARE * self._accel_m_s2
        root_s = np.sqrt(GUARD_DELAY_S**2 + 2.0 * (room_m + self._margin_m) / guarded_m_s2)
        return np.asarray(np.minimum(np.sqrt(2.0 * brake_m_s2 * room_m), guarded_m_s2 * (root_s - GUARD_DELAY_S)))

    def is_roomy(self, xy_m: Pair, room_m: float) -> bool:
        """Return whether the edge is farther than this, or has no dents: then all ways between places are inside."""
        return self._convex or not shapely.dwithin(self._boundary, shapely.Point(xy_m), room_m)

    def have_room(self, xy_m: Floats, room_m: float) -> NDArray[np.bool_]:
        """Return around which of the points (n, 2) everything within `room_m` may be flown over."""
        near = shapely.dwithin(self._boundary, shapely.points(xy_m), room_m)
        return np.asarray(self.contains(xy_m) & ~near)

    def sendable_share(self, xy_m: Floats, velocity_m_s: Floats, accel_m_s2: Floats, brake_m_s2: float) -> Floats:
        """Return (n,) shares of their speed at which states `are_sendable`, to a 32nd: 1 where they are as they are.

        Acceleration changes with the square of the speed.
        """
        share = np.ones(len(xy_m))
        bad = np.flatnonzero(~self.are_sendable(xy_m, velocity_m_s, accel_m_s2, brake_m_s2))
        low, high = np.zeros((len(bad), 1)), np.ones((len(bad), 1))
        for _ in range(RAY_HALVINGS if len(bad) else 0):
            middle = (low + high) / 2.0
            sendable = self.are_sendable(
                xy_m[bad], middle * velocity_m_s[bad], middle**2 * accel_m_s2[..., bad, :], brake_m_s2
            )[:, None]
            low, high = np.where(sendable, middle, low), np.where(sendable, high, middle)
        share[bad] = low[:, 0]
        return share

    def enters_no_fly(self, way_m: Floats) -> bool:
        """Return whether a way (n, 2) enters a no-fly zone; leaving one that it begins in is allowed."""
        inside = shapely.intersects_xy(self._closed, way_m[:, 0], way_m[:, 1])
        return bool((inside[1:] & ~inside[:-1]).any())

    def ways_inside_m(self, xy_m: Floats) -> Floats:
        """Return (n, 2) vectors from each point to the nearest place inside; zeros for points inside."""
        ways = np.zeros_like(xy_m)
        if self._in_the_open(xy_m):
            return ways
        outside = np.flatnonzero(~self.contains(xy_m))
        if len(outside):
            lines = shapely.shortest_line(self.polygon, shapely.points(xy_m[outside]))
            ways[outside] = shapely.get_coordinates(lines)[::2] - xy_m[outside]
        return ways

    def pulled_inside(self, xy_m: Floats, deeper_m: float = 0.0) -> Floats:
        """Return the points (n, 2), with those outside moved to the nearest place inside, and `deeper_m` farther.

        The nearest place is on the edge, and by rounding it may still be outside.
        """
        ways_m = self.ways_inside_m(xy_m)
        if deeper_m > 0.0:
            ways_m *= 1.0 + deeper_m / np.maximum(np.hypot(*ways_m.T), 1e-9)[:, None]
        return xy_m + ways_m

    def _in_the_open(self, xy_m: Floats, room_m: float = 0.0) -> bool:
        """Return whether these points certainly have no obstacle around them, which is the usual case."""
        # Column by column: along the first axis numpy takes four times as long, and each step of a descent asks.
        if not len(xy_m):
            return True
        x, y = xy_m[:, 0], xy_m[:, 1]
        left, low, right, high = self._open
        least, most = min(x.min() - left, y.min() - low), min(right - x.max(), high - y.max())
        return bool(min(least, most) >= room_m)

    def closed_inside(self, path_m: Floats, step_m: float) -> Floats:
        """Return the closed path with ways around where it leaves the region, in steps of at most `step_m`."""
        if self._in_the_open(path_m):
            return path_m
        legs = shapely.linestrings(np.stack([path_m, np.roll(path_m, -1, axis=0)], axis=1))
        if shapely.covers(self.polygon, legs).all():
            return path_m
        kept = path_m[self.contains(path_m)]
        if not len(kept):
            kept = self.pulled_inside(path_m[:1])
        after = np.roll(kept, -1, axis=0)
        clear = shapely.covers(self.polygon, shapely.linestrings(np.stack([kept, after], axis=1)))
        short = clear & (np.hypot(*(after - kept).T) < step_m - SAME_M)
        whole: list[Floats] = []
        for here, there, straight, one_step in zip(kept, after, clear.tolist(), short.tolist(), strict=True):
            if one_step:  # most are
                whole.append(here)
            else:
                whole.extend(_steps(here, there, step_m) if straight else self._stepped(here, there, step_m))
        path = np.array(whole)
        moved_m = np.hypot(*np.diff(path, axis=0, append=path[:1]).T)
        return np.asarray(path[moved_m > SAME_M]) if (moved_m > SAME_M).any() else self.pulled_inside(path_m)

    def open_inside(self, path_m: Floats, step_m: float) -> Floats:
        """Return the open path (n, 2), led around where its legs leave the region, in steps of at most `step_m`."""
        whole: list[Floats] = []
        for here, there in pairwise(path_m):
            whole.extend(self._stepped(here, there, step_m))
        path = np.array([*whole, path_m[-1]])
        moved_m = np.hypot(*np.diff(path, axis=0, prepend=path[:1] - 1.0).T)
        return np.asarray(path[moved_m > SAME_M])

    def _stepped(self, here: Floats, there: Floats, step_m: float) -> Iterator[Floats]:
        """Yield points of the way from here to there, without its end."""
        straight = self._convex or not len(self._corners) or self.clear(here, there)
        onward_m = None if straight else self._onward_m(there)
        for _ in range(len(self._corners) + 1):
            leg, corner = self.next_leg(here, there, onward_m)
            yield from _steps(here, leg, step_m)
            if not corner:
                return
            here = leg

    def room_ahead_m(self, xy_m: Floats, heading: Floats, up_to_m: float) -> Floats:
        """Return (n,) distances from each point along its unit `heading` (n, 2) to the edge, at most `up_to_m`."""
        room = np.full(len(xy_m), up_to_m)
        if self._in_the_open(xy_m, up_to_m):
            return room
        near = np.flatnonzero(shapely.dwithin(self._boundary, shapely.points(xy_m), up_to_m))
        if len(near):
            room[near] = self._free_m(xy_m[near], heading[near], up_to_m)
        return room

    def _free_m(self, xy_m: Floats, heading: Floats, up_to_m: float) -> Floats:
        """Return (n,) lengths that are free along each `heading`: steps of about `RAY_STEP_M`, the last one halved."""
        away = np.linspace(0.0, up_to_m, math.ceil(up_to_m / RAY_STEP_M) + 1)[1:]
        at = (xy_m[:, None] + away[:, None] * heading[:, None]).reshape(-1, 2)
        inside = shapely.intersects_xy(self._edge, at[:, 0], at[:, 1]).reshape(len(xy_m), -1)
        blocked = np.argmin(inside, axis=1)
        open_ = inside.all(axis=1)
        high = away[blocked]
        low = high - away[0]
        for _ in range(RAY_HALVINGS):
            middle = (low + high) / 2.0
            at = xy_m + middle[:, None] * heading
            free = shapely.intersects_xy(self._edge, at[:, 0], at[:, 1])
            low, high = np.where(free, middle, low), np.where(free, high, middle)
        return np.where(open_, up_to_m, low)


class RegionOfTask:
    """Where the vehicles of a task may fly, less where lost ones may be at the time."""

    def __init__(self, task: PlannerTask) -> None:
        """Find the whole region. Raises ValueError if margin and no-fly zones leave nothing."""
        self._task = task
        self.whole = FlyableRegion(task.area, task.no_fly, task.limits, task.zone)
        self._last: tuple[tuple[KeepOut, ...], FlyableRegion] = (), self.whole

    def clear_of(self, keep_out: tuple[KeepOut, ...]) -> FlyableRegion:
        """Return the region without these volumes; the whole one if they leave nothing of it."""
        task = self._task
        if self._last[0] != keep_out:
            try:
                closed = (*task.no_fly, *as_no_fly(keep_out))
                self._last = keep_out, FlyableRegion(task.area, closed, task.limits, task.zone)
            except ValueError:  # the guard keeps them apart then
                self._last = keep_out, self.whole
        return self._last[1]


def _steps(here: Floats, there: Floats, step_m: float) -> Floats:
    """Return points of the straight way in steps of at most `step_m`, without its end."""
    way = there - here
    count = max(1, math.ceil(math.hypot(way[0], way[1]) / step_m))
    return np.asarray(here + way * (np.arange(count) / count)[:, None])
