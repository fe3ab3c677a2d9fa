"""Finds what is wrong with a plan: what the station would not accept, or the guard would veto; and compares plans."""

import math
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.geometry.zones import Shape, polygon_of
from tui_gcs.core.guard.guard import BAND_TOLERANCE_M, SPEED_TOLERANCE
from tui_gcs.core.guard.motion_prediction import CLIMB_M_S, DESCENT_M_S
from tui_gcs.core.motion.cruise import MAX_CRUISE_S
from tui_gcs.core.protocol.common import FleetFrame, Freshness, Intent, Phase, PlannerTask, TeamPlan
from tui_gcs.core.protocol.plan_limits import MAX_ANNOTATIONS, MAX_METRICS

MAX_SAMPLES = 600
"""Samples of a trajectory that the station accepts."""


def active_ids(frame: FleetFrame) -> set[int]:
    """Return the vehicles that may get intents."""
    return {
        vehicle
        for i, vehicle in enumerate(frame.ids)
        if frame.phase[i] is Phase.FLYING
        and frame.freshness[i] is not Freshness.LOST
        and all(map(math.isfinite, frame.position_m[i]))
    }


def faults(plan: TeamPlan, frame: FleetFrame, task: PlannerTask, *, inside: bool = True) -> list[str]:
    """Return everything wrong with `plan`, one short text each. `inside` requires its places to be in the area."""
    active, seen = active_ids(frame), set[int]()
    found: list[str] = []
    for intent in plan.intents:
        if intent.vehicle not in active:
            found.append(f"an intent for vehicle {intent.vehicle}, which is not active")
        if intent.vehicle in seen:
            found.append(f"two intents for vehicle {intent.vehicle}")
        seen.add(intent.vehicle)
        wrong = nonsense(intent, plan.t_s) or too_fast(intent, task) or (outside(intent, task) if inside else "")
        if wrong:
            found.append(f"vehicle {intent.vehicle}: {wrong}")
    return found + list(_drawing_faults(plan))


def _drawing_faults(plan: TeamPlan) -> Iterator[str]:
    drawn = plan.annotations or ()
    if len(drawn) > MAX_ANNOTATIONS:
        yield f"more than {MAX_ANNOTATIONS} annotations: only so many are drawn"
    if not all(_finite(point) for annotation in drawn for point in annotation.points_m):
        yield "an annotation with a point that is not finite"
    if len(plan.metrics) > MAX_METRICS:
        yield f"{len(plan.metrics)} metrics: only {MAX_METRICS} are shown"


def nonsense(intent: Intent, t_s: float) -> str:
    """Return why no vehicle can do what `intent` asks, or ""."""
    kind, position = intent.kind, intent.position_m
    if kind in ("goto", "orbit") and (position is None or not _finite(position)):
        return f"{kind} without a finite position_m"
    if intent.speed_m_s is not None and not (math.isfinite(intent.speed_m_s) and intent.speed_m_s > 0):
        return f"speed_m_s is {intent.speed_m_s}: must be positive"
    if kind == "orbit" and not (math.isfinite(intent.radius_m) and intent.radius_m > 0):
        return f"orbit with radius_m {intent.radius_m}: must be positive"
    if kind == "velocity":
        if intent.velocity_m_s is None or not _finite(intent.velocity_m_s):
            return "velocity without a finite velocity_m_s"
        if not 0 < intent.valid_s <= MAX_CRUISE_S:
            return f"velocity with valid_s {intent.valid_s}: must be more than 0, at most {MAX_CRUISE_S:g}"
    return _bad_trajectory(intent, t_s) if kind == "trajectory" else ""


def _bad_trajectory(intent: Intent, t_s: float) -> str:
    count = len(intent.positions_m)
    if not 2 <= count <= MAX_SAMPLES or count != len(intent.velocities_m_s):
        return f"trajectory of {count} positions and {len(intent.velocities_m_s)} velocities: 2 to 600 of each, as many"
    if not (math.isfinite(intent.t0_s) and math.isfinite(intent.dt_s) and intent.dt_s > 0):
        return f"trajectory with t0_s {intent.t0_s}, dt_s {intent.dt_s}: finite, and dt_s more than 0"
    if not all(_finite(v) for samples in (intent.positions_m, intent.velocities_m_s) for v in samples):
        return "trajectory with a sample that is not finite"
    # A planner that counts from its own start instead of `ctx.t_s` sends such a one, and its vehicles stand.
    if intent.t0_s + intent.dt_s * (count - 1) < t_s:
        return "trajectory that ended before the plan was made: t0_s counts as ctx.t_s does"
    return ""


def too_fast(intent: Intent, task: PlannerTask) -> str:
    """Return why the guard would veto the intent's speed, or ""."""
    velocities = [*intent.velocities_m_s, *([intent.velocity_m_s] if intent.velocity_m_s is not None else [])]
    asked, upwards = [math.hypot(*v) for v in velocities], [v[2] for v in velocities]
    if intent.speed_m_s is not None:
        asked.append(intent.speed_m_s)
    limit = task.limits.speed_m_s
    if asked and max(asked) > limit * SPEED_TOLERANCE:
        return f"{max(asked):.1f} m/s asked, {limit:.1f} allowed (task.limits.speed_m_s)"
    for up in upwards:
        if not -DESCENT_M_S * SPEED_TOLERANCE <= up <= CLIMB_M_S * SPEED_TOLERANCE:
            return f"{up:+.1f} m/s up asked, -{DESCENT_M_S:.1f} to {CLIMB_M_S:+.1f} allowed"
    return ""


def outside(intent: Intent, task: PlannerTask) -> str:
    """Return why the guard would veto the intent's places, or ""."""
    places = np.array(list(_places(intent)), dtype=float).reshape(-1, 3)
    region = _inner(task.area.shape, task.limits.geofence_margin_m)
    out = places[~shapely.intersects_xy(region, places[:, 0], places[:, 1])]
    if len(out):
        return f"({out[0][0]:.0f}, {out[0][1]:.0f}) is outside the operating area less its margin (task.area)"
    low, high = task.area.alt_min_m - BAND_TOLERANCE_M, task.area.alt_max_m + BAND_TOLERANCE_M
    bad = places[(places[:, 2] < low) | (places[:, 2] > high)]
    if len(bad):
        band = f"{task.area.alt_min_m:g} to {task.area.alt_max_m:g} m"
        return f"height {bad[0][2]:.0f} m is outside the altitude band {band}: take fleet.layer_m"
    return ""


def rows_outside(position_m: NDArray[np.floating[Any]], task: PlannerTask) -> list[int]:
    """Return the rows outside the operating area less its margin."""
    region = _inner(task.area.shape, task.limits.geofence_margin_m)
    return [int(row) for row in np.flatnonzero(~shapely.intersects_xy(region, position_m[:, 0], position_m[:, 1]))]


def _places(intent: Intent) -> Iterator[tuple[float, float, float]]:
    if intent.kind == "goto" and intent.position_m is not None:
        yield intent.position_m
    if intent.kind == "orbit" and intent.position_m is not None:
        x, y, z = intent.position_m
        for quarter in range(8):
            angle = quarter * math.pi / 4
            yield x + intent.radius_m * math.cos(angle), y + intent.radius_m * math.sin(angle), z
    if intent.kind == "trajectory":
        yield from intent.positions_m


@cache
def _inner(shape: Shape, margin_m: float) -> shapely.Geometry:
    # A centimetre of tolerance for rounding.
    region = polygon_of(shape).buffer(-margin_m + 0.01)
    shapely.prepare(region)
    return region


def _finite(numbers: Iterable[float]) -> bool:
    return all(map(math.isfinite, numbers))


def plan_difference(one: TeamPlan, other: TeamPlan) -> str:
    """Return the first difference of two plans in words; "" if they are equal (computing times do not count)."""
    mine, yours = ({intent.vehicle: intent for intent in plan.intents} for plan in (one, other))
    for vehicle in sorted(mine.keys() | yours.keys()):
        if vehicle not in mine or vehicle not in yours:
            return f"vehicle {vehicle} gets an intent in one run and none in the other"
        if text := intent_difference(mine[vehicle], yours[vehicle], 0.0):
            return f"vehicle {vehicle} {text}"
    if [i.vehicle for i in one.intents] != [i.vehicle for i in other.intents]:
        return "intents come in another order"
    if one.metrics.keys() != other.metrics.keys():
        return "other metrics are given"
    for name in one.metrics:
        a, b = one.metrics[name], other.metrics[name]
        if a != b and not (math.isnan(a) and math.isnan(b)):
            short = f"{a:.6g}", f"{b:.6g}"
            return f"metric {name} is {' and '.join(short if short[0] != short[1] else (repr(a), repr(b)))}"
    return "" if one.annotations == other.annotations else "other annotations are drawn"


def intent_difference(mine: Intent, yours: Intent, tolerance: float) -> str:
    """Return how two intents differ by more than `tolerance` (metres, m/s or seconds), or "".

    Their vehicles may differ.
    """
    if mine.kind != yours.kind:
        return f"gets {mine.kind} in one run and {yours.kind} in the other"
    for name in ("positions_m", "velocities_m_s", "position_m", "velocity_m_s"):
        a, b = (np.array(getattr(intent, name) or (), dtype=float).ravel() for intent in (mine, yours))
        if a.shape != b.shape:
            return f"gets {name} of {a.size} and of {b.size} numbers"
        gap = float(np.abs(a - b).max(initial=0.0))
        if not gap <= tolerance:
            return f"is sent {gap:.2g} m elsewhere" if "position" in name else f"is sent {gap:.2g} m/s faster or slower"
    for name in ("speed_m_s", "radius_m", "t0_s", "dt_s", "valid_s"):
        first, second = getattr(mine, name), getattr(yours, name)
        if (first is None) != (second is None) or (first is not None and not abs(first - second) <= tolerance):
            return f"gets {name} {first} in one run and {second} in the other"
    exact = ("clockwise", "joined") if tolerance else ("clockwise", "joined", "slot", "reason")
    other = next((name for name in exact if getattr(mine, name) != getattr(yours, name)), "")
    return f"gets another {other}" if other else ""
