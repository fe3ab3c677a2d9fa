"""What planner workers leave behind."""

import errno
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from tui_gcs.core.process.planner_workers import (
    END_S,
    FIRST_WAIT_S,
    KEPT_LOG_BYTES,
    LOOK_GAP_S,
    MAX_LOG_BYTES,
    Declarations,
    PlannerWorkers,
)


def test_a_planner_that_prints_without_end_does_not_fill_the_disk(tmp_path: Path) -> None:
    log = tmp_path / "run-planners.log"
    workers = PlannerWorkers(tmp_path / "bus", log)
    workers.keep([], 0.0)
    log.write_bytes(b"first words\n")
    with log.open("ab") as worker:
        worker.write(b"x" * MAX_LOG_BYTES)
        worker.flush()
        workers.keep([], LOOK_GAP_S / 2)
        assert log.stat().st_size > MAX_LOG_BYTES, "not looked at yet"
        workers.keep([], LOOK_GAP_S)
        worker.write(b"last words\n")
    text = log.read_bytes()
    assert len(text) < KEPT_LOG_BYTES + 100
    assert text.startswith(b"first words\n") and text.endswith(
        b"--- planners print too much: what came here is not kept ---\nlast words\n"
    )


def test_planners_that_printed_nothing_yet_are_no_news(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    workers = PlannerWorkers(tmp_path / "bus", tmp_path / "run-planners.log")
    workers.keep([], 0.0)
    workers.keep([], LOOK_GAP_S)
    assert not caplog.records


FORKS = """
import os, signal, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
if os.fork() == 0:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    time.sleep(100)
print(os.getpgrp(), flush=True)
{then}
"""


def group_of(then: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[PlannerWorkers, int]:
    """Keeps one worker, a program that starts another one, and the group both are in."""
    module = folder / "forks.py"
    module.write_text(FORKS.format(then=then))
    monkeypatch.setattr("tui_gcs.core.process.planner_workers.command_of", lambda *_: [sys.executable, str(module)])
    workers = PlannerWorkers(folder / "bus", folder / "log")
    workers.keep(["red"], 0.0)
    wait_for(lambda: (folder / "log").read_text().endswith("\n"))
    return workers, int((folder / "log").read_text())


def wait_for(done: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 10.0
    while not done():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def is_empty(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def test_what_a_planner_started_is_killed_with_it_when_it_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workers, group = group_of("time.sleep(100)", tmp_path, monkeypatch)
    workers.end_stuck(["red"])
    wait_for(lambda: workers.pid("red") is None and is_empty(group))


def test_what_a_planner_started_is_killed_when_it_died(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    workers, group = group_of("os._exit(3)", tmp_path, monkeypatch)
    wait_for(lambda: workers.pid("red") is None)
    workers.keep(["red"], 1.0)
    wait_for(lambda: is_empty(group))


def test_a_worker_of_a_team_that_is_no_more_is_killed_if_it_does_not_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workers, group = group_of("time.sleep(100)", tmp_path, monkeypatch)
    workers.keep([], 1.0)
    workers.keep([], 1.0 + END_S / 2)
    assert not is_empty(group)

    def is_gone() -> bool:
        workers.keep([], 1.0 + END_S)
        return is_empty(group)

    wait_for(is_gone)


ESCAPES = """
import os, time
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        open({file!r}, "w").write(str(os.getpid()) + "\\n")
        time.sleep(100)
    {middle}
time.sleep({lives})
"""
STATION = """
import sys, time
from pathlib import Path
from tui_gcs.core.base.descendants import adopt_orphans
from tui_gcs.core.process import planner_workers
planner_workers.command_of = lambda *_: [sys.executable, sys.argv[1]]
workers = planner_workers.PlannerWorkers(Path("bus"), Path("log"), adopts={adopts})
workers.keep(["red"], 0.0)
while not Path("escaped").exists() or not Path("escaped").read_text().endswith("\\n"):
    time.sleep(0.02)
{then}
for now in range(100, 200):
    time.sleep(0.05)
    workers.keep({teams}, float(now))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux gives orphans to another process than init")
@pytest.mark.parametrize("middle", ["os._exit(0)", "time.sleep(100)"], ids=["daemon", "session"])
@pytest.mark.parametrize(
    ("lives", "then", "teams"),
    [
        (100, "workers.end_stuck(['red'])", []),
        # Nobody keeps workers any more, so that nothing but the end itself kills what they left.
        (100, "workers.end(); time.sleep(100)", []),
        (0.5, "", ["red"]),
        (100, "", []),
    ],
    ids=["killed", "ended", "died", "team gone"],
)
def test_what_a_planner_started_in_another_session_ends_with_it(
    tmp_path: Path, middle: str, lives: float, then: str, teams: list[str]
) -> None:
    module, station, escaped = tmp_path / "planner.py", tmp_path / "station.py", tmp_path / "escaped"
    module.write_text(ESCAPES.format(file=str(escaped), middle=middle, lives=lives))
    teams_text = "['red'] if now < 101 else []" if teams else "[]"
    station.write_text(STATION.format(adopts="adopt_orphans()", then=then, teams=teams_text))
    ends_with_station(station, module, escaped)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux shows whose child a process is")
def test_without_orphans_what_a_planner_started_in_another_session_still_ends_with_it(tmp_path: Path) -> None:
    """Where the kernel gives orphans to nobody, the descendants of a living planner are killed before it is."""
    module, station, escaped = tmp_path / "planner.py", tmp_path / "station.py", tmp_path / "escaped"
    module.write_text(ESCAPES.format(file=str(escaped), middle="time.sleep(100)", lives=100))
    station.write_text(STATION.format(adopts="False", then="workers.end_stuck(['red'])", teams="[]"))
    ends_with_station(station, module, escaped)


def ends_with_station(station: Path, module: Path, escaped: Path) -> None:
    """Run the station until it has ended what its planner started."""
    tmp_path = station.parent
    run = subprocess.Popen([sys.executable, str(station), str(module)], cwd=tmp_path)
    try:
        wait_for(lambda: escaped.exists() and escaped.read_text().endswith("\n"))
        pid = int(escaped.read_text())
        wait_for(lambda: not is_alive(pid))
    finally:
        run.kill()
        run.wait()


def is_alive(pid: int) -> bool:
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


COUNTS = """
import os, sys, time
os.sched_setaffinity(0, {{min(os.sched_getaffinity(0))}})
print("\\n", flush=True)
{then}
"""
SPINS = "while True: pass"


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux counts how long a process waits for a processor")
@pytest.mark.parametrize(("then", "starved"), [(SPINS, True), ("time.sleep(100)", False)])
def test_a_worker_without_cpu_time_is_told_from_one_that_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, then: str, starved: bool
) -> None:
    """Four more processes want the same core: who wants it, too, waits for four fifths of the time; who sleeps, not."""
    module = tmp_path / "counts.py"
    module.write_text(COUNTS.format(then=then))
    monkeypatch.setattr("tui_gcs.core.process.planner_workers.command_of", lambda *_: [sys.executable, str(module)])
    spins = [sys.executable, "-c", COUNTS.format(then=SPINS)]
    # In sessions of their own, as the worker: Linux shares the time out among sessions (autogroup).
    others = [subprocess.Popen(spins, stdout=subprocess.DEVNULL, start_new_session=True) for _ in range(4)]
    workers = PlannerWorkers(tmp_path / "bus", tmp_path / "log")
    try:
        workers.keep(["red"], 0.0)
        wait_for(lambda: (tmp_path / "log").read_text().endswith("\n"))
        begun_s = time.monotonic()
        before_s = workers.waited_s("red", 100.0)
        wait_for(lambda: time.monotonic() - begun_s > 2.0)
        share = (workers.waited_s("red", 200.0) - before_s) / (time.monotonic() - begun_s)
    finally:
        workers.end_stuck(["red"])
        for other in others:
            other.kill()
            other.wait()
    assert (share > 0.5) is starved


def no_process(*_: object, **__: object) -> NoReturn:
    raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))


def test_where_the_system_has_no_process_the_station_goes_on_and_tries_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    workers = PlannerWorkers(tmp_path / "bus", tmp_path / "log")
    monkeypatch.setattr("tui_gcs.core.process.planner_workers.command_of", lambda *_: ["true"])
    with monkeypatch.context() as full:
        full.setattr(subprocess, "Popen", no_process)
        workers.keep(["red"], 0.0)
        workers.keep(["red"], FIRST_WAIT_S / 2)
        assert workers.pid("red") is None
        assert [record.message for record in caplog.records] == [
            "no planner worker for team red: [Errno 11] Resource temporarily unavailable"
        ]
    workers.keep(["red"], FIRST_WAIT_S)
    first = workers._workers["red"].process
    first.wait()
    workers.keep(["red"], 1.5 * FIRST_WAIT_S)  # it is found dead
    with monkeypatch.context() as full:
        full.setattr(subprocess, "Popen", no_process)
        workers.keep(["red"], 2.5 * FIRST_WAIT_S)
    workers.keep(["red"], 3.0 * FIRST_WAIT_S)
    assert workers._workers["red"].process is first, "tried again after twice the wait"
    workers.keep(["red"], 4.5 * FIRST_WAIT_S)
    assert workers._workers["red"].process is not first
    workers.end()


def test_where_the_system_has_no_process_no_planner_is_described(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(subprocess, "Popen", no_process)
    declarations = Declarations()
    assert declarations.poll() == ()
    assert "planners cannot be described: " in caplog.text
    declarations.end()
