"""ArduCopter's COMMAND_LONG / COMMAND_INT: what is done, and with which result it is acknowledged."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from sitl.ardupilot import failsafes as ardupilot_failsafes
from sitl.ardupilot import guided
from sitl.common.autopilot import Command
from sitl.common.states import (
    AUTO,
    AUTO_RTL,
    GUIDED,
    LAND,
    LOITER,
    MODE_NAMES,
    OFFERED,
    RTL,
    Result,
    Severity,
    Stage,
)
from sitl.common.streams import MIN_INTERVAL_MS, OFF
from sitl.links.wire import LAYOUTS
from sitl.services import payload

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter

FORCE = 21196
CUSTOM_MODE_ENABLED = 1
MAX_SPEED_M_S = 10.0
CHANGE_MODE = 1
"""DO_REPOSITION flag: go to GUIDED from any mode."""


def execute(ap: "ArduCopter", command: Command, system: int, component: int) -> None:
    """Do it and acknowledge it to `system`/`component`.

    Texts follow the acknowledgement; before 'ArduPilot Ready' they come first (both measured).
    """
    handler = HANDLERS.get(command.number)
    ap.deferred = []
    result = handler(ap, command) if handler is not None else payload.ardupilot_order(ap, command, system, component)
    result = Result.UNSUPPORTED if result is None else result
    if ap.stage < Stage.READY:
        ap.flush()
    kept, ap.deferred = ap.deferred, None
    ap.acknowledge(command.number, result, system, component)
    ap.deferred = kept
    ap.flush()
    if command.number == _REBOOT and result == Result.ACCEPTED:
        ap.restart(ap.now_us)


def _result(done: bool) -> Result:
    return Result.ACCEPTED if done else Result.FAILED


def _do_set_mode(ap: "ArduCopter", command: Command) -> Result:
    if not int(_number(command.p[0])) & CUSTOM_MODE_ENABLED:
        return Result.DENIED
    return _result(ap.set_mode(int(_number(command.p[1])) & 0xFF))


def _number(value: float) -> float:
    """NaN and infinity count as 0."""
    return value if math.isfinite(value) else 0.0


def _arm_disarm(ap: "ArduCopter", command: Command) -> Result:
    forced = command.p[1] == FORCE
    if command.p[0] == 1:
        return _arm(ap, forced=forced)
    if command.p[0] != 0:
        return Result.UNSUPPORTED
    if ap.armed:
        if not ap.landed and not forced:
            return Result.FAILED
        ap.disarm()
    return Result.ACCEPTED


def _arm(ap: "ArduCopter", *, forced: bool) -> Result:
    if ap.armed:
        return Result.ACCEPTED
    problems = [] if forced and ap.stage >= Stage.READY else ap.arming_problems()
    for problem in problems:
        ap.text(Severity.CRITICAL, f"Arm: {problem}")
    if problems:
        return Result.FAILED
    ap.arm()
    return Result.ACCEPTED


def _take_off(ap: "ArduCopter", command: Command) -> Result:
    return _result(ap.take_off(command.p[6]))


def _mode_command(mode: int) -> "Callable[[ArduCopter, Command], Result]":
    return lambda ap, _: _result(ap.set_mode(mode))


def _reposition(ap: "ArduCopter", command: Command) -> Result:
    """Only as COMMAND_INT; speed and yaw are ignored."""
    if command.frame is None:
        return Result.UNSUPPORTED
    place = guided.place(ap, command.frame, int(command.p[4]), int(command.p[5]), command.p[6])
    if place is None or command.frame not in (0, 3, 6, 11):
        return Result.DENIED
    may_change_mode = int(_number(command.p[1])) & CHANGE_MODE
    if ap.mode != GUIDED and not (may_change_mode and ap.set_mode(GUIDED)):
        return Result.DENIED
    if not ardupilot_failsafes.allowed(ap, place):
        return Result.FAILED
    if guided.flies_guided(ap):
        guided.fly(ap, place, None)
    return Result.ACCEPTED


def _change_speed(ap: "ArduCopter", command: Command) -> Result:
    kind, speed_m_s = command.p[0], command.p[1]
    if not speed_m_s > 0.0:
        return Result.FAILED
    speeds = {0: ap.vehicles.speed_m_s, 1: ap.vehicles.speed_m_s, 2: ap.vehicles.climb_m_s, 3: ap.vehicles.descent_m_s}
    if kind in speeds:
        speeds[int(kind)][ap.index] = min(speed_m_s, MAX_SPEED_M_S)
    return Result.ACCEPTED


def _pause(ap: "ArduCopter", command: Command) -> Result:
    if ap.mode == AUTO and not ap.landed:
        if command.p[0] == 0:
            ap.mission.pause()
        else:
            ap.mission.go_on()
        return Result.ACCEPTED
    if ap.mode != GUIDED:
        return Result.DENIED
    if not guided.flies_guided(ap):
        return Result.FAILED
    target = ap.shown_target_m
    if command.p[0] == 0:
        ap.hold()
    elif target is not None:
        guided.fly(ap, target, None)
    return Result.ACCEPTED


def _condition_yaw(ap: "ArduCopter", command: Command) -> Result:
    yaw = math.radians(_number(command.p[0]))
    if command.p[3] == 1:
        yaw = float(ap.vehicles.yaw_rad[ap.index]) + math.copysign(1.0, command.p[2]) * yaw
    if guided.flies_guided(ap):
        ap.vehicles.yaw_target_rad[ap.index] = yaw % (2.0 * math.pi)
    return Result.ACCEPTED


def _roi(ap: "ArduCopter", command: Command) -> Result:
    """Measured: without a gimbal the nose turns there. The next place to fly to ends it."""
    x, y = command.p[4:6]
    if command.frame is not None:
        x, y = x / 1e7, y / 1e7
    if not (abs(x) <= 90.0 and abs(y) <= 180.0):
        return Result.DENIED
    if guided.flies_guided(ap):
        east, north = ap.vehicles.to_local(ap.index, x, y)
        here = ap.vehicles.seen(ap.index)
        ap.vehicles.yaw_target_rad[ap.index] = math.atan2(east - here[0], north - here[1]) % (2.0 * math.pi)
    return Result.ACCEPTED


def _no_roi(ap: "ArduCopter", _: Command) -> Result:
    """The nose stays where it points (measured)."""
    return Result.ACCEPTED


def _mission_start(ap: "ArduCopter", command: Command) -> Result:
    first = int(_number(command.p[0]))
    if first and not ap.mission.jump(first, restart=False):
        return Result.DENIED
    return _result(ap.start_mission())


def _set_mission_current(ap: "ArduCopter", command: Command) -> Result:
    """p2=1 begins a finished mission anew."""
    seq = int(_number(command.p[0]))
    done = ap.mission.jump(seq, restart=command.p[1] == 1)
    return Result.ACCEPTED if done else Result.DENIED


def _land_start(ap: "ArduCopter", _: Command) -> Result:
    ap.text(Severity.WARNING, "Unable to start landing sequence")
    return _result(ap.set_mode(AUTO_RTL))


def _fence_enable(ap: "ArduCopter", command: Command) -> Result:
    """The parameter does not show it."""
    if command.p[0] not in (0, 1, 2):
        return Result.FAILED
    ap.fence_enabled = command.p[0] == 1
    return Result.ACCEPTED


def _set_home(ap: "ArduCopter", command: Command) -> Result:
    """Here only: p1=1. It moves the zero of relative altitude, in flight too."""
    if command.p[0] != 1 or ap.stage < Stage.HOME_SET:
        return Result.FAILED
    ap.set_home()
    return Result.ACCEPTED


def _message_name(ap: "ArduCopter", msgid: float) -> str | None:
    layout = LAYOUTS.get(int(_number(msgid)))
    return layout.name if layout is not None and layout.name in ap.BUILDERS else None


def _set_message_interval(ap: "ArduCopter", command: Command) -> Result:
    name = _message_name(ap, command.p[0])
    interval_us = command.p[1]
    if name is None or not math.isfinite(interval_us):
        return Result.DENIED
    if interval_us == 0:
        if name == "HEARTBEAT":
            ap.streams.ask(name, 1000, ap.now_us)
        else:
            ap.streams.ask(name, None, ap.now_us)
    elif interval_us < 0:
        ap.streams.ask(name, OFF, ap.now_us)
    else:
        interval_ms = int(interval_us) // 1000
        if interval_ms < MIN_INTERVAL_MS:
            return Result.DENIED
        ap.streams.ask(name, interval_ms, ap.now_us)
    return Result.ACCEPTED


def _get_message_interval(ap: "ArduCopter", command: Command) -> Result:
    name = _message_name(ap, command.p[0])
    interval_ms = 0 if name is None else ap.streams.interval_ms(name)
    interval_us = 0 if name is None else interval_ms * 1000 if interval_ms else -1
    ap.send("MESSAGE_INTERVAL", message_id=int(_number(command.p[0])) & 0xFFFF, interval_us=interval_us)
    return Result.ACCEPTED


def _request_message(ap: "ArduCopter", command: Command) -> Result:
    msgid = int(_number(command.p[0]))
    if msgid == _AVAILABLE_MODES:
        _available_mode(ap, int(_number(command.p[1])))
        return Result.ACCEPTED
    if msgid in _NO_REPLY:
        name = _message_name(ap, msgid)
        if name is not None:
            ap.report(name)
        return Result.ACCEPTED
    name = _message_name(ap, command.p[0])
    return _result(name is not None and ap.report(name))


def _available_mode(ap: "ArduCopter", index: int) -> None:
    """One at a time; 0 is the first only, and beyond the end comes nothing. Junk follows the end of a name."""
    number = max(index, 1)
    if number > len(OFFERED):
        return
    mode = OFFERED[number - 1]
    name = MODE_NAMES[mode].encode("ascii") + b"\0" + _JUNK
    ap.send("AVAILABLE_MODES", number_modes=len(OFFERED), mode_index=number, custom_mode=mode, mode_name=name[:35])


def _run_prearm_checks(ap: "ArduCopter", _: Command) -> Result:
    if ap.armed:
        return Result.FAILED
    ap.say_prearm()
    return Result.ACCEPTED


def _reboot(ap: "ArduCopter", command: Command) -> Result:
    if command.p[0] not in (1, 3):
        return Result.UNSUPPORTED
    return _result(not ap.armed)


def _reset_battery(ap: "ArduCopter", command: Command) -> Result:
    ap.consumed_mah = ap.params["BATT_CAPACITY"] * (1.0 - min(max(_number(command.p[1]), 0.0), 100.0) / 100.0)
    ap.failsafes.discard("battery")
    ap.battery_level, ap.battery_low_us = 0, None
    return Result.ACCEPTED


_REBOOT = 246
_AVAILABLE_MODES = 435
_NO_REPLY = frozenset({132, 136, 162, 226, 259, 260, 264, 437})
"""REQUEST_MESSAGE is acknowledged, but there may be nothing to send."""
_JUNK = b"Failed to pause\0Failed to resume\0%s: manual control"
"""What lies in memory behind the name of a mode is sent, too."""
HANDLERS: "dict[int, Callable[[ArduCopter, Command], Result]]" = {
    17: _mode_command(LOITER),
    20: _mode_command(RTL),
    21: _mode_command(LAND),
    22: _take_off,
    115: _condition_yaw,
    176: _do_set_mode,
    178: _change_speed,
    179: _set_home,
    192: _reposition,
    189: _land_start,
    193: _pause,
    195: _roi,
    197: _no_roi,
    201: _roi,
    207: _fence_enable,
    224: _set_mission_current,
    _REBOOT: _reboot,
    300: _mission_start,
    400: _arm_disarm,
    401: _run_prearm_checks,
    510: _get_message_interval,
    511: _set_message_interval,
    512: _request_message,
    42651: _reset_battery,
}
