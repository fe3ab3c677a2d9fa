"""What PX4 stores of an item, and the bytes that identify it (docs/autopilots.md "Mission / fence / rally of PX4")."""

import math
import struct
from dataclasses import replace

from sitl.common import missions
from sitl.common.missions import FENCE, MISSION, Item

_IDENTITY = struct.Struct("<BHB4f2if")

# MAV_FRAME: above mean sea level, and relative to home.
_ABSOLUTE, _RELATIVE = frozenset({0, 5}), frozenset({3, 6})
_ROI, _ROI_NONE, _ROI_LOCATION = frozenset({80, 201}), 0, 3
_ROI_MODES_WITHOUT_PLACE = frozenset({0, 1, 2})
_FENCE_COMMANDS = frozenset({5000, 5001, 5002, 5003, 5004})
_WITHOUT_PLACE = frozenset(
    {20, 93, 112, 114, 177, 178, 179, 189, 196, 197, 200, 203, 204, 205, 206, 211, 214, 260, 187}
    | {530, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600}
)


def read_frame(item: Item, *, whole: bool) -> int:
    """Return the frame of an item that is read: only the zero of its height was stored. `whole` is MISSION_ITEM_INT."""
    if item.frame in _ABSOLUTE:
        return missions.FRAME_AMSL_INT if whole else missions.FRAME_AMSL
    if item.frame in _RELATIVE:
        return missions.FRAME_RELATIVE_INT if whole else missions.FRAME_RELATIVE
    return item.frame


def identity(item: Item) -> bytes:
    """Return the bytes of an item, as it was sent, that count for a plan's opaque id."""
    return _IDENTITY.pack(
        item.frame, item.command, item.autocontinue, item.p1, item.p2, item.p3, item.p4, item.x, item.y, item.z
    )


def kept(kind: int, new: Item) -> tuple[int, Item]:
    """Return MAV_MISSION_RESULT and the item as it is stored: unused parameters are 0, the frame is unchanged."""
    if new.frame in _ABSOLUTE | _RELATIVE:
        result, stored = _with_place(new)
    elif new.frame == missions.FRAME_MISSION:
        result, stored = _without_place(new)
    else:
        return missions.UNSUPPORTED_FRAME, new
    foreign = new.command in _FENCE_COMMANDS or new.command == missions.RALLY_POINT
    if result == missions.ACCEPTED and (
        (kind == MISSION and foreign and new.command != missions.RETURN_POINT)
        or (kind == FENCE and new.command in missions.POLYGONS and stored.p1 < 3)
    ):
        return missions.ERROR, new
    return result, stored


def _with_place(new: Item) -> tuple[int, Item]:
    plain = replace(new, p1=0.0, p2=0.0, p3=0.0, p4=0.0)
    yaw = math.degrees(math.radians(new.p4) % math.tau) if math.isfinite(new.p4) else math.nan
    match new.command:
        case missions.WAYPOINT:
            stored = replace(plain, p1=new.p1, p2=new.p2, p4=yaw)
        case missions.LOITER_UNLIMITED:
            stored = replace(plain, p3=new.p3, p4=yaw)
        case missions.LOITER_TIME:
            stored = replace(plain, p1=new.p1, p2=float(new.p2 > 0.0), p3=new.p3, p4=float(new.p4 > 0.0))
        case missions.LAND:
            stored = replace(plain, p2=_whole(new.p2), p4=yaw)
        case missions.TAKEOFF | 84 | 85:
            stored = replace(plain, p4=yaw)
        case 31:
            stored = replace(plain, p1=float(new.p1 > 0.0), p2=new.p2, p4=float(new.p4 > 0.0))
        case missions.POLYGON_IN | missions.POLYGON_OUT:
            stored = replace(plain, p1=float(int(max(new.p1, 0.0) + 0.5)) if math.isfinite(new.p1) else 0.0)
        case missions.CIRCLE_IN | missions.CIRCLE_OUT:
            stored = replace(plain, p1=new.p1)
        case missions.RETURN_POINT | missions.RALLY_POINT | 195 | 4501:
            stored = plain
        case 80 | 201:
            if new.p1 not in (_ROI_NONE, _ROI_LOCATION):
                return missions.INVALID_PARAM1, new
            # The place to look at is lost.
            stored = plain
        case _:
            return missions.UNSUPPORTED, new
    return missions.ACCEPTED, stored


def _without_place(new: Item) -> tuple[int, Item]:
    """Store an item with numbers that are 32-bit floats: large whole numbers come back rounded."""
    stored = replace(new, x=_single(new.x), y=_single(new.y))
    if new.command == missions.DO_JUMP:
        stored = replace(stored, p1=_whole(new.p1), p2=_whole(new.p2))
    if new.command in _ROI:
        return (missions.ACCEPTED if new.p1 in _ROI_MODES_WITHOUT_PLACE else missions.INVALID_PARAM1), stored
    return (missions.ACCEPTED if new.command in _WITHOUT_PLACE else missions.UNSUPPORTED), stored


def _whole(value: float) -> float:
    return float(int(value)) if math.isfinite(value) else 0.0


def _single(value: int) -> int:
    single: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return round(single)
