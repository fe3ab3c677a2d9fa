"""ArduCopter's COMMAND_LONG and COMMAND_INT: what each does, and with which result it is acknowledged.

See docs/autopilots.md "ArduCopter". Calibrations and motor tests are in `calibration`, gimbal and camera in
`services.payload`.
"""

import math
from collections.abc import Callable

from sitl.ardupilot.arming import Arming
from sitl.ardupilot.guided import MAX_SPEED_M_S
from sitl.ardupilot.mode_controller import ModeController
from sitl.ardupilot.modes import AUTO, AUTO_RTL, AVAILABLE, GUIDED, LAND, LOITER, MODE_NAMES, RTL
from sitl.ardupilot.parts import CopterParts
from sitl.ardupilot.telemetry import CopterTelemetry
from sitl.common.command import Command
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Result, Stage
from sitl.common.streams import MIN_INTERVAL_MS, OFF

# MAV_CMD_COMPONENT_ARM_DISARM, param2: without checks, and in the air.
FORCE = 21196
# MAV_MODE_FLAG_CUSTOM_MODE_ENABLED: without it param2 of DO_SET_MODE is no mode of ArduPilot.
CUSTOM_MODE_ENABLED = 1
CHANGE_MODE = 1
"""DO_REPOSITION flag: enter GUIDED from any mode."""
_REBOOT = 246
# Message id.
_AVAILABLE_MODES = 435
_NO_REPLY = frozenset({132, 136, 162, 226, 259, 260, 264, 437})
"""Messages for which REQUEST_MESSAGE is acknowledged even if there is nothing to send."""
_JUNK = b"Failed to pause\0Failed to resume\0%s: manual control"
"""Bytes that lie in memory behind the name of a mode, and are sent with it."""


class CopterCommands(Part):
    """Carries out commands and acknowledges them."""

    def __init__(
        self,
        platform: Platform,
        parts: CopterParts,
        modes: ModeController,
        arming: Arming,
        telemetry: CopterTelemetry,
        restart: Callable[[], None],
    ) -> None:
        super().__init__(platform)
        self._to, self._modes, self._arming = parts, modes, arming
        self._telemetry, self._restart = telemetry, restart
        self._handlers: dict[int, Callable[[Command], Result]] = {
            17: self._mode_command(LOITER),
            20: self._mode_command(RTL),
            21: self._mode_command(LAND),
            22: lambda command: _result(modes.take_off(command.p[6])),
            115: self._condition_yaw,
            176: self._do_set_mode,
            178: self._change_speed,
            179: self._set_home,
            192: self._reposition,
            189: self._land_start,
            193: self._pause_continue,
            195: self._roi,
            # ROI_NONE: the nose stays where it points (measured).
            197: lambda _: Result.ACCEPTED,
            201: self._roi,
            207: self._fence_enable,
            224: self._set_mission_current,
            _REBOOT: self._reboot,
            300: self._mission_start,
            400: self._arm_disarm,
            401: self._run_prearm_checks,
            510: self._get_message_interval,
            511: self._set_message_interval,
            512: self._request_message,
            42651: self._reset_battery,
        }

    def execute(self, command: Command) -> None:
        """Carry out a command and acknowledge it.

        Texts follow the acknowledgement; before 'ArduPilot Ready' they come first (both measured).
        """
        # Calibrations are dialogues of their own.
        if self._state.stage >= Stage.READY and self._to.calibration.execute(command):
            return
        handler = self._handlers.get(command.number, self._to.payload.execute)
        # Texts are held back, because they follow the acknowledgement; stations collect them to explain a refusal.
        self._outbox.hold_back()
        result = handler(command)
        # Neither flight nor payload knows the command.
        result = Result.UNSUPPORTED if result is None else result
        held = self._outbox.take_held()
        if self._state.stage < Stage.READY:
            self._outbox.send_all(held)
            held = []
        self._outbox.answer(command, result)
        self._outbox.send_all(held)
        if command.number == _REBOOT and result == Result.ACCEPTED:
            self._restart()

    def _mode_command(self, mode: int) -> Callable[[Command], Result]:
        return lambda _: _result(self._modes.set_mode(mode))

    def _do_set_mode(self, command: Command) -> Result:
        if not int(_number(command.p[0])) & CUSTOM_MODE_ENABLED:
            return Result.DENIED
        return _result(self._modes.set_mode(int(_number(command.p[1])) & 0xFF))

    def _arm_disarm(self, command: Command) -> Result:
        forced = command.p[1] == FORCE
        if command.p[0] == 1:
            return self._arm(forced=forced)
        if command.p[0] != 0:
            return Result.UNSUPPORTED
        if self._state.armed:
            # Refused without a text, as a take-off is (docs/autopilots.md "Refusals and their texts").
            if not self._state.landed and not forced:
                return Result.FAILED
            self._arming.disarm()
        return Result.ACCEPTED

    def _arm(self, *, forced: bool) -> Result:
        if self._state.armed:
            return Result.ACCEPTED
        # Forced arming skips all checks, but not before the boot is over.
        problems = [] if forced and self._state.stage >= Stage.READY else self._arming.refusals()
        for problem in problems:
            self._outbox.text(MavSeverity.CRITICAL, f"Arm: {problem}")
        if problems:
            return Result.FAILED
        self._arming.arm()
        return Result.ACCEPTED

    def _reposition(self, command: Command) -> Result:
        """Fly to a place. Only a COMMAND_INT is taken; its speed and yaw are ignored."""
        if command.frame is None:
            return Result.UNSUPPORTED
        guided = self._to.guided
        place = guided.place(command.frame, int(command.p[4]), int(command.p[5]), command.p[6])
        if place is None:  # it takes the frames of set-points: 0, 3, 5, 6, 10, 11
            return Result.DENIED
        may_change_mode = int(_number(command.p[1])) & CHANGE_MODE
        if self._state.mode != GUIDED and not (may_change_mode and self._modes.set_mode(GUIDED)):
            return Result.DENIED
        # Unlike PX4, ArduCopter reports a target outside the fence.
        if not self._to.fence.allows(place):
            return Result.FAILED
        if guided.is_flying:
            guided.fly(place, None)
        return Result.ACCEPTED

    def _change_speed(self, command: Command) -> Result:
        kind, speed_m_s = command.p[0], command.p[1]
        if not speed_m_s > 0.0:
            return Result.FAILED
        masses = self._body.masses
        speeds = {0: masses.speed_m_s, 1: masses.speed_m_s, 2: masses.climb_m_s, 3: masses.descent_m_s}
        if kind in speeds:
            speeds[int(kind)][self._body.index] = min(speed_m_s, MAX_SPEED_M_S)
        return Result.ACCEPTED

    def _pause_continue(self, command: Command) -> Result:
        guided, auto = self._to.guided, self._to.auto
        if self._state.mode == AUTO and not self._state.landed:
            if command.p[0] == 0:
                auto.pause()
            else:
                auto.resume()
            return Result.ACCEPTED
        if self._state.mode != GUIDED:
            return Result.DENIED
        if not guided.is_flying:
            return Result.FAILED
        target = guided.shown_target_m
        if command.p[0] == 0:
            guided.hold()
        elif target is not None:
            guided.fly(target, None)
        return Result.ACCEPTED

    def _condition_yaw(self, command: Command) -> Result:
        yaw = math.radians(_number(command.p[0]))
        if command.p[3] == 1:
            yaw = self._body.yaw_rad + math.copysign(1.0, command.p[2]) * yaw
        if self._to.guided.is_flying:
            self._body.turn_to(yaw % (2.0 * math.pi))
        return Result.ACCEPTED

    def _roi(self, command: Command) -> Result:
        """Turn to a region of interest: without a gimbal the nose turns (measured), until the next place to fly to."""
        x, y = command.p[4:6]
        if command.frame is not None:
            x, y = x / 1e7, y / 1e7
        if not (abs(x) <= 90.0 and abs(y) <= 180.0):
            return Result.DENIED
        if self._to.guided.is_flying:
            east, north = self._body.to_local(x, y)
            here = self._body.seen_m()
            self._body.turn_to(math.atan2(east - here[0], north - here[1]) % (2.0 * math.pi))
        return Result.ACCEPTED

    def _mission_start(self, command: Command) -> Result:
        first = int(_number(command.p[0]))
        if first and not self._to.auto.choose(first, restart=False):
            return Result.DENIED
        return _result(self._modes.start_mission())

    def _set_mission_current(self, command: Command) -> Result:
        """Choose the item of the mission; p2=1 begins a finished mission again."""
        done = self._to.auto.choose(int(_number(command.p[0])), restart=command.p[1] == 1)
        return Result.ACCEPTED if done else Result.DENIED

    def _land_start(self, _: Command) -> Result:
        # A mission with DO_LAND_START is not simulated, so there is never a landing sequence.
        self._outbox.text(MavSeverity.WARNING, "Unable to start landing sequence")
        return _result(self._modes.set_mode(AUTO_RTL))

    def _fence_enable(self, command: Command) -> Result:
        if command.p[0] not in (0, 1, 2):
            return Result.FAILED
        # The parameter FENCE_ENABLE keeps its value; SYS_STATUS and FENCE_STATUS show the state.
        self._to.fence.enabled = command.p[0] == 1
        return Result.ACCEPTED

    def _set_home(self, command: Command) -> Result:
        """Set home here (p1=1); other places are refused. It moves the zero of relative altitude, in flight too."""
        if command.p[0] != 1 or self._state.stage < Stage.HOME_SET:
            return Result.FAILED
        self._state.set_home()
        return Result.ACCEPTED

    def _message_name(self, msgid: float) -> str | None:
        return self._telemetry.name_of(int(_number(msgid)))

    def _set_message_interval(self, command: Command) -> Result:
        name = self._message_name(command.p[0])
        interval_us, now_us = command.p[1], self._clock.now_us
        if name is None or not math.isfinite(interval_us):
            return Result.DENIED
        if interval_us == 0:
            self._streams.ask(name, 1000 if name == "HEARTBEAT" else None, now_us)
        elif interval_us < 0:
            self._streams.ask(name, OFF, now_us)
        else:
            interval_ms = int(interval_us) // 1000
            # Intervals are kept as whole milliseconds; 400 Hz is DENIED.
            if interval_ms < MIN_INTERVAL_MS:
                return Result.DENIED
            self._streams.ask(name, interval_ms, now_us)
        return Result.ACCEPTED

    def _get_message_interval(self, command: Command) -> Result:
        self._telemetry.report_interval(int(_number(command.p[0])))
        return Result.ACCEPTED

    def _request_message(self, command: Command) -> Result:
        msgid = int(_number(command.p[0]))
        if msgid == _AVAILABLE_MODES:
            self._send_available_mode(int(_number(command.p[1])))
            return Result.ACCEPTED
        name = self._message_name(command.p[0])
        reported = name is not None and self._telemetry.report(name)
        # The ACK is no proof of a reply: for some messages it comes although nothing follows.
        return Result.ACCEPTED if msgid in _NO_REPLY else _result(reported)

    def _send_available_mode(self, index: int) -> None:
        """Send one mode. Unlike in the MAVLink standard 0 is the first one only; beyond the end nothing is sent."""
        number = max(index, 1)
        if number > len(AVAILABLE):
            return
        mode = AVAILABLE[number - 1]
        name = MODE_NAMES[mode].encode("ascii") + b"\0" + _JUNK
        self._outbox.send(
            "AVAILABLE_MODES", number_modes=len(AVAILABLE), mode_index=number, custom_mode=mode, mode_name=name[:35]
        )

    def _run_prearm_checks(self, _: Command) -> Result:
        if self._state.armed:
            return Result.FAILED
        self._arming.report_problems()
        return Result.ACCEPTED

    def _reboot(self, command: Command) -> Result:
        if command.p[0] not in (1, 3):
            return Result.UNSUPPORTED
        return _result(not self._state.armed)

    def _reset_battery(self, command: Command) -> Result:
        self._to.battery.reset(min(max(_number(command.p[1]), 0.0), 100.0) / 100.0)
        self._state.failsafes.discard("battery")
        return Result.ACCEPTED


def _result(done: bool) -> Result:
    return Result.ACCEPTED if done else Result.FAILED


def _number(value: float) -> float:
    """Return a value, with 0 for NaN and infinity."""
    return value if math.isfinite(value) else 0.0
