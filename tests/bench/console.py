"""What a console costs: bytes to the terminal, CPU, memory, and how soon a key is answered.

Bytes and CPU of a picture first in lock-step, five pictures a second: the bytes are exact on every machine, also a busy
one, where a console that does not get its turn paints less. Then through a pty: a paper station in a process of its
own publishes over the real bus; the console is the real one. The naive console, Textual alone with every panel
refreshed, is measured in the same run, beside it.
"""

import asyncio
import contextlib
import gc
import itertools
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.color import ColorSystem

from tests.bench.latency import percentile
from tests.bench.live import FLEET_MARK, cpu_s, painted
from tests.bench.row import NotMeasured, Row
from tests.rigs.console_pty import PtyConsole
from tests.screens.rigs.meter import metered
from tui_gcs.feed.logs.event_history import MAX_EVENTS

CHILD = "tests.bench.console_child"
COLUMNS, LINES = 120, 40
SETTLED_S, MEASURED_S = 4.0, 15.0
COLOURS = {
    "16 colours": {"TERM": "xterm-16color", "COLORTERM": ""},
    "256 colours": {"TERM": "xterm-256color", "COLORTERM": ""},
    "16 colours, slow": {"TERM": "xterm-16color", "COLORTERM": "", "TUI_GCS_SLOW": "1"},
    "truecolour": {"TERM": "xterm-256color", "COLORTERM": "truecolor"},
}
LIMITS_KB_S = {
    (8, "16 colours"): 3.0,
    (8, "256 colours"): 3.0,
    (8, "truecolour"): 3.0,
    (50, "16 colours"): 8.0,
    (50, "256 colours"): 8.0,
    (50, "truecolour"): 14.0,
}
SYSTEMS = {
    "16 colours": ColorSystem.STANDARD,
    "256 colours": ColorSystem.EIGHT_BIT,
    "truecolour": ColorSystem.TRUECOLOR,
}
FLOWN_S = 10.0
BEGIN_S, HOUR_S = 120, 3600
"""Until trails, events and caches are as full as they get, then one hour."""
KEYS = 60
BLOCKED_S = 10.0


def console(folder: Path) -> Iterator[Row]:
    """All of it."""
    for count, system in itertools.product((8, 50, 250), ("16 colours", "256 colours", "truecolour")):
        yield from lock_step(count, system)
    yield from an_hour()
    for count in (8, 50, 250):
        with paper_station(count):
            naive = rate(count, "truecolour", ["--naive"])
            yield Row(f"{count} vehicles, naive, truecolour: written", naive[0], "kB/s")
            yield Row(f"{count} vehicles, naive: CPU of the console", naive[1], "%")
            for colours in ("16 colours", "256 colours", "truecolour"):
                kb_s, cpu, rss_mb = rate(count, colours)
                name = f"{count} vehicles, {COLUMNS}x{LINES}, {colours}"
                yield Row(f"{name}: written", kb_s, "kB/s", LIMITS_KB_S.get((count, colours)))
            yield Row(f"{count} vehicles: naive to ours, bytes", naive[0] / kb_s, "x")
            yield Row(f"{count} vehicles: CPU of the console", cpu, "%", 12 if count == 250 else None)
            kb_s, _, _ = rate(count, "16 colours, slow")
            yield Row(f"{count} vehicles, --slow: written", kb_s, "kB/s", 2.0 if count <= 50 else None)
            if count == 250:
                yield Row("250 vehicles: resident memory", rss_mb, "MB", 120)
                yield from keys()
                yield from blocked(folder)
                yield first_frame()


def lock_step(count: int, colours: str) -> Iterator[Row]:
    """Exact: bytes of ten seconds, and the CPU they took."""
    written, cpu_used_s = asyncio.run(metered_flight(count, SYSTEMS[colours], naive=False))
    limit = LIMITS_KB_S.get((count, colours))
    yield Row(f"lock-step, {count} vehicles, {colours}: written", written / FLOWN_S / 1000, "kB/s", limit)
    if colours == "truecolour":
        naive, naive_cpu_s = asyncio.run(metered_flight(count, SYSTEMS[colours], naive=True))
        yield Row(f"lock-step, {count} vehicles, naive: written", naive / FLOWN_S / 1000, "kB/s")
        yield Row(f"lock-step, {count} vehicles: naive to ours, bytes", naive / written, "x")
        yield Row(f"lock-step, {count} vehicles: CPU", 100 * cpu_used_s / FLOWN_S, "%", 12 if count == 250 else None)
        yield Row(f"lock-step, {count} vehicles, naive: CPU", 100 * naive_cpu_s / FLOWN_S, "%")


def an_hour() -> Iterator[Row]:
    """Memory over an hour of flight with 250 vehicles, a picture and an event each second, as fast as it goes."""

    async def fly() -> tuple[float, float]:
        async with metered(250, ColorSystem.TRUECOLOR) as meter:
            await meter.pass_time(BEGIN_S)
            gc.collect()
            begin_mb = resident_mb(os.getpid())
            await meter.pass_time(HOUR_S)
            if len(meter.app.feed.events.kept) < MAX_EVENTS:
                raise NotMeasured("the console missed events")
            gc.collect()
            return begin_mb, resident_mb(os.getpid())

    begin_mb, end_mb = asyncio.run(fly())
    yield Row("lock-step, 250 vehicles, an hour: memory grows by", end_mb - begin_mb, "MB", 3)


async def metered_flight(count: int, system: ColorSystem, *, naive: bool) -> tuple[int, float]:
    """(bytes, CPU seconds) of `FLOWN_S` in flight."""
    async with metered(count, system, naive=naive) as meter:
        return await meter.fly(FLOWN_S)


def rate(count: int, colours: str, options: list[str] | None = None) -> tuple[float, float, float]:
    """(kB/s written, CPU in % of a core, resident MB) of a console in flight."""
    with attached(colours, options or []) as terminal:
        terminal.read(SETTLED_S)
        before_s, began_s = cpu_s(terminal.pid), time.monotonic()
        written = len(terminal.read(MEASURED_S))
        elapsed_s = time.monotonic() - began_s
        return written / elapsed_s / 1000, 100 * (cpu_s(terminal.pid) - before_s) / elapsed_s, resident_mb(terminal.pid)


def keys() -> Iterator[Row]:
    """From a key to the words that answer it, while 250 vehicles fly."""
    chance, delays_ms = random.Random(1), []
    with attached("256 colours", []) as terminal:
        terminal.read(SETTLED_S)
        for _ in range(KEYS):
            terminal.read(chance.uniform(0.2, 0.5))
            pressed_s = time.monotonic()
            terminal.press(b"5")
            until(terminal, lambda got: b"5_" in got)
            delays_ms.append((time.monotonic() - pressed_s) * 1000)
            terminal.read(0.1)
            terminal.press(b"\x7f\x1b")
            terminal.read(0.3)
    yield Row("250 vehicles, key to screen: p50", percentile(delays_ms, 50), "ms")
    yield Row("250 vehicles, key to screen: p95", percentile(delays_ms, 95), "ms", 50)


def blocked(folder: Path) -> Iterator[Row]:
    """Nobody reads the terminal for a while: does the loop go on, and is it said afterwards?"""
    gaps = folder / "gaps"
    with attached("truecolour", ["--storm", "--gaps", str(gaps)]) as terminal:
        terminal.read(SETTLED_S)
        began_s = time.monotonic()
        time.sleep(BLOCKED_S)
        noted = [[float(word) for word in line.split()] for line in gaps.read_text().splitlines()]
        gap_s = max((gap_s for at_s, gap_s in noted if at_s > began_s), default=0.0)
        terminal.read(3.0)
        said = b"LAGGED" in terminal.output
    yield Row(f"terminal not read for {BLOCKED_S:.0f} s: longest gap of the loop", gap_s, "s", 0.25)
    yield Row("terminal not read: said afterwards", float(said), "", 1, at_least=True)


def first_frame() -> Row:
    """From the start of the process to a frame with the fleet, best of three."""
    taken_s = []
    for _ in range(3):
        began_s = time.monotonic()
        terminal = PtyConsole([], COLUMNS, LINES, module=CHILD)
        taken_s.append(painted(terminal, began_s, FLEET_MARK))
        terminal.kill()
    return Row("first frame with the fleet, best of 3", min(taken_s), "s", 0.8)


@contextlib.contextmanager
def attached(colours: str, options: list[str]) -> Iterator[PtyConsole]:
    """A console that shows the fleet."""
    terminal = PtyConsole(options, COLUMNS, LINES, COLOURS[colours], CHILD)
    try:
        painted(terminal, time.monotonic(), FLEET_MARK)
        yield terminal
    finally:
        terminal.kill()


@contextlib.contextmanager
def paper_station(count: int) -> Iterator[None]:
    """So many vehicles in flight, in a process of its own."""
    process = subprocess.Popen([sys.executable, "-m", "tests.screens.rigs.paper_fleet", str(count)])
    try:
        time.sleep(1.0)
        if process.poll() is not None:
            raise NotMeasured("the paper station did not start")
        yield
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()


def until(terminal: PtyConsole, what: Callable[[bytes], bool], seconds: float = 5.0) -> None:
    """Read until what was read satisfies."""
    got, end_s = b"", time.monotonic() + seconds
    while not what(got):
        got += terminal.read_some(0.5)
        if time.monotonic() > end_s:
            raise NotMeasured("no answer to a key")


def resident_mb(pid: int) -> float:
    """Resident memory of a process; NaN where there is no /proc."""
    try:
        return int((Path("/proc") / str(pid) / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except OSError:
        return float("nan")
