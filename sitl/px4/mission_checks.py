"""What PX4 thinks of a plan after it acknowledged it. Only events (and a few texts) say what is wrong."""

import math
from typing import TYPE_CHECKING

from sitl.common import missions
from sitl.common.missions import Item
from sitl.common.states import Severity
from sitl.common.tasks import Task

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

RALLY_COMPLAINT_US = 2_000_000
LEVEL_ERROR, LEVEL_WARNING, LEVEL_CRITICAL, LEVEL_FRAME = 0x63, 0x64, 0x42, 0x33
"""Log levels of events: in the vehicle's log and for others."""
NO_PLACE = frozenset({missions.FRAME_MISSION})
_PLACES = frozenset({16, 17, 19, 21, 22, 31, 84, 85})


def judge_mission(ap: "Px4") -> None:
    """Set `plans.feasible`; a mission that is not shows as mission_state 1 with a total above 0."""
    plans = ap.plans
    plans.feasible = bool(plans.mission) and _mission_is_good(ap, plans.mission)
    plans.changed(missions.MISSION)


def _mission_is_good(ap: "Px4", items: list[Item]) -> bool:
    placed = [item for item in items if item.command in _PLACES and item.frame not in NO_PLACE]
    good = _order_is_good(ap, items, placed) and (not placed or not placed[0].x or _first_is_near(ap, placed[0]))
    return _mission_is_inside(ap, items) and good  # the fence is looked at in any case


def _order_is_good(ap: "Px4", items: list[Item], placed: list[Item]) -> bool:
    for seq, item in enumerate(items):
        if item.command == missions.LAND and seq == 0:
            return _reject(ap, "navigator_mis_starts_w_landing")
        if item.command == missions.TAKEOFF:
            lowest_m = 0.0 if item.relative else home_amsl_m(ap)
            if item.z <= lowest_m:
                return _reject(ap, "navigator_mis_takeoff_too_low", lowest_m)
            if item is not placed[0]:
                return _reject(ap, "navigator_mis_takeoff_not_first")
    return True


def _first_is_near(ap: "Px4", first: Item) -> bool:
    distance_m = math.hypot(*_metres_from_home(ap, first))
    if distance_m <= float(ap.params["MIS_DIST_1WP"]) or ap.params["MIS_DIST_1WP"] <= 0:
        return True
    ap.event("navigator_mis_first_wp_far", int(distance_m), levels=LEVEL_WARNING)
    return False


def _mission_is_inside(ap: "Px4", items: list[Item]) -> bool:
    for seq, item in enumerate(items):
        if item.command in _PLACES and item.frame not in NO_PLACE and (item.x or item.y) and not inside(ap, item):
            text, event = f"Geofence violation for waypoint {seq + 1}", "navigator_mis_geofence_violation"
            ap.tell(text, event, seq + 1, severity=Severity.CRITICAL, levels=LEVEL_ERROR)
            return False
    return True


def _reject(ap: "Px4", event: str, *arguments: float) -> bool:
    """Only an event says so: no text."""
    ap.event(event, *arguments, levels=LEVEL_ERROR)
    return False


def judge_fence(ap: "Px4") -> None:
    """Set `plans.in_force`: shapes that do not contain home are dropped with a text each.

    PX4's bug is here, too: after the first circle every vertex of a polygon begins a polygon of its own, which runs
    into whatever follows; where the list ends before it does, it contains nothing.
    """
    plans, shapes, at, circles = ap.plans, [], 0, False
    while at < len(plans.fence):
        item = plans.fence[at]
        if item.command not in missions.POLYGONS | missions.CIRCLES:
            at += 1
            continue
        circles = circles or item.command in missions.CIRCLES
        size = 1 if item.command in missions.CIRCLES else int(item.p1)
        shape = plans.fence[at : at + size]
        at += 1 if circles else size
        if _contains_home(ap, shape):
            shapes.append(shape)
            continue
        text, event = "Geofence invalid, doesn't contain Home position", "navigator_geofence_invalid_against_home"
        ap.tell(text, event, severity=Severity.CRITICAL, levels=LEVEL_CRITICAL)
    plans.in_force = shapes
    plans.changed(missions.FENCE)


def judge_rally(ap: "Px4") -> None:
    """Frames 5 and 6 are taken, and complained of every 2 s while it is armed."""
    ap.tasks.start("rally complaint", _complain(ap), ap.now_us)


def _complain(ap: "Px4") -> Task:
    bad = next((point.frame for point in ap.plans.rally if point.frame not in (0, 3)), None)
    while bad is not None:
        yield RALLY_COMPLAINT_US
        if not ap.armed:
            continue
        event = "rtl_unsupported_mav_frame"
        ap.tell("RTL: unsupported MAV_FRAME", event, bad, severity=Severity.CRITICAL, levels=LEVEL_FRAME)


def home_amsl_m(ap: "Px4") -> float:
    """Altitude of home."""
    return ap.home_m[2] + ap.spec.ground_amsl_m


def _metres_from_home(ap: "Px4", item: Item) -> tuple[float, float]:
    x_m, y_m = ap.vehicles.to_local(ap.index, item.lat_deg, item.lon_deg)
    return x_m - ap.home_m[0], y_m - ap.home_m[1]


def _contains_home(ap: "Px4", shape: list[Item]) -> bool:
    """Home is where it may be: inside what is to be stayed in, outside what is not."""
    return _allows(shape, [_metres_from_home(ap, corner) for corner in shape])


def _allows(shape: list[Item], corners: list[tuple[float, float]]) -> bool:
    """`corners` are relative to the place that is asked about."""
    command = shape[0].command
    if command in missions.CIRCLES:
        within = math.hypot(*corners[0]) < shape[0].p1
    else:
        within = len(shape) == int(shape[0].p1) and _around(corners)
    return within == (command in (missions.POLYGON_IN, missions.CIRCLE_IN))


def _around(corners: list[tuple[float, float]]) -> bool:
    """The origin is inside the polygon."""
    within = False
    for k, (x1, y1) in enumerate(corners):
        x2, y2 = corners[k - 1]
        if (y1 > 0.0) != (y2 > 0.0) and x1 - y1 * (x2 - x1) / (y2 - y1) > 0.0:
            within = not within
    return within


def inside(ap: "Px4", item: Item) -> bool:
    """A place respects every shape in force."""
    east, north = _metres_from_home(ap, item)
    for shape in ap.plans.in_force:
        corners = [(x - east, y - north) for x, y in (_metres_from_home(ap, corner) for corner in shape)]
        if not _allows(shape, corners):
            return False
    return True
