"""A console attached to a fake station, on a virtual clock, for Pilot tests."""

from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.actions.palette.own_commands import OwnCommands
from tui_gcs.app import ConsoleApp
from tui_gcs.client.user_settings import SettingsInUse
from tui_gcs.console.groups import GroupFile
from tui_gcs.console.parts import ConsoleOptions
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.formats.base_map_files import BaseMap
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Note, RunKind
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.fleet.result_panel import ResultPanel

WIDE, NARROW = (120, 40), (80, 24)


@dataclass
class Console:
    """What a test holds in its hands."""

    app: ConsoleApp
    pilot: QuietPilot
    station: FakeStation
    clock: VirtualClock

    @property
    def fly(self) -> FlyScreen:
        """The fly screen, wherever it lies in the stack."""
        return next(screen for screen in self.app.screen_stack if isinstance(screen, FlyScreen))

    def told(self) -> str:
        """Everything the operator was told, as the journal has it: the line itself is there for seconds only."""
        return "\n".join(request.text for request in self.station.requests if isinstance(request, Note))

    def result(self) -> str:
        """The table of the newest order; "" when it is closed."""
        panels = [panel for panel in self.app.screen_stack[0].query(ResultPanel) if panel.display]
        return panels[0].text() if panels else ""

    async def settle(self) -> None:
        """Everything asked is answered and shown."""
        await self.pilot.pause()
        await self.app.workers.wait_for_complete()
        await self.app.feed.idle()
        self.app.feed.deliver()
        await self.pilot.pause()

    async def tick(self, dt_s: float = 0.1) -> None:
        """The station moves on, the console shows it."""
        self.station.tick(dt_s)
        self.clock.advance(dt_s)
        await self.settle()

    async def tick_until(self, is_shown: Callable[[], bool], ticks: int = 10) -> None:
        """Ticks until it is shown, because an answer of the station may come a tick later on a loaded machine."""
        for _ in range(ticks):
            await self.tick()
            if is_shown():
                return

    async def press(self, *keys: str) -> None:
        """Keys, and what they lead to."""
        await self.pilot.press(*keys)
        await self.settle()

    def text(self) -> str:
        """The screen as plain text; the one place that reads Textual's compositor."""
        strips = self.app.screen._compositor.render_strips()
        return "\n".join(strip.text.rstrip() for strip in strips) + "\n"

    def line(self, y: int) -> str:
        """One line of the screen."""
        return self.text().splitlines()[y]


@asynccontextmanager
async def console(
    size: tuple[int, int] = WIDE,
    prepare: Callable[[FakeStation], None] = lambda station: None,
    *,
    kind: RunKind = RunKind.SIM,
    glyphs: GlyphSet = UNICODE,
    replay: bool = False,
    read_only: bool = False,
    groups: GroupFile | None = None,
    own_commands: Mapping[str, str] | None = None,
    settings: SettingsInUse | None = None,
    recordings: Mapping[str, Path] | None = None,
    base_map: BaseMap | None = None,
) -> AsyncIterator[Console]:
    """A running console on a station that `prepare` has set up."""
    bus = MemoryBus()
    station = FakeStation(bus, kind=kind)
    prepare(station)
    clock = VirtualClock()
    app = ConsoleApp(
        bus,
        "console-test",
        kind,
        ConsoleOptions(
            glyphs=glyphs,
            replay=replay,
            read_only=read_only,
            groups=groups,
            recordings=recordings or {},
            base_map=base_map,
            own_commands=OwnCommands(own_commands) if own_commands else None,
            settings=settings or SettingsInUse(),
        ),
        clock=clock,
    )
    async with app.run_test(size=size):
        attached = Console(app, QuietPilot(app), station, clock)
        await attached.settle()
        await attached.tick()
        yield attached
