"""MISSION: how PX4 flies the items of a mission, and what it says of them."""

from typing import TYPE_CHECKING, Any

from sitl.common import missions
from sitl.common.mission_flight import MissionFlight, Point
from sitl.common.missions import Item
from sitl.common.states import Phase
from sitl.px4.mission_protocol import mission_current
from sitl.px4.modes import MISSION

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

ACTIVE, PAUSED_OR_WAITING, COMPLETE = 3, 2, 5
"""MISSION_STATE."""
IN_MISSION, ELSEWHERE = 1, 2
"""MISSION_CURRENT.mission_mode."""


class Px4Mission:
    """The mission of one vehicle."""

    def __init__(self, ap: "Px4") -> None:
        self.ap = ap
        self.flight = MissionFlight(ap, self, first=0, radius_m=max(ap.params["NAV_ACC_RAD"], 0.1))

    def begin(self) -> None:
        """MISSION has begun in the air: go on where it stopped."""
        self.ap.tell("Executing Mission", "mission_execute")
        self.flight.start()

    def changed(self, kind: int) -> None:
        """Another plan is stored, or another item chosen."""
        ap = self.ap
        if kind == missions.FENCE:
            ap.shapes = None
            return
        if kind != missions.MISSION:
            return
        self.flight.complete = False
        if not self.flight.running:
            return
        if ap.plans.feasible and ap.plans.seq < len(ap.plans.mission):
            self.flight.jump(ap.plans.seq)

    def fields(self) -> dict[str, Any]:
        """Of MISSION_CURRENT."""
        fields: dict[str, Any] = dict(mission_current(self.ap))
        if self.flight.complete:
            fields["mission_state"] = COMPLETE
        elif self.flight.running:
            fields["mission_state"] = ACTIVE
        return {**fields, "mission_mode": IN_MISSION if self.ap.mode == MISSION else ELSEWHERE}

    # What the mission asks for

    def go(self, place_m: Point) -> None:
        """Fly there."""
        self.ap.enter(Phase.AIRBORNE)
        self.ap.flight.go(place_m)

    def climb(self, height_m: float) -> None:
        """Take off, or climb on the spot."""
        ap = self.ap
        x, y, z = ap.vehicles.seen(ap.index)
        above_m = height_m - ap.home_m[2]
        if z < height_m:
            ap.tell(f"Climb to {above_m:.1f} meters above home", "mission_climb_before_start", above_m)
        ap.flight.go((x, y, max(height_m, z)))

    def land(self) -> None:
        """Land here."""
        self.ap.flight.land()

    def come_home(self) -> None:
        """Return and land, still in MISSION."""
        self.ap.flight.come_home()

    def change_speed(self, speed_m_s: float) -> None:
        """DO_CHANGE_SPEED on the way."""
        self.ap.flight.change_speed(speed_m_s)

    def begun(self, seq: int, item: Item) -> None:
        """PX4 says nothing."""

    def reached(self, seq: int, item: Item, *, last: bool) -> None:
        """Its place was reached."""
        self.ap.send("MISSION_ITEM_REACHED", seq=seq)

    def finished(self) -> None:
        """It holds."""
        if not self.ap.landed:
            self.ap.tell("Mission finished, loitering", "mission_finished_loiter")
            self.ap.hold_after_mission()

    def touched_down(self) -> None:
        """Landed by its last item."""
        if self.flight.running:
            self.flight.running, self.flight.complete = False, True
            self.ap.tell("Mission finished, landed", "mission_finished")
