"""`tui-gcs sim`: vehicles without a station, simulated by us or by the autopilots' own simulators."""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tui_gcs.cli.common import check_seed
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.sim_fleet import spec_of_options
from tui_gcs.client.launcher import StationLaunchError, check_fault, free_port, proxy_command
from tui_gcs.core.base.directories import ConfigError, state_dir
from tui_gcs.core.base.run_kind import RunKind

PX4_ADDRESS = "127.0.0.1:14550"
"""The only address to which a real PX4 sends."""
NAMES = {"ardupilot": "ArduPilot", "px4": "PX4"}
OURSELVES = ("127.0.0.1", "localhost", "::1", "0.0.0.0", "::")  # noqa: S104 - compared with, not bound
STOP_S = 10.0
POLL_S = 0.1
MIN_SPEED, MAX_SPEED = 0.1, 100.0


def run(arguments: argparse.Namespace) -> int:
    """Run until interrupted, or until the vehicles end by themselves."""
    check_seed(arguments.seed)
    _check(arguments)
    spec = spec_of_options(arguments)
    relay = _relay(arguments)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "spec.json"
        # Without a token vehicles prove nothing: to a station they are LIVE unless it is given `--kind sim`.
        file.write_text(json.dumps(spec | {"token": ""}))
        commands = [_vehicles(arguments, str(file), relay or arguments.target)]
        if arguments.real is not None:
            _check_real(commands[0])
        if relay is not None:
            commands.insert(0, proxy_command(relay, arguments.target, arguments.fault, spec["seed"]))
        sys.stdout.write(_start_lines(arguments, spec))
        sys.stdout.flush()
        return _run(commands)


def _check(arguments: argparse.Namespace) -> None:
    """Raise `CommandError` for options that are impossible, alone or together."""
    host, _, port = arguments.target.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 0 < int(port) < 65536:
        raise CommandError(f"--target {arguments.target}: must be HOST:PORT, for example 127.0.0.1:14550")
    if not MIN_SPEED <= arguments.speed <= MAX_SPEED:
        raise CommandError(f"--speed {arguments.speed:g}: must be {MIN_SPEED:g} to {MAX_SPEED:g}")
    try:
        check_fault(arguments.fault)
    except StationLaunchError as error:
        raise CommandError(str(error)) from None
    if arguments.real is None:
        given = [name for name in ("binary", "params", "wipe") if getattr(arguments, name)]
        if given:
            raise CommandError(f"--{given[0]} is for real autopilots: say --real arducopter or --real px4, too")
        return
    if arguments.autopilot is not None:
        raise CommandError("--autopilot is for our simulator: --real names the autopilot already")
    if arguments.wind is not None or arguments.gps_noise is not None:
        raise CommandError("--wind and --gps-noise are for our simulator: real ones have parameters for it (SIM_…)")


def _check_real(command: list[str]) -> None:
    """Check before the start what the autopilots' simulators need. Raises `CommandError`."""
    done = subprocess.run([*command, "--check"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise CommandError(done.stderr.strip().rpartition("\n")[2].removeprefix("sitl: "))


def _relay(arguments: argparse.Namespace) -> str | None:
    """Return the address of the proxy that adds faults; None if vehicles send to the target itself."""
    if arguments.real != "px4":
        return f"127.0.0.1:{free_port()}" if arguments.fault else None
    # A real PX4 streams to this address at once and answers its first partner for ever (docs/autopilots.md).
    if arguments.target not in (PX4_ADDRESS, PX4_ADDRESS.replace("127.0.0.1", "localhost")):
        return PX4_ADDRESS
    if arguments.fault:
        raise CommandError(
            f"PX4 sends to {PX4_ADDRESS} only, where the faults must listen then: name another target, "
            "for example --target 127.0.0.1:14560"
        )
    return None


def _vehicles(arguments: argparse.Namespace, spec: str, target: str) -> list[str]:
    """Return the command line of the vehicles' process."""
    if arguments.real is None:
        command = [sys.executable, "-m", "sitl.launch.simulated"]
    else:
        try:
            folder = state_dir(RunKind.SIM) / "real"
        except ConfigError as error:
            raise CommandError(str(error)) from None
        command = [sys.executable, "-m", "sitl.launch.real", arguments.real, "--folder", str(folder)]
        for name in ("binary", "params"):
            if getattr(arguments, name) is not None:
                command += [f"--{name}", getattr(arguments, name)]
        command += ["--wipe"] * arguments.wipe
    command += ["--spec", spec, "--target", target, "--speed", f"{arguments.speed:g}"]
    # A `kill -9` of this process runs none of its clean-up: the vehicles watch it and end with it.
    return [*command, "--parent", str(os.getpid())]


def _start_lines(arguments: argparse.Namespace, spec: dict[str, Any]) -> str:
    """Return the lines that describe which vehicles send where, and what to type next."""
    vehicles = spec["vehicles"]
    ids = [vehicle["system_id"] for vehicle in vehicles]
    kinds = f"real {arguments.real}" if arguments.real else _kinds([vehicle["autopilot"] for vehicle in vehicles])
    first = vehicles[0]
    place = f"{first['lat_deg']:.6f},{first['lon_deg']:.6f},{first['ground_amsl_m']:g}"
    lines = [
        f"{len(ids)} vehicles ({kinds}), ids {_ranges(ids)}, send to {arguments.target}; the first stands at {place}",
        *(["PX4's own simulator takes no heading"] if arguments.real == "px4" and first["heading_deg"] else []),
        *([f"faults between them and the station: {arguments.fault}"] if arguments.fault else []),
        f"next, in another terminal: {_next(arguments)}",
        "Ctrl-C ends them",
    ]
    return "\n".join(lines) + "\n"


def _next(arguments: argparse.Namespace) -> str:
    host, _, port = arguments.target.rpartition(":")
    fly = f"tui-gcs fly {arguments.scenario or 'SCENARIO.toml'} --link udpin:"
    if host in OURSELVES:
        return f"{fly}127.0.0.1:{port} --kind sim"
    return f"{fly}0.0.0.0:{port}   (on {host}; there they count as LIVE)"


def _kinds(autopilots: list[str]) -> str:
    counted = {NAMES[kind]: autopilots.count(kind) for kind in NAMES if kind in autopilots}
    return (
        ", ".join(f"{number} {name}" for name, number in counted.items()) if len(counted) > 1 else next(iter(counted))
    )


def _ranges(ids: list[int]) -> str:
    """Return "1-4,7" for 1, 2, 3, 4, 7."""
    from tui_gcs.core.protocol.alarms import id_ranges

    return id_ranges(ids).replace(" ", ",")


class _Interrupted(Exception):
    """Raised when the user interrupts the run."""


def _interrupt(*_: object) -> None:
    raise _Interrupted


def _run(commands: list[list[str]]) -> int:
    """Start all commands, wait until one ends or the user interrupts, then end the others in reverse order."""
    before = {number: signal.signal(number, _interrupt) for number in (signal.SIGTERM, signal.SIGINT)}
    children: list[subprocess.Popen[bytes]] = []
    try:
        for command in commands:
            children.append(subprocess.Popen(command, stdin=subprocess.DEVNULL))
        while True:
            for child in children:
                if child.poll() is not None:
                    return child.returncode or 0
            time.sleep(POLL_S)
    except _Interrupted:
        return 0
    finally:
        for number in before:
            signal.signal(number, signal.SIG_IGN)  # the second Ctrl-C of an impatient user must not leave vehicles
        for child in reversed(children):
            _end(child)
        for number, handler in before.items():
            signal.signal(number, handler)


def _end(child: subprocess.Popen[bytes]) -> None:
    if child.poll() is None:
        child.terminate()
        try:
            child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
