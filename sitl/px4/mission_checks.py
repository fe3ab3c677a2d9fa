"""PX4's checks of a plan after it was acknowledged. Only events, and a few texts, report what is wrong with it."""

import math

from sitl.common import missions
from sitl.common.fence import is_within
from sitl.common.missions import Item
from sitl.common.platform import Part, Platform
from sitl.common.tasks import Task
from sitl.px4.announcer import Announcer

RALLY_COMPLAINT_US = 2_000_000
LEVELS_ERROR, LEVELS_WARNING, LEVELS_CRITICAL, LEVELS_FRAME = 0x63, 0x64, 0x42, 0x33
"""log_levels of EVENTs: for stations (high four bits) and in the vehicle's log (low four bits)."""
NO_PLACE = frozenset({missions.FRAME_MISSION})
_PLACES = frozenset({16, 17, 19, 21, 22, 31, 84, 85})


class MissionChecks(Part):
    """Judges the plans of one vehicle."""

    def __init__(self, platform: Platform, announcer: Announcer) -> None:
        super().__init__(platform)
        self._announcer = announcer

    def judge(self, kind: int) -> None:
        """Judge the plan of a MAV_MISSION_TYPE."""
        if kind == missions.MISSION:
            self._judge_mission()
        elif kind == missions.FENCE:
            self._judge_fence()
        else:
            self._tasks.start("rally complaint", self._complain_of_rally_points(), self._clock.now_us)

    def _judge_mission(self) -> None:
        """Set `plans.feasible`; a refused mission shows as mission_state 1 with a total above 0."""
        plans = self._plans
        plans.feasible = bool(plans.mission) and self._mission_is_good(plans.mission)
        plans.changed(missions.MISSION)

    def _mission_is_good(self, items: list[Item]) -> bool:
        placed = [item for item in items if item.command in _PLACES and item.frame not in NO_PLACE]
        good = self._order_is_good(items, placed) and (not placed or not placed[0].x or self._first_is_near(placed[0]))
        # The fence is checked in any case, because its text may be the second reason.
        return self._mission_is_inside(items) and good

    def _order_is_good(self, items: list[Item], placed: list[Item]) -> bool:
        for seq, item in enumerate(items):
            if item.command == missions.LAND and seq == 0:
                return self._reject("navigator_mis_starts_w_landing")
            if item.command == missions.TAKEOFF:
                min_m = 0.0 if item.relative else self._state.home_m[2] + self._spec.ground_amsl_m
                if item.z <= min_m:
                    return self._reject("navigator_mis_takeoff_too_low", min_m)
                if item is not placed[0]:
                    return self._reject("navigator_mis_takeoff_not_first")
        return True

    def _first_is_near(self, first: Item) -> bool:
        distance_m = math.hypot(*self._metres_from_home(first))
        if distance_m <= float(self._params["MIS_DIST_1WP"]) or self._params["MIS_DIST_1WP"] <= 0:
            return True
        self._announcer.event("navigator_mis_first_wp_far", int(distance_m), levels=LEVELS_WARNING)
        return False

    def _mission_is_inside(self, items: list[Item]) -> bool:
        for seq, item in enumerate(items):
            has_place = item.command in _PLACES and item.frame not in NO_PLACE and (item.x or item.y)
            if has_place and not self._is_inside(item):
                text = f"Geofence violation for waypoint {seq + 1}"
                self._announcer.alert(text, "navigator_mis_geofence_violation", seq + 1, levels=LEVELS_ERROR)
                return False
        return True

    def _reject(self, event: str, *arguments: float) -> bool:
        """Report a refusal, by an event without a text."""
        self._announcer.event(event, *arguments, levels=LEVELS_ERROR)
        return False

    def _judge_fence(self) -> None:
        """Set `plans.in_force`: shapes that do not contain home are dropped with a text each."""
        plans, shapes, at, circles = self._plans, [], 0, False
        while at < len(plans.fence):
            item = plans.fence[at]
            if item.command not in missions.POLYGONS | missions.CIRCLES:
                at += 1
                continue
            circles = circles or item.command in missions.CIRCLES
            size = 1 if item.command in missions.CIRCLES else int(item.p1)
            shape = plans.fence[at : at + size]
            # A bug of PX4, measured: after the first circle every vertex of a polygon begins a polygon of its own,
            # which runs into whatever follows. Where the list ends before the polygon does, it contains nothing.
            at += 1 if circles else size
            if self._allows_home(shape):
                shapes.append(shape)
                continue
            text = "Geofence invalid, doesn't contain Home position"
            self._announcer.alert(text, "navigator_geofence_invalid_against_home", levels=LEVELS_CRITICAL)
        plans.in_force = shapes
        plans.changed(missions.FENCE)

    def _complain_of_rally_points(self) -> Task:
        """Complain about rally points in frames 5 and 6, which are accepted, every 2 s while armed."""
        bad = next((point.frame for point in self._plans.rally if point.frame not in (0, 3)), None)
        while bad is not None:
            yield RALLY_COMPLAINT_US
            if not self._state.armed:
                continue
            self._announcer.alert("RTL: unsupported MAV_FRAME", "rtl_unsupported_mav_frame", bad, levels=LEVELS_FRAME)

    def _metres_from_home(self, item: Item) -> tuple[float, float]:
        x_m, y_m = self._body.to_local(item.lat_deg, item.lon_deg)
        home_m = self._state.home_m
        return x_m - home_m[0], y_m - home_m[1]

    def _allows_home(self, shape: list[Item]) -> bool:
        return _allows(shape, [self._metres_from_home(corner) for corner in shape])

    def _is_inside(self, item: Item) -> bool:
        """Return whether a place respects every shape in force."""
        east, north = self._metres_from_home(item)
        for shape in self._plans.in_force:
            corners = [(x - east, y - north) for x, y in (self._metres_from_home(corner) for corner in shape)]
            if not _allows(shape, corners):
                return False
        return True


def _allows(shape: list[Item], corners: list[tuple[float, float]]) -> bool:
    """Return whether a shape allows the origin of `corners`."""
    command = shape[0].command
    if command in missions.CIRCLES:
        within = math.hypot(*corners[0]) < shape[0].p1
    else:
        within = len(shape) == int(shape[0].p1) and is_within(corners, 0.0, 0.0)
    return within == (command in (missions.POLYGON_IN, missions.CIRCLE_IN))
