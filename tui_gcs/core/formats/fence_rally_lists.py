"""The older text files of ArduPilot's tools: a fence as corners, rally points as lines.

Fence: `latitude longitude` in each line; the first is the return point, the others one closed polygon to stay inside
of. Rally: `RALLY latitude longitude height break_height landing_direction flags`, heights in metres above home.
"""

import math

from tui_gcs.core.formats.content import FormatError, Written, counted
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import (
    AMSL,
    FENCE_RETURN,
    PLAIN_FRAME,
    POLYGON_IN,
    RALLY_POINT,
    RELATIVE,
    Plan,
    PlanItem,
    PlanKind,
    fence_shapes,
)

MAX_LINES = 50_000
"""The most lines of a file: six times the most parameters, so that a larger one is refused early."""
RALLY_WORD = "RALLY"
RALLY_FIELDS = (4, 7)
"""The number of fields, `RALLY` included; older files end after the height."""
Lines = list[tuple[int, list[str]]]


def lines_of(text: str) -> Lines:
    """Return (number, fields) of every line that is neither empty nor a comment. Raises FormatError.

    Fields are divided by blanks, commas and, as ArduPilot reads parameters, equals signs.
    """
    if text.count("\n") > MAX_LINES:
        raise FormatError(f"more than {MAX_LINES} lines")
    plain = ((number, line.split("#")[0]) for number, line in enumerate(text.splitlines(), 1))
    split = ((number, line.replace(",", " ").replace("=", " ").split()) for number, line in plain)
    return [(number, fields) for number, fields in split if fields]


def is_fence(lines: Lines) -> bool:
    """Whether lines begin like an old fence file."""
    return bool(lines) and len(lines[0][1]) == 2 and all(_is_number(field) for field in lines[0][1])


def is_rally(lines: Lines) -> bool:
    """Whether lines begin like an old rally file."""
    return bool(lines) and lines[0][1][0].upper() == RALLY_WORD


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_fence(lines: Lines) -> Plan:
    """Read an old fence file. Raises FormatError."""
    if len(lines) > MAX_ITEMS:
        raise FormatError(f"more than {MAX_ITEMS} points")
    if len(lines) < 4:
        raise FormatError(f"{counted(len(lines), 'line')}: a return point and three corners are needed")
    places = [_place(number, fields, 2) for number, fields in lines]
    corners = places[1:]
    # The files repeat the first corner at the end.
    if len(corners) > 3 and corners[0] == corners[-1]:
        corners = corners[:-1]
    vertices = [PlanItem(POLYGON_IN, AMSL, (float(len(corners)), 0.0, 0.0, 0.0), x, y) for x, y in corners]
    back = [PlanItem(FENCE_RETURN, AMSL, x=places[0][0], y=places[0][1])]
    # A return point of 0, 0 stands for none.
    return Plan(PlanKind.FENCE, (*vertices, *(back if places[0] != (0, 0) else [])))


def write_fence(plan: Plan) -> Written:
    """Write `plan` as an old fence file: its first inclusion polygon and its return point. Raises FormatError."""
    shapes = fence_shapes(plan.items)
    polygons = [shape for shape in shapes if shape.command == POLYGON_IN]
    if not polygons:
        raise FormatError("an old fence file holds one inclusion polygon, and this fence has none")
    kept = polygons[0].items
    returns = [shape.items[0] for shape in shapes if shape.command == FENCE_RETURN]
    others = [shape.text for shape in shapes if shape is not polygons[0] and shape.command != FENCE_RETURN]
    lost = tuple(f"{text}: an old fence file holds one inclusion polygon" for text in others)
    notes: tuple[str, ...] = ()
    if returns:
        back = (returns[0].x, returns[0].y)
    else:
        back = (round(sum(i.x for i in kept) / len(kept)), round(sum(i.y for i in kept) / len(kept)))
        notes = ("no return point was given: the middle of the polygon's corners is written",)
    places = [back, *((item.x, item.y) for item in kept), (kept[0].x, kept[0].y)]
    text = "".join(f"{_degrees(x)}\t{_degrees(y)}\n" for x, y in places)
    return Written(text.encode(), lost, notes)


def read_rally(lines: Lines) -> tuple[Plan, tuple[str, ...]]:
    """Read an old rally file: the rally points, and what of it a vehicle does not take. Raises FormatError."""
    if len(lines) > MAX_ITEMS:
        raise FormatError(f"more than {MAX_ITEMS} points")
    items = []
    lost = 0
    for number, fields in lines:
        if fields[0].upper() != RALLY_WORD or not RALLY_FIELDS[0] <= len(fields) <= RALLY_FIELDS[1]:
            raise FormatError(f"line {number}: not '{RALLY_WORD} latitude longitude height ...'")
        x, y = _place(number, fields[1:3], 2)
        height_m, *others = (_number(number, field) for field in fields[3:])
        # The last three fields are for aeroplanes, which land at a rally point.
        lost += any(others)
        items.append(PlanItem(RALLY_POINT, RELATIVE, x=x, y=y, z=height_m))
    lost_text = f"break height, landing direction or flags of {counted(lost, 'rally point')}: for aeroplanes, not kept"
    return Plan(PlanKind.RALLY, tuple(items)), (lost_text,) * bool(lost)


def write_rally(plan: Plan) -> Written:
    """Write `plan` as an old rally file: its points with heights above home."""
    kept = [item for item in plan.items if PLAIN_FRAME.get(item.frame) == RELATIVE]
    lost = len(plan.items) - len(kept)
    lost_text = f"{counted(lost, 'rally point')} not above home: an old rally file has no other heights"
    lines = [f"{RALLY_WORD}\t{_degrees(i.x)}\t{_degrees(i.y)}\t{i.z:.9g}\t0\t0\t0\n" for i in kept]
    return Written("".join(lines).encode(), (lost_text,) * bool(lost))


def _place(number: int, fields: list[str], count: int) -> tuple[int, int]:
    """Convert latitude and longitude to 1e-7 degrees. Raises FormatError."""
    if len(fields) != count:
        raise FormatError(f"line {number}: {counted(len(fields), 'field')} instead of latitude and longitude")
    lat_deg, lon_deg = (_number(number, field) for field in fields)
    if abs(lat_deg) > 90 or abs(lon_deg) > 180:
        raise FormatError(f"line {number}: {lat_deg:g}, {lon_deg:g} is no place on earth")
    return round(lat_deg * 1e7), round(lon_deg * 1e7)


def _number(number: int, field: str) -> float:
    try:
        value = float(field)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FormatError(f"line {number}: not a number")
    return value


def _degrees(value: int) -> str:
    return f"{value / 1e7:.7f}"
