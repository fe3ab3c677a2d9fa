"""Missions, fences and rally points as a vehicle stores them: items, plans, transfers.

How a plan is uploaded, stored and judged is each autopilot's own: see `mission_protocol` in `ardupilot` and `px4`.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
"""Values of MAV_MISSION_TYPE: the kinds of plans."""
KINDS = (MISSION, FENCE, RALLY)

# MAV_MISSION_RESULT (common.xml).
ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE, INVALID = 0, 1, 2, 3, 4, 5
INVALID_PARAM1, INVALID_X, INVALID_Y, INVALID_PARAM7 = 6, 10, 11, 12
INVALID_SEQUENCE, DENIED, CANCELLED = 13, 14, 15
"""Values of MAV_MISSION_RESULT, as MISSION_ACK reports them."""

# MAV_CMD of items (common.xml).
WAYPOINT, LOITER_TIME, RETURN, LAND, TAKEOFF, LOITER_UNLIMITED, SPLINE = 16, 19, 20, 21, 22, 17, 82
DO_JUMP = 177
# MAV_CMD of fences and rally points.
RETURN_POINT, POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT, RALLY_POINT = 5000, 5001, 5002, 5003, 5004, 5100
POLYGONS, CIRCLES = frozenset({POLYGON_IN, POLYGON_OUT}), frozenset({CIRCLE_IN, CIRCLE_OUT})

# MAV_FRAME.
FRAME_AMSL, FRAME_MISSION, FRAME_RELATIVE, FRAME_AMSL_INT, FRAME_RELATIVE_INT = 0, 2, 3, 5, 6

_ITEM_INT = struct.Struct("<4f2ifHHBBBBBB")
ITEM_BYTES = _ITEM_INT.size
"""Length of a MISSION_ITEM_INT in ArduPilot's `@MISSION` files."""

_SAME = ("command", "frame", "x", "y", "z", "current", "autocontinue")
_FIELDS = {name: name for name in _SAME} | {f"p{n}": f"param{n}" for n in range(1, 5)}
"""Fields of MISSION_ITEM and MISSION_ITEM_INT by the names of `Item`."""


@dataclass(frozen=True, slots=True)
class Item:
    """One item as it was received, or as it was stored.

    `x` and `y` are latitude and longitude in 1e-7 degrees if the frame has a place, else numbers; `z` is metres above
    the zero of the frame.
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
        """Whether `z` counts from home."""
        return self.frame in (FRAME_RELATIVE, FRAME_RELATIVE_INT)

    @property
    def lat_deg(self) -> float:
        """Latitude, if the frame has a place."""
        return self.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Longitude, if the frame has a place."""
        return self.y * 1e-7

    def fields(self, seq: int) -> dict[str, Any]:
        """Return the fields of a MISSION_ITEM_INT without its addressee and its mission type."""
        return {"seq": seq, **{field: getattr(self, name) for name, field in _FIELDS.items()}}

    def packed(self, seq: int, kind: int) -> bytes:
        """Return the bytes of this item in an `@MISSION` file."""
        return _ITEM_INT.pack(
            self.p1, self.p2, self.p3, self.p4, self.x, self.y, self.z, seq, self.command, 0, 0,
            self.frame, self.current, self.autocontinue, kind,
        )  # fmt: skip


def item_of(fields: dict[str, Any]) -> Item:
    """Return the item in a MISSION_ITEM_INT."""
    return Item(**{name: fields[field] for name, field in _FIELDS.items()})


def item_of_floats(fields: dict[str, Any]) -> Item:
    """Return the item in an old MISSION_ITEM; its 32-bit degrees are good for about a metre."""
    scale = 1 if fields["frame"] == FRAME_MISSION else 10_000_000
    # The old message has floats, in which a station may send anything; the stored item has 32 bits.
    whole = {name: max(min(round(fields[name] * scale), 2**31 - 1), -(2**31)) for name in ("x", "y")}
    return item_of({**fields, **whole})


def float_fields(item: Item, seq: int) -> dict[str, Any]:
    """Return the fields of an old MISSION_ITEM."""
    scale = 1.0 if item.frame == FRAME_MISSION else 1e-7
    return {**item.fields(seq), "x": item.x * scale, "y": item.y * scale}


def unpack_item(data: bytes) -> Item:
    """Return the item in ITEM_BYTES of an `@MISSION` file.

    Raises:
        struct.error: `data` has another length.
    """
    p1, p2, p3, p4, x, y, z, _, command, _, _, frame, current, autocontinue, _ = _ITEM_INT.unpack(data)
    return Item(command, frame, p1, p2, p3, p4, x, y, z, current, autocontinue)


def _ignore(_: int) -> None:
    """Take no notice of a change."""


@dataclass
class Plans:
    """The plans of one vehicle. Only the mission protocol changes the lists; the parts that fly read them.

    ArduPilot's mission begins with a placeholder for home: item 1 is the first to be flown.
    """

    mission: list[Item] = field(default_factory=list)
    fence: list[Item] = field(default_factory=list)
    rally: list[Item] = field(default_factory=list)
    ids: list[int] = field(default_factory=lambda: [0, 0, 0])
    """PX4: opaque ids by MAV_MISSION_TYPE, 0 for an empty list. ArduPilot has none."""
    seq: int = 0
    """The item that is flown now, or next."""
    feasible: bool = False
    """PX4: the mission has passed its checks and may be flown."""
    in_force: list[list[Item]] = field(default_factory=list)
    """PX4: polygons and circles of the fence that have passed their checks."""
    flying: bool = False
    """A mission is being flown now (ArduPilot: mode AUTO, armed). The mode controller sets it."""
    changed: Callable[[int], None] = _ignore
    """Called with the kind after every change, on ArduPilot after every item. The mission mode sets it."""

    def of(self, kind: int) -> list[Item]:
        """Return the list of a MAV_MISSION_TYPE."""
        return (self.mission, self.fence, self.rally)[kind]

    def put(self, kind: int, items: list[Item]) -> None:
        """Replace the list of a MAV_MISSION_TYPE."""
        self.of(kind)[:] = items


@dataclass
class Transfer:
    """An upload, or on PX4 also a download, that is under way."""

    kind: int
    system: int
    component: int
    seq: int
    """Upload: the item that is requested. Download: one after the item that was requested last."""
    end: int
    """One after the last item."""
    last_heard_us: int
    items: list[Item] = field(default_factory=list)
    crc: int = 0

    def is_with(self, system: int, component: int) -> bool:
        """Return whether the transfer is with this station."""
        return (self.system, self.component) == (system, component)


def without_place(item: Item) -> Item:
    """Return the item with latitude, longitude and altitude zero."""
    return replace(item, x=0, y=0, z=0.0)
