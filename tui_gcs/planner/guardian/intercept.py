"""Interception: when a vehicle can be near a target that flies straight on, and how long that is of use.

The solution is closed-form for constant velocities: |q + w t - p| = V t + c is quadratic in t. The time that a vehicle
needs to turn is taken into account by moving its start back by what it loses meanwhile, and solving again.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.patrol.transit import Mobility

Floats = NDArray[np.floating[Any]]

REPEATS = 4
"""Solutions with a better known start; the last one changes by less than 0.1 s."""
PREDICTION_S = 60.0
"""Targets are extrapolated this far."""
PREDICTION_STEP_S = 1.0
ZONE_TOLERANCE_M = 10.0
"""A target that would pass the zone by less than this counts as flying into it."""
MIN_TARGET_SPEED_M_S = 0.5
"""Slower targets count as standing."""


@dataclass(frozen=True)
class Interception:
    """Meetings of vehicles with targets; arrays have the broadcast shape of the arguments."""

    after_s: Floats
    """Time from now; infinite where a target cannot be caught."""
    place_m: Floats
    """(…, 2) where the vehicle is then."""
    velocity_m_s: Floats
    """(…, 2) velocity of the vehicle then."""


def intercept(
    xy_m: Floats, velocity_m_s: Floats, target_m: Floats, target_m_s: Floats, mobility: Mobility, within_m: float
) -> Interception:
    """Return the earliest meetings within `within_m`; places and velocities are (…, 2) and broadcast.

    They are exact for a vehicle at full speed on its course; otherwise the shorter the turn, the more exact.
    """
    speed, accel = mobility.speed_m_s, mobility.accel_m_s2
    xy_m, velocity_m_s, target_m, target_m_s = np.broadcast_arrays(xy_m, velocity_m_s, target_m, target_m_s)
    start, course, after = xy_m, np.zeros_like(xy_m), np.full(xy_m.shape[:-1], np.inf)
    for _ in range(REPEATS):
        # Fixed-point iteration: the turn depends on the course, and the course on the start after the turn.
        after = first_contact_s(target_m - start, target_m_s, speed, within_m)
        reached = np.where(np.isfinite(after), after, 0.0)[..., None]
        way = target_m + target_m_s * reached - start
        away = np.hypot(way[..., 0], way[..., 1])[..., None]
        course = np.where(away > 1e-6, way / np.maximum(away, 1e-6), 0.0)
        change = speed * course - velocity_m_s
        turn_s = np.hypot(change[..., 0], change[..., 1]) / accel
        # A vehicle that is there before it has turned loses only what it would have lost until then.
        lost_s = np.minimum(turn_s, 2.0 * reached[..., 0]) / 2.0
        start = xy_m - change * lost_s[..., None]
    place = start + speed * course * np.where(np.isfinite(after), after, 0.0)[..., None]
    return Interception(after, place, speed * course)


def first_contact_s(gap_m: Floats, target_m_s: Floats, speed: float, within_m: float) -> Floats:
    """Return the smallest t >= 0 with |gap + w t| <= speed t + within; infinite without one."""
    # a < 0: the vehicle is faster than the target, and there is exactly one contact. a > 0: only a target that
    # approaches can be met.
    a = (target_m_s**2).sum(axis=-1) - speed**2
    b = (gap_m * target_m_s).sum(axis=-1) - speed * within_m
    c = (gap_m**2).sum(axis=-1) - within_m**2
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        even = np.where(b < 0.0, -c / (2.0 * b), np.inf)
        slower = (-b - root) / a
        faster = np.where((b < 0.0) & (b * b >= a * c), c / (-b + root), np.inf)
    after = np.where(np.abs(a) < 1e-6, even, np.where(a < 0.0, slower, faster))
    return np.asarray(np.where(c <= 0.0, 0.0, after))


class TargetBoundaries:
    """Prepared polygons that targets are tested against: the zone, a wider zone, and where vehicles can reach."""

    def __init__(self, zone: shapely.Polygon, flyable: shapely.Polygon, within_m: float) -> None:
        """`flyable` is where vehicles may fly; they reach `within_m` farther."""
        self.zone, self.wide = zone, zone.buffer(ZONE_TOLERANCE_M)
        self.reach = flyable.buffer(within_m)
        for polygon in (self.zone, self.wide, self.reach):
            shapely.prepare(polygon)


@dataclass(frozen=True)
class TargetCourse:
    """Where a target is going."""

    enters_s: float
    """Time until it is in the zone: 0 inside, infinite for a target that passes, stands or flies away."""
    reachable_s: float
    """Time until vehicles can be near enough to it; infinite if they never can."""


def target_courses(edges: TargetBoundaries, target_m: Floats, target_m_s: Floats) -> list[TargetCourse]:
    """Return the courses of k targets at (k, 2)."""
    times = np.arange(0.0, PREDICTION_S + PREDICTION_STEP_S / 2.0, PREDICTION_STEP_S)
    found = []
    for here, velocity in zip(target_m, target_m_s, strict=True):
        path = here + velocity * times[:, None]
        speed = float(np.hypot(*velocity))
        reached = shapely.intersects_xy(edges.reach, path[:, 0], path[:, 1])
        enters_s = 0.0 if shapely.intersects_xy(edges.zone, *here) else np.inf
        if speed >= MIN_TARGET_SPEED_M_S and enters_s:
            way = shapely.LineString([path[0], path[-1]])
            for edge in (edges.zone, edges.wide):
                hit = shapely.intersection(way, edge)
                if not hit.is_empty:
                    enters_s = float(shapely.distance(hit, shapely.Point(here))) / speed
                    break
        found.append(TargetCourse(enters_s, float(times[int(np.argmax(reached))]) if reached.any() else np.inf))
    return found
