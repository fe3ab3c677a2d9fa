"""The command line without a terminal: `--help`, and a round in lock-step."""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from tests.bench.row import NotMeasured, Row
from tui_gcs.core.records.tlog_reader import read_tlog

COMMAND = [str(Path(sys.executable).with_name("tui-gcs"))]


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
    """Round 1, take-off to landing, as a whole command; flown time from its own recording."""
    began_s = time.monotonic()
    done = subprocess.run([*COMMAND, "demo", "--headless", "--rounds", "1"], capture_output=True, check=False)
    wall_s = time.monotonic() - began_s
    if done.returncode:
        raise NotMeasured(f"demo --headless --rounds 1 ended with {done.returncode}")
    recordings = list(folder.rglob("*.tlog"))
    if len(recordings) != 1:
        raise NotMeasured(f"it left {len(recordings)} recordings")
    times_s = [wall for wall, _ in read_tlog(recordings[0])]
    flown_s = times_s[-1] - times_s[0]
    yield Row("lock-step, round 1: flown", flown_s, "s")
    yield Row("lock-step, round 1: times real time", flown_s / wall_s, "x", 10, at_least=True)
