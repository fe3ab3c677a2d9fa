"""Missions of other stations: reading is free, items may lead only where vehicles may be, the fence is ours.

Numbers: MAV_CMD, MAV_MISSION_TYPE of common.xml.
"""

from tui_gcs.core.forward_orders import (
    Asked,
    Order,
    Refused,
    Ruling,
    framed_height_m,
    here_m,
    place_m,
    read_order,
    require_band,
    require_inside,
    require_speed,
    says_here,
)
from tui_gcs.core.wire.mavlink import AUTOPILOT_ARDUPILOT

FENCE, ALL_MISSIONS = 1, 255
"""MAV_MISSION_TYPE."""
CHANGE_SPEED, WAYPOINT = 178, 16
ITEM_PLACES = frozenset({16, 17, 18, 19, 21, 22, 31, 82, 84, 85, 5100})
"""Items that are flown to: way-points, loitering, landing, take-off, rally points."""
ITEM_HERE = frozenset({21, 22, 84, 85})
"""Items that may name no place (0, 0): where it is then."""
ITEM_LANDINGS = frozenset({21, 85})
ITEM_RADIUS = {17: 3, 18: 3, 19: 3, 31: 2}
"""Which parameter is the radius to circle at."""
ITEM_PLAIN = frozenset({20, 93, 112, 114, 115, 177, 195, 197, 201, 203, 205, 206, 214, 530, 600, 601})
ITEM_PLAIN |= {1000, 1001, 2000, 2001, 2500, 2501}
"""Return, delays, conditions, jumps, region of interest, camera and gimbal."""


def mission_read(asked: Asked) -> Ruling:
    """A request or answer that reads the mission, or takes part in any transfer. Raises `Refused`."""
    _mission_type(asked)
    return Ruling("mission read")


def mission_write(asked: Asked) -> Ruling:
    """The beginning of an upload, or the deletion of all items. Raises `Refused`."""
    _mission_type(asked, writes=True)
    return Ruling("mission clear" if asked.name == "MISSION_CLEAR_ALL" else "mission upload")


def _mission_type(asked: Asked, *, writes: bool = False) -> int:
    kind: int = asked.fields["mission_type"]
    if writes and kind in (FENCE, ALL_MISSIONS):
        raise Refused("would change the fence")
    if kind not in (0, 1, 2):
        raise Refused(f"unknown mission type {kind}")
    return kind


def mission_item(asked: Asked) -> Ruling:
    """One item of an upload. Raises `Refused`."""
    kind = _mission_type(asked, writes=True)
    seq, order = asked.fields["seq"], read_order(asked.message)
    if asked.fields["current"] not in (0, 1):  # 2 and 3: ArduPilot flies there at once
        raise Refused("a guided way-point is a set-point")
    is_home = seq == 0 and kind == 0 and asked.vehicle.autopilot == AUTOPILOT_ARDUPILOT
    if not (is_home and order.command == WAYPOINT):  # stored as the real home, whatever is sent
        try:
            _item_order(asked, order)
        except Refused as refused:
            raise Refused(f"mission item {seq}: {refused}") from None
    return Ruling("mission upload item")


def _item_order(asked: Asked, order: Order) -> None:
    """Raise `Refused` for an item that leads where no vehicle may go."""
    if order.command == CHANGE_SPEED:
        require_speed(asked, order.param(2))
    elif order.command in ITEM_PLACES:
        is_here = order.command in ITEM_HERE and says_here(asked, order)
        there = None if is_here else place_m(asked, order)
        radius = ITEM_RADIUS.get(order.command)
        require_inside(asked, there or here_m(asked.vehicle), abs(order.param(radius)) if radius else 0.0)
        if order.command not in ITEM_LANDINGS:
            require_band(asked, framed_height_m(asked, order), climbing=order.command in ITEM_HERE)
    elif order.command not in ITEM_PLAIN:
        raise Refused(f"command {order.command}: not on the list of what other stations may send in a mission")
