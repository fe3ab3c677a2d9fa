"""Starting, finding and ending stations: what the command line does before and after the console.

A station runs detached from the terminal under a small supervisor, which starts it again when it dies and, for the
demo, owns the simulated vehicles.
"""

import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui_gcs.core.base.clock import wall_offset_s
from tui_gcs.core.base.directories import STATION_LOCK, SUPERVISOR_LOCK, runtime_dir, state_dir, try_lock
from tui_gcs.core.base.run_kind import RunKind

if TYPE_CHECKING:
    from tui_gcs.core.protocol.planning import PlannerInfo

RUN_FILE = "run.json"
START_LIMIT_S = 15.0
RESTART_S = 0.3
CANNOT_START = 2
MAX_RESTARTS = 20
"""In one minute; more means it cannot live."""


class LaunchError(Exception):
    """A station cannot be started or found: one line."""


def is_running(kind: RunKind) -> bool:
    """Whether a supervisor or a station of this kind holds its lock."""
    directory = runtime_dir(kind)
    for name in (SUPERVISOR_LOCK, STATION_LOCK):
        with (directory / name).open("a") as lock:
            if not try_lock(lock):
                return True
    return False


def running_scenario(kind: RunKind) -> str:
    """Path of the scenario that the running station was started with."""
    try:
        return str(json.loads((runtime_dir(kind) / RUN_FILE).read_text())["scenario_path"])
    except (OSError, ValueError, KeyError):
        return ""


def launch(
    kind: RunKind,
    scenario_path: str,
    toml: str,
    links: list[str],
    sim_spec: dict[str, Any] | None = None,
    *,
    forced_kind: bool = False,
    forward: list[tuple[str, bool]] | None = None,
    dialects: list[str] | None = None,
    fault: str = "",
    planners: "list[PlannerInfo] | None" = None,
    watch: bool = False,
    operator_at: dict[str, float] | None = None,
) -> None:
    """Start a supervised station, detached from this terminal; returns at once.

    With `sim_spec` (see `sitl.launch.simulated`) the supervisor starts those vehicles too, with a token only this run
    knows; `fault` makes their links bad (see `sitl.links.faults`).
    `forward`: (link, whether commands may come in) of other stations. `dialects`: files of MAVLink definitions.
    `operator_at`: fields of `OperatorId` for Remote ID.
    `planners`: those in files, as they declared themselves; `watch`: what is saved there flies on (SIM only).
    """
    if watch and kind is not RunKind.SIM:
        raise LaunchError("a planner that changes while it flies is for simulated vehicles only")
    directory = runtime_dir(kind)
    for name in ("error", "memory.json", "bus", "bus.lock"):
        (directory / name).unlink(missing_ok=True)
    setting: dict[str, Any] = {
        "kind": kind,
        "scenario_path": scenario_path,
        "toml": toml,
        "links": links,
        "run_name": time.strftime("%Y%m%d-%H%M%S") + f"-{secrets.token_hex(2)}",
        "wall_offset_s": wall_offset_s(),
        "forced_kind": forced_kind,
        "forward": forward or [],
        "dialects": dialects or [],
        "planners": [_builtins(info) for info in planners or []],
        "watch": watch,
        "operator_at": operator_at,
    }
    if sim_spec is not None:
        port = free_port()
        setting["links"] = [f"udpin:127.0.0.1:{port}"]
        setting["sim_target"] = f"127.0.0.1:{port}"
        setting["fault"] = fault
        setting["token"] = secrets.token_hex(8)
        setting["sim_spec"] = sim_spec | {"token": setting["token"]}
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


def _builtins(info: "PlannerInfo") -> Any:
    import msgspec

    return msgspec.to_builtins(info)


def start_error(kind: RunKind) -> str:
    """Why the station could not start, or ""."""
    try:
        return (runtime_dir(kind) / "error").read_text()
    except OSError:
        return ""


def check_fault(text: str) -> None:
    """Raise `LaunchError` if this is no text of faults; the simulator judges, in a process of its own."""
    if text:
        done = subprocess.run(
            [sys.executable, "-m", "sitl.links.faults", text], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise LaunchError(done.stderr.strip().rpartition("\n")[2])


def proxy_command(listen: str, to: str, fault: str, seed: int) -> list[str]:
    """The command line of the process that makes links bad; it ends with this one."""
    command = [sys.executable, "-m", "sitl.launch.proxy", "--listen", listen, "--to", to, "--fault", fault]
    return [*command, "--seed", str(seed), "--parent", str(os.getpid())]


def free_port() -> int:
    """A UDP port of this machine that nobody listens on just now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _write_private(path: Path, text: str) -> None:
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(text)


# ---------------------------------------------------------------- the supervisor process


def supervise(kind: RunKind) -> int:
    """Run simulator and station until the station ends on request. Exit code 0, or why not."""
    directory = runtime_dir(kind)
    with (directory / SUPERVISOR_LOCK).open("a") as lock:
        if not try_lock(lock):
            return 3
        setting = json.loads((directory / RUN_FILE).read_text())
        wanted, wants = os.pipe()
        simulation = _start_sim(directory, setting, wanted)
        os.close(wanted)
        try:
            return _keep_station(directory, wants)
        finally:
            for process in simulation:
                process.terminate()
                process.wait()
            (directory / RUN_FILE).unlink(missing_ok=True)
            (directory / "memory.json").unlink(missing_ok=True)


def _start_sim(directory: Path, setting: dict[str, Any], wanted: int) -> list[subprocess.Popen[bytes]]:
    """The vehicles, and what makes their links bad, if anything.

    They end by themselves when nobody holds the other end of the pipe `wanted`: this process, and the station, which
    flies on without it.
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
    tied = [[*command, "--lifeline", str(wanted)] for command in commands]
    return [subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=(wanted,)) for command in tied]


def _keep_station(directory: Path, wants: int) -> int:
    """Start the station again whenever it dies. It holds `wants` as long as it lives, and none of its children does."""
    station: subprocess.Popen[bytes] | None = None
    asked = {"end": False}

    def end(*_: object) -> None:
        asked["end"] = True
        if station is not None:
            station.terminate()

    signal.signal(signal.SIGTERM, end)
    starts: list[float] = []
    while not asked["end"]:
        starts = [*(t for t in starts if time.monotonic() - t < 60), time.monotonic()]
        if len(starts) > MAX_RESTARTS:
            (directory / "error").write_text(f"the station died {MAX_RESTARTS} times in a minute: see its log")
            return 1
        command = [sys.executable, "-m", "tui_gcs.core.process.station_process", str(directory / RUN_FILE)]
        station = subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=(wants,))
        code = station.wait()
        if code in (0, CANNOT_START):
            return code
        time.sleep(RESTART_S)
    return 0


if __name__ == "__main__":
    sys.exit(supervise(RunKind(sys.argv[1])))
