"""Rules for messages of other stations: the allow-list, and what is checked of each message on it.

Whether the vehicle is heard, ours and may be commanded just now is checked by the uplink. Numbers: MAV_CMD of
common.xml.
"""

import math
from collections.abc import Callable

from tui_gcs.core.firmware.foreign_command_policy import MISSION_MODES, OTHER_MODES, foreign_command_policy, stop_word
from tui_gcs.core.forward.foreign_missions import ForeignCommand, read_command
from tui_gcs.core.forward.mission_rules import (
    mission_continue,
    mission_item,
    mission_part,
    mission_read,
    mission_start,
    mission_step,
    mission_write,
    require_resumable,
)
from tui_gcs.core.forward.parameter_rules import parameter
from tui_gcs.core.forward.request_checks import (
    ForeignRefusal,
    ForeignRequest,
    Ruling,
    command_height_m,
    here_m,
    means_here,
    place_m,
    require_apart,
    require_band,
    require_inside,
    require_integer,
    require_speed,
    require_way,
    start,
    stop,
)
from tui_gcs.core.mavlink.enum_names import FLAG_ARMED
from tui_gcs.core.mavlink.mode_names import mode_name

KEYS = frozenset({7, 256, 299})
"""AUTH_KEY, SETUP_SIGNING, WIFI_CONFIG_AP: frames that carry keys go neither in nor out."""
STEERING = frozenset(
    {
        "MANUAL_CONTROL",
        "RC_CHANNELS_OVERRIDE",
        "SET_ACTUATOR_CONTROL_TARGET",
        "SET_ATTITUDE_TARGET",
        "SET_POSITION_TARGET_GLOBAL_INT",
        "SET_POSITION_TARGET_LOCAL_NED",
    }
)
"""Set-points and sticks: two stations that steer one vehicle would tear it to and fro."""
REPOSITION = 192
MIN_INTERVAL_US, MAX_INTERVAL_US = 20_000, 10_000_000
"""Message intervals that other stations may request."""
NEEDED_MESSAGES, MAX_NEEDED_INTERVAL_US = frozenset({0, 33}), 1_000_000
"""HEARTBEAT and GLOBAL_POSITION_INT, by which this station judges and predicts, and their longest interval."""
CUSTOM_MODE = 1
"""MAV_MODE_FLAG_CUSTOM_MODE_ENABLED."""


def judge(request: ForeignRequest) -> Ruling:
    """Whether one message of another station may go to its vehicle. Never raises."""
    rule = MESSAGES.get(request.name)
    if rule is None:
        return Ruling(why_not="not on the list of what other stations may send")
    try:
        return rule(request)
    except ForeignRefusal as refused:
        return Ruling(why_not=str(refused), mission_result=refused.mission_result)


def may_stop(request: ForeignRequest) -> bool:
    """Whether it can be a hold, a landing, a return or a disarming, which must not wait."""
    if request.name in ("COMMAND_LONG", "COMMAND_INT"):
        command = read_command(request.message)
        return command.command in _MAY_STOP or _is_pause(command)
    return request.name == "SET_MODE"


def _unchecked(what: str) -> Callable[[ForeignRequest], Ruling]:
    return lambda request: Ruling(what)


def _command(request: ForeignRequest) -> Ruling:
    command = read_command(request.message)
    if command.command in READS:
        return Ruling("request")
    if command.command in STOPS:
        return stop(STOPS[command.command])
    if command.command in PLAIN:
        return Ruling(PLAIN[command.command])
    if command.command in CHECKED:
        return CHECKED[command.command](request, command)
    why = DANGEROUS.get(command.command, "not on the list of what other stations may ask")
    raise ForeignRefusal(f"command {command.command}: {why}")


def _arm(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    if command.param(2) != 0:  # 21196 forces, 2989 forces ArduPilot to arm
        raise ForeignRefusal("a forced arming or disarming")
    if command.param(1) not in (0, 1):
        raise ForeignRefusal(f"neither arm (1) nor disarm (0): {command.param(1):g}")
    return start("arm")._replace(arms=True) if command.param(1) else stop("disarm")


def _set_mode(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    # ArduCopter takes DO_SET_MODE with 262 as 6, RTL (docs/autopilots.md "Dangerous things first").
    base = require_integer(command.param(1), 255)
    main = require_integer(command.param(2), 255)  # ArduPilot cuts off what is above
    if foreign_command_policy(request.vehicle).two_part_modes:
        return _mode(request, base, main << 16 | require_integer(command.param(3), 255) << 24)
    return _mode(request, base, main)


def _mode(request: ForeignRequest, base: int, custom: int) -> Ruling:
    """The ruling on a mode."""
    vehicle = request.vehicle
    if not base & CUSTOM_MODE:
        raise ForeignRefusal("a mode without its number (base mode only)")
    # SET_MODE's base mode has a bit that arms, which no rule for arming would see.
    if base & FLAG_ARMED and not vehicle.telemetry.armed:
        raise ForeignRefusal("a mode that arms")
    name = mode_name(vehicle.autopilot, vehicle.type, custom)
    if word := stop_word(vehicle, name):
        return stop(word)
    # The mode alone makes a vehicle fly its mission: from where it is to the item that comes next.
    if name in MISSION_MODES:
        require_resumable(request)
    if name in OTHER_MODES:
        return Ruling(f"mode {name}")
    raise ForeignRefusal(f"mode {name}: only modes that need no pilot's sticks and no set-points")


def _standard_mode(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    rulings = {5: stop("return"), 6: Ruling("mode MISSION"), 7: stop("land")}  # MAV_STANDARD_MODE
    if command.param(1) not in rulings:
        raise ForeignRefusal(f"standard mode {command.param(1):g}: only return (5), mission (6), land (7)")
    if command.param(1) == 6:
        require_resumable(request)
    return rulings[int(command.param(1))]


def _take_off(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    here = here_m(request.vehicle)
    require_inside(request, here)
    if not means_here(request, command):
        there = place_m(request, command) or here
        require_inside(request, there)
        require_way(request, there)
    height_m = command_height_m(request, command)
    if not (math.isnan(height_m) and foreign_command_policy(request.vehicle).own_take_off_height):
        require_band(request, height_m, climbing=True)
    return start("take-off")


def _reposition(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    if _is_pause(command):
        return stop("hold")
    require_speed(request, command.param(1))
    there = place_m(request, command) or here_m(request.vehicle)
    require_inside(request, there, max(0.0, command.param(3)))  # which a plane circles at
    require_way(request, there)
    height_m = command_height_m(request, command)
    if math.isnan(height_m):
        height_m = request.vehicle.telemetry.position_m[2]
    require_band(request, height_m)
    require_apart(request, (*there, height_m))
    return Ruling("reposition")


def _is_pause(command: ForeignCommand) -> bool:
    """Whether it leads to where the vehicle is, at its height: stations pause a PX4 like that."""
    return command.command == REPOSITION and command.degrees() is None and math.isnan(command.param(7))


def _pause(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    if command.param(1) not in (0, 1):
        raise ForeignRefusal(f"neither pause (0) nor continue (1): {command.param(1):g}")
    return mission_continue(request) if command.param(1) else stop("hold")


def _speed(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    require_speed(request, command.param(2))
    return Ruling("speed")


def _interval(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    msgid, interval_us = require_integer(command.param(1), 0xFFFFFF), command.param(2)
    # 0 means "as usual", which may be never.
    if msgid in NEEDED_MESSAGES and not MIN_INTERVAL_US <= interval_us <= MAX_NEEDED_INTERVAL_US:
        raise ForeignRefusal(
            f"an interval of {interval_us:g} µs: this station needs message {msgid} at least once a second"
        )
    if interval_us != 0 and not MIN_INTERVAL_US <= interval_us <= MAX_INTERVAL_US:  # 0: as usual
        raise ForeignRefusal(f"an interval of {interval_us:g} µs would stop messages or fill the link")
    return Ruling("message rates")


def _reboot(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    # Other values shut the autopilot down or leave it in its bootloader, and reboot cameras and gimbals.
    if command.param(1) != 1 or any(command.params[1:]):
        raise ForeignRefusal("only a plain restart of the autopilot (param 1 = 1, all others 0)")
    _require_disarmed(request)
    return Ruling("reboot")


def _fence(request: ForeignRequest, command: ForeignCommand) -> Ruling:
    if command.param(1) != 1:
        raise ForeignRefusal("would switch the fence off")
    return Ruling("fence on")


def _require_disarmed(request: ForeignRequest) -> None:
    if request.vehicle.telemetry.armed:
        raise ForeignRefusal("it is armed")


READS = frozenset({401, 410, 510, 512, 519, 520, 521, 522, 525, 527, 528, 2504, 2505, 5200, 42428})
"""Requests for information: pre-arm checks, home, messages, versions, cameras, banner."""
STOPS = {20: "return", 21: "land"}
"""MAV_CMD that are stops, and the operator's words for them."""
PLAIN = {
    115: "yaw",
    195: "region of interest",
    197: "region of interest",
    201: "region of interest",
    203: "camera",
    205: "gimbal",
    530: "camera",
    531: "camera",
    532: "camera",
    1000: "gimbal",
    1001: "gimbal",
    2000: "camera",
    2001: "camera",
    2500: "camera",
    2501: "camera",
}
"""MAV_CMD and the operator's words, where nothing more is to be checked."""
CHECKED: dict[int, Callable[[ForeignRequest, ForeignCommand], Ruling]] = {
    22: _take_off,
    84: _take_off,
    176: _set_mode,
    178: _speed,
    REPOSITION: _reposition,
    193: _pause,
    207: _fence,
    224: lambda request, command: mission_step(request, command.param(1)),
    246: _reboot,
    262: _standard_mode,
    300: lambda request, command: mission_start(request, command.param(1)),
    400: _arm,
    511: _interval,
}
"""MAV_CMD and its check."""
DANGEROUS = {
    179: "would move home, the zero of all heights",
    185: "flight termination",
    208: "releases the parachute",
    209: "motor test",
    241: "calibration, which may run motors",
    245: "would overwrite stored parameters",
    310: "actuator test",
    420: "failure injection",
}
"""Why a command is refused, where more than "not on the list" can be stated."""
_MAY_STOP = frozenset({20, 21, 176, 193, 262, 400})


def _legacy_mode(request: ForeignRequest) -> Ruling:
    return _mode(request, request.fields["base_mode"], request.fields["custom_mode"])


def _cancel(request: ForeignRequest) -> Ruling:
    # Cancelling a hold of this station's operator would be the one way to keep a vehicle from stopping.
    if request.fields["command"] in _MAY_STOP:
        raise ForeignRefusal("would cancel a stop")
    return Ruling("cancel")


def _data_stream(request: ForeignRequest) -> Ruling:
    rate_hz = request.fields["req_message_rate"] if request.fields["start_stop"] == 1 else 0
    if not 0 < rate_hz <= 1e6 / MIN_INTERVAL_US:
        raise ForeignRefusal(f"{rate_hz} Hz would stop messages or fill the link")
    return Ruling("message rates")


def _log_read(request: ForeignRequest) -> Ruling:
    _require_disarmed(request)
    return Ruling("log read")


def _no_files(request: ForeignRequest) -> Ruling:
    raise ForeignRefusal("an autopilot has one file session, and it is this station's")


MESSAGES: dict[str, Callable[[ForeignRequest], Ruling]] = {
    "COMMAND_CANCEL": _cancel,
    "COMMAND_INT": _command,
    "COMMAND_LONG": _command,
    "FILE_TRANSFER_PROTOCOL": _no_files,
    "LOG_REQUEST_DATA": _log_read,
    "LOG_REQUEST_END": _unchecked("log read"),
    "LOG_REQUEST_LIST": _log_read,
    "MISSION_ACK": mission_read,
    "MISSION_CLEAR_ALL": mission_write,
    "MISSION_COUNT": mission_write,
    "MISSION_ITEM": mission_item,
    "MISSION_ITEM_INT": mission_item,
    "MISSION_REQUEST": mission_read,
    "MISSION_REQUEST_INT": mission_read,
    "MISSION_REQUEST_LIST": mission_read,
    "MISSION_REQUEST_PARTIAL_LIST": mission_read,
    "MISSION_SET_CURRENT": lambda request: mission_step(request, request.fields["seq"]),
    "MISSION_WRITE_PARTIAL_LIST": mission_part,
    "PARAM_REQUEST_LIST": _unchecked("parameter read"),
    "PARAM_REQUEST_READ": _unchecked("parameter read"),
    "PARAM_SET": parameter,
    "REQUEST_DATA_STREAM": _data_stream,
    "SET_MODE": _legacy_mode,
}
"""All that is ever passed on, by message name."""
