"""PX4's commander: which mode is flown, arming and disarming, and what a failsafe overrules."""

from dataclasses import dataclass

from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Phase, Result
from sitl.px4.mission_mode import MissionMode
from sitl.px4.modes import HOLD, LAND, MISSION, MODES, OFFBOARD, ORBIT, PASSING, RTL, STICKS, TAKEOFF, mode_of
from sitl.px4.parts import Px4Parts

ARMED_BY_COMMAND, BY_LANDING, BY_INACTION, BY_MISSION = 4, 6, 7, 5
"""Values of arm_disarm_reason in the events of arming and disarming."""
CALIBRATING, ACTIVE, CRITICAL, STANDBY, UNKNOWN = 2, 4, 5, 3, 0
"""Values of MAV_STATE in the heartbeat."""
RAISED_THROTTLE = 600
"""A throttle stick above this takes off."""


@dataclass
class Failsafe:
    """A failsafe that is in force: its cause, and the mode it flies."""

    cause: str
    action: int
    """The mode that it ends in."""
    hold_until_us: int
    """Until then it flies Hold."""
    resumes: bool = False
    """The operator's mode is in force again when the cause is gone."""

    def mode(self, now_us: int) -> int:
        """Return the mode that it flies now."""
        return HOLD if now_us < self.hold_until_us else self.action


class Commander(Part):
    """Decides what one vehicle flies. The mode that is flown is `state.mode`."""

    def __init__(self, platform: Platform, parts: Px4Parts) -> None:
        super().__init__(platform)
        self._announcer, self._navigator, self._inputs = parts.announcer, parts.navigator, parts.inputs
        self._checks, self._battery, self._sd_log = parts.checks, parts.battery, parts.sd_log
        self._calibration = parts.calibration
        self.mission = MissionMode(platform, parts.announcer, parts.navigator, self._mission_finished)
        self.intended = HOLD
        """The mode that was chosen, also while a failsafe flies another one."""
        self.failsafe: Failsafe | None = None
        self._normal_mode = HOLD
        """The last chosen mode that does not end by itself."""

    def request_mode(self, main: int, sub: int) -> Result:
        """Change to the mode of a DO_SET_MODE or SET_MODE."""
        mode = mode_of(main, sub)
        if mode is None:
            self._announcer.text(MavSeverity.CRITICAL, "Unsupported main mode\t")
            return Result.TEMPORARILY_REJECTED
        return self.set_mode(mode)

    def set_mode(self, mode: int) -> Result:
        """Change to a mode that the operator has chosen: on the ground to any, in the air to one that can be flown."""
        # Disarmed, any mode is accepted; arming in it is refused then (docs/autopilots.md "Modes of PX4").
        if self._state.armed and not self._checks.can_run(mode):
            info = MODES.get(mode)
            name, number = (info.name, info.number) if info else ("External", 255)
            text = f"Switching to {name} is currently not available"
            self._announcer.alert(text, "commander_modeswitch_not_avail", mode, number)
            return Result.TEMPORARILY_REJECTED
        self.intended = mode
        # After the flight the mode before a take-off, return or landing is in force again; after OFFBOARD that refuses
        # arming.
        if mode not in PASSING:
            self._normal_mode = mode
        # The operator overrules a failsafe; it does not act again before its cause was gone.
        self.failsafe = None
        # A vehicle that is in Hold on its way to a place flies on.
        self.apply_mode(again=not mode == self._state.mode == HOLD)
        return Result.ACCEPTED

    def apply_mode(self, *, again: bool = False) -> None:
        """Fly the failsafe's mode, else the chosen one; `again` begins a mode that is in force already."""
        mode = self.failsafe.mode(self._clock.now_us) if self.failsafe else self.intended
        if mode == self._state.mode and not again:
            return
        self.mission.stop()
        self._plans.flying = mode == MISSION
        self._state.mode = mode
        if self._state.armed:
            self._begin(mode)

    def _begin(self, mode: int) -> None:
        navigator = self._navigator
        if self._state.landed:
            # A mode that leads up is looked for in every tick.
            return
        if mode == TAKEOFF:
            navigator.climb()
            return
        self._state.enter(Phase.AIRBORNE)
        if mode == RTL:
            navigator.come_home()
        elif mode == LAND:
            navigator.land()
        elif mode == MISSION:
            self.mission.begin()
        # The circle of DO_ORBIT comes after the mode: without an earlier one the vehicle holds until then.
        elif mode != ORBIT or navigator.orbit is None:
            navigator.hold()

    @property
    def system_status(self) -> int:
        """HEARTBEAT.system_status: on the ground it is STANDBY only if the vehicle could be armed in this mode."""
        if self._calibration.is_running:
            return CALIBRATING
        if self.failsafe:
            return CRITICAL
        if self._state.armed:
            return ACTIVE
        return STANDBY if self._checks.can_arm(self._state.mode) else UNKNOWN

    def arm(self, reason: int = ARMED_BY_COMMAND) -> Result:
        """Start the motors, if the checks allow it; PX4 has no way to force it."""
        if self._state.armed:
            return Result.ACCEPTED
        if self._calibration.is_running:
            self._announcer.alert("Arming denied: calibrating", "commander_arm_denied_calibrating")
            return Result.TEMPORARILY_REJECTED
        if not self._checks.can_arm(self._state.mode):
            text = "Arming denied: Resolve system health failures first"
            self._announcer.alert(text, "commander_arm_denied_resolve_failures")
            return Result.TEMPORARILY_REJECTED
        self._state.armed, self._navigator.flew = True, False
        self._state.enter(Phase.GROUND)
        self._state.set_home()
        self._announcer.announce("Armed by external command", "commander_armed_by", reason)
        self._sd_log.open()
        self._begin(self._state.mode)
        return Result.ACCEPTED

    def disarm(self, reason: int, text: str) -> None:
        """Stop the motors; a vehicle in the air falls. The mode before a return or landing is in force again."""
        self._state.armed = False
        self._state.enter(Phase.GROUND)
        self._navigator.rest()
        self._announcer.announce(f"Disarmed by {text}", "commander_disarmed_by", reason)
        self._sd_log.close_soon()
        self.failsafe = None
        self._battery.recharge()
        self.intended = self._normal_mode
        self.apply_mode()

    def tick(self) -> None:
        """Do one tick of an armed vehicle."""
        if self.failsafe:
            self.apply_mode()
        if self._state.phase == Phase.GROUND:
            self._stand()
            return
        self._fly()
        if self._navigator.landing_detected():
            self._announcer.announce("Landing detected", "commander_landing_detected")
            self.mission.touched_down()

    def _stand(self) -> None:
        since_s = self._state.in_phase_us / 1e6
        if self._navigator.flew:
            delay_s = self._params["COM_DISARM_LAND"]
            if 0.0 < delay_s <= since_s:
                self.disarm(BY_LANDING, "landing")
        elif self._leads_up():
            self._state.enter(Phase.SPOOL_UP)
        else:
            delay_s = self._params["COM_DISARM_PRFLT"]
            if 0.0 < delay_s <= since_s:
                self.disarm(BY_INACTION, "auto preflight disarming")

    def _leads_up(self) -> bool:
        """Return whether the mode takes the vehicle off the ground."""
        mode = self._state.mode
        if mode == TAKEOFF or (mode == MISSION and self._plans.feasible):
            return True
        if mode == OFFBOARD:
            return self._navigator.wants_up()
        return mode in STICKS and self._inputs.sticks_alive and self._inputs.sticks[2] > RAISED_THROTTLE

    def _fly(self) -> None:
        state, navigator, phase = self._state, self._navigator, self._state.phase
        if phase == Phase.SPOOL_UP:
            if navigator.spool_up():
                if state.mode == TAKEOFF:
                    navigator.climb()
                elif state.mode == MISSION:
                    self.mission.begin()
                    state.enter(Phase.TAKEOFF)
            return
        if phase == Phase.TAKEOFF:
            if navigator.lift_off(climbs=state.mode == TAKEOFF):
                self._hold_after(TAKEOFF)
        else:
            navigator.tick()
        if state.mode == MISSION and phase != Phase.TAKEOFF:
            self.mission.tick()
        elif state.mode == ORBIT:
            navigator.fly_orbit()
        elif state.mode in STICKS:
            navigator.follow_joystick()

    def _mission_finished(self) -> None:
        self._hold_after(MISSION)

    def _hold_after(self, mode: int) -> None:
        """Change to Hold at the end of a mode, unless the operator has chosen another one since."""
        if self.intended == mode:
            self.intended = self._normal_mode = HOLD
            self.apply_mode()
