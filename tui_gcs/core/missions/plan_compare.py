"""Comparison of a plan that was sent with what a vehicle holds, as its autopilot stores items.

Places must be equal to 1e-7 degrees; heights and parameters as far as float32 and the autopilot's storage allow. Fence
shapes may come in another order. What an autopilot is known not to store is no difference, but a note.
"""

import math
from collections import Counter
from dataclasses import dataclass

from tui_gcs.core.firmware.plan_dialects import PlanDialect
from tui_gcs.core.plans.model import FenceShape, Plan, PlanItem, PlanKind, fence_shapes, float32

MAX_DIFFERENCES = 10
PARAM_TOLERANCE = 1e-5
"""The relative tolerance of a parameter: float32 has 6e-8, and degrees to radians and back cost some more."""
# Angles come back as 32-bit floats.
YAW_TOLERANCE_DEG = 1e-3
PLACE_TOLERANCE = 1
"""The tolerance of a place in 1e-7 degrees: PX4 stores degrees as float64."""


@dataclass(frozen=True)
class Comparison:
    """The differences between two plans."""

    differences: tuple[str, ...] = ()
    """What is not as it was sent; empty if the vehicle holds the plan."""
    notes: tuple[str, ...] = ()
    """What this autopilot does not store of what was sent."""

    @property
    def same(self) -> bool:
        """Whether the vehicle holds the plan."""
        return not self.differences


def compare(sent: Plan, held: Plan, dialect: PlanDialect) -> Comparison:
    """Compare `held`, which a vehicle returned, with `sent`."""
    if sent.kind is PlanKind.FENCE:
        return Comparison(_shapes(sent, held, dialect), _notes(sent, dialect))
    found = []
    if len(sent.items) != len(held.items):
        found.append(f"{len(held.items)} items instead of {len(sent.items)}")
    for index, (ours, theirs) in enumerate(zip(sent.items, held.items, strict=False)):
        difference = _item(ours, theirs, sent.kind, dialect)
        if difference:
            found.append(f"item {index + 1}: {difference}")
            # A plan shifted by one item differs everywhere.
            if len(found) >= MAX_DIFFERENCES:
                break
    return Comparison(tuple(found), _notes(sent, dialect))


def begins_alike(sent: Plan, held: Plan, dialect: PlanDialect) -> int:
    """How many items from the first are as they were sent."""
    for index, (ours, theirs) in enumerate(zip(sent.items, held.items, strict=False)):
        if _item(ours, theirs, sent.kind, dialect):
            return index
    return min(len(sent.items), len(held.items))


def _item(sent: PlanItem, held: PlanItem, kind: PlanKind, dialect: PlanDialect) -> str:
    """Return what is different, or ""."""
    ours, theirs = dialect.stored(kind, sent), dialect.stored(kind, held)
    if ours.command != theirs.command:
        return f"command {theirs.command} instead of {ours.command}"
    if ours.frame != theirs.frame:
        return f"frame {theirs.frame} instead of {ours.frame}"
    if abs(ours.x - theirs.x) > PLACE_TOLERANCE or abs(ours.y - theirs.y) > PLACE_TOLERANCE:
        return f"is at {_at(theirs)} instead of {_at(ours)}"
    if not _near(ours.z, theirs.z, dialect.z_tolerance_m):
        return f"height {theirs.z:g} m instead of {ours.z:g} m"
    if ours.autocontinue != theirs.autocontinue:
        return "stops there, or does not"
    # An autopilot may drop parameters of a command that it does not know.
    loose = not dialect.is_listed(ours.command)
    for number, (a, b) in enumerate(zip(ours.params, theirs.params, strict=True), 1):
        if not _near_param(a, b, is_yaw=number == 4) and not (loose and b == 0):
            return f"param {number} is {b:g} instead of {a:g}"
    return ""


def _at(item: PlanItem) -> str:
    return f"{item.lat_deg:.7f}, {item.lon_deg:.7f}"


def _near(a: float, b: float, tolerance: float) -> bool:
    return a == b or abs(a - b) <= tolerance + 1e-6 * abs(a) or (math.isnan(a) and math.isnan(b))


def _near_param(a: float, b: float, *, is_yaw: bool) -> bool:
    # 0 and 360 degrees are the same heading.
    around = is_yaw and 0 <= a <= 360 and 0 <= b <= 360 and 360.0 - abs(a - b) <= YAW_TOLERANCE_DEG
    return around or _near(a, b, max(1e-6, PARAM_TOLERANCE * abs(a) if math.isfinite(a) else 0.0))


def _shapes(sent: Plan, held: Plan, dialect: PlanDialect) -> tuple[str, ...]:
    """Return the shapes that are missing, and those that are not ours, in any order."""
    ours, theirs = (Counter(_key(s, dialect) for s in fence_shapes(plan.items)) for plan in (sent, held))
    words = {_key(s, dialect): s.text for plan in (sent, held) for s in fence_shapes(plan.items)}
    missing = [f"{words[key]} is missing" for key in (ours - theirs).elements()]
    foreign = [f"{words[key]} is not ours" for key in (theirs - ours).elements()]
    return tuple((missing + foreign)[:MAX_DIFFERENCES])


def _key(shape: FenceShape, dialect: PlanDialect) -> tuple[object, ...]:
    """Return a key that is equal for equal shapes. Fence numbers are whole, or float32, so no tolerance is needed."""
    kept = [dialect.stored(PlanKind.FENCE, item) for item in shape.items]
    return (shape.command, *((item.params[0], item.x, item.y) for item in kept))


def _notes(plan: Plan, dialect: PlanDialect) -> tuple[str, ...]:
    """Return the parameters that are not stored as they were sent, by command."""
    lost: Counter[str] = Counter()
    for item in plan.items:
        kept = dialect.stored(plan.kind, item)
        for number, (sent, stays) in enumerate(zip(item.params, kept.params, strict=True), 1):
            turned = number == 4 and math.isfinite(sent) and _near_param(sent % 360.0, stays, is_yaw=True)
            if math.isfinite(sent) and not turned and not _near_param(float32(sent), stays, is_yaw=False):
                lost[f"param {number} of command {item.command}"] += 1
    return tuple(f"{dialect.name} does not keep {what} ({count} x)" for what, count in sorted(lost.items()))[
        :MAX_DIFFERENCES
    ]
