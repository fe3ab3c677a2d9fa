"""The mode AUTO: how ArduCopter flies the items of a mission, and what it reports of them."""

from sitl.ardupilot.flight import CopterFlight
from sitl.ardupilot.modes import AUTO
from sitl.common import missions
from sitl.common.mission_flight import MissionFlight
from sitl.common.missions import Item
from sitl.common.platform import Platform
from sitl.common.states import MavSeverity, Phase
from sitl.physics.point_masses import Point

HOME = 0
"""The item that stands for home."""
NOT_PRESENT, WAITING, ACTIVE, PAUSED, COMPLETE = 1, 2, 3, 4, 5
"""Values of MISSION_STATE in MISSION_CURRENT."""
ARM_IN_AUTO, WITHOUT_THROTTLE = 1, 2
"""AUTO_OPTIONS bits: the vehicle may arm in AUTO; a mission may take off although the throttle stick is down."""
_NAMES = {
    missions.WAYPOINT: "WP",
    missions.SPLINE: "SplineWP",
    missions.TAKEOFF: "Takeoff",
    missions.LAND: "Land",
    missions.RETURN: "RTL",
    missions.LOITER_TIME: "LoitTime",
    missions.LOITER_UNLIMITED: "LoitUnlim",
}


class AutoMode(MissionFlight):
    """The mission of one vehicle: its progress, and the movements it calls for."""

    FIRST = HOME + 1

    def __init__(self, platform: Platform, flight: CopterFlight) -> None:
        super().__init__(platform, radius_m=max(platform.params["WPNAV_RADIUS"] / 100.0, 0.1))
        self._flight = flight
        self._paused = False

    @property
    def exists(self) -> bool:
        """Whether there is any item but home."""
        return len(self._plans.mission) > HOME + 1

    def allows(self, option: int) -> bool:
        """Return whether AUTO_OPTIONS has a bit."""
        return bool(int(self._params["AUTO_OPTIONS"]) & option)

    def begin(self) -> None:
        """Start the mission, because AUTO begins in the air or MISSION_START has come."""
        self._paused = False
        self.start()

    def leave(self) -> None:
        """Stop the mission, because another mode begins."""
        self._paused = False
        self.stop()
        self._plans.flying = False

    def pause(self) -> None:
        """Hold where the vehicle is (DO_PAUSE_CONTINUE 0)."""
        self._paused = True
        self._body.hold_here()

    def resume(self) -> None:
        """Continue a mission that was paused (DO_PAUSE_CONTINUE 1)."""
        if self._paused:
            self._paused = False
            self.start()

    def tick(self) -> None:
        """Fly on to the next place of the mission."""
        if not self._paused:
            super().tick()

    def changed(self) -> None:
        """Take note of changed items; while the mission is flown the vehicle flies to the new place at once."""
        plans = self._plans
        # An upload in AUTO acts item by item, so a half-uploaded mission is flown
        # (docs/autopilots.md "Missions, fence, rally of ArduCopter").
        if not (self.running and plans.flying):
            return
        if plans.seq < len(plans.mission):
            self._outbox.text(MavSeverity.CRITICAL, "Auto mission changed, restarted command")
            self.jump(plans.seq)
        else:
            self._outbox.text(MavSeverity.CRITICAL, "Auto mission changed but failed to restart command")

    def choose(self, seq: int, *, restart: bool) -> bool:
        """Continue with item `seq`, where 0 stands for the first; False if there is no such item."""
        if not 0 <= seq < max(len(self._plans.mission), 1):
            return False
        if restart and self.complete and self._state.mode == AUTO and not self._state.landed:
            self.complete = False
            self.running = True
        self.jump(seq)
        return True

    def fields(self) -> dict[str, int]:
        """Return MISSION_CURRENT; ArduPilot counts without home and has no opaque ids."""
        plans, in_auto = self._plans, self._state.mode == AUTO
        if not self.exists:
            state = NOT_PRESENT
        # Outside AUTO the state is always 2, also for a mission that is complete.
        elif not in_auto:
            state = WAITING
        elif self.complete:
            state = COMPLETE
        else:
            state = PAUSED if self._paused else ACTIVE
        # After an upload that shortened the mission the current item may lie beyond its end: 0 is reported then.
        seq = plans.seq if plans.seq < len(plans.mission) or self.running else 0
        return {
            "seq": seq,
            "total": max(len(plans.mission) - 1, 0),
            "mission_state": state,
            "mission_mode": int(in_auto),
        }

    def go(self, place_m: Point) -> None:
        """Fly to the place of an item."""
        self._state.enter(Phase.AIRBORNE)
        self._body.set_target(place_m)

    def climb(self, height_m: float) -> None:
        """Take off, or climb where the vehicle is."""
        self._flight.climb(height_m)

    def land(self) -> None:
        """Land where the vehicle is."""
        self._flight.begin_landing()

    def come_home(self) -> None:
        """Return and land, still in AUTO."""
        self._flight.begin_return()

    def change_speed(self, speed_m_s: float) -> None:
        """Fly with another speed from now on (DO_CHANGE_SPEED)."""
        if speed_m_s > 0.0:
            self._body.masses.speed_m_s[self._body.index] = speed_m_s

    def begun(self, item: Item) -> None:
        """Report that an item that moves the vehicle has begun."""
        self._outbox.text(
            MavSeverity.INFO, f"Mission: {self._plans.seq} {_NAMES.get(item.command, f'ID={item.command}')}"
        )

    def reached(self, *, last: bool) -> None:
        """Report that the place of the current item was reached; only items with a delay and the last have a text."""
        super().reached(last=last)
        if last:
            self._outbox.text(MavSeverity.INFO, f"Reached command #{self._plans.seq}")
