"""A vehicle's MAVLink endpoint: datagrams in, to the autopilot; everything else is ignored."""

from collections.abc import Callable
from typing import Any

from sitl.ardupilot import (
    calibration as calibration_ardupilot,
)
from sitl.ardupilot import (
    ftp as ftp_ardupilot,
)
from sitl.ardupilot import mission_protocol as plan_ardupilot
from sitl.ardupilot import (
    remote_id,
    traffic,
)
from sitl.common.autopilot import Autopilot, Command
from sitl.common.states import Severity, Stage
from sitl.links.wire import Received, cut
from sitl.px4 import calibration as calibration_px4
from sitl.px4 import ftp as ftp_px4
from sitl.px4 import mission_protocol as plan_px4
from sitl.services import log_protocol, parameter_protocol, shell

AUTOPILOT_COMPONENT = 1


def receive(ap: Autopilot, datagram: bytes) -> None:
    """Handle all frames of one datagram; junk is skipped. Only PX4 looks at the target component."""
    handlers, px4 = _HANDLERS[ap.spec.autopilot], ap.spec.autopilot == "px4"
    for frame in cut(datagram):
        handler = handlers.get(frame.name)
        if handler is None or frame.fields.get("target_system", 0) not in (0, ap.spec.system_id):
            continue
        if px4 and frame.fields.get("target_component", 0) not in (0, AUTOPILOT_COMPONENT):
            continue
        if ap.signer.believes(frame.raw):
            handler(ap, frame)


def _heartbeat(ap: Autopilot, frame: Received) -> None:
    ap.hear_gcs(frame.system, frame.fields["type"])


def _command_long(ap: Autopilot, frame: Received) -> None:
    f = frame.fields
    p = (f["param1"], f["param2"], f["param3"], f["param4"], f["param5"], f["param6"], f["param7"])
    _execute(ap, Command(f["command"], p, None), frame)


def _command_int(ap: Autopilot, frame: Received) -> None:
    f = frame.fields
    p = (f["param1"], f["param2"], f["param3"], f["param4"], f["x"], f["y"], f["z"])
    _execute(ap, Command(f["command"], p, f["frame"]), frame)


def _execute(ap: Autopilot, command: Command, frame: Received) -> None:
    """Calibrations and motor tests are dialogues of their own; everything else is flight."""
    dialogue = _DIALOGUES[ap.spec.autopilot]
    if ap.stage < Stage.READY or not dialogue(ap, command, frame.system, frame.component):
        ap.execute(command, frame.system, frame.component)


def _set_mode(ap: Autopilot, frame: Received) -> None:
    ap.legacy_set_mode(frame.fields, frame.system, frame.component)


def _sticks(ap: Autopilot, frame: Received) -> None:
    target = frame.fields["target"]
    if target == ap.spec.system_id or (target == 0 and ap.spec.autopilot == "px4"):
        ap.hear_sticks(frame.system, frame.fields)


def _set_current(ap: Any, frame: Received) -> None:
    """ArduPilot: a number beyond the end is not answered."""
    ap.mission.jump(frame.fields["seq"], restart=False)


def _request_event(ap: Autopilot, frame: Received) -> None:
    ap.resend_events(frame.fields, frame.system, frame.component)


def _set_point(ap: Autopilot, frame: Received) -> None:
    ap.set_point(frame.name, frame.fields)


def _request_data_stream(ap: Autopilot, frame: Received) -> None:
    f = frame.fields
    ap.streams.ask_stream(f["req_stream_id"], f["req_message_rate"] if f["start_stop"] else 0, ap.now_us)


def _timesync(ap: Autopilot, frame: Received) -> None:
    if frame.fields["tc1"] == 0:
        ap.send("TIMESYNC", tc1=(ap.now_us - ap.power_on_us) * 1000, ts1=frame.fields["ts1"])


def _setup_signing(ap: Autopilot, frame: Received) -> None:
    """SETUP_SIGNING: never acknowledged; what is sent from now on shows it. PX4 takes it over USB only."""
    if ap.signer.px4:
        return
    if ap.armed:
        ap.text(Severity.WARNING, "ERROR: Won't setup signing when armed")
        return
    ap.signer.take(bytes(frame.fields["secret_key"]), frame.fields["initial_timestamp"])


Handlers = dict[str, Callable[[Any, Received], None]]
"""By message; the vehicle is of the personality whose table it is."""

_COMMON: Handlers = {
    "HEARTBEAT": _heartbeat,
    "COMMAND_LONG": _command_long,
    "COMMAND_INT": _command_int,
    "SET_MODE": _set_mode,
    "SET_POSITION_TARGET_GLOBAL_INT": _set_point,
    "SET_POSITION_TARGET_LOCAL_NED": _set_point,
    "MANUAL_CONTROL": _sticks,
    "REQUEST_EVENT": _request_event,
    "REQUEST_DATA_STREAM": _request_data_stream,
    "TIMESYNC": _timesync,
    "SETUP_SIGNING": _setup_signing,
}
_DIALOGUES: dict[str, Callable[[Any, Command, int, int], bool]] = {
    "ardupilot": calibration_ardupilot.execute,
    "px4": calibration_px4.execute,
}
_HANDLERS: dict[str, Handlers] = {
    "ardupilot": {
        **_COMMON,
        "ADSB_VEHICLE": traffic.heard,
        "COMMAND_ACK": calibration_ardupilot.heard_ack,
        "OPEN_DRONE_ID_BASIC_ID": remote_id.heard,
        "OPEN_DRONE_ID_SYSTEM": remote_id.heard,
        "OPEN_DRONE_ID_SYSTEM_UPDATE": remote_id.heard,
        "SERIAL_CONTROL": shell.ardupilot,
        "PARAM_REQUEST_READ": parameter_protocol.ardupilot_read,
        "PARAM_REQUEST_LIST": parameter_protocol.ardupilot_list,
        "PARAM_SET": parameter_protocol.ardupilot_set,
        "LOG_REQUEST_LIST": log_protocol.ardupilot_list,
        "LOG_REQUEST_DATA": log_protocol.ardupilot_data,
        "LOG_REQUEST_END": log_protocol.ardupilot_end,
        "LOG_ERASE": log_protocol.ardupilot_erase,
        "FILE_TRANSFER_PROTOCOL": ftp_ardupilot.handle,
        "MISSION_COUNT": plan_ardupilot.count,
        "MISSION_ITEM_INT": plan_ardupilot.item_int,
        "MISSION_ITEM": plan_ardupilot.item,
        "MISSION_REQUEST_LIST": plan_ardupilot.request_list,
        "MISSION_REQUEST_INT": plan_ardupilot.request_int,
        "MISSION_REQUEST": plan_ardupilot.request,
        "MISSION_CLEAR_ALL": plan_ardupilot.clear_all,
        "MISSION_SET_CURRENT": _set_current,
        "MISSION_WRITE_PARTIAL_LIST": plan_ardupilot.write_partial,
    },
    "px4": {
        **_COMMON,
        "SERIAL_CONTROL": shell.px4,
        "PARAM_REQUEST_READ": parameter_protocol.px4_read,
        "PARAM_REQUEST_LIST": parameter_protocol.px4_list,
        "PARAM_SET": parameter_protocol.px4_set,
        "LOG_REQUEST_LIST": log_protocol.px4_list,
        "LOG_REQUEST_DATA": log_protocol.px4_data,
        "LOG_REQUEST_END": log_protocol.px4_end,
        "LOG_ERASE": log_protocol.px4_erase,
        "FILE_TRANSFER_PROTOCOL": ftp_px4.handle,
        "MISSION_COUNT": plan_px4.count,
        "MISSION_ITEM_INT": plan_px4.item_int,
        "MISSION_ITEM": plan_px4.item,
        "MISSION_REQUEST_LIST": plan_px4.request_list,
        "MISSION_REQUEST_INT": plan_px4.request_int,
        "MISSION_REQUEST": plan_px4.request,
        "MISSION_CLEAR_ALL": plan_px4.clear_all,
        "MISSION_ACK": plan_px4.acknowledged,
        "MISSION_SET_CURRENT": plan_px4.set_current,
    },
}
