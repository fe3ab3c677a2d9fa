"""Pairing: which vehicle meets which targets, one after the other, so that most are met in time."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.intercept import Course, Meeting, meet
from tui_gcs.planner.lazy_scipy import matched
from tui_gcs.planner.transit import Mobility

Floats = NDArray[np.floating[Any]]
Routes = dict[int, tuple[int, ...]]
"""Targets in order, by a vehicle's row."""

IN_TIME = 1e4
"""Worth of a target met in time, in seconds: more than any sum of times."""
LATE_S, KEPT_LATE_S = 0.7, 1.0
"""A meeting may be so late, and that of who is on the way already: turning is estimated too long, not too short."""
KEPT_S = 0.6
"""A vehicle keeps its target if that costs no more."""
NEVER = 1e6
MOST_TRIED = 8
"""Vehicles that might stay, when all would leave."""


@dataclass(frozen=True)
class Duty:
    """What one vehicle is to do: targets in order, by their rows."""

    targets: tuple[int, ...]
    place_m: Floats
    """(2,) where it meets the first."""
    velocity_m_s: Floats
    """(2,) with which it flies there."""
    after_s: float
    margin_s: float
    """Of its first meeting; negative: too late."""
    waits: bool
    """The target is not yet where vehicles may fly: be there and wait."""


@dataclass(frozen=True)
class Situation:
    """n vehicles and k targets, places and velocities (…, 2)."""

    xy_m: Floats
    velocity_m_s: Floats
    target_m: Floats
    target_m_s: Floats
    courses: list[Course]
    kept: Floats
    """(n, k) 1 where a vehicle has this target now."""
    mobility: Mobility
    within_m: float

    @property
    def limit_s(self) -> Floats:
        """(k,) latest useful meetings."""
        return np.array([course.enters_s for course in self.courses]) + LATE_S


def pair(now: Situation) -> dict[int, Duty]:
    """Duties by vehicle's row. Nobody has none only if fewer would not do as much: somebody stays if possible.

    First targets by assignment; what is left is appended to, or put before, what a vehicle has already.
    """
    n = len(now.xy_m)
    if not n or not len(now.target_m):
        return {}
    here, there = now.xy_m[:, None], now.velocity_m_s[:, None]
    first = _delayed(meet(here, there, now.target_m, now.target_m_s, now.mobility, now.within_m), now)
    second = _seconds(first, now)
    routes, worth = _routes(first, second, now, np.ones(n, dtype=bool))
    if len(routes) == n > 1:
        spare = sorted(routes, key=lambda row: first.after_s[row, routes[row][0]] - now.limit_s[routes[row][0]])
        others = [_routes(first, second, now, np.arange(n) != row) for row in spare[:MOST_TRIED]]
        best = max(others, key=lambda other: other[1])
        if best[1] > worth - IN_TIME / 2.0:
            routes = best[0]
    routes |= _late(first, now, routes)
    return {row: _duty(row, route, first, now) for row, route in sorted(routes.items())}


def _late(first: Meeting, now: Situation, routes: Routes) -> Routes:
    """Targets that nobody meets in time are followed all the same, while half of the vehicles stay for others."""
    n, busy = first.after_s.shape[0], {target for route in routes.values() for target in route}
    left = [k for k in range(len(now.courses)) if k not in busy]
    free = [row for row in range(n) if row not in routes]
    most = len(free) - (n + 1) // 2
    if most <= 0 or not left:
        return {}
    cost = np.minimum(first.after_s[np.ix_(free, left)], NEVER) - KEPT_S * now.kept[np.ix_(free, left)]
    found = sorted((float(cost[r, c]), free[r], left[c]) for r, c in matched(cost) if cost[r, c] < NEVER / 2.0)
    return {row: (target,) for _, row, target in found[:most]}


def _delayed(first: Meeting, now: Situation) -> Meeting:
    """Nobody meets a target before it is where vehicles may fly."""
    reachable = np.array([course.reachable_s for course in now.courses])
    return Meeting(np.maximum(first.after_s, reachable), first.place_m, first.velocity_m_s)


def _seconds(first: Meeting, now: Situation) -> Floats:
    """(n, k, k) when vehicle i meets target l if it meets j before."""
    begin = np.where(np.isfinite(first.after_s), first.after_s, 0.0)[..., None]
    there = now.target_m + now.target_m_s * begin[..., None]
    then = meet(
        first.place_m[:, :, None], first.velocity_m_s[:, :, None], there, now.target_m_s, now.mobility, now.within_m
    )
    reachable = np.array([course.reachable_s for course in now.courses])
    return np.asarray(np.maximum(first.after_s[..., None] + then.after_s, reachable))


def _routes(first: Meeting, second: Floats, now: Situation, free: NDArray[np.bool_]) -> tuple[Routes, float]:
    """Targets in order by vehicle's row, only for those that are `free`, and what that is worth."""
    limit = now.limit_s
    in_time = first.after_s <= limit + KEPT_LATE_S * now.kept
    cost = np.minimum(first.after_s, NEVER / 10) - KEPT_S * now.kept - IN_TIME * in_time
    cost[~in_time | ~free[:, None]] = NEVER
    routes: Routes = {}
    worth = 0.0
    for row, column in matched(cost):
        if cost[row, column] < 0.0:
            routes[row] = (column,)
            worth -= cost[row, column]
    left = [k for k in range(len(limit)) if all(k not in route for route in routes.values())]
    rows = sorted(routes)
    if not left or not rows:
        return routes, worth
    more, order = np.full((len(rows), len(left)), NEVER), {}
    for r, row in enumerate(rows):
        (has,) = routes[row]
        for c, new in enumerate(left):
            for route in ((has, new), (new, has)):
                ends = second[row][route]
                if first.after_s[row, route[0]] <= limit[route[0]] and ends <= limit[route[1]]:
                    took = ends - first.after_s[row, has] - IN_TIME
                    if took < more[r, c]:
                        more[r, c], order[r, c] = took, route
    for r, c in matched(more):
        if more[r, c] < 0.0:
            routes[rows[r]] = order[r, c]
            worth -= more[r, c]
    return routes, worth


def _duty(row: int, route: tuple[int, ...], first: Meeting, now: Situation) -> Duty:
    target = route[0]
    after_s = float(first.after_s[row, target])
    waits = after_s <= now.courses[target].reachable_s + 1e-6 and after_s > 0.0
    there = now.target_m[target] + now.target_m_s[target] * after_s
    place = there if waits else first.place_m[row, target]
    return Duty(
        route, place, first.velocity_m_s[row, target], after_s, float(now.courses[target].enters_s - after_s), waits
    )
