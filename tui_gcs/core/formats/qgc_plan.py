"""Reading QGroundControl's `.plan` (JSON): mission, fence and rally points in one file.

A survey and a corridor scan contain their way-points already; they are flattened into the mission. The path of a
structure scan or a landing pattern is not in the file, but computed anew by QGroundControl whenever it uploads: such a
mission can be kept, but not flown (`Content.not_flown`). The document itself is kept for writing (`qgc_write`).
"""

import math
from dataclasses import dataclass, replace
from typing import Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import Content, FormatError, Home, QgcSource, counted, place_item
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import (
    AMSL,
    CIRCLE_IN,
    CIRCLE_OUT,
    FENCE_RETURN,
    HERE,
    JUMP,
    PLAIN_FRAME,
    POLYGON_IN,
    POLYGON_OUT,
    RALLY_POINT,
    RELATIVE,
    Plan,
    PlanItem,
    PlanKind,
)

FILE_TYPE = "Plan"
# A MAV_CMD has seven parameters; the last three of an item with a place are its place.
PARAMS = 7
MAX_WORD = 40


def is_qgc(document: dict[str, Any]) -> bool:
    """Whether a JSON document is a `.plan`."""
    return document.get("fileType") == FILE_TYPE


def content_of(document: dict[str, Any]) -> Content:
    """Read a parsed `.plan`. Raises FormatError."""
    if not is_qgc(document):
        raise FormatError('no plan of QGroundControl: "fileType" is not "Plan"')
    _version(document, "the plan", (1,))
    mission = _section(document, "mission")
    flat = _mission(mission)
    fence, fence_notes = _fence(_section(document, "geoFence", optional=True))
    return Content(
        mission=Plan(PlanKind.MISSION, flat.items),
        fence=Plan(PlanKind.FENCE, fence),
        rally=Plan(PlanKind.RALLY, _rally(_section(document, "rallyPoints", optional=True))),
        home=_home(mission),
        source=QgcSource(document, flat.blocks),
        autopilot=_whole(mission.get("firmwareType", 0), "mission.firmwareType"),
        left_out=flat.rounded,
        notes=(*fence_notes, *flat.notes),
        not_flown=flat.not_flown,
    )


@dataclass(frozen=True)
class _Flat:
    items: tuple[PlanItem, ...]
    blocks: tuple[tuple[int, int], ...]
    not_flown: tuple[str, ...]
    rounded: tuple[str, ...]
    notes: tuple[str, ...]


def _mission(mission: dict[str, Any]) -> _Flat:
    _version(mission, "mission", (1, 2))
    if mission.get("complexItems"):
        raise FormatError("mission: complexItems of an old QGroundControl; open it there and save it again")
    entries = _list(mission, "items", "mission")
    items: list[PlanItem] = []
    blocks: list[tuple[int, int]] = []
    ids: dict[int, int] = {}
    not_flown: list[str] = []
    rounded: list[str] = []
    surveys = 0
    for number, entry in enumerate(entries, 1):
        where = f"mission item {number}"
        if not isinstance(entry, dict):
            raise FormatError(f"{where}: an object was expected")
        first = len(items)
        if entry.get("type") == "ComplexItem":
            inside = _complex(entry, where)
            if inside is None:
                not_flown.append(f"item {number}, {_word(entry.get('complexItemType'))}")
            else:
                surveys += 1
                items += [_simple(raw, where, rounded) for raw in inside]
        else:
            _identified(entry, where, first, ids)
            items.append(_simple(entry, where, rounded))
        blocks.append((first, len(items) - first))
        if len(items) > MAX_ITEMS:
            raise FormatError(f"more than {MAX_ITEMS} items")
    notes = (f"{counted(surveys, 'survey or scan', 'surveys or scans')} flattened into way-points",) * bool(surveys)
    resolved = tuple(_resolved(item, ids, index) for index, item in enumerate(items))
    return _Flat(resolved, tuple(blocks), tuple(not_flown), tuple(rounded), notes)


def _identified(entry: dict[str, Any], where: str, index: int, ids: dict[int, int]) -> None:
    """Note the number by which jumps name an item; without one it is the item's place in the mission, from 1."""
    number = _whole(entry.get("doJumpId", index + 1), f"{where}: doJumpId")
    # A jump to a number that two items have is refused.
    ids[number] = -1 if number in ids else index


def _resolved(item: PlanItem, ids: dict[int, int], index: int) -> PlanItem:
    """Turn a jump to a number into one to an index. Raises FormatError."""
    if item.command != JUMP:
        return item
    target = ids.get(int(item.params[0])) if math.isfinite(item.params[0]) else None
    if target is None or target < 0:
        what = "several items have" if target is not None else "no item has"
        raise FormatError(f"item {index + 1} jumps to number {item.params[0]:g}, which {what}")
    return replace(item, params=(float(target), *item.params[1:]))


def _complex(entry: dict[str, Any], where: str) -> list[Any] | None:
    """Return the way-points that a survey or scan contains; None if it contains none."""
    inside = entry.get("TransectStyleComplexItem")
    if not isinstance(inside, dict) or "Items" not in inside:
        return None
    return _list(inside, "Items", where)


def _simple(entry: Any, where: str, rounded: list[str]) -> PlanItem:
    if not isinstance(entry, dict) or entry.get("type") not in ("SimpleItem", "missionItem"):
        raise FormatError(f"{where}: neither SimpleItem nor ComplexItem")
    command = _whole(entry.get("command"), f"{where}: command")
    frame = _whole(entry.get("frame"), f"{where}: frame")
    values = _seven(entry, where)
    item = PlanItem(
        command,
        PLAIN_FRAME.get(frame, frame),
        (values[0], values[1], values[2], values[3]),
        autocontinue=_truth(entry.get("autoContinue", True), f"{where}: autoContinue"),
    )
    x, y, z = values[4:]
    if not item.is_place:
        x, y, z = (0.0 if math.isnan(value) else value for value in (x, y, z))
    # QGroundControl writes null where the command acts at the vehicle's place.
    elif command in HERE and math.isnan(x) and math.isnan(y):
        x = y = 0.0  # where the vehicle is then
    return replace(item, x=_wire(x, item, where, rounded), y=_wire(y, item, where, rounded), z=z)


def _seven(entry: dict[str, Any], where: str) -> list[float]:
    """Return the seven parameters, in the present form or the older one. Raises FormatError."""
    if "params" not in entry:
        raw = [entry.get(f"param{number}") for number in range(1, 5)]
    else:
        raw = list(_list(entry, "params", where))
    if len(raw) == 4:
        raw += _list(entry, "coordinate", where) if "coordinate" in entry else []
    if len(raw) != PARAMS:
        raise FormatError(f"{where}: {len(raw)} params instead of {PARAMS}")
    return [math.nan if value is None else _number(value, f"{where}: param {i}") for i, value in enumerate(raw, 1)]


def _wire(value: float, item: PlanItem, where: str, rounded: list[str]) -> int:
    """Convert degrees to 1e-7 degrees. A bare number that is not whole is rounded, and noted."""
    if math.isnan(value):
        raise FormatError(f"{where}: no latitude or longitude")
    if item.holds_degrees:
        if abs(value) > 180:
            raise FormatError(f"{where}: {value:g} is no latitude or longitude")
        return round(value * 1e7)
    if not value.is_integer():
        rounded.append(f"{where}: {value:g} of command {item.command} is sent as {round(value)}: no fractions there")
    return round(value)


def _home(mission: dict[str, Any]) -> Home | None:
    raw = mission.get("plannedHomePosition")
    if raw is None:
        return None
    lat_deg, lon_deg, amsl_m = _position(raw, "mission.plannedHomePosition", 3)
    return Home(lat_deg, lon_deg, amsl_m)


def _fence(fence: dict[str, Any]) -> tuple[tuple[PlanItem, ...], tuple[str, ...]]:
    if not fence:
        return (), ()
    version = _version(fence, "geoFence", (1, 2))
    items: list[PlanItem] = []
    polygons = _list(fence, "polygons", "geoFence", optional=True)
    if version == 1 and fence.get("polygon"):
        polygons = [{"polygon": _list(fence, "polygon", "geoFence"), "inclusion": True}]
    for number, raw in enumerate(polygons, 1):
        items += polygon_items(raw, f"fence polygon {number}")
        if len(items) > MAX_ITEMS:
            raise FormatError(f"a fence of more than {MAX_ITEMS} points")
    for number, raw in enumerate(_list(fence, "circles", "geoFence", optional=True), 1):
        items.append(circle_item(raw, f"fence circle {number}"))
    if fence.get("breachReturn") is not None:
        lat_deg, lon_deg, height_m = _position(fence["breachReturn"], "geoFence.breachReturn", 3)
        items.append(place_item(FENCE_RETURN, RELATIVE, lat_deg, lon_deg, height_m))
    if len(items) > MAX_ITEMS:
        raise FormatError(f"a fence of more than {MAX_ITEMS} points")
    notes = ("its fence is of an old QGroundControl: one inclusion polygon",) if version == 1 and polygons else ()
    return tuple(items), notes


def polygon_items(raw: Any, where: str) -> list[PlanItem]:
    """Read the vertices of one fence polygon. Raises FormatError."""
    if not isinstance(raw, dict):
        raise FormatError(f"{where}: an object was expected")
    command = POLYGON_IN if _truth(raw.get("inclusion", True), f"{where}: inclusion") else POLYGON_OUT
    corners = [_corner(corner, where) for corner in _list(raw, "polygon", where)]
    if len(corners) > 3 and corners[0] == corners[-1]:
        corners.pop()
    return [place_item(command, AMSL, lat, lon, param1=float(len(corners))) for lat, lon in corners]


def _corner(raw: Any, where: str) -> tuple[float, float]:
    lat_deg, lon_deg, _ = _position(raw["coordinate"] if isinstance(raw, dict) and "coordinate" in raw else raw, where)
    return lat_deg, lon_deg


def circle_item(raw: Any, where: str) -> PlanItem:
    """Read one fence circle. Raises FormatError."""
    circle = raw.get("circle") if isinstance(raw, dict) else None
    if not isinstance(raw, dict) or not isinstance(circle, dict):
        raise FormatError(f"{where}: an object with a circle was expected")
    lat_deg, lon_deg, _ = _position(circle.get("center"), f"{where}: center")
    command = CIRCLE_IN if _truth(raw.get("inclusion", True), f"{where}: inclusion") else CIRCLE_OUT
    return place_item(command, AMSL, lat_deg, lon_deg, param1=_number(circle.get("radius"), f"{where}: radius"))


def _rally(rally: dict[str, Any]) -> tuple[PlanItem, ...]:
    if not rally:
        return ()
    _version(rally, "rallyPoints", (1, 2))
    points = _list(rally, "points", "rallyPoints")
    if len(points) > MAX_ITEMS:
        raise FormatError(f"more than {MAX_ITEMS} rally points")
    return tuple(rally_item(raw, f"rally point {number}") for number, raw in enumerate(points, 1))


def rally_item(raw: Any, where: str) -> PlanItem:
    """Read one rally point: its height is above home. Raises FormatError."""
    return place_item(RALLY_POINT, RELATIVE, *_position(raw, where, 3))


def _section(document: dict[str, Any], name: str, *, optional: bool = False) -> dict[str, Any]:
    found = document.get(name, {} if optional else None)
    if not isinstance(found, dict):
        raise FormatError(f"{name} is missing" if found is None else f"{name}: an object was expected")
    return found


def _version(section: dict[str, Any], what: str, known: tuple[int, ...]) -> int:
    version = _whole(section.get("version", known[-1]), f"{what}: version")
    if version not in known:
        raise FormatError(f"{what}: version {version} is not known here ({', '.join(map(str, known))})")
    return version


def _list(section: dict[str, Any], name: str, where: str, *, optional: bool = False) -> list[Any]:
    found = section.get(name, [] if optional else None)
    if not isinstance(found, list):
        raise FormatError(f"{where}: {name} is no list")
    return found


def _position(raw: Any, where: str, least: int = 2) -> tuple[float, float, float]:
    """Read latitude, longitude, and a height or NaN. Raises FormatError."""
    if not isinstance(raw, list) or not least <= len(raw) <= 3:
        raise FormatError(f"{where}: [latitude, longitude{', height' * (least == 3)}] was expected")
    lat_deg, lon_deg = (_number(value, where) for value in raw[:2])
    if abs(lat_deg) > 90 or abs(lon_deg) > 180:
        raise FormatError(f"{where}: {lat_deg:g}, {lon_deg:g} is no place on earth")
    return lat_deg, lon_deg, _number(raw[2], where) if len(raw) == 3 and raw[2] is not None else math.nan


def _number(value: Any, where: str) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            if math.isfinite(number := float(value)):
                return number
        except OverflowError:
            pass
    raise FormatError(f"{where}: {_word(value)} is no number")


def _whole(value: Any, where: str) -> int:
    number = _number(value, where)
    if not number.is_integer() or abs(number) > 2**31:
        raise FormatError(f"{where}: {number:g} is no whole number")
    return int(number)


def _truth(value: Any, where: str) -> bool:
    if not isinstance(value, bool):
        raise FormatError(f"{where}: true or false was expected")
    return value


def _word(value: Any) -> str:
    return clean(str(value), MAX_WORD) if not isinstance(value, dict | list) else "a list or object"
