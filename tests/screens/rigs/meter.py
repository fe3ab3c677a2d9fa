"""Bytes that a console writes to its terminal, in lock-step: exact, the same on every machine."""

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import msgspec
from rich.color import ColorSystem
from rich.console import RenderableType
from textual.app import App
from textual.screen import Screen

from tests.screens.rigs.paper_fleet import FRAME_HZ, STATUS_HZ, PaperFleet
from tui_gcs.app import ConsoleApp
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import EventClass, JournalEvent, encode
from tui_gcs.feed.feed import PERIOD_S

FRAMES_REPEATED = 20
SOMETHING: dict[str, Any] = {
    "cls": EventClass.VEHICLE,
    "severity": 6,
    "source": "vehicle 1",
    "text": "mission item 7 reached",
}
TURNS = 12
"""Turns of the event loop in which all that follows from a message has been handled."""


class MeteredConsole(ConsoleApp):
    """A console that thinks it has a terminal."""

    @property
    def is_headless(self) -> bool:
        return False


class NaiveConsole(MeteredConsole):
    """Textual alone, every panel whole each time: what `update` and `refresh` without thought lead to."""

    def _display(self, screen: Screen[Any], renderable: RenderableType | None) -> None:
        App._display(self, screen, renderable)


@dataclass
class Meter:
    """A console in flight and what it has written."""

    app: ConsoleApp
    station: PaperFleet
    clock: VirtualClock
    written: list[str]
    events: int = -1
    """Number of the newest."""

    async def painted(self) -> None:
        """Everything that is under way is on the screen."""
        for _ in range(TURNS):
            await asyncio.sleep(0)
        self.app.screen._on_timer_update()

    async def fly(self, seconds: float) -> tuple[int, float]:
        """(bytes, CPU seconds of the console) of so many seconds."""
        before, cpu_s, ticks = len(self.written), 0.0, round(FRAME_HZ * PERIOD_S)
        for delivery in range(round(seconds / PERIOD_S)):
            for _ in range(ticks):
                self.station.publish_fleet(1.0 / FRAME_HZ)
            if delivery % round(1.0 / STATUS_HZ / PERIOD_S) == 0:
                self.station.publish_status()
            self.clock.advance(PERIOD_S)
            began_s = time.process_time()
            self.app.feed.deliver()
            if isinstance(self.app, NaiveConsole):
                for widget in self.app.screen.walk_children():
                    widget.notify_style_update()
                    widget.refresh()
            await self.painted()
            cpu_s += time.process_time() - began_s
        return sum(len(text.encode()) for text in self.written[before:]), cpu_s

    async def pass_time(self, seconds: int) -> None:
        """So many seconds with one picture each and an event; the paper fleet repeats itself, for it costs most."""
        frames = []
        for _ in range(FRAMES_REPEATED):
            self.station.t_s += 1.0
            frames.append(self.station.frame())
        for second in range(seconds):
            self.station.t_s += 1.0
            t_s = self.station.t_s
            frame = msgspec.structs.replace(frames[second % len(frames)], seq=10_000 + second, t_s=t_s, wall_s=t_s)
            self.station.bus.publish(keys.FLEET, encode(frame))
            self.events += 1
            self.station.bus.publish(
                keys.EVENT, encode(JournalEvent(seq=self.events, t_s=t_s, wall_s=t_s, **SOMETHING))
            )
            self.clock.advance(1.0)
            self.app.feed.deliver()
            await self.painted()
            self.written.clear()


@asynccontextmanager
async def metered(
    count: int, colours: ColorSystem, *, size: tuple[int, int] = (120, 40), naive: bool = False
) -> AsyncIterator[Meter]:
    """`count` vehicles in flight on a console of this size."""
    bus, clock, written = MemoryBus(), VirtualClock(), []
    station = PaperFleet(bus, count=count)
    station.fly()
    app = (NaiveConsole if naive else MeteredConsole)(bus, "console-test", clock=clock)
    app.console._color_system = colours
    async with app.run_test(size=size) as pilot:
        app._driver.write = written.append
        app.redraw()
        meter = Meter(app, station, clock, written)
        await pilot.pause()
        await app.feed.idle()
        await meter.fly(2.0)
        yield meter
