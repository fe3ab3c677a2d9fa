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

from tui_gcs.core.process.planner_workers import END_S, FIRST_WAIT_S, Declarations, PlannerWorkers
from tui_gcs.core.protocol.planner_log import PLANNER_LOG_END, PlannerLogLevel
from tui_gcs.core.records.planner_log import PlannerLog


def workers_in(folder: Path) -> PlannerWorkers:
    return PlannerWorkers(folder / "bus", PlannerLog(folder / "log", lambda: 0.0))


def printed(folder: Path) -> str:
    """What the worker of team red has printed."""
    lines = PlannerLog(folder / "log", lambda: 0.0).before(PLANNER_LOG_END).lines
    return "\n".join(line.text for line in lines if line.level is PlannerLogLevel.STDOUT)


SPEAKS = """
import sys
print("on my way", flush=True)
sys.stderr.write("<4>mine: low on ideas\\n\\x1b[31mplain words")
sys.exit(3)
"""


def test_what_a_worker_prints_is_kept_with_its_team_planner_and_level(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = tmp_path / "speaks.py"
    module.write_text(SPEAKS)
    monkeypatch.setattr("tui_gcs.core.process.planner_workers.command_of", lambda *_: [sys.executable, str(module)])
    log = PlannerLog(tmp_path / "log", lambda: 1.5)
    workers = PlannerWorkers(tmp_path / "bus", log)
    workers.keep({"red": "mine"}, 0.0)
    pid = workers.pid("red")

    def has_ended() -> bool:
        workers.keep({"red": "mine"}, 0.1)
        return workers.pid("red") is None and len(log.before(PLANNER_LOG_END).lines) == 5

    wait_for(has_ended)
    lines = log.before(PLANNER_LOG_END).lines
    assert {(line.wall_s, line.team, line.planner) for line in lines} == {(1.5, "red", "mine")}
    first, *said, last = [(line.level.value, line.text) for line in lines]
    assert first == ("station", f"its worker is started, process {pid}")
    assert sorted(said) == [("stderr", "␛[31mplain words"), ("stdout", "on my way"), ("warning", "mine: low on ideas")]
    assert last == ("station", "its worker ended (exit code 3); the next one is started in 1 s")


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
    workers = workers_in(folder)
    wait_for(lambda: workers.keep({"red": "mine"}, 0.0) or printed(folder) != "")
    return workers, int(printed(folder))


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
    workers.keep({"red": "mine"}, FIRST_WAIT_S / 2)  # no second one is started
    wait_for(lambda: is_empty(group))


def test_a_worker_of_a_team_that_is_no_more_is_killed_if_it_does_not_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workers, group = group_of("time.sleep(100)", tmp_path, monkeypatch)
    workers.keep({}, 1.0)
    workers.keep({}, 1.0 + END_S / 2)
    assert not is_empty(group)

    def is_gone() -> bool:
        workers.keep({}, 1.0 + END_S)
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
from tui_gcs.core.records.planner_log import PlannerLog
planner_workers.command_of = lambda *_: [sys.executable, sys.argv[1]]
workers = planner_workers.PlannerWorkers(Path("bus"), PlannerLog(Path("log"), time.time), adopts={adopts})
workers.keep({{"red": "mine"}}, 0.0)
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
    teams_text = "{'red': 'mine'} if now < 101 else {}" if teams else "{}"
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
print("counting", flush=True)
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
    workers = workers_in(tmp_path)
    try:
        wait_for(lambda: workers.keep({"red": "mine"}, 0.0) or printed(tmp_path) != "")
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
    workers = workers_in(tmp_path)
    monkeypatch.setattr("tui_gcs.core.process.planner_workers.command_of", lambda *_: ["true"])
    with monkeypatch.context() as full:
        full.setattr(subprocess, "Popen", no_process)
        workers.keep({"red": "mine"}, 0.0)
        workers.keep({"red": "mine"}, FIRST_WAIT_S / 2)
        assert workers.pid("red") is None
        assert [record.message for record in caplog.records] == [
            "no planner worker for team red: [Errno 11] Resource temporarily unavailable"
        ]
    workers.keep({"red": "mine"}, FIRST_WAIT_S)
    first = workers._workers["red"].process
    first.wait()
    workers.keep({"red": "mine"}, 1.5 * FIRST_WAIT_S)  # it is found dead
    with monkeypatch.context() as full:
        full.setattr(subprocess, "Popen", no_process)
        workers.keep({"red": "mine"}, 2.5 * FIRST_WAIT_S)
    workers.keep({"red": "mine"}, 3.0 * FIRST_WAIT_S)
    assert workers._workers["red"].process is first, "tried again after twice the wait"
    workers.keep({"red": "mine"}, 4.5 * FIRST_WAIT_S)
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
