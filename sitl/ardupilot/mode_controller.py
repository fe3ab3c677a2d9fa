"""Changes of mode of an ArduCopter: which are refused, and what begins with each mode."""

import math

from sitl.ardupilot.auto_mode import WITHOUT_THROTTLE
from sitl.ardupilot.guided import load_speeds
from sitl.ardupilot.joystick import STICK_DOWN_SINK_M_S
from sitl.ardupilot.modes import (
    AUTO,
    AUTO_RTL,
    BRAKE,
    GUIDED,
    LAND,
    MANUAL_THROTTLE,
    MODE_NAMES,
    NEED_POSITION,
    RETURN_MODES,
    STICK_MODES,
)
from sitl.ardupilot.parts import CopterParts
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Phase, Stage


class ModeController(Part):
    """Changes the mode of one vehicle. The mode itself is `state.mode`."""

    def __init__(self, platform: Platform, parts: CopterParts) -> None:
        super().__init__(platform)
        self._flight, self._guided, self._auto = parts.flight, parts.guided, parts.auto
        self._joystick, self._position = parts.joystick, parts.position

    def set_mode(self, mode: int) -> bool:
        """Change mode; False (and a text) if that is refused."""
        state = self._state
        name = MODE_NAMES.get(mode)
        if name is None:
            self._outbox.text(MavSeverity.WARNING, f"No such mode {mode}")
            return False
        # The mode in force is accepted again, without beginning it anew.
        if mode == state.mode:
            return True
        # Disarmed, every known mode is accepted, AUTO without a mission too
        # (docs/autopilots.md "Refusals and their texts").
        if state.armed:
            reason = self._refusal(mode)
            if reason:
                self._outbox.text(MavSeverity.WARNING, f"Mode change to {name} failed: {reason}")
                return False
        if state.mode == AUTO:
            self._auto.leave()
        state.mode = mode
        load_speeds(self._params, self._body)
        self._guided.clear()
        if state.armed:
            self._begin(mode)
        if state.stage >= Stage.READY:
            # A change of mode is reported at once (seen on 4.7), not with the next heartbeat.
            self._streams.send_once("HEARTBEAT")
        return True

    def _refusal(self, mode: int) -> str:
        if mode == AUTO and not self._auto.exists:
            return "init failed"
        if mode == AUTO_RTL:
            return "No landing sequence found"
        if mode in NEED_POSITION and not self._position.is_usable:
            return "requires position"
        return ""

    def _begin(self, mode: int) -> None:
        state, body = self._state, self._body
        self._plans.flying = mode == AUTO
        if state.landed:
            state.enter(Phase.GROUND)
            return
        body.lift()
        body.masses.falling[body.index] = False
        state.enter(Phase.AIRBORNE)
        if mode in RETURN_MODES:
            self._flight.begin_return()
        elif mode == LAND:
            self._flight.begin_landing()
        elif mode == AUTO:
            self._auto.begin()
        elif mode in (GUIDED, BRAKE):
            body.hold_here()
        elif mode in MANUAL_THROTTLE:
            body.rest()
        elif not self._follow_joystick():
            # The throttle stick of SITL's default receiver is down.
            body.sink(STICK_DOWN_SINK_M_S)

    def tick(self) -> None:
        """Fly the mission of AUTO, or follow a joystick in the modes that a pilot flies."""
        if self._state.mode == AUTO:
            self._auto.tick()
        elif self._state.mode in STICK_MODES and self._joystick.is_present and not self._follow_joystick():
            self._joystick.drop()
            self._body.sink(STICK_DOWN_SINK_M_S)

    def _follow_joystick(self) -> bool:
        """Fly as the joystick demands; False if there is none any more, so that the receiver's sticks count."""
        velocity_m_s = self._joystick.velocity_m_s()
        if velocity_m_s is None:
            return False
        self._body.set_velocity(velocity_m_s)
        return True

    def start_mission(self) -> bool:
        """Enter AUTO for MISSION_START; on the ground nothing moves unless AUTO_OPTIONS allows it."""
        state = self._state
        if state.mode != AUTO and not self.set_mode(AUTO):
            return False
        if state.armed and state.landed and self._auto.allows(WITHOUT_THROTTLE):
            self._auto.begin()
        return True

    def take_off(self, alt_m: float) -> bool:
        """Take off to `alt_m` above home (NAV_TAKEOFF); False where a real ArduCopter refuses."""
        state = self._state
        if not state.armed or state.mode != GUIDED or not state.landed:
            return False
        if not (math.isfinite(alt_m) and alt_m + state.home_m[2] > self._body.seen_m()[2]):
            return False
        self._flight.take_off(alt_m + state.home_m[2])
        return True
