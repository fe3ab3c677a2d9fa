"""`QGC WPL 110`: the text format of missions that every ground station reads; fences and rally points use it, too.

The first line of a mission is home wherever ArduPilot's tools or Mission Planner wrote it (way-point, height above sea
level, index 0). The vehicle's own home counts, so that line is no item. Jumps count the lines of the file; ours count
the items of the plan.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum

from tui_gcs.core.formats.content import FormatError, Home, place_item
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import AMSL, FENCE_COMMANDS, JUMP, RALLY_POINT, WAYPOINT, Plan, PlanItem, PlanKind

HEADERS = ("QGC WPL 110", "QGC WPL 100")
FIELDS = 12


class HomeLine(Enum):
    """Whether the first line of a mission is home."""

    AUTO = "auto"
    YES = "yes"
    NO = "no"


@dataclass(frozen=True)
class WplPlan:
    """The contents of a file."""

    plan: Plan
    home: Home | None = None
    """The home in its first line, if that was taken for home."""


def is_wpl(text: str) -> bool:
    """Whether a text begins like such a file."""
    return text.lstrip().startswith("QGC WPL")


def write_wpl(plan: Plan, home: Home | None = None) -> str:
    """Write `plan`; a mission begins with a home line, at `home` or at 0, 0. Raises FormatError."""
    lines = [HEADERS[0]]
    first = 0
    if plan.kind is PlanKind.MISSION:
        first = 1
        # Every reader takes the first line of a mission for home, so it must be there.
        at = home or Home(0.0, 0.0, 0.0)
        amsl_m = 0.0 if math.isnan(at.amsl_m) else at.amsl_m
        lines.append(_line(0, place_item(WAYPOINT, AMSL, at.lat_deg, at.lon_deg, amsl_m)))
    for index, item in enumerate(plan.items, first):
        lines.append(_line(index, _with_jump(item, +first)))
    return "\n".join(lines) + "\n"


def _line(index: int, item: PlanItem) -> str:
    x, y = (_degrees(item.x), _degrees(item.y)) if item.holds_degrees else (str(item.x), str(item.y))
    values = [*map(_number, item.params), x, y, _number(item.z), str(int(item.autocontinue))]
    return "\t".join([str(index), str(int(index == 0)), str(item.frame), str(item.command), *values])


def _degrees(value: int) -> str:
    """Format 1e-7 degrees exactly, with seven decimals."""
    sign = "-" if value < 0 else ""
    return f"{sign}{abs(value) // 10**7}.{abs(value) % 10**7:07d}"


def _number(value: float) -> str:
    return "nan" if math.isnan(value) else f"{value:.9g}"


def read_wpl(text: str, kind: PlanKind | None = None, home: HomeLine = HomeLine.AUTO) -> WplPlan:
    """Read a plan. Its kind follows from its commands, if it is not given. Raises FormatError."""
    numbered = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    lines = [(number, line) for number, line in numbered if line and not line.startswith("#")]
    if not lines or lines[0][1] not in HEADERS:
        raise FormatError(f"does not begin with '{HEADERS[0]}'")
    # Two lines more than allowed: home, and one that shows that there are too many.
    read = [_read_line(number, line) for number, line in lines[1 : MAX_ITEMS + 3]]
    found = _kind([item for _, item in read])
    if kind is not None and kind is not found and read:
        raise FormatError(f"it is a {found.word}, not a {kind.word}")
    kind = kind if kind is not None else found
    has_home = bool(read) and kind is PlanKind.MISSION and _is_home(*read[0], home)
    kept = read[has_home:]
    if len(kept) > MAX_ITEMS:
        raise FormatError(f"more than {MAX_ITEMS} items")
    # Jumps count the file's lines, which begin with home.
    shift = kept[0][0] if kept else 0
    plan = Plan(kind, tuple(_with_jump(item, -shift) for _, item in kept))
    if not has_home:
        return WplPlan(plan)
    first = read[0][1]
    return WplPlan(plan, Home(first.lat_deg, first.lon_deg, first.z))


def _kind(items: list[PlanItem]) -> PlanKind:
    commands = {item.command for item in items}
    if commands and commands <= FENCE_COMMANDS:
        return PlanKind.FENCE
    return PlanKind.RALLY if commands == {RALLY_POINT} else PlanKind.MISSION


def _is_home(index: int, item: PlanItem, home: HomeLine) -> bool:
    if home is not HomeLine.AUTO:
        return home is HomeLine.YES
    return index == 0 and item.command == WAYPOINT and item.frame == AMSL


def _read_line(number: int, line: str) -> tuple[int, PlanItem]:
    """Read one line: the index in the file, and the item. Raises FormatError."""
    parts = line.replace(",", " ").split()
    if len(parts) != FIELDS:
        raise FormatError(f"line {number}: {len(parts)} fields instead of {FIELDS}")
    if "_" in line:  # Python would accept 1_0
        raise FormatError(f"line {number}: not the numbers of an item")
    try:
        index, _, frame, command = (int(part) for part in parts[:4])
        p1, p2, p3, p4, x, y, z = (float(part) for part in parts[4:11])
        item = PlanItem(command, frame, (p1, p2, p3, p4), z=z, autocontinue=bool(int(parts[11])))
        factor = 1e7 if item.holds_degrees else 1
        return index, replace(item, x=round(x * factor), y=round(y * factor))
    except (ValueError, OverflowError):
        raise FormatError(f"line {number}: not the numbers of an item") from None


def _with_jump(item: PlanItem, shift: int) -> PlanItem:
    if item.command != JUMP or not shift:
        return item
    return replace(item, params=(item.params[0] + shift, *item.params[1:]))
