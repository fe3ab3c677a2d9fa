"""Plans as files: `QGC WPL 110`, the text that every ground station reads, and a plain JSON that loses nothing.

In WPL the first line of a mission is home wherever ArduPilot's tools or Mission Planner wrote it (waypoint, height
above sea level, index 0); the vehicle's own home counts, so it is not sent. Jumps count the file's lines, ours the
plan's items.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import msgspec

from tui_gcs.core.plan import AMSL, JUMP, WAYPOINT, Plan, PlanItem, PlanKind
from tui_gcs.core.plan_check import MOST_ITEMS

HEADERS = ("QGC WPL 110", "QGC WPL 100")
MOST_BYTES = 2 << 20
FIELDS = 12


class PlanFileError(Exception):
    """Not a plan that can be read: one line with what and where."""


class HomeLine(Enum):
    """Whether the first line of a WPL mission is home."""

    AUTO = "auto"
    YES = "yes"
    NO = "no"


@dataclass(frozen=True)
class ReadPlan:
    """What was in a file."""

    plan: Plan
    left_out_home: bool = False
    """Its first line was taken for home."""


def read_plan(text: str, kind: PlanKind, home: HomeLine = HomeLine.AUTO) -> ReadPlan:
    """The plan in `text`, WPL or JSON. Raises PlanFileError."""
    if len(text) > MOST_BYTES:
        raise PlanFileError(f"longer than {MOST_BYTES >> 20} MB")
    text = text.lstrip("\ufeff")
    if text.lstrip().startswith("{"):
        return ReadPlan(_from_json(text, kind))
    return _from_wpl(text, kind, home)


# ---------------------------------------------------------------- WPL


def write_wpl(plan: Plan, home_deg: tuple[float, float, float] | None = None) -> str:
    """`plan` as text; a mission begins with a home line, at `home_deg` (latitude, longitude, metres AMSL) or at 0."""
    lines = [HEADERS[0]]
    first = 0
    if plan.kind is PlanKind.MISSION:
        first = 1
        lat_deg, lon_deg, alt_m = home_deg or (0.0, 0.0, 0.0)
        place = PlanItem(WAYPOINT, AMSL, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=alt_m)
        lines.append(_line(0, place))
    for index, item in enumerate(plan.items, first):
        lines.append(_line(index, _with_jump(item, +first)))
    return "\n".join(lines) + "\n"


def _line(index: int, item: PlanItem) -> str:
    x, y = (_degrees(item.x), _degrees(item.y)) if item.is_place else (str(item.x), str(item.y))
    values = [*map(_number, item.params), x, y, _number(item.z), str(int(item.autocontinue))]
    return "\t".join([str(index), str(int(index == 0)), str(item.frame), str(item.command), *values])


def _degrees(value: int) -> str:
    """Exact: 1e-7 degrees are seven decimals."""
    sign = "-" if value < 0 else ""
    return f"{sign}{abs(value) // 10**7}.{abs(value) % 10**7:07d}"


def _number(value: float) -> str:
    return "nan" if math.isnan(value) else f"{value:.9g}"


def _from_wpl(text: str, kind: PlanKind, home: HomeLine) -> ReadPlan:
    numbered = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    lines = [(number, line) for number, line in numbered if line and not line.startswith("#")]
    if not lines or lines[0][1] not in HEADERS:
        raise PlanFileError(f"neither '{HEADERS[0]}' text nor JSON")
    read = [_read_line(number, line) for number, line in lines[1 : MOST_ITEMS + 3]]
    has_home = bool(read) and kind is PlanKind.MISSION and _is_home(*read[0], home)
    kept = read[has_home:]
    if len(kept) > MOST_ITEMS:
        raise PlanFileError(f"more than {MOST_ITEMS} items")
    shift = kept[0][0] if kept else 0
    return ReadPlan(Plan(kind, tuple(_with_jump(item, -shift) for _, item in kept)), has_home)


def _is_home(index: int, item: PlanItem, home: HomeLine) -> bool:
    if home is not HomeLine.AUTO:
        return home is HomeLine.YES
    return index == 0 and item.command == WAYPOINT and item.frame == AMSL


def _read_line(number: int, line: str) -> tuple[int, PlanItem]:
    """Index in the file, and the item."""
    parts = line.replace(",", " ").split()
    if len(parts) != FIELDS:
        raise PlanFileError(f"line {number}: {len(parts)} fields instead of {FIELDS}")
    try:
        index, _, frame, command = (int(part) for part in parts[:4])
        p1, p2, p3, p4, x, y, z = (float(part) for part in parts[4:11])
        item = PlanItem(command, frame, (p1, p2, p3, p4), z=z, autocontinue=bool(int(parts[11])))
        factor = 1e7 if item.is_place else 1
        return index, replace(item, x=round(x * factor), y=round(y * factor))
    except (ValueError, OverflowError):
        raise PlanFileError(f"line {number}: not the numbers of an item") from None


def _with_jump(item: PlanItem, shift: int) -> PlanItem:
    if item.command != JUMP or not shift:
        return item
    return replace(item, params=(item.params[0] + shift, *item.params[1:]))


# ---------------------------------------------------------------- JSON


class _Item(msgspec.Struct, forbid_unknown_fields=True):
    command: int
    frame: int
    params: list[float | None]
    z: float
    lat: float | None = None
    lon: float | None = None
    x: int = 0
    y: int = 0
    autocontinue: bool = True


class _File(msgspec.Struct, forbid_unknown_fields=True):
    kind: str
    items: list[_Item]


def write_json(plan: Plan) -> str:
    """`plan` with places in degrees; a parameter that is no number is null."""
    items = [_to_json(item) for item in plan.items]
    return msgspec.json.format(msgspec.json.encode({"kind": plan.kind.word, "items": items})).decode() + "\n"


def _to_json(item: PlanItem) -> dict[str, Any]:
    place = {"lat": item.lat_deg, "lon": item.lon_deg} if item.is_place else {"x": item.x, "y": item.y}
    params = [None if math.isnan(value) else value for value in item.params]
    row = {"command": item.command, "frame": item.frame, "params": params, **place, "z": item.z}
    return row if item.autocontinue else row | {"autocontinue": False}


def _from_json(text: str, kind: PlanKind) -> Plan:
    try:
        file = msgspec.json.decode(text, type=_File)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise PlanFileError(f"{error}; `plan download` writes what can be read: FILE.json or WPL") from None
    if file.kind != kind.word:
        raise PlanFileError(f"it is a {file.kind}, not a {kind.word}"[:100])
    if len(file.items) > MOST_ITEMS:
        raise PlanFileError(f"more than {MOST_ITEMS} items")
    return Plan(kind, tuple(_json_item(number, row) for number, row in enumerate(file.items, 1)))


def _json_item(number: int, row: _Item) -> PlanItem:
    if len(row.params) != 4:
        raise PlanFileError(f"item {number}: 4 params are needed")
    p1, p2, p3, p4 = (math.nan if value is None else value for value in row.params)
    x, y = row.x, row.y
    if row.lat is not None and row.lon is not None:
        if abs(row.lat) > 90 or abs(row.lon) > 180:
            raise PlanFileError(f"item {number}: no place on earth")
        x, y = round(row.lat * 1e7), round(row.lon * 1e7)
    return PlanItem(row.command, row.frame, (p1, p2, p3, p4), x, y, row.z, row.autocontinue)
