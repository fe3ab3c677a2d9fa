"""The real form: `tui-gcs demo` in a pseudo-terminal, its processes counted while idle and in flight."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.bench.row import NotMeasured, Row
from tests.rigs.console_pty import PtyConsole
from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import STATUS, BusError
from tui_gcs.core.protocol.zenoh_bus import ZenohBus, connect

MEASURED_S = 20.0
EMPTY_MARK, FLEET_MARK = b"map", b"swarm"
"""What a first frame shows: the map's title at once, the scenario's name when the station was heard."""


def live(_: Path) -> Iterator[Row]:
    """First frame, idle console, whole demo in flight."""
    began_s = time.monotonic()
    console = PtyConsole(["demo"], 80, 24)
    ours = {console.pid}
    try:
        yield Row("`demo` with nothing running: first console frame", painted(console, began_s, EMPTY_MARK), "s", 1)
        yield Row("`demo` with nothing running: frame with the fleet", painted(console, began_s, FLEET_MARK), "s")
        bus = joined()
        status: list[m.StationStatus] = []
        bus.subscribe(STATUS, lambda _, data: status.append(m.decode(data, m.StationStatus)))
        wait(console, lambda: bool(status) and status[-1].heard == 8, 20, "eight vehicles heard")
        yield first_frame_again()
        console.read(15)  # planners design their tours once; that is not idleness
        yield from cpu_rows("console on the ground, no key, 80x24, CPU", {console.pid}, console, 3)
        ours |= family(console.pid)
        yield from cpu_rows(f"all {len(ours)} processes on the ground, CPU", ours, console, None)
        start(bus, console)
        wait(console, lambda: bool(status) and status[-1].armed == 8, 30, "eight vehicles armed")
        console.read(50)  # take-off, transfer to the tours
        ours |= family(console.pid)
        yield from cpu_rows(f"all {len(ours)} processes in flight at 1x, CPU", ours, console, 60)
        if status[-1].armed != 8 or status[-1].run is not m.RunPhase.RUNNING:
            raise NotMeasured(f"the fleet did not fly on: {status[-1].armed} armed, {status[-1].run}")
        bus.close()
    finally:
        end(ours)
        os.waitpid(console.pid, 0)


def painted(console: PtyConsole, began_s: float, mark: bytes) -> float:
    while mark not in console.output:
        console.read(0.005)
        if time.monotonic() - began_s > 30:
            raise NotMeasured(f"no frame within 30 s; it wrote {console.output[-200:]!r}")
    return time.monotonic() - began_s


def first_frame_again() -> Row:
    """A console attached to a running station, best of three: what the console itself takes."""
    taken_s = []
    for _ in range(3):
        began_s = time.monotonic()
        console = PtyConsole(["attach"], 80, 24)
        taken_s.append(painted(console, began_s, FLEET_MARK))
        console.kill()
    return Row("`attach`: first console frame, with the fleet, best of 3", min(taken_s), "s", 1)


def cpu_rows(name: str, pids: set[int], console: PtyConsole, limit: float | None) -> Iterator[Row]:
    before_s, began_s = sum(map(cpu_s, pids)), time.monotonic()
    console.read(MEASURED_S)
    used_s = sum(map(cpu_s, pids)) - before_s
    yield Row(name, 100 * used_s / (time.monotonic() - began_s), "%", limit)


def cpu_s(pid: int) -> float:
    """CPU seconds of a process so far; 10 ms steps where there is /proc, 1 s or 10 ms from ps elsewhere."""
    stat = Path("/proc") / str(pid) / "stat"
    if stat.exists():
        fields = stat.read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    shown = ps("-o", "time=", "-p", str(pid)).strip()
    if not shown:
        raise NotMeasured("a process has ended")
    days, _, clock = shown.rpartition("-")
    seconds = 0.0
    for part in clock.split(":"):
        seconds = seconds * 60 + float(part)
    return seconds + 86_400 * int(days or 0)


def family(pid: int) -> set[int]:
    """A process and all it started, directly or not."""
    parents = {int(a): int(b) for a, b in (line.split() for line in ps("-A", "-o", "pid=,ppid=").splitlines())}
    found, grown = {pid}, True
    while grown:
        more = {child for child, parent in parents.items() if parent in found} - found
        grown = bool(more)
        found |= more
    return found - {child for child in found if parents.get(child) == os.getpid() and child != pid}


def ps(*arguments: str) -> str:
    return subprocess.run(["ps", *arguments], capture_output=True, text=True, check=False).stdout


def joined() -> ZenohBus:
    for _ in range(100):
        try:
            return connect(socket_path(RunKind.SIM))
        except BusError:
            time.sleep(0.1)
    raise NotMeasured("no station within 10 s")


def wait(console: PtyConsole, what: Callable[[], bool], seconds: float, why: str) -> None:
    end_s = time.monotonic() + seconds
    while not what():
        console.read(0.1)
        if time.monotonic() > end_s:
            raise NotMeasured(f"not within {seconds:g} s: {why}")


def start(bus: ZenohBus, console: PtyConsole) -> None:
    """Start as a console does; asked again while the simulated vehicles still get ready."""
    request = m.encode(m.Start(vehicles=tuple(range(1, 9))))

    def started() -> bool:
        return m.decode(bus.ask("gcs/req/bench", request), m.Reply).ok

    wait(console, started, 30, "vehicles ready to start")


def end(pids: set[int]) -> None:
    """The console, then the supervisor, which ends its own; whatever is left by then is killed."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        for pid in sorted(pids):
            try:
                os.kill(pid, number)
            except ProcessLookupError:
                continue
        time.sleep(1.0)
