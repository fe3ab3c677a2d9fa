"""The fake station with a scenario text that can be replaced, as the plan screen needs it.

Also a program: `python -m tests.screens.rigs.plan_station [scene]` shows the console on it.
"""

import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from tests.screens.rigs.console import WIDE, Console
from tests.screens.rigs.fake_station import SCENARIO_FILE, SCENES, FakeStation
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.app import ConsoleApp
from tui_gcs.console.parts import ConsoleOptions
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.scenario.load import parse, read_text
from tui_gcs.screens.plan.plan_screen import PlanScreen
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet


@dataclass
class PlanStation(FakeStation):
    """Answers GetScenario and ApplyScenario like the real one."""

    path: str = str(SCENARIO_FILE)
    toml: str = ""
    revision: int = 1
    refuse_apply: str = ""
    answers: Callable[[m.AnyRequest], m.Reply | None] = lambda _request: None
    """Before everything else: a reply, or None."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.toml = self.toml or read_text(SCENARIO_FILE)
        self.scenario = parse(self.toml)

    def keep_in(self, file: Path) -> None:
        """It flies what stands in this file."""
        file.write_text(self.toml)
        self.path = str(file)

    def change(self) -> m.ScenarioChanged:
        return m.ScenarioChanged(revision=self.revision, path=self.path, toml=self.toml, scenario=self.scenario)

    def set_scenario(self, toml: str) -> None:
        """As if another console had applied this."""
        self.toml, self.scenario, self.revision = toml, parse(toml), self.revision + 1
        self.bus.publish(keys.SCENARIO, m.encode(self.change()))

    def applied(self) -> list[m.ApplyScenario]:
        return [request for request in self.requests if isinstance(request, m.ApplyScenario)]

    def _reply(self, request: m.AnyRequest) -> m.Reply:
        if (reply := self.answers(request)) is not None:
            return reply
        if isinstance(request, m.GetScenario):
            return m.Reply(ok=True, scenario=self.change())
        if isinstance(request, m.ApplyScenario):
            if self.refuse_apply:
                return m.Reply(ok=False, text=self.refuse_apply)
            if request.base_revision != self.revision:
                return m.Reply(ok=False, text="the scenario has changed since you began to edit")
            self.set_scenario(request.toml)
            return m.Reply(ok=True, text="scenario applied", scenario=self.change())
        return super()._reply(request)


class PlanConsole(Console):
    """A console on its plan screen."""

    @property
    def plan(self) -> PlanScreen:
        return cast(PlanScreen, self.app.screen)

    @property
    def plan_station(self) -> PlanStation:
        return cast(PlanStation, self.station)

    async def field(self, name: str) -> None:
        """Put the cursor into this field of a form, everything in it selected."""
        for widget in self.plan.query("FormField, ChoiceField, CornersField"):
            if getattr(widget, "field", "") == name and widget.focusable:
                widget.focus()
                await self.pilot.pause()
                return
        raise AssertionError(f"no field {name} can have the cursor")

    async def type_into(self, name: str, text: str) -> None:
        """Replace what stands in a field, key by key."""
        await self.field(name)
        await self.press("ctrl+u", *(KEYS.get(character, character) for character in text))

    def map_zone(self, name: str) -> object:
        """The shape the map draws for a zone."""
        current = self.plan.map_view.content.current
        return next(zone.shape for zone in current.zones if zone.name == name)

    def verdict(self) -> str:
        return " ".join(self.plan.verdict.text().split())

    def said(self) -> str:
        return self.plan.edit_line.text()


KEYS = {" ": "space", ".": "full_stop", "-": "minus", ",": "comma", "/": "slash", "_": "underscore"}


@asynccontextmanager
async def plan_console(
    size: tuple[int, int] = WIDE,
    prepare: Callable[[PlanStation], None] = lambda station: None,
    *,
    glyphs: GlyphSet = UNICODE,
    **station_values: object,
) -> AsyncIterator[PlanConsole]:
    """A console showing the plan screen."""
    bus = MemoryBus()
    station = PlanStation(bus, **station_values)
    prepare(station)
    clock = VirtualClock()
    app = ConsoleApp(bus, "console-test", options=ConsoleOptions(glyphs=glyphs), clock=clock)
    async with app.run_test(size=size):
        attached = PlanConsole(app, QuietPilot(app), station, clock)
        await attached.settle()
        await attached.tick()
        await attached.press("p")
        yield attached


def main(argv: list[str]) -> None:
    """Run the console on this station at 10 Hz."""
    import threading
    import time

    bus = MemoryBus()
    station = PlanStation(bus)
    scene: Callable[[FakeStation], None] = SCENES[argv[0] if argv else "ground"]
    scene(station)
    stopped = threading.Event()

    def publish() -> None:
        while not stopped.is_set():
            station.tick(0.1)
            time.sleep(0.1)

    threading.Thread(target=publish, daemon=True).start()
    ConsoleApp(bus, "console-test").run()
    stopped.set()


if __name__ == "__main__":
    main(sys.argv[1:])
