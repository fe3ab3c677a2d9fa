"""Building missions from generated paths: take-off, way-points at a height, actions on the way, return."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.survey import Lane, Place
from tui_gcs.core.plans.model import MISSION_FRAME, RELATIVE, RETURN, TAKE_OFF, WAYPOINT, PlanItem

ANY_HEADING = (0.0, 0.0, 0.0, math.nan)
"""Parameters of a way-point without heading: PX4 would turn to a heading of 0, north."""
CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED; a first parameter of 1 means ground speed."""
PHOTOS_EACH = 206
"""MAV_CMD_DO_SET_CAM_TRIGG_DIST: a photo after every so many metres."""


def waypoint(frame: LocalFrame, place_m: Place, height_m: float) -> PlanItem:
    """Make a way-point at a height above home."""
    lat_deg, lon_deg = frame.to_geodetic(*place_m)
    return PlanItem(WAYPOINT, RELATIVE, ANY_HEADING, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=height_m)


def take_off(frame: LocalFrame, home_m: Place, height_m: float) -> PlanItem:
    """Make a take-off, with the place as QGroundControl writes it; ArduCopter does not keep the place."""
    return replace(waypoint(frame, home_m, height_m), command=TAKE_OFF)


def return_home() -> PlanItem:
    """Make an item that returns and lands."""
    return PlanItem(RETURN, MISSION_FRAME)


def photos_each(distance_m: float) -> PlanItem:
    """Make an item that takes a photo every `distance_m` metres from here on; 0 ends that."""
    return PlanItem(PHOTOS_EACH, MISSION_FRAME, (distance_m, 0.0, 0.0, 0.0))


def path_items(frame: LocalFrame, places_m: Iterable[Place], height_m: float) -> Items:
    """Make way-points along a path."""
    return tuple(waypoint(frame, place, height_m) for place in places_m)


def lane_items(frame: LocalFrame, lanes: Sequence[Lane], height_m: float, photos_m: float = 0.0) -> Items:
    """Make way-points along lanes, with photos on the lanes if `photos_m` is given."""
    items: list[PlanItem] = []
    for begin_m, end_m in lanes:
        items.append(waypoint(frame, begin_m, height_m))
        if photos_m > 0:
            items.append(photos_each(photos_m))
        items.append(waypoint(frame, end_m, height_m))
        if photos_m > 0:
            items.append(photos_each(0.0))
    return tuple(items)


def ground_speed(speed_m_s: float) -> PlanItem:
    """Make an item that sets the ground speed from here on."""
    return PlanItem(CHANGE_SPEED, MISSION_FRAME, (1.0, speed_m_s, -1.0, 0.0))


def whole(frame: LocalFrame, home_m: Place, items: Items, height_m: float, speed_m_s: float | None = None) -> Items:
    """Return a complete mission: take-off, speed (None: the vehicle's own), these items, return."""
    begin = (take_off(frame, home_m, height_m), *([ground_speed(speed_m_s)] if speed_m_s is not None else []))
    return (*begin, *items, return_home()) if items else ()
