"""SERIAL_CONTROL: PX4's shell, and what ArduPilot's serial ports answer."""

import re
from typing import TYPE_CHECKING

from sitl.common.autopilot import Autopilot
from sitl.common.parameters import REAL32
from sitl.common.tasks import Task
from sitl.links.wire import Received

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

REPLY, RESPOND, EXCLUSIVE = 1, 2, 4
CHUNK_BYTES = 70
CHUNK_US = 4_000
SHELL_DEVICE = 10
GPS1_DEVICE, SERIAL0_DEVICE = 2, 100
MAX_LINE = 256
MAX_OUTPUT = 65_536

_PROMPT = "pxh> "
_OUTPUT = "shell output"
_NAMES = """actuator_test airship_att_control airspeed_selector attitude_estimator_q battery_simulator bsondump
camera_feedback camera_trigger commander control_allocator dataman dyn ekf2 failure fake_gps fake_imu
fake_magnetometer flight_mode_manager gimbal gps gyro_calibration hello land_detector listener load_mon logger
manual_control mavlink mc_att_control mc_pos_control mc_rate_control navigator param perf pwm_out_sim rc_update
sensors simulator_sih system_time tune_control uorb ver work_queue"""
_COMMANDS = frozenset(_NAMES.split())
_VERSION = """HW arch: PX4_SITL
PX4 git-hash: 9e479a38f66825ebf3d39003eb1f6fa0cbd65b1e
PX4 version: 1.17.0 40 (17891392)
PX4 git-branch: master
OS: Linux
Build variant: default
Toolchain: GNU GCC, 12.2.0
"""
_NAV_SAT = bytes.fromhex("b56201021c00")
"""How u-blox messages begin: what a look at the GPS port shows."""


# PX4


def px4(ap: "Px4", frame: Received) -> None:
    """The shell, device 10. Without RESPOND nothing comes back and it is closed."""
    f = frame.fields
    if f["device"] != SHELL_DEVICE:
        return
    if not f["flags"] & RESPOND:
        ap.stores.shell_line = ""
        ap.tasks.stop(_OUTPUT)
        ap.stores.shell_output = b""
        return
    typed = bytes(f["data"][: min(f["count"], CHUNK_BYTES)]).decode("ascii", "replace")
    line = ap.stores.shell_line + typed
    *whole, rest = line.split("\n")
    ap.stores.shell_line = rest[:MAX_LINE]
    output = "".join(f"{each}\n{_run(ap, each.strip())}{_PROMPT}" for each in whole)
    if not output:
        return
    waiting = ap.stores.shell_output
    ap.stores.shell_output = (waiting + output.encode("ascii", "replace"))[:MAX_OUTPUT]
    if not waiting:
        ap.tasks.start(_OUTPUT, _send(ap), ap.now_us)


def _send(ap: "Px4") -> Task:
    """Pieces of 70 bytes, 4 ms apart."""
    yield CHUNK_US
    while ap.stores.shell_output:
        chunk, ap.stores.shell_output = ap.stores.shell_output[:CHUNK_BYTES], ap.stores.shell_output[CHUNK_BYTES:]
        _reply(ap, SHELL_DEVICE, chunk)
        yield CHUNK_US


def _reply(ap: Autopilot, device: int, data: bytes) -> None:
    ap.send("SERIAL_CONTROL", device=device, flags=REPLY, count=len(data), data=data.ljust(CHUNK_BYTES, b"\0"))


def _run(ap: "Px4", line: str) -> str:
    name, _, rest = line.partition(" ")
    if not name:
        return ""
    if name == "help":
        return "Builtin Commands:\n" + "".join(f"  {command}\n" for command in sorted(_COMMANDS))
    if name == "ver":
        return _VERSION if rest in ("", "all") else ""
    if name == "commander" and rest == "status":
        state = "Armed" if ap.armed else "Disarmed"
        return f"INFO  [commander] {state}\nINFO  [commander] in failsafe: {'yes' if ap.failsafe else 'no'}\n"
    if name == "param":
        return _param(ap, rest.split())
    if name in _COMMANDS:
        return ""
    return f"Invalid command: {name}\ntype 'help' for a list of commands\n"


def _param(ap: "Px4", words: list[str]) -> str:
    """`param show NAME*`, `param set NAME VALUE`."""
    if words[:1] == ["set"] and len(words) == 3:
        entry = ap.params.by_name(words[1])
        if entry is None or not re.fullmatch(r"-?\d{1,9}(\.\d{1,9})?", words[2]):
            return f"ERROR [param] Parameter {words[1]} not found.\n"
        ap.params.set(words[1], float(words[2]))
        return f"  {words[1]}: curr: {entry.value:g} -> new: {ap.params[words[1]]:g}\n"
    if words[:1] == ["show"]:
        wanted = words[-1].rstrip("*") if len(words) > 1 else ""
        entries = [entry for entry in ap.params if entry.name.startswith(wanted)]
        lines = (
            f"x   {entry.name} [{entry.position},0] : "
            + (f"{entry.value:.4f}" if entry.kind == REAL32 else f"{entry.value:.0f}")
            for entry in entries
        )
        shown = "".join(f"{line}\n" for line in lines)
        return f"Symbols: x = used, + = saved, * = unsaved\n{shown}\n {len(ap.params)}/1800 parameters used.\n"
    return ""


# ArduPilot


def ardupilot(ap: Autopilot, frame: Received) -> None:
    """Only GPS1 and SERIAL0 answer; taking SERIAL0, our own link, exclusively kills it for good."""
    f = frame.fields
    if f["flags"] & REPLY:
        return
    if f["device"] == SERIAL0_DEVICE and f["flags"] & EXCLUSIVE:
        ap.silent = True
        return
    if not f["flags"] & RESPOND:
        return
    if f["device"] == GPS1_DEVICE:
        _reply(ap, GPS1_DEVICE, _NAV_SAT.ljust(CHUNK_BYTES, b"\x55"))
    elif f["device"] == SERIAL0_DEVICE:
        _reply(ap, SERIAL0_DEVICE, bytes.fromhex("fd09000023ffbe000000"))
