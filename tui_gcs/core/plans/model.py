"""Plan model: missions, fences and rally points that vehicles hold, as lists of MAVLink items.

A plan is the same on every autopilot. What one autopilot wants differently (ArduPilot's home as item 0, frames, order
of fence shapes) is in `core/firmware/plan_dialects.py`. Numbers are common.xml's: MAV_CMD, MAV_FRAME, MAV_MISSION_TYPE.
"""

import hashlib
import math
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

# MAV_CMD of items that have a place (common.xml).
WAYPOINT, LOITER_UNLIMITED, LOITER_TURNS, LOITER_TIME, RETURN, LAND, TAKE_OFF = range(16, 23)
LOITER_TO_ALT, SPLINE, VTOL_TAKE_OFF, VTOL_LAND, PAYLOAD_PLACE = 31, 82, 84, 85, 94
NAV_LAST = 95
"""MAV_CMD_NAV_LAST: commands below fly or wait, those above are done on the way."""
# MAV_CMD of items that change what follows, and have no place to fly to.
DELAY, JUMP, ROI_LOCATION = 93, 177, 195
# Items of fences; param1 is the number of corners of a polygon, or the radius of a circle.
FENCE_RETURN, POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT = range(5000, 5005)
RALLY_POINT = 5100

POLYGONS, CIRCLES = frozenset({POLYGON_IN, POLYGON_OUT}), frozenset({CIRCLE_IN, CIRCLE_OUT})
FENCE_COMMANDS = POLYGONS | CIRCLES | {FENCE_RETURN}
HERE = frozenset({LAND, TAKE_OFF, VTOL_TAKE_OFF, VTOL_LAND})
"""Items that may have no place (0, 0) on every autopilot: they act where the vehicle is then."""
ARDUPILOT_HERE = HERE | {*(WAYPOINT, LOITER_UNLIMITED, LOITER_TURNS, LOITER_TIME, LOITER_TO_ALT, SPLINE, PAYLOAD_PLACE)}
"""Items that may have no place on ArduPilot (ModeAuto::loc_from_cmd, Location::sanitize). A PX4 flies to 0, 0."""
PLACES = ARDUPILOT_HERE | FENCE_COMMANDS | {ROI_LOCATION, RALLY_POINT}
"""Items with a place in x, y, z."""

BARE_NUMBERS = frozenset({202, 203})
"""DO_DIGICAM_CONFIGURE and DO_DIGICAM_CONTROL: x and y are plain numbers in every frame."""

AMSL, MISSION_FRAME, RELATIVE, TERRAIN = 0, 2, 3, 10
"""MAV_FRAME: above mean sea level, no place at all, above home, above the ground."""
PLAIN_FRAME = {AMSL: AMSL, 5: AMSL, MISSION_FRAME: MISSION_FRAME, RELATIVE: RELATIVE, 6: RELATIVE, 10: 10, 11: TERRAIN}
"""The frames a plan may use, and what each means: the _INT forms are the same frames."""


PlanWord = Literal["mission", "fence", "rally"]


class PlanKind(IntEnum):
    """The kind of a plan (MAV_MISSION_TYPE)."""

    MISSION = 0
    FENCE = 1
    RALLY = 2

    @property
    def word(self) -> PlanWord:
        """The operator's word for the kind."""
        return _WORDS[self]


_WORDS: tuple[PlanWord, PlanWord, PlanWord] = ("mission", "fence", "rally")


@dataclass(frozen=True, slots=True)
class PlanItem:
    """One item as in MISSION_ITEM_INT, without what the transfer adds (seq, current, targets).

    The target of a DO_JUMP (`params[0]`) is an index into the plan's items, from 0, on every autopilot.
    """

    command: int
    frame: int = RELATIVE
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    x: int = 0
    """Latitude in 1e-7 degrees, where it is a place."""
    y: int = 0
    """Longitude in 1e-7 degrees, where it is a place."""
    z: float = 0.0
    """Height in metres, in the item's frame."""
    autocontinue: bool = True

    @property
    def is_place(self) -> bool:
        """Whether x, y, z are a place on earth."""
        return self.command in PLACES and self.frame != MISSION_FRAME

    @property
    def has_no_place(self) -> bool:
        """Whether it should have a place and has none (0, 0)."""
        return self.is_place and self.x == 0 and self.y == 0

    @property
    def holds_degrees(self) -> bool:
        """Whether x and y are 1e-7 degrees, also of commands that need no place: the frame decides (MISSION_ITEM_INT).

        Where the frame is no place they are the plain numbers that files give.
        """
        return self.frame != MISSION_FRAME and self.command not in BARE_NUMBERS

    @property
    def lat_deg(self) -> float:
        """Latitude in degrees, of an item that is a place."""
        return self.x / 1e7

    @property
    def lon_deg(self) -> float:
        """Longitude in degrees, of an item that is a place."""
        return self.y / 1e7


@dataclass(frozen=True, slots=True)
class Plan:
    """A mission, a fence or rally points."""

    kind: PlanKind
    items: tuple[PlanItem, ...] = ()

    @property
    def fingerprint(self) -> str:
        """A digest that is equal for equal items. On the wire numbers are float32, and so they are compared."""
        digest = hashlib.sha256(bytes((self.kind,)))
        for item in self.items:
            digest.update(struct.pack("<HB?ii", item.command, item.frame, item.autocontinue, item.x, item.y))
            digest.update(struct.pack("<5f", *map(float32, (*item.params, item.z))))
        return digest.hexdigest()[:16]


def float32(value: float) -> float:
    """Return `value` as a vehicle gets it: every NaN is the same one, and what is too large is infinite."""
    if math.isnan(value):
        return math.nan
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


@dataclass(frozen=True, slots=True)
class FenceShape:
    """One polygon, circle or return point of a fence; `first` is the index of its first item."""

    command: int
    first: int
    items: tuple[PlanItem, ...]

    @property
    def text(self) -> str:
        """The shape in an operator's words."""
        if self.command in POLYGONS:
            return f"{'inclusion' if self.command == POLYGON_IN else 'exclusion'} polygon of {len(self.items)} points"
        if self.command in CIRCLES:
            return f"{'inclusion' if self.command == CIRCLE_IN else 'exclusion'} circle"
        return "return point"


def fence_shapes(items: tuple[PlanItem, ...]) -> list[FenceShape]:
    """Return the shapes of a fence.

    A polygon ends after as many vertices as its first item has as parameter, or where they end.
    """
    shapes: list[FenceShape] = []
    at = 0
    while at < len(items):
        command, count = items[at].command, 1
        if command in POLYGONS:
            vertices = items[at].params[0]
            most = int(vertices) if 1 <= vertices <= len(items) else len(items)
            while count < most and at + count < len(items) and items[at + count].command == command:
                count += 1
        shapes.append(FenceShape(command, at, items[at : at + count]))
        at += count
    return shapes
