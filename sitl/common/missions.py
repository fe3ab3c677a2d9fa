"""Missions, fences and rally points of a vehicle: what is stored, and MISSION_* messages in and out.

How they are taken and what becomes of them is each autopilot's own: `plan_ardupilot`, `plan_px4`.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
"""MAV_MISSION_TYPE."""
KINDS = (MISSION, FENCE, RALLY)

ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE, INVALID = 0, 1, 2, 3, 4, 5
INVALID_PARAM1, INVALID_X, INVALID_Y, INVALID_PARAM7 = 6, 10, 11, 12
INVALID_SEQUENCE, DENIED, CANCELLED = 13, 14, 15
"""MAV_MISSION_RESULT."""

WAYPOINT, LOITER_TIME, RETURN, LAND, TAKEOFF, LOITER_UNLIMITED, SPLINE = 16, 19, 20, 21, 22, 17, 82
DO_JUMP, DO_LAND_START = 177, 189
RETURN_POINT, POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT, RALLY_POINT = 5000, 5001, 5002, 5003, 5004, 5100
POLYGONS, CIRCLES = frozenset({POLYGON_IN, POLYGON_OUT}), frozenset({CIRCLE_IN, CIRCLE_OUT})

FRAME_AMSL, FRAME_MISSION, FRAME_RELATIVE, FRAME_AMSL_INT, FRAME_RELATIVE_INT, FRAME_TERRAIN = 0, 2, 3, 5, 6, 10

_ITEM_INT = struct.Struct("<4f2ifHHBBBBBB")
ITEM_BYTES = _ITEM_INT.size
"""A MISSION_ITEM_INT as ArduPilot's `@MISSION` files hold it."""


@dataclass(frozen=True, slots=True)
class Item:
    """One item as it came, or as it was stored.

    `x` and `y` are latitude and longitude in 1e-7 degrees where the frame has a place, else numbers; `z` is metres
    above what the frame says.
    """

    command: int
    frame: int = FRAME_RELATIVE
    p1: float = 0.0
    p2: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0
    current: int = 0
    autocontinue: int = 1

    @property
    def relative(self) -> bool:
        """`z` is above home."""
        return self.frame in (FRAME_RELATIVE, FRAME_RELATIVE_INT)

    @property
    def lat_deg(self) -> float:
        """Latitude."""
        return self.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Longitude."""
        return self.y * 1e-7

    def fields(self, seq: int) -> dict[str, Any]:
        """Of MISSION_ITEM_INT; who it is for and its mission type are missing."""
        return {
            "seq": seq,
            "frame": self.frame,
            "command": self.command,
            "current": self.current,
            "autocontinue": self.autocontinue,
            "param1": self.p1,
            "param2": self.p2,
            "param3": self.p3,
            "param4": self.p4,
            "x": self.x,
            "y": self.y,
            "z": self.z,
        }

    def packed(self, seq: int, kind: int) -> bytes:
        """As in an `@MISSION` file."""
        return _ITEM_INT.pack(
            self.p1, self.p2, self.p3, self.p4, self.x, self.y, self.z, seq, self.command, 0, 0,
            self.frame, self.current, self.autocontinue, kind,
        )  # fmt: skip


def item_of(fields: dict[str, Any]) -> Item:
    """The item of a MISSION_ITEM_INT."""
    return Item(
        command=fields["command"],
        frame=fields["frame"],
        p1=fields["param1"],
        p2=fields["param2"],
        p3=fields["param3"],
        p4=fields["param4"],
        x=fields["x"],
        y=fields["y"],
        z=fields["z"],
        current=fields["current"],
        autocontinue=fields["autocontinue"],
    )


def item_of_floats(fields: dict[str, Any]) -> Item:
    """The item of an old MISSION_ITEM: places are degrees in 32 bits, good for about a metre."""
    scale = 1 if fields["frame"] == FRAME_MISSION else 10_000_000
    whole = {name: max(min(round(fields[name] * scale), 2**31 - 1), -(2**31)) for name in ("x", "y")}
    return item_of({**fields, **whole})


def float_fields(item: Item, seq: int) -> dict[str, Any]:
    """Of the old MISSION_ITEM."""
    scale = 1.0 if item.frame == FRAME_MISSION else 1e-7
    return {**item.fields(seq), "x": item.x * scale, "y": item.y * scale}


def unpack_item(data: bytes) -> Item:
    """An item of an `@MISSION` file.

    Raises:
        struct.error: Not ITEM_BYTES long.
    """
    p1, p2, p3, p4, x, y, z, _, command, _, _, frame, current, autocontinue, _ = _ITEM_INT.unpack(data)
    return Item(command, frame, p1, p2, p3, p4, x, y, z, current, autocontinue)


def _nobody(_: int) -> None:
    """Nobody wants to know."""


@dataclass
class Plans:
    """What one vehicle holds. Lists are replaced or changed by the protocol only; flying code reads them.

    ArduPilot's mission begins with a place holder for home: item 1 is the first to be flown.
    """

    mission: list[Item] = field(default_factory=list)
    fence: list[Item] = field(default_factory=list)
    rally: list[Item] = field(default_factory=list)
    ids: list[int] = field(default_factory=lambda: [0, 0, 0])
    """PX4: opaque ids by MAV_MISSION_TYPE; 0 when there is nothing. ArduPilot has none."""
    seq: int = 0
    """The item that is or will be flown."""
    feasible: bool = False
    """PX4: the mission may be flown."""
    in_force: list[list[Item]] = field(default_factory=list)
    """PX4: the polygons and circles of the fence that were found good."""
    flying: bool = False
    """Set by who flies: a mission is being flown now (ArduPilot: mode AUTO, armed)."""
    changed: Callable[[int], None] = _nobody
    """Called with the kind after every change, item by item on ArduPilot. Set by who flies."""

    def of(self, kind: int) -> list[Item]:
        """The list of a MAV_MISSION_TYPE."""
        return (self.mission, self.fence, self.rally)[kind]

    def put(self, kind: int, items: list[Item]) -> None:
        """Replace a list."""
        if kind == MISSION:
            self.mission = items
        elif kind == FENCE:
            self.fence = items
        else:
            self.rally = items


@dataclass
class Transfer:
    """An upload (or, PX4, a download) under way."""

    kind: int
    system: int
    component: int
    seq: int
    """The item that is asked for or, in a download, was asked for last plus one."""
    end: int
    """One after the last."""
    heard_us: int
    items: list[Item] = field(default_factory=list)
    crc: int = 0

    def is_with(self, system: int, component: int) -> bool:
        """Who is it that uploads?"""
        return (self.system, self.component) == (system, component)


def without_place(item: Item) -> Item:
    """The item with latitude, longitude and altitude zero."""
    return replace(item, x=0, y=0, z=0.0)
