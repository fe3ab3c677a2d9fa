"""Starts, finds and ends stations: what the command line does before and after the console.

A station runs detached from the terminal under a small supervisor. The supervisor restarts it when it dies and, for the
demo, owns the simulated vehicles.
"""

import contextlib
import json
import logging
import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui_gcs.core.base.clock import wall_offset_s
from tui_gcs.core.base.descendants import adopt_orphans, kill_orphans
from tui_gcs.core.base.directories import (
    EARLIER_STATE_FILE,
    STATE_FILE,
    STATION_LOCK,
    SUPERVISOR_LOCK,
    runtime_dir,
    state_dir,
    try_lock,
)
from tui_gcs.core.base.open_files import require_open_files
from tui_gcs.core.base.run_kind import RunKind

if TYPE_CHECKING:
    from tui_gcs.core.protocol.planning import PlannerInfo

log = logging.getLogger("tui_gcs.supervisor")

RUN_FILE = "run.json"
START_LIMIT_S = 15.0
"""Time in which a started station must answer."""
RESTART_S = 0.3
"""Pause before a station is restarted that died soon after its start."""
SHORT_LIFE_S = 5.0
"""A station that lived longer is restarted at once: until then its vehicles are steered by nothing."""
CANNOT_START = 2
"""Exit code of a station that must not be restarted."""
NO_PROCESS_S = 1.0
"""Pause before a station is started again for which the system had no process."""
MAX_RESTARTS = 20
"""Restarts in one minute; more of them mean that the station cannot live."""


class StationLaunchError(Exception):
    """A station cannot be started or found; one line."""


def is_running(kind: RunKind) -> bool:
    """Return whether a supervisor or a station of this kind holds its lock."""
    directory = runtime_dir(kind)
    for name in (SUPERVISOR_LOCK, STATION_LOCK):
        with (directory / name).open("a") as lock:
            if not try_lock(lock):
                return True
    return False


def running_scenario(kind: RunKind) -> str:
    """Return the path of the scenario that the running station was started with."""
    try:
        return str(json.loads((runtime_dir(kind) / RUN_FILE).read_text())["scenario_path"])
    except (OSError, ValueError, KeyError):
        return ""


@dataclass(frozen=True)
class LaunchOptions:
    """How a station is started, beyond its scenario and links."""

    sim_spec: dict[str, Any] | None = None
    """Vehicles that the supervisor simulates (see `sitl.launch.simulated`)."""
    fault: str = ""
    """Faults of the simulated vehicles' links (see `sitl.links.faults`)."""
    forced_kind: bool = False
    """The operator named the kind of run (`--kind`)."""
    forward: Sequence[tuple[str, bool]] = ()
    """Links of other stations, and whether commands may come in."""
    dialects: Sequence[str] = ()
    """Paths of files with definitions of MAVLink messages."""
    planners: "Sequence[PlannerInfo]" = ()
    """Planners in files, as they declared themselves."""
    watch: bool = False
    """Saved versions of these planners take over (SIM only)."""
    terrain: str = ""
    """Path of a terrain file or folder from which vehicles are answered; empty for none."""
    operator_at: dict[str, float] | None = None
    """Fields of `OperatorId` for Remote ID."""


def launch(
    kind: RunKind, scenario_path: str, toml: str, links: list[str], options: LaunchOptions | None = None
) -> None:
    """Start a supervised station, detached from this terminal, and return at once.

    Raises:
        StationLaunchError: planners in files may change in flight only in SIM.
        ConfigError: a directory cannot be used, or too few files may be open.
    """
    options = options or LaunchOptions()
    if options.watch and kind is not RunKind.SIM:
        raise StationLaunchError("a planner that changes while it flies is for simulated vehicles only")
    require_open_files()
    directory = runtime_dir(kind)
    for name in ("error", "bus", "bus.lock"):
        (directory / name).unlink(missing_ok=True)
    _keep_earlier_state(directory, own_vehicles=options.sim_spec is not None)
    setting: dict[str, Any] = {
        "kind": kind,
        "scenario_path": scenario_path,
        "toml": toml,
        "links": links,
        "run_name": time.strftime("%Y%m%d-%H%M%S") + f"-{secrets.token_hex(2)}",
        "wall_offset_s": wall_offset_s(),
        "forced_kind": options.forced_kind,
        "forward": options.forward,
        "dialects": options.dialects,
        "planners": [_builtins(info) for info in options.planners],
        "watch": options.watch,
        "terrain": options.terrain,
        "operator_at": options.operator_at,
    }
    if options.sim_spec is not None:
        setting |= _sim_setting(options.sim_spec, options.fault)
    _write_private(directory / RUN_FILE, json.dumps(setting))
    log = state_dir(kind) / f"{setting['run_name']}.log"
    with log.open("ab") as output:
        subprocess.Popen(
            [sys.executable, "-m", "tui_gcs.client.launcher", kind, str(directory)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
        )


def _keep_earlier_state(directory: Path, *, own_vehicles: bool) -> None:
    """Keep the state of a station that was killed with its supervisor: its vehicles may be in the air.

    An orderly end removes it. Simulated vehicles of our own ended with that station.
    """
    if own_vehicles:
        for name in (STATE_FILE, EARLIER_STATE_FILE):
            (directory / name).unlink(missing_ok=True)
    else:
        with contextlib.suppress(FileNotFoundError):
            (directory / STATE_FILE).rename(directory / EARLIER_STATE_FILE)


def _sim_setting(sim_spec: dict[str, Any], fault: str) -> dict[str, Any]:
    port = free_port()
    # Only the vehicles of this run know the token: it proves that they are simulated (docs/architecture.md).
    token = secrets.token_hex(8)
    return {
        "links": [f"udpin:127.0.0.1:{port}"],
        "sim_target": f"127.0.0.1:{port}",
        "fault": fault,
        "token": token,
        "sim_spec": sim_spec | {"token": token},
    }


def _builtins(info: "PlannerInfo") -> Any:
    import msgspec

    return msgspec.to_builtins(info)


def start_error(kind: RunKind) -> str:
    """Return why the station could not start, or ""."""
    try:
        return (runtime_dir(kind) / "error").read_text()
    except OSError:
        return ""


def check_fault(text: str) -> None:
    """Raise `StationLaunchError` if a text of faults is wrong; a process of the simulator checks it."""
    if text:
        done = subprocess.run(
            [sys.executable, "-m", "sitl.links.faults", text], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise StationLaunchError(done.stderr.strip().rpartition("\n")[2])


def proxy_command(listen: str, to: str, fault: str, seed: int) -> list[str]:
    """Return the command line of the proxy that makes links faulty; the proxy ends with this process."""
    command = [sys.executable, "-m", "sitl.launch.proxy", "--listen", listen, "--to", to, "--fault", fault]
    return [*command, "--seed", str(seed), "--parent", str(os.getpid())]


def free_port() -> int:
    """Return a UDP port of this machine that is free now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _write_private(path: Path, text: str) -> None:
    # O_EXCL with 0600 on a new file: an older file may have had other permissions, and the token must stay private.
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(text)


def supervise(kind: RunKind) -> int:
    """Run simulator and station until the station ends on request. Return exit code 0, or another one for a failure."""
    directory = runtime_dir(kind)
    with (directory / SUPERVISOR_LOCK).open("a") as lock:
        if not try_lock(lock):
            return 3
        setting = json.loads((directory / RUN_FILE).read_text())
        # The pipe's other end closes with the last process that holds it, even after `kill -9`: no poll and no pid file
        # needed.
        lifeline, wants = os.pipe()
        simulation = _start_sim(directory, setting, lifeline)
        os.close(lifeline)
        try:
            code = _keep_station(directory, wants)
            if code == 0:  # one that could not even start leaves it to the next
                (directory / EARLIER_STATE_FILE).unlink(missing_ok=True)
            return code
        finally:
            for process in simulation:
                process.terminate()
                process.wait()
            (directory / RUN_FILE).unlink(missing_ok=True)
            (directory / STATE_FILE).unlink(missing_ok=True)


def _start_sim(directory: Path, setting: dict[str, Any], lifeline: int) -> list[subprocess.Popen[bytes]]:
    """Start the vehicles, and the proxy that makes their links faulty, if wanted.

    They end by themselves when no process holds the other end of the pipe `lifeline`: this one does, and the station,
    which flies on without it.
    """
    if "sim_spec" not in setting:
        return []
    spec = directory / "sim.json"
    _write_private(spec, json.dumps(setting["sim_spec"]))
    target, commands = setting["sim_target"], []
    if setting["fault"]:
        target = f"127.0.0.1:{free_port()}"
        commands.append(proxy_command(target, setting["sim_target"], setting["fault"], setting["sim_spec"]["seed"]))
    command = [sys.executable, "-m", "sitl.launch.simulated", "--spec", str(spec), "--target", target]
    commands.insert(0, [*command, "--parent", str(os.getpid())])
    tied = [[*command, "--lifeline", str(lifeline)] for command in commands]
    return [subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=(lifeline,)) for command in tied]


def _keep_station(directory: Path, wants: int) -> int:
    """Restart the station whenever it dies. It alone holds `wants`; its children do not."""
    station: subprocess.Popen[bytes] | None = None
    request = {"end": False}

    def end(*_: object) -> None:
        request["end"] = True
        if station is not None:
            station.terminate()

    signal.signal(signal.SIGTERM, end)
    adopts = adopt_orphans()
    starts: list[float] = []
    while not request["end"]:
        starts = [*(t for t in starts if time.monotonic() - t < 60), time.monotonic()]
        if len(starts) > MAX_RESTARTS:
            (directory / "error").write_text(f"the station died {MAX_RESTARTS} times in a minute: see its log")
            return 1
        command = [sys.executable, "-m", "tui_gcs.core.process.station_process", str(directory / RUN_FILE)]
        try:
            station = subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=(wants,))
        except OSError as error:  # a busy computer has no process or no memory to give; that passes
            log.error("the station is not started: %s; it is tried again", error)
            starts.pop()
            time.sleep(NO_PROCESS_S)
            continue
        code = station.wait()
        if adopts:
            kill_orphans(set())  # planner workers of the dead station, and what they have started
        if code in (0, CANNOT_START):
            return code
        if time.monotonic() - starts[-1] < SHORT_LIFE_S:
            time.sleep(RESTART_S)
    return 0


if __name__ == "__main__":
    sys.exit(supervise(RunKind(sys.argv[1])))
