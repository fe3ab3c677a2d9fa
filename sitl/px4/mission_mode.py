"""The mode Mission: how PX4 flies the items of a mission, and what it reports of them."""

from collections.abc import Callable

from sitl.common.mission_flight import MissionFlight
from sitl.common.missions import FENCE, LAND, LOITER_UNLIMITED, MISSION, RALLY
from sitl.common.outbox import Fields
from sitl.common.platform import Platform
from sitl.common.states import Phase
from sitl.common.tasks import Task
from sitl.physics.point_masses import Point
from sitl.px4 import modes
from sitl.px4.announcer import Announcer
from sitl.px4.navigator import Navigator

NO_ITEMS = 65535
"""MISSION_CURRENT.total without a mission."""
REFUSED, NOT_STARTED, ACTIVE, COMPLETE = 1, 2, 3, 5
"""MISSION_STATE; REFUSED with a total above 0 means that the mission did not pass its checks."""
REPEATS, REPEAT_US = 10, 1_000_000
"""How often MISSION_ITEM_REACHED is sent again, with MISSION_CURRENT at 1 Hz (mavlink_mission.h)."""
IN_MISSION, ELSEWHERE = 1, 2
"""Values of mission_mode in MISSION_CURRENT."""


class MissionMode(MissionFlight):
    """The mission of one vehicle: its progress, and the movements it calls for."""

    def __init__(
        self, platform: Platform, announcer: Announcer, navigator: Navigator, on_finished: Callable[[], None]
    ) -> None:
        """`on_finished` is called when a mission ends in the air."""
        super().__init__(platform, radius_m=max(platform.params["NAV_ACC_RAD"], 0.1))
        self._announcer, self._navigator, self._on_finished = announcer, navigator, on_finished

    def begin(self) -> None:
        """Start the mission in the air, or continue it where it stopped."""
        self._announcer.announce("Executing Mission", "mission_execute")
        self.start()

    def changed(self) -> None:
        """Take note of another mission, or of another current item."""
        self.complete = False
        if not self.running:
            return
        if self._plans.feasible and self._plans.seq < len(self._plans.mission):
            self.jump(self._plans.seq)

    def fields(self) -> Fields:
        """Return the fields of MISSION_CURRENT."""
        plans = self._plans
        state = NOT_STARTED if plans.feasible else REFUSED
        if self.complete:
            state = COMPLETE
        elif self.running:
            state = ACTIVE
        return {
            "seq": plans.seq,
            "total": len(plans.mission) or NO_ITEMS,
            "mission_state": state,
            "mission_id": plans.ids[MISSION],
            "fence_id": plans.ids[FENCE],
            "rally_points_id": plans.ids[RALLY],
            "mission_mode": IN_MISSION if self._state.mode == modes.MISSION else ELSEWHERE,
        }

    def passed(self) -> None:
        """Report an item that takes no time: PX4 reports every completed item (mission_base.cpp)."""
        self._report(self._plans.seq)

    def reached(self, *, last: bool) -> None:
        """Report that the current item is completed; one to loiter without an end never is."""
        if self._plans.mission[self._plans.seq].command != LOITER_UNLIMITED:
            self._report(self._plans.seq)

    def _report(self, seq: int) -> None:
        self._tasks.start("mission item reached", self._repeated(seq), self._clock.now_us)

    def _repeated(self, seq: int) -> Task:
        """Send MISSION_ITEM_REACHED, and again until another item is completed or the mission is another one.

        Source: mavlink_mission.cpp, `send`.
        """
        mission = self._plans.ids[MISSION]
        for _ in range(1 + REPEATS):
            if self._plans.ids[MISSION] != mission:
                return
            self._outbox.send("MISSION_ITEM_REACHED", seq=seq)
            yield REPEAT_US

    def touched_down(self) -> None:
        """End a mission with a landing as its last item."""
        if self.running:
            if self._plans.mission[self._plans.seq].command == LAND:
                self._report(self._plans.seq)
            self.running, self.complete = False, True
            self._announcer.announce("Mission finished, landed", "mission_finished")

    def go(self, place_m: Point) -> None:
        """Fly to the place of an item."""
        self._state.enter(Phase.AIRBORNE)
        self._navigator.go(place_m)

    def climb(self, height_m: float) -> None:
        """Take off, or climb where the vehicle is."""
        x, y, z = self._body.seen_m()
        above_m = height_m - self._state.home_m[2]
        if z < height_m:
            text = f"Climb to {above_m:.1f} meters above home"
            self._announcer.announce(text, "mission_climb_before_start", above_m)
        self._navigator.go((x, y, max(height_m, z)))

    def land(self) -> None:
        """Land where the vehicle is."""
        self._navigator.land()

    def come_home(self) -> None:
        """Return and land, still in Mission."""
        self._navigator.come_home()

    def change_speed(self, speed_m_s: float) -> None:
        """Fly with another speed from now on (DO_CHANGE_SPEED)."""
        self._navigator.change_speed(speed_m_s)

    def finished(self) -> None:
        """Report the end of the mission, and hold."""
        if not self._state.landed:
            self._announcer.announce("Mission finished, loitering", "mission_finished_loiter")
            self._on_finished()
