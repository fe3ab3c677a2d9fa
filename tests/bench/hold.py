"""What a HOLD ALL costs and waits for while 250 vehicles are heard, in CPU time: it does not depend on other load.

Console and station are in one process, on one thread and the in-memory bus; the vehicles are the stream of the other
figures on a virtual clock. From key to frame it takes at most: what the console does in one go, the console's own part,
what the station does in one go, the station's own part. `latency` measures the same by the wall clock, through real
processes.
"""

import asyncio
import time
from collections.abc import Iterator
from pathlib import Path

from tests.bench.latency import percentile
from tests.bench.row import NotMeasured, Row
from tests.bench.sender import answers, is_question
from tests.bench.station import SCENARIO
from tests.bench.stream import stream
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Hold
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.scenario.load import load
from tui_gcs.core.station.parts import StationConfig
from tui_gcs.core.station.station import Station
from tui_gcs.feed.requests import ConsoleRequests

VEHICLES, SECONDS, WARM_S, TICK_S = 250, 40.0, 10.0, 0.05
HOLD_EVERY_S = 0.1
SET_POSITION_TARGET = b"\x56\x00\x00"


class TimedLink(MemoryLink):
    """Notes at which CPU time each set-point leaves."""

    def __init__(self) -> None:
        super().__init__("memory")
        self.sent_s: list[float] = []

    def send(self, data: bytes, to: Address) -> None:
        if data[7:10] == SET_POSITION_TARGET:
            self.sent_s.append(time.process_time())
        super().send(data, to)


class HeardFleet:
    """A station that hears the stream, and what it sends, tick by tick."""

    def __init__(self, folder: Path) -> None:
        self.clock, self.bus, self.link = VirtualClock(), MemoryBus(), TimedLink()
        self.recorder, self.journal = TlogWriter(folder / "hold.tlog"), Journal(folder / "hold.jsonl")
        config = StationConfig(RunKind.LIVE, load(SCENARIO), SCENARIO.read_text(), "", judge_steps=False)
        self.station = Station(config, self.clock, self.bus, [self.link], self.recorder, self.journal)
        attach_frontend(self.station)
        self._due = iter(stream(VEHICLES, SECONDS))
        self._next = next(self._due, None)
        self._newest: dict[int, bytes] = {}
        self.pieces_ms: list[float] = []
        """CPU time of each part of a tick that nothing interrupts."""

    def tick(self) -> bool:
        """Pass `TICK_S`; False at the stream's end."""
        self.clock.advance(TICK_S)
        while self._next is not None and self._next.t_s <= self.clock.now():
            system = self._next.vehicle + 1
            if self._next.data:
                self._newest[system] = self._next.data
                self.link.inject(self._next.data, ("vehicle", system))
            self._next = next(self._due, None)
        self.station.receive()
        began_s = time.process_time()
        for _ in self.station.steps():
            self.pieces_ms.append((time.process_time() - began_s) * 1e3)
            began_s = time.process_time()
        while self.link.sent:
            data, (_, system) = self.link.sent.popleft()
            if is_question(data) and int(system) in self._newest:
                answer, _ = answers(int(system), data, self._newest[int(system)])
                self.link.inject(answer, ("vehicle", int(system)))
        return self._next is not None

    def close(self) -> None:
        self.recorder.close()
        self.journal.close()


def hold(folder: Path) -> Iterator[Row]:
    """About 60 s of CPU time."""
    first_ms, all_ms, pieces_ms = asyncio.run(_holds(folder))
    yield Row("HOLD ALL, console's call to the first frame: CPU p50", percentile(first_ms, 50), "ms")
    yield Row("HOLD ALL, console's call to the first frame: CPU p99", percentile(first_ms, 99), "ms", 5)
    yield Row("HOLD ALL, console's call to the last frame: CPU p99", percentile(all_ms, 99), "ms", 10)
    yield Row("station at 250 vehicles, in one go before a stop: CPU p99", percentile(pieces_ms, 99), "ms", 10)
    yield Row("station at 250 vehicles, in one go before a stop: CPU max", max(pieces_ms), "ms")


async def _holds(folder: Path) -> tuple[list[float], list[float], list[float]]:
    """Milliseconds of CPU time to the first and to the last frame of each HOLD ALL, and of the station's pieces."""
    fleet = HeardFleet(folder)
    requests = ConsoleRequests(fleet.bus, "console-bench")
    first_ms: list[float] = []
    all_ms: list[float] = []
    due_s = WARM_S
    while fleet.tick():
        if fleet.clock.now() < WARM_S:
            fleet.pieces_ms.clear()
        if fleet.clock.now() < due_s:
            continue
        due_s += HOLD_EVERY_S
        fleet.link.sent_s.clear()
        began_s = time.process_time()
        reply = requests.begin(Hold())
        answer = await reply
        if not fleet.link.sent_s:
            raise NotMeasured(f"nothing was sent: {answer.text} {answer.results}")
        first_ms.append((fleet.link.sent_s[0] - began_s) * 1e3)
        all_ms.append((fleet.link.sent_s[-1] - began_s) * 1e3)
    heard = len(fleet.station.picture.fleet.vehicles)
    if heard != VEHICLES:
        raise NotMeasured(f"{heard} of {VEHICLES} vehicles were heard")
    fleet.close()
    return first_ms, all_ms, fleet.pieces_ms
