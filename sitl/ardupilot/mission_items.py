"""What ArduCopter stores of an item, and why it refuses a fence.

An item has 15 bytes: frames lose their _INT, altitudes become centimetres, most parameters are dropped
(docs/autopilots.md "Missions, fence, rally of ArduCopter").
"""

import math
from dataclasses import replace
from typing import Any

from sitl.common import missions
from sitl.common.missions import FENCE, MISSION, RALLY, Item

# Heights are stored as centimetres in 24 bits.
MAX_ALT_M = 83_886.0
MAX_LAT, MAX_LON = 900_000_000, 1_800_000_000
MAX_VERTICES = 255

_WITH_PLACE = frozenset({16, 17, 18, 19, 21, 22, 30, 31, 82, 92, 179, 188, 189, 191, 201, 84, 85, 94})
_WITHOUT_PLACE = frozenset(
    {20, 83, 93, 112, 114, 115, 177, 178, 181, 182, 183, 184, 202, 203, 205, 206, 207, 208, 210, 211, 212, 213, 216}
    | {193, 194, 215, 217, 218, 222, 223, 531, 532, 534, 600, 601, 1000, 2000, 2001, 2500, 2501, 3000}
    | {42600, 42702, 42703}
)
_FORMS = {
    **dict.fromkeys((16, 22, 82, 92), "w---"),
    **dict.fromkeys((179, 193, 194, 201, 207, 208, 210, 212, 215, 216, 600, 2001, 2500, 2501, 3000), "i---"),
    **dict.fromkeys((177, 181, 183, 211, 218, 601), "ii--"),
    **dict.fromkeys((112, 114), "f---"),
    **dict.fromkeys((531, 532), "if--"),
    **dict.fromkeys((42600, 42702), "iiff"),
    **dict.fromkeys((1000, 42703), "iiii"),
    30: "w---", 84: "w---", 85: "w---", 94: "w---", 93: "fiii", 115: "ffii", 178: "iff-", 182: "iif-", 184: "iiif",
    202: "iibi", 203: "iiii", 205: "fff-", 206: "f-b-", 222: "ifff", 534: "iib-", 2000: "ifwi",
}  # fmt: skip
"""How p1 to p4 are stored, read off a real ArduCopter: - not at all, i whole, b and w in 8 and 16 bits, f as floats."""
_YAW_MAY_BE_NAN = frozenset({16, 17, 21, 22, 84, 85})


def _place_problem(new: Item) -> int:
    if abs(new.x) > MAX_LAT:
        return missions.INVALID_X
    return missions.INVALID_Y if abs(new.y) > MAX_LON else missions.ACCEPTED


def _param_problem(new: Item) -> int:
    """Return the result for a parameter that is infinite, or NaN and not a yaw."""
    for number, value in enumerate((new.p1, new.p2, new.p3, new.p4)):
        nan_allowed = number == 3 and new.command in _YAW_MAY_BE_NAN
        if math.isinf(value) or (math.isnan(value) and not nan_allowed):
            return missions.INVALID_PARAM1 + number
    return missions.ACCEPTED


# Measured: frame 6 comes back as 3, and 2 and 5 as 0 (docs/autopilots.md "Missions, fence, rally of ArduCopter").
_FRAMES = {0: 0, 2: 0, 5: 0, 3: 3, 6: 3, 10: 10, 11: 10}


def _stored_mission_item(new: Item) -> tuple[int, Item]:
    """Return the result and the item as it is stored."""
    problem = _param_problem(new)
    if problem:
        return problem, new
    if new.command in (0, 1):
        return missions.INVALID, new
    plain = replace(new, current=0, autocontinue=1)
    if new.command in _WITHOUT_PLACE:
        return missions.ACCEPTED, missions.without_place(replace(plain, frame=missions.FRAME_AMSL, **_kept(new)))
    if new.command not in _WITH_PLACE:
        return missions.UNSUPPORTED, new
    problem = _place_problem(new)
    if problem:
        return problem, new
    if math.isnan(new.z) or abs(new.z) >= MAX_ALT_M:
        return missions.INVALID_PARAM7, new
    if new.frame not in _FRAMES:
        return missions.UNSUPPORTED_FRAME, new
    return missions.ACCEPTED, replace(plain, frame=_FRAMES[new.frame], z=int(new.z * 100.0) / 100.0, **_kept(new))


def _wrapped(value: float, bits: int) -> float:
    """Return a parameter that is stored in so many bits without a sign."""
    return float(int(value) & (1 << bits) - 1) if math.isfinite(value) else 0.0


def _kept(new: Item) -> dict[str, Any]:
    """Return the parameters as far as they are stored."""
    turn = -1.0 if new.p3 < 0.0 else 1.0
    tangent = float(new.p4 > 0.0)
    none = {"p1": 0.0, "p2": 0.0, "p3": 0.0, "p4": 0.0}
    match new.command:
        case missions.LOITER_UNLIMITED:
            return {**none, "p3": turn * _wrapped(abs(new.p3), 16)}
        case 18:  # LOITER_TURNS, whose turns and radius share 16 bits
            return {**none, "p1": float(int(new.p1)), "p3": turn * float(int(abs(new.p3))), "p4": tangent}
        case missions.LOITER_TIME:
            return {**none, "p1": _wrapped(new.p1, 16), "p3": turn, "p4": tangent}
        case missions.LAND:
            return {**none, "p1": _wrapped(new.p1, 16), "p4": -1.0 if new.p4 < 0.0 else 1.0}
        case 31:  # LOITER_TO_ALT
            radius = -1.0 if new.p2 < 0.0 else 1.0
            return {**none, "p2": radius * _wrapped(abs(new.p2), 16), "p4": tangent}
    values = (new.p1, new.p2, new.p3, new.p4)
    kept = zip(none, _FORMS.get(new.command, "----"), values, strict=True)
    return {name: _form(form, value) for name, form, value in kept}


def _form(form: str, value: float) -> float:
    """Return a parameter in the form in which it is stored (see `_FORMS`)."""
    match form:
        case "-":
            return 0.0
        case "i":
            return float(int(value)) if math.isfinite(value) else 0.0
        case "b":
            return _wrapped(value, 8)
        case "w":
            return _wrapped(value, 16)
    return value


def _stored_fence_item(new: Item) -> tuple[int, Item]:
    if new.frame not in (0, 3, 5, 6, 10, 11):
        return missions.UNSUPPORTED_FRAME, new
    place = Item(new.command, missions.FRAME_AMSL, x=new.x, y=new.y, autocontinue=0)
    if new.command in missions.POLYGONS:
        if not 0.0 <= new.p1 <= MAX_VERTICES:
            return missions.INVALID_PARAM1, new
        return missions.ACCEPTED, replace(place, p1=float(int(new.p1)))
    if new.command in missions.CIRCLES:
        return missions.ACCEPTED, replace(place, p1=new.p1)
    return (missions.ACCEPTED if new.command == missions.RETURN_POINT else missions.UNSUPPORTED), place


def _stored_rally_point(new: Item) -> tuple[int, Item]:
    if new.command != missions.RALLY_POINT:
        return missions.UNSUPPORTED, new
    problem = _place_problem(new)
    if problem:
        return problem, new
    if not -32768.0 <= new.z <= 32767.0:
        return missions.INVALID_PARAM7, new
    if new.frame == missions.FRAME_MISSION or new.frame not in _FRAMES:
        return missions.UNSUPPORTED_FRAME, new
    kept = Item(new.command, _FRAMES[new.frame], x=new.x, y=new.y, z=float(int(new.z)), autocontinue=0)
    return missions.ACCEPTED, kept


STORED = {MISSION: _stored_mission_item, FENCE: _stored_fence_item, RALLY: _stored_rally_point}
"""Functions that return MAV_MISSION_RESULT and the stored form of an item, by kind of plan."""

INCOMPLETE = "Incorrect item count"
_FENCE_TYPES = {5000: 95, 5001: 98, 5002: 97, 5003: 92, 5004: 93}
"""Numbers by which ArduPilot's texts name the types of points."""


def fence_problem(items: list[Item]) -> str:
    """Return the text with which ArduPilot refuses a fence; "" if it is good."""
    wanted, left, count_of_polygon, seen_return = 0, 0, 0, False
    for point in items:
        if point.command in missions.POLYGONS:
            vertices = int(point.p1)
            if vertices < 3:
                return f"Invalid vertex count ({vertices})"
            if left == 0:
                wanted, left, count_of_polygon = point.command, vertices, vertices
            elif point.command != wanted:
                return f"Received incorrect vertex type (want={_FENCE_TYPES[wanted]} got={_FENCE_TYPES[point.command]})"
            elif vertices != count_of_polygon:
                # The text of the real one ends with a line feed, too.
                return f"Unexpected vertex count want={count_of_polygon} got={vertices}\n"
            left -= 1
        elif left:
            return f"Received incorrect type (want={_FENCE_TYPES[wanted]} got={_FENCE_TYPES[point.command]})"
        elif point.command in missions.CIRCLES and not point.p1 > 0.0:
            return "Non-positive circle radius"
        elif point.command == missions.RETURN_POINT:
            if seen_return:
                return "Multiple return points"
            seen_return = True
        if _place_problem(point):
            return "Bad lat or lon"
    return INCOMPLETE if left else ""
