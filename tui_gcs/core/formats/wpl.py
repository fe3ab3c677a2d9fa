"""`QGC WPL 110`: the text format of missions that every ground station reads; fences and rally points use it, too.

The first line is home where ArduPilot's tools wrote the file: a way-point with index 0, above sea level by Mission
Planner, in any frame by hand (ArduPilot takes index 0 for home whatever its frame). Mission Planner puts it before
fences and rally points, too. The vehicle's own home counts, so that line is no item. Jumps count the lines of the file;
ours count the items of the plan.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum

from tui_gcs.core.formats.content import FormatError, Home, place_item
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import (
    AMSL,
    FENCE_COMMANDS,
    JUMP,
    PLAIN_FRAME,
    RALLY_POINT,
    WAYPOINT,
    Plan,
    PlanItem,
    PlanKind,
)

HEADERS = ("QGC WPL 110", "QGC WPL 100")
# `QGC WPL 110`: index, current, frame, command, four parameters, three of the place, autocontinue.
FIELDS = 12
NO_COMMAND = 0
"""The command of Mission Planner's home line while it does not know where home is."""


class HomeLine(Enum):
    """Whether the first line is home."""

    AUTO = "auto"
    """A way-point with index 0 is home in any frame, as ArduPilot and its tools take it."""
    AMSL = "amsl"
    """Only a way-point with index 0 above sea level is: for autopilots that have no home in a mission."""
    YES = "yes"
    NO = "no"


@dataclass(frozen=True)
class WplPlan:
    """The contents of a file."""

    plan: Plan
    home: Home | None = None
    """The home in its first line, if that was taken for home and has a place."""
    note: str = ""
    """For what the first line was taken, and by which option it is taken for the other."""


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
    has_home, note = _first_line(*read[0], home) if read else (False, "")
    kept = read[has_home:]
    found = _kind([item for _, item in kept])
    if kind is not None and kind is not found and kept:
        raise FormatError(f"it is a {found.word}, not a {kind.word}")
    if len(kept) > MAX_ITEMS:
        raise FormatError(f"more than {MAX_ITEMS} items")
    # Jumps count the file's lines, which begin with home.
    shift = kept[0][0] if kept else 0
    plan = Plan(kind if kind is not None else found, tuple(_with_jump(item, -shift) for _, item in kept))
    return WplPlan(plan, _home(read[0][1]) if has_home else None, note)


def _kind(items: list[PlanItem]) -> PlanKind:
    commands = {item.command for item in items}
    if commands and commands <= FENCE_COMMANDS:
        return PlanKind.FENCE
    return PlanKind.RALLY if commands == {RALLY_POINT} else PlanKind.MISSION


def _first_line(index: int, item: PlanItem, home: HomeLine) -> tuple[bool, str]:
    """Return whether the first line is home, and a note for the operator where it could have been either."""
    is_place = item.command in (WAYPOINT, NO_COMMAND)
    if item.command in FENCE_COMMANDS or item.command == RALLY_POINT or not (is_place or home is HomeLine.YES):
        return False, ""
    is_amsl = PLAIN_FRAME.get(item.frame) == AMSL
    why_not = ""
    if index != 0:
        why_not = f"its index is {index}"
    elif home is HomeLine.AMSL and not is_amsl:
        # QGroundControl writes missions of a PX4 without home.
        why_not = f"its frame is {item.frame}, and PX4 has no home in a mission"
    if home is HomeLine.NO or (home is not HomeLine.YES and why_not):
        return False, f"its first line is an item: {why_not or 'as was asked for'} (--home-line yes: it is home)"
    in_frame = "" if is_amsl else f" in frame {item.frame}, as ArduPilot takes it"
    return True, f"its first line is home{in_frame}, and is no item (--home-line no: it is one)"


def _home(item: PlanItem) -> Home | None:
    """Return the place in a home line; a height that is not above sea level is unknown."""
    if item.command == NO_COMMAND:
        return None
    amsl_m = item.z if PLAIN_FRAME.get(item.frame) == AMSL else math.nan
    return Home(item.lat_deg, item.lon_deg, amsl_m)


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
