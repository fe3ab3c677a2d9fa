"""PX4's COMMAND_LONG / COMMAND_INT: what is done, and how it is acknowledged."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from sitl.common.autopilot import Command
from sitl.common.states import Result, Severity, Stage
from sitl.links.wire import LAYOUTS
from sitl.px4.modes import HOLD, LAND, MISSION, OFFERED, ORBIT, RTL, TAKEOFF
from sitl.px4.navigator import Circle, Point
from sitl.px4.stream_rates import BACK_TO_HZ
from sitl.services import payload

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

COMMANDER_US = 5_000
"""How long the commander thinks before its answer (measured 2 to 10 ms)."""
FORCE = 21196
ONLY_CHANGE_MODE = 1
"""The one value of DO_REPOSITION's flags that is taken."""
NO_PLACE = 2**31 - 1
"""x or y of a COMMAND_INT: as it is."""
MAX_ORBIT_M_S = 10.0
DO_SET_MODE = 176
_AVAILABLE_MODES, _REQUEST_MESSAGE = 435, 512


def execute(ap: "Px4", command: Command, system: int, component: int) -> None:
    """Do it and acknowledge it to `system`/`component`.

    DO_SET_MODE is acknowledged twice: at once by who received it, always ACCEPTED, then by who decides.
    """
    if ap.stage < Stage.READY:
        return
    if command.number == DO_SET_MODE:
        ap.acknowledge(command.number, Result.ACCEPTED, system, component)
        ap.deferred = []
        result = _do_set_mode(ap, command)
        ap.answer_later(command.number, result, system, component, COMMANDER_US)
        return
    handler = HANDLERS.get(command.number)
    if command.number == _REQUEST_MESSAGE:  # the message comes before the acknowledgement
        ap.acknowledge(command.number, _request_message(ap, command), system, component)
        return
    ap.deferred = []
    done = handler(ap, command) if handler is not None else payload.px4_order(ap, command, system, component)
    if done is None and payload.px4_is_silent(command):
        ap.deferred = None
        return
    kept, ap.deferred = ap.deferred, None
    ap.acknowledge(command.number, Result.UNSUPPORTED if done is None else done, system, component)
    ap.deferred = kept
    ap.flush()


def _int(value: float) -> int:
    """NaN and infinity count as 0."""
    return int(value) if math.isfinite(value) else 0


def _do_set_mode(ap: "Px4", command: Command) -> Result:
    if not _int(command.p[0]) & 1:
        return Result.ACCEPTED  # and nothing happens
    return ap.request_mode(_int(command.p[1]) & 0xFF, _int(command.p[2]) & 0xFF)


def _arm_disarm(ap: "Px4", command: Command) -> Result:
    """Forced arming skips nothing; forced disarming does."""
    if command.p[0] == 1:
        return ap.arm()
    if command.p[0] != 0:
        return Result.UNSUPPORTED
    if not ap.armed:
        return Result.ACCEPTED
    if not ap.landed and command.p[1] != FORCE:
        ap.tell("Disarming denied: not landed", "commander_disarm_denied_not_landed", severity=Severity.CRITICAL)
        return Result.TEMPORARILY_REJECTED
    ap.disarm(4, "external command")
    return Result.ACCEPTED


def _place(ap: "Px4", command: Command) -> Point | None:
    """The place of p5 to p7: latitude, longitude, AMSL whatever the frame says; None for impossible ones."""
    x, y, z = ap.vehicles.seen(ap.index)
    latitude, longitude, amsl_m = command.p[4:]
    if command.frame is not None:
        latitude = math.nan if latitude == NO_PLACE else latitude / 1e7
        longitude = math.nan if longitude == NO_PLACE else longitude / 1e7
    if math.isfinite(latitude) and math.isfinite(longitude):
        if abs(latitude) > 90.0 or abs(longitude) > 180.0:
            return None
        x, y = ap.vehicles.to_local(ap.index, latitude, longitude)
    return x, y, amsl_m - ap.spec.ground_amsl_m if math.isfinite(amsl_m) else z


def _take_off(ap: "Px4", command: Command) -> Result:
    """The altitude is AMSL; NaN is the default height. In flight, too."""
    if not ap.can_run(TAKEOFF):
        return Result.TEMPORARILY_REJECTED
    amsl_m = command.p[6]
    ap.flight.takeoff_m = amsl_m - ap.spec.ground_amsl_m if math.isfinite(amsl_m) else None
    return ap.set_mode(TAKEOFF)


def _mode_command(mode: int, text: str, event: str) -> "Callable[[Px4, Command], Result]":
    """The same by DO_SET_MODE is done without a word."""

    def change(ap: "Px4", _: Command) -> Result:
        if ap.can_run(mode):
            ap.tell(text, event)
        return ap.set_mode(mode)

    return change


def _reposition(ap: "Px4", command: Command) -> Result:
    """The commander says yes; whether it flies there is the navigator's business."""
    if command.p[1] != ONLY_CHANGE_MODE:
        return Result.UNSUPPORTED
    place = _place(ap, command)
    if place is None:
        return Result.DENIED
    if not ap.armed:
        return Result.ACCEPTED
    result = ap.set_mode(HOLD)
    if result != Result.ACCEPTED or ap.landed:
        return result
    if not ap.inside_fence(place):
        ap.tell(
            "Reposition is outside geofence",
            "navigator_reposition_outside_geofence",
            severity=Severity.CRITICAL,
            levels=0x63,
        )
        return Result.ACCEPTED
    if command.p[0] > 0.0:
        ap.flight.cruise_m_s = command.p[0]
    yaw = command.p[3]
    ap.flight.go(place, yaw_rad=yaw if math.isfinite(yaw) else None)
    return Result.ACCEPTED


def _change_altitude(ap: "Px4", command: Command) -> Result:
    """p1 AMSL."""
    if not ap.armed or ap.landed or not math.isfinite(command.p[0]):
        return Result.ACCEPTED
    x, y, _ = ap.vehicles.seen(ap.index)
    result = ap.set_mode(HOLD)
    if result == Result.ACCEPTED:
        ap.flight.go((x, y, command.p[0] - ap.spec.ground_amsl_m))
    return result


def _change_speed(ap: "Px4", command: Command) -> Result:
    """p2 in m/s; -1 is the default."""
    ap.flight.change_speed(command.p[1])
    return Result.ACCEPTED


def _orbit(ap: "Px4", command: Command) -> Result:
    place = _place(ap, command)
    if place is None:
        return Result.DENIED
    radius_m = command.p[0] if math.isfinite(command.p[0]) and command.p[0] else 20.0
    speed_m_s = min(abs(command.p[1]), MAX_ORBIT_M_S) if math.isfinite(command.p[1]) else 1.0
    result = ap.set_mode(ORBIT)
    if result == Result.ACCEPTED:
        ap.flight.circle = Circle(*place, radius_m, speed_m_s)
    return result


def _mission_start(ap: "Px4", _: Command) -> Result:
    """Arms by itself."""
    if not ap.mission_ready:
        ap.tell(
            "Mission start denied! No valid mission",
            "commander_mission_start_denied_no_mission",
            severity=Severity.CRITICAL,
        )
        return Result.DENIED
    result = ap.set_mode(MISSION)
    return ap.arm(5) if result == Result.ACCEPTED else result


def _set_home(ap: "Px4", command: Command) -> Result:
    if command.p[0] != 1 or ap.stage < Stage.HOME_SET:
        return Result.DENIED
    ap.set_home()
    return Result.ACCEPTED


def _message_name(ap: "Px4", msgid: float) -> str | None:
    layout = LAYOUTS.get(_int(msgid))
    return layout.name if layout is not None and layout.name in ap.BUILDERS else None


def _set_message_interval(ap: "Px4", command: Command) -> Result:
    name, interval_us = _message_name(ap, command.p[0]), command.p[1]
    if name is None or not math.isfinite(interval_us):
        return Result.FAILED
    if interval_us < 0:
        ap.streams.ask(name, 0, ap.now_us)
    elif interval_us == 0:
        hz = BACK_TO_HZ.get(name, 0.0)
        ap.streams.ask(name, round(1000 / hz) if hz else ap.streams.default_ms(name), ap.now_us)
    else:
        ap.streams.ask(name, max(1, round(interval_us / 1000)), ap.now_us)
    return Result.ACCEPTED


def _get_message_interval(ap: "Px4", command: Command) -> Result:
    name = _message_name(ap, command.p[0])
    interval_ms = 0 if name is None else ap.streams.interval_ms(name)
    interval_us = 0 if name is None else interval_ms * 1000 if interval_ms else -1
    ap.send("MESSAGE_INTERVAL", message_id=_int(command.p[0]) & 0xFFFF, interval_us=interval_us)
    return Result.ACCEPTED


def _request_message(ap: "Px4", command: Command) -> Result:
    if _int(command.p[0]) == _AVAILABLE_MODES:
        return _available_modes(ap, _int(command.p[1]))
    name = _message_name(ap, command.p[0])
    return Result.ACCEPTED if name is not None and ap.report(name) else Result.DENIED


def _available_modes(ap: "Px4", index: int) -> Result:
    """0: all of them. Those with a standard mode have no name."""
    if not 0 <= index <= len(OFFERED):
        return Result.DENIED
    for number, mode in enumerate(OFFERED, 1):
        if index in (0, number):
            ap.send(
                "AVAILABLE_MODES",
                number_modes=len(OFFERED),
                mode_index=number,
                standard_mode=mode.standard,
                custom_mode=mode.custom,
                properties=mode.properties,
                mode_name=mode.name.encode("ascii"),
            )
    return Result.ACCEPTED


def _reboot(_: "Px4", command: Command) -> Result:
    """Not in a simulation; 0 is to do nothing."""
    return Result.ACCEPTED if command.p[0] == 0 else Result.DENIED


def _roi(_: "Px4", __: Command) -> Result:
    """Accepted, on the ground, too; without a gimbal nothing moves (measured: its nose stayed where it was)."""
    return Result.ACCEPTED


def _legacy_request(name: str) -> "Callable[[Px4, Command], Result]":
    """Commands from before REQUEST_MESSAGE."""
    return lambda ap, _: Result.ACCEPTED if ap.report(name) else Result.DENIED


HANDLERS: "dict[int, Callable[[Px4, Command], Result]]" = {
    20: _mode_command(RTL, "Returning to launch", "commander_rtl"),
    21: _mode_command(LAND, "Landing at current position", "commander_landing_current_pos"),
    22: _take_off,
    34: _orbit,
    178: _change_speed,
    179: _set_home,
    186: _change_altitude,
    192: _reposition,
    195: _roi,
    196: _roi,
    197: _roi,
    201: _roi,
    246: _reboot,
    300: _mission_start,
    400: _arm_disarm,
    410: _legacy_request("HOME_POSITION"),
    510: _get_message_interval,
    511: _set_message_interval,
    _REQUEST_MESSAGE: _request_message,
    519: _legacy_request("PROTOCOL_VERSION"),
    520: _legacy_request("AUTOPILOT_VERSION"),
}
"""By MAV_CMD; DO_SET_MODE goes its own way. CONDITION_YAW, DO_PAUSE_CONTINUE and DO_SET_MISSION_CURRENT are missing."""
