"""SERIAL_CONTROL: PX4's shell, and the serial ports of ArduPilot (docs/autopilots.md "Shell of PX4")."""

import re
from collections.abc import Callable

from sitl.common.autopilot import Handler
from sitl.common.outbox import Outbox
from sitl.common.parameters import REAL32
from sitl.common.platform import Part, Platform
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame

# SERIAL_CONTROL_FLAG. EXCLUSIVE on device 100 ends a real ArduCopter's link at once, and for good.
REPLY, RESPOND, EXCLUSIVE = 1, 2, 4
# SERIAL_CONTROL.data (common.xml).
CHUNK_BYTES = 70
CHUNK_US = 4_000
# SERIAL_CONTROL_DEV_SHELL.
SHELL_DEVICE = 10
GPS1_DEVICE, SERIAL0_DEVICE = 2, 100
MAX_LINE = 256
MAX_OUTPUT_BYTES = 65_536

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
"""First bytes of a u-blox message: ArduPilot's GPS port sends such messages."""


class Px4Shell(Part):
    """PX4's shell on device 10."""

    def __init__(self, platform: Platform, is_in_failsafe: Callable[[], bool]) -> None:
        super().__init__(platform)
        self._is_in_failsafe = is_in_failsafe
        self._line = ""
        """Characters of a line that is not ended yet."""
        self._output = b""
        """Output that is not sent yet."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {"SERIAL_CONTROL": self._receive}

    def _receive(self, frame: ReceivedFrame) -> None:
        f = frame.fields
        if f["device"] != SHELL_DEVICE:
            return
        # Closes the shell: what was typed is forgotten, and nothing comes back.
        if not f["flags"] & RESPOND:
            self._line = ""
            self._tasks.stop(_OUTPUT)
            self._output = b""
            return
        # A line may come in pieces: it is run when its line feed arrives.
        typed = bytes(f["data"][: min(f["count"], CHUNK_BYTES)]).decode("ascii", "replace")
        line = self._line + typed
        *whole, rest = line.split("\n")
        self._line = rest[:MAX_LINE]
        output = "".join(f"{each}\n{self._run(each.strip())}{_PROMPT}" for each in whole)
        if not output:
            return
        waiting = self._output
        self._output = (waiting + output.encode("ascii", "replace"))[:MAX_OUTPUT_BYTES]
        if not waiting:
            self._tasks.start(_OUTPUT, self._send(), self._clock.now_us)

    def _send(self) -> Task:
        """Send the output in pieces of 70 bytes, 4 ms apart."""
        yield CHUNK_US
        while self._output:
            chunk, self._output = self._output[:CHUNK_BYTES], self._output[CHUNK_BYTES:]
            _reply(self._outbox, SHELL_DEVICE, chunk)
            yield CHUNK_US

    def _run(self, line: str) -> str:
        name, _, rest = line.partition(" ")
        if not name:
            return ""
        if name == "help":
            return "Builtin Commands:\n" + "".join(f"  {command}\n" for command in sorted(_COMMANDS))
        if name == "ver":
            return _VERSION if rest in ("", "all") else ""
        if name == "commander" and rest == "status":
            state = "Armed" if self._state.armed else "Disarmed"
            failsafe = "yes" if self._is_in_failsafe() else "no"
            return f"INFO  [commander] {state}\nINFO  [commander] in failsafe: {failsafe}\n"
        if name == "param":
            return self._param(rest.split())
        if name in _COMMANDS:
            return ""
        return f"Invalid command: {name}\ntype 'help' for a list of commands\n"

    def _param(self, words: list[str]) -> str:
        """Run `param show NAME*` or `param set NAME VALUE`."""
        params = self._params
        if words[:1] == ["set"] and len(words) == 3:
            entry = params.by_name(words[1])
            if entry is None or not re.fullmatch(r"-?\d{1,9}(\.\d{1,9})?", words[2]):
                return f"ERROR [param] Parameter {words[1]} not found.\n"
            params.set(words[1], float(words[2]))
            return f"  {words[1]}: curr: {entry.value:g} -> new: {params[words[1]]:g}\n"
        if words[:1] == ["show"]:
            wanted = words[-1].rstrip("*") if len(words) > 1 else ""
            entries = [entry for entry in params if entry.name.startswith(wanted)]
            lines = (
                f"x   {entry.name} [{entry.position},0] : "
                + (f"{entry.value:.4f}" if entry.kind == REAL32 else f"{entry.value:.0f}")
                for entry in entries
            )
            shown = "".join(f"{line}\n" for line in lines)
            return f"Symbols: x = used, + = saved, * = unsaved\n{shown}\n {len(params)}/1800 parameters used.\n"
        return ""


class ArduPilotSerialPorts(Part):
    """ArduPilot's serial ports, of which only GPS1 and SERIAL0 answer."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {"SERIAL_CONTROL": self._receive}

    def _receive(self, frame: ReceivedFrame) -> None:
        f = frame.fields
        if f["flags"] & REPLY:
            return
        if f["device"] == SERIAL0_DEVICE and f["flags"] & EXCLUSIVE:
            # SERIAL0 is the link this came over: exclusive use of it ends the link for good.
            self._outbox.silent = True
            return
        if not f["flags"] & RESPOND:
            return
        if f["device"] == GPS1_DEVICE:
            _reply(self._outbox, GPS1_DEVICE, _NAV_SAT.ljust(CHUNK_BYTES, b"\x55"))
        elif f["device"] == SERIAL0_DEVICE:
            _reply(self._outbox, SERIAL0_DEVICE, bytes.fromhex("fd09000023ffbe000000"))


def _reply(outbox: Outbox, device: int, data: bytes) -> None:
    outbox.send("SERIAL_CONTROL", device=device, flags=REPLY, count=len(data), data=data.ljust(CHUNK_BYTES, b"\0"))
