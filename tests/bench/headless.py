"""The command line without a terminal: `--help`, and rehearsals in lock-step."""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from tests.bench.row import NotMeasured, Row
from tui_gcs.core.judging.mission_script import Script, Step
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.scenario.load import load
from tui_gcs.rehearsal.lock_step import LockStep

COMMAND = [str(Path(sys.executable).with_name("tui-gcs"))]
MANY = 250
MEASURED_S = 120.0
"""Simulated time in which the speed of many vehicles is measured."""


def cpu_of(command: list[str]) -> float:
    """CPU seconds (user and system) of a command and its children."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise NotMeasured(f"{' '.join(command[1:])} ended with {child.returncode}")
    return usage.ru_utime + usage.ru_stime


def help_cpu(_: Path) -> Iterator[Row]:
    """CPU of `tui-gcs --help`, median of nine."""
    cpu_of([*COMMAND, "--help"])  # the first one may have to compile
    yield Row(
        "tui-gcs --help, CPU", 1000 * statistics.median(cpu_of([*COMMAND, "--help"]) for _ in range(9)), "ms", 150
    )


def lock_step(folder: Path) -> Iterator[Row]:
    """Rehearsals, faster than real time: the shipped scenario as a whole command, and 250 vehicles in flight."""
    for rounds, limit in ((1, 10.0), (3, 40.0)):
        flown_s, wall_s = _rehearsed(folder / str(rounds), rounds)
        name = f"lock-step, {rounds} round{'s' if rounds > 1 else ''} of the shipped scenario"
        yield Row(f"{name}: flown", flown_s, "s")
        yield Row(f"{name}: times real time", flown_s / wall_s, "x", limit, at_least=True)
    yield Row(f"lock-step, {MANY} vehicles in flight: times real time", _speed_of_many(folder), "x", 2.0, at_least=True)


def _rehearsed(folder: Path, rounds: int) -> tuple[float, float]:
    """Flown time of `tui-gcs rehearse`, from its own recording, and the wall time of the whole command."""
    environment = os.environ | {"TUI_GCS_STATE_DIR": str(folder)}
    began_s = time.monotonic()
    command = [*COMMAND, "rehearse", "--rounds", str(rounds)]
    done = subprocess.run(command, capture_output=True, check=False, env=environment)
    wall_s = time.monotonic() - began_s
    if done.returncode:
        raise NotMeasured(f"rehearse --rounds {rounds} ended with {done.returncode}")
    recordings = list(folder.rglob("*.tlog"))
    if len(recordings) != 1:
        raise NotMeasured(f"it left {len(recordings)} recordings")
    times_s = [wall for wall, _ in read_tlog(recordings[0])]
    return times_s[-1] - times_s[0], wall_s


def _speed_of_many(folder: Path) -> float:
    """Simulated seconds per second of wall time, of `MANY` vehicles from their start on; they climb and go to work."""
    file = folder / "many.toml"
    made = [*COMMAND, "scenario", "new", str(file), "--vehicles", str(MANY)]
    subprocess.run(made, capture_output=True, check=True)
    with closing(LockStep(load(file), file.read_text(), folder, beside=True)) as flight:
        script = Script(flight.scenario, flight.bus, principal="bench", whole_duration=False)
        while script.step is Step.WAIT:
            flight.step()
            script.tick()
            if script.done or flight.clock.now() > 60.0:
                raise NotMeasured(f"{MANY} vehicles do not start: {script.headline}")
        began_s, begun_s = time.monotonic(), flight.clock.now()
        while flight.clock.now() < begun_s + MEASURED_S:
            flight.step()
            script.tick()
        return MEASURED_S / (time.monotonic() - began_s)
