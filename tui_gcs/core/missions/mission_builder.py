"""Generated ways made into missions: take-off, way-points at a height, what is to be done on the way, return."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.survey import Lane, Place
from tui_gcs.core.plans.model import MISSION_FRAME, RELATIVE, RETURN, TAKE_OFF, WAYPOINT, PlanItem

ANY_HEADING = (0.0, 0.0, 0.0, math.nan)
"""PX4 would turn to a heading of 0, north."""
CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED; its first parameter 1 is ground speed."""
PHOTOS_EACH = 206
"""MAV_CMD_DO_SET_CAM_TRIGG_DIST."""


def waypoint(frame: LocalFrame, place_m: Place, height_m: float) -> PlanItem:
    """Fly there, at a height above home."""
    lat_deg, lon_deg = frame.to_geodetic(*place_m)
    return PlanItem(WAYPOINT, RELATIVE, ANY_HEADING, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=height_m)


def take_off(frame: LocalFrame, home_m: Place, height_m: float) -> PlanItem:
    """Up from where it stands, which is said as QGroundControl says it; ArduCopter keeps no place of it."""
    return replace(waypoint(frame, home_m, height_m), command=TAKE_OFF)


def home_again() -> PlanItem:
    """Return and land."""
    return PlanItem(RETURN, MISSION_FRAME)


def photos_each(distance_m: float) -> PlanItem:
    """A photo each so many metres from here on; 0: no more."""
    return PlanItem(PHOTOS_EACH, MISSION_FRAME, (distance_m, 0.0, 0.0, 0.0))


def path_items(frame: LocalFrame, places_m: Iterable[Place], height_m: float) -> Items:
    """Way-points along a way."""
    return tuple(waypoint(frame, place, height_m) for place in places_m)


def lane_items(frame: LocalFrame, lanes: Sequence[Lane], height_m: float, photos_m: float = 0.0) -> Items:
    """Way-points along lanes, with photos on them if asked for."""
    items: list[PlanItem] = []
    for begin_m, end_m in lanes:
        items.append(waypoint(frame, begin_m, height_m))
        if photos_m > 0:
            items.append(photos_each(photos_m))
        items.append(waypoint(frame, end_m, height_m))
        if photos_m > 0:
            items.append(photos_each(0.0))
    return tuple(items)


def speed(speed_m_s: float) -> PlanItem:
    """Over ground from here on."""
    return PlanItem(CHANGE_SPEED, MISSION_FRAME, (1.0, speed_m_s, -1.0, 0.0))


def whole(frame: LocalFrame, home_m: Place, items: Items, height_m: float, speed_m_s: float | None = None) -> Items:
    """A mission of its own: up, at a speed (None: the vehicle's own), these items, home again."""
    begin = (take_off(frame, home_m, height_m), *([speed(speed_m_s)] if speed_m_s is not None else []))
    return (*begin, *items, home_again()) if items else ()
