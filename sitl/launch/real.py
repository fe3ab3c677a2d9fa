"""Real autopilots that fly in their own simulators.

Called as `python -m sitl.launch.real arducopter|px4 --spec FILE --target HOST:PORT`.

FILE is what `sitl.launch.simulated` reads; only ids and places count. Every vehicle is a process with a directory of
its own under --folder, where its parameters, missions and logs stay from run to run. The processes end with this one,
however it ends.

A stock build is expected: `arducopter` of ArduPilot's sitl board, `px4` of PX4's px4_sitl_default with the
`etc` directory of its build beside `bin`.
"""

import argparse
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from sitl.launch.process import (
    LaunchError,
    ParentBond,
    ProgramLoop,
    Starter,
    add_starter,
    parse_target,
    refuse,
    resolved,
)

PX4_PORT = 14550
"""Port on this machine to which a stock PX4 sends: its start script has no other."""
OUTPUT = "out.log"
START_S = 5.0
"""A vehicle that ends before this time could not start."""
STOP_S = 3.0
WATCH_S = 0.25
TAIL_LINES, TAIL_BYTES = 8, 4096
EXIT_ENDED = 1
BUILD = {
    "arducopter": "build it (./waf configure --board sitl; ./waf copter) and add build/sitl/bin to PATH",
    "px4": "build it (make px4_sitl_default) and add build/px4_sitl_default/bin to PATH",
}
_CALIBRATED = {"OFFS": "0.001", "SCAL": "1.001"}
_PARAMETERS = [
    "FRAME_CLASS 1",
    "BATT_MONITOR 4",
    *(f"INS_ACC{n}{kind}_{axis} {value}" for n in ("", "2") for kind, value in _CALIBRATED.items() for axis in "XYZ"),
    *(f"COMPASS_OFS{n}_X 5" for n in ("", "2", "3")),
]
ARDUCOPTER_PARAMETERS = "".join(f"{line}\n" for line in _PARAMETERS)
"""Parameters without which ArduCopter does not arm in a simulator: a frame, and sensors that look calibrated.

They were found by trying. Without BATT_MONITOR it reports no battery (measured: SYS_STATUS without volts, and no
BATTERY_STATUS at all).
"""
ARDUCOPTER_SILENT_PORTS = (1, 2, 5, 6, 7, 8)
"""Serial ports that are switched off.

By default they are TCP servers on all interfaces, at port numbers that two fleets would share.
"""


@dataclass(frozen=True)
class StartPlace:
    """A vehicle's id and start place."""

    system_id: int
    lat_deg: float
    lon_deg: float
    amsl_m: float
    heading_deg: float


@dataclass(frozen=True)
class Options:
    """The options that all vehicles of a run share."""

    binary: Path
    target: tuple[str, int]
    parameters: Path | None = None
    speed: float = 1.0
    wipe: bool = False


def find(autopilot: str, named: str | None, path: str | None = None) -> Path:
    """Return the program `named`, or the autopilot's on PATH (or `path`).

    Raises:
        LaunchError: There is none; the message is what to do about it.
    """
    found = shutil.which(named or autopilot, path=path)
    if found is not None:
        return Path(found).resolve()
    if named is not None:
        raise LaunchError(f"--binary {named}: there is no program there that may be run")
    raise LaunchError(f"{autopilot} is not on PATH: {BUILD[autopilot]}, or name the program by --binary PATH")


def arducopter(place: StartPlace, options: Options, folder: Path) -> tuple[list[str], dict[str, str]]:
    """Return command line and further environment of one ArduCopter."""
    parameters = options.parameters
    if parameters is None:
        parameters = folder / "defaults.parm"
        parameters.write_text(ARDUCOPTER_PARAMETERS)
    home = f"{place.lat_deg:.7f},{place.lon_deg:.7f},{place.amsl_m:g},{place.heading_deg:g}"
    host, port = options.target
    command = [str(options.binary), "--model", "+", "--speedup", f"{options.speed:g}", "--home", home]
    command += ["--defaults", str(parameters), "-I", str(place.system_id), "--sysid", str(place.system_id)]
    command += ["--serial0", f"udpclient:{host}:{port}"]
    for number in ARDUCOPTER_SILENT_PORTS:
        command += [f"--serial{number}", "none"]
    return command, {}


def px4(place: StartPlace, options: Options, folder: Path) -> tuple[list[str], dict[str, str]]:
    """Return command line and further environment of one PX4; its instance number is its id - 1.

    Raises:
        LaunchError: The build has no `etc`, or PX4 cannot do what the options ask for.
    """
    if options.target != ("127.0.0.1", PX4_PORT):
        raise LaunchError(f"--target: PX4 sends to 127.0.0.1:{PX4_PORT} only; put sitl.launch.proxy between")
    if options.parameters is not None:
        raise LaunchError("--params: PX4 takes parameters from the environment: PX4_PARAM_NAME=value tui-gcs sim …")
    environment = {
        "PX4_SIM_MODEL": os.environ.get("PX4_SIM_MODEL", "sihsim_quadx"),
        "PX4_HOME_LAT": f"{place.lat_deg:.7f}",
        "PX4_HOME_LON": f"{place.lon_deg:.7f}",
        "PX4_HOME_ALT": f"{place.amsl_m:g}",
    }
    if options.speed != 1.0:
        environment["PX4_SIM_SPEED_FACTOR"] = f"{options.speed:g}"
    return [str(options.binary), "-i", str(place.system_id - 1), "-d", str(px4_etc(options.binary))], environment


def px4_etc(binary: Path) -> Path:
    """Return the directory of a build's start scripts, from its `bin/px4`. Raises `LaunchError` if there is none."""
    for etc in (binary.parent.parent / "etc", binary.parent / "etc"):
        if (etc / "init.d-posix" / "rcS").is_file():
            return etc
    raise LaunchError(f"{binary}: no etc directory of its build beside it: name the build's bin/px4")


AUTOPILOTS = {"arducopter": arducopter, "px4": px4}


class VehicleProcess:
    """The process of one vehicle, and its directory, which stays locked."""

    def __init__(self, name: str, folder: Path) -> None:
        """Lock `folder`, which is made if missing. Raises `LaunchError` if another run has locked it."""
        self.name = name
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._lock = (folder / "lock").open("a")
        except OSError as error:
            raise LaunchError(f"{folder}: cannot be used ({error.strerror})") from None
        try:
            # Two runs with one directory would overwrite each other's parameters and missions.
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise LaunchError(f"{name} flies already: end the other run, or take other ids (--first)") from None
        self._process: subprocess.Popen[bytes] | None = None

    def start(self, command: Sequence[str], environment: Mapping[str, str], bond: ParentBond) -> None:
        """Start the program in its directory. Raises `LaunchError` if it cannot be run."""
        with (self.folder / OUTPUT).open("wb") as output:
            try:
                self._process = subprocess.Popen(
                    command,
                    cwd=self.folder,
                    env=dict(os.environ) | dict(environment),
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    # A session of its own: a signal reaches the autopilot and all that it has started.
                    start_new_session=True,
                    preexec_fn=bond,
                )
            except OSError as error:
                raise LaunchError(f"{command[0]}: cannot be run ({error.strerror})") from None

    @property
    def status(self) -> int | None:
        """The exit status (negative for a signal); None while the process lives, and before it was started."""
        return self._process.poll() if self._process is not None else None

    def signal(self, number: int) -> None:
        """Send a signal to the process and to all that it has started."""
        if self._process is not None and self._process.poll() is None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)

    def report_of_end(self) -> str:
        """Return lines for the operator: the exit status and the end of the output."""
        output = self.folder / OUTPUT
        return f"{self.name} ended with status {self.status}; the end of its output ({output}):\n{self._tail()}"

    def _tail(self) -> str:
        with (self.folder / OUTPUT).open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - TAIL_BYTES))
            text = re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", file.read().decode("utf-8", "replace"))
        lines = ["".join(c if c.isprintable() else " " for c in line).rstrip() for line in text.splitlines()]
        return "".join(f"    {line}\n" for line in [line for line in lines if line][-TAIL_LINES:]) or "    (nothing)\n"


class RealFleet:
    """The processes of all vehicles of a run."""

    def __init__(self, autopilot: str, places: Sequence[StartPlace], options: Options, folder: Path) -> None:
        """Start all vehicles. Raises `LaunchError` if one cannot start; then none runs."""
        self.instances: list[VehicleProcess] = []
        bond = ParentBond()
        with ExitStack() as undo:
            undo.callback(self.stop)
            for place in places:
                name = f"{autopilot} {place.system_id}"
                instance = VehicleProcess(name, folder / f"{autopilot}-{place.system_id}")
                if options.wipe:
                    _empty(instance.folder)
                self.instances.append(instance)
                instance.start(*AUTOPILOTS[autopilot](place, options, instance.folder), bond)
            undo.pop_all()

    def ended(self) -> list[VehicleProcess]:
        """Return the processes that have ended since the last call."""
        gone = [instance for instance in self.instances if instance.status is not None]
        self.instances = [instance for instance in self.instances if instance not in gone]
        return gone

    def stop(self) -> None:
        """End all processes; one that has not ended within STOP_S is killed."""
        for instance in self.instances:
            instance.signal(signal.SIGTERM)
        end = time.monotonic() + STOP_S
        while any(instance.status is None for instance in self.instances) and time.monotonic() < end:
            time.sleep(0.02)
        for instance in self.instances:
            instance.signal(signal.SIGKILL)


def _empty(folder: Path) -> None:
    """Delete parameters, missions and logs of earlier runs."""
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        # This run holds the lock: without its file another run could take the same directory.
        elif entry.name != "lock":
            entry.unlink()


class FleetWatch(ProgramLoop):
    """Waits for the end: a signal, the end of the starter, or that of all vehicles."""

    def __init__(self, fleet: RealFleet, starter: Starter, out: IO[str]) -> None:
        super().__init__(starter)
        self._fleet, self._out = fleet, out

    def run(self) -> int:
        """Wait, and return the exit status: 0 after a signal, 1 when a vehicle could not start or all have ended."""
        started = time.monotonic()
        while self.running and self.starter.is_there:
            for instance in self._fleet.ended():
                self._out.write(f"sitl: {instance.report_of_end()}")
                self._out.flush()
                if not self._fleet.instances or time.monotonic() - started < START_S:
                    return EXIT_ENDED
            time.sleep(WATCH_S)
        return 0


def read_places(spec: Path) -> list[StartPlace]:
    """Return ids and places of a spec file. Raises `LaunchError` if it has none."""
    try:
        entries = json.loads(spec.read_text(encoding="utf-8"))["vehicles"]
        return [_place(entry) for entry in entries]
    except OSError as error:
        raise LaunchError(f"{spec}: {error.strerror}") from None
    except (KeyError, TypeError, ValueError) as error:
        raise LaunchError(f"{spec}: {error}") from None


def _place(entry: dict[str, Any]) -> StartPlace:
    lat_deg, lon_deg, amsl_m = (float(entry[key]) for key in ("lat_deg", "lon_deg", "ground_amsl_m"))
    return StartPlace(int(entry["system_id"]), lat_deg, lon_deg, amsl_m, float(entry.get("heading_deg", 0.0)))


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m sitl.launch.real", description="Real autopilots in their simulators."
    )
    parser.add_argument("autopilot", choices=tuple(AUTOPILOTS))
    parser.add_argument("--spec", type=Path, required=True, help="JSON file: vehicles")
    parser.add_argument("--target", required=True, metavar="HOST:PORT", help="where the ground station listens")
    parser.add_argument("--folder", type=Path, required=True, help="directories of the vehicles are made there")
    parser.add_argument("--binary", metavar="PATH", help="the program, if it is not on PATH")
    parser.add_argument("--params", type=Path, metavar="FILE", help="ArduPilot: default parameters")
    parser.add_argument("--speed", type=float, default=1.0, help="times real time (default 1)")
    parser.add_argument("--wipe", action="store_true", help="factory parameters, no missions, no logs")
    add_starter(parser)
    parser.add_argument("--check", action="store_true", help="start nothing: say what would be in the way")
    return parser.parse_args(argv)


def _options(args: argparse.Namespace) -> Options:
    target = resolved(parse_target(args.target), "--target")
    if not 0.1 <= args.speed <= 100.0:
        raise LaunchError(f"--speed {args.speed:g}: must be 0.1 to 100")
    if args.params is not None and not args.params.is_file():
        raise LaunchError(f"--params {args.params}: there is no such file")
    binary = find(args.autopilot, args.binary)
    if args.autopilot == "px4":
        px4_etc(binary)
    return Options(binary, target, args.params and args.params.resolve(), args.speed, args.wipe)


def main(argv: list[str] | None = None) -> int:
    """Run the program.

    Returns 0 after a signal or the starter's end, 1 if vehicles ended by themselves, 2 for bad input.
    """
    args = _arguments(argv)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: sys.exit(0))
    try:
        places, options = read_places(args.spec), _options(args)
        starter = Starter(args.parent, args.lifeline)
        if args.check:
            return 0
        fleet = RealFleet(args.autopilot, places, options, args.folder.resolve())
    except (LaunchError, OSError) as error:
        return refuse(error)
    watch = FleetWatch(fleet, starter, sys.stderr)
    watch.catch_signals()
    try:
        return watch.run()
    finally:
        fleet.stop()


if __name__ == "__main__":
    sys.exit(main())
