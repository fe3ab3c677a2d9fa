"""AUTO: how ArduCopter flies the items of a mission, and what it says of them."""

from typing import TYPE_CHECKING

from sitl.common import missions
from sitl.common.mission_flight import MissionFlight, Point
from sitl.common.missions import Item
from sitl.common.states import AUTO, Phase, Severity

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter

HOME = 0
NOT_PRESENT, WAITING, ACTIVE, PAUSED, COMPLETE = 1, 2, 3, 4, 5
"""MISSION_STATE."""
WITHOUT_THROTTLE = 2
"""AUTO_OPTIONS: a mission may take off though the throttle stick is down."""
ARM_IN_AUTO = 1
_NAMES = {
    missions.WAYPOINT: "WP",
    missions.SPLINE: "SplineWP",
    missions.TAKEOFF: "Takeoff",
    missions.LAND: "Land",
    missions.RETURN: "RTL",
    missions.LOITER_TIME: "LoitTime",
    missions.LOITER_UNLIMITED: "LoitUnlim",
}


class CopterMission:
    """The mission of one vehicle."""

    def __init__(self, ap: "ArduCopter") -> None:
        self.ap = ap
        radius_m = max(ap.params["WPNAV_RADIUS"] / 100.0, 0.1)
        self.flight = MissionFlight(ap, self, first=HOME + 1, radius_m=radius_m)
        self.paused = False

    @property
    def exists(self) -> bool:
        """Whether there is anything but home."""
        return len(self.ap.plans.mission) > HOME + 1

    def begin(self) -> None:
        """AUTO has begun, in the air or with MISSION_START."""
        self.paused = False
        self.flight.start()

    def on_ground(self) -> None:
        """AUTO on the ground: nothing moves before MISSION_START, and only with AUTO_OPTIONS."""
        self.flight.running = False

    def leave(self) -> None:
        """Another mode."""
        self.paused = False
        self.flight.stop()
        self.ap.plans.flying = False

    def pause(self) -> None:
        """DO_PAUSE_CONTINUE 0."""
        self.paused = True
        self.ap.vehicles.hold_here(self.ap.index)

    def go_on(self) -> None:
        """DO_PAUSE_CONTINUE 1."""
        if self.paused:
            self.paused = False
            self.flight.start()

    def tick(self) -> None:
        """Fly on."""
        if not self.paused:
            self.flight.tick()

    def changed(self) -> None:
        """The items changed; while it is flown it flies to the new place at once."""
        plans = self.ap.plans
        if not (self.flight.running and plans.flying):
            return
        if plans.seq < len(plans.mission):
            self.ap.text(Severity.CRITICAL, "Auto mission changed, restarted command")
            self.flight.jump(plans.seq)
        else:
            self.ap.text(Severity.CRITICAL, "Auto mission changed but failed to restart command")

    def jump(self, seq: int, *, restart: bool) -> bool:
        """Go on with item `seq`; 0 means the first. False if there is no such item."""
        if not 0 <= seq < max(len(self.ap.plans.mission), 1):
            return False
        if restart and self.flight.complete and self.ap.mode == AUTO and not self.ap.landed:
            self.flight.complete = False
            self.flight.running = True
        self.flight.jump(seq)
        return True

    def fields(self) -> dict[str, int]:
        """Of MISSION_CURRENT: without home, and without opaque ids."""
        plans, in_auto = self.ap.plans, self.ap.mode == AUTO
        if not self.exists:
            state = NOT_PRESENT
        elif not in_auto:
            state = WAITING
        elif self.flight.complete:
            state = COMPLETE
        else:
            state = PAUSED if self.paused else ACTIVE
        seq = plans.seq if plans.seq < len(plans.mission) or self.flight.running else 0
        return {
            "seq": seq,
            "total": max(len(plans.mission) - 1, 0),
            "mission_state": state,
            "mission_mode": int(in_auto),
        }

    # What the mission asks for

    def go(self, place_m: Point) -> None:
        """Fly there."""
        self.ap.enter(Phase.AIRBORNE)
        self.ap.vehicles.set_target(self.ap.index, place_m)

    def climb(self, height_m: float) -> None:
        """Take off, or climb on the spot."""
        ap = self.ap
        ap.takeoff_m = height_m
        if ap.landed:
            ap.enter(Phase.SPOOL_UP)
            return
        x, y, z = ap.vehicles.seen(ap.index)
        ap.vehicles.set_target(ap.index, (x, y, max(height_m, z)))

    def land(self) -> None:
        """Land here."""
        self.ap.begin_landing()

    def come_home(self) -> None:
        """Return and land, still in AUTO."""
        self.ap.begin_return()

    def change_speed(self, speed_m_s: float) -> None:
        """DO_CHANGE_SPEED on the way."""
        if speed_m_s > 0.0:
            self.ap.vehicles.speed_m_s[self.ap.index] = speed_m_s

    def begun(self, seq: int, item: Item) -> None:
        """An item that moves it has begun."""
        self.ap.text(Severity.INFO, f"Mission: {seq} {_NAMES.get(item.command, f'ID={item.command}')}")

    def reached(self, seq: int, item: Item, *, last: bool) -> None:
        """Its place was reached; only delayed and last ones are worth a text."""
        self.ap.send("MISSION_ITEM_REACHED", seq=seq)
        if last:
            self.ap.text(Severity.INFO, f"Reached command #{seq}")

    def finished(self) -> None:
        """It stays where it is."""
