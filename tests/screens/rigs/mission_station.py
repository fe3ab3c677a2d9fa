"""The fake station with vehicles that take and give plans, and a console on its missions screen."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import msgspec

from tests.screens.rigs.console import WIDE
from tests.screens.rigs.plan_station import KEYS, PlanConsole, PlanStation
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.app import ConsoleApp
from tui_gcs.console.parts import ConsoleOptions
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.screens.missions.missions_screen import MissionsScreen
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet

Rows = tuple[s.PlanRow, ...]


@dataclass
class MissionStation(PlanStation):
    """Every transfer is halfway when it is first looked at, and over the next time."""

    held: dict[tuple[int, str], Rows] = field(default_factory=dict)
    fails: dict[tuple[int, str], str] = field(default_factory=dict)
    """Why an upload of a kind of plan fails with a vehicle."""
    hangs: bool = False
    meets: dict[int, str] = field(default_factory=dict)
    """What the mission of a vehicle would meet, as the station says when it is asked to compare."""
    not_compared: str = ""
    _asked: dict[int, s.Request] = field(default_factory=dict)

    def uploads(self) -> list[tuple[int, str]]:
        """What was sent to whom, in order."""
        return [(r.vehicles[0], r.kind) for r in self.requests if isinstance(r, s.UploadPlan)]

    def _reply(self, request: m.AnyRequest) -> m.Reply:
        match request:
            case s.UploadPlan() | s.DownloadPlan():
                number = len(self._asked) + 1
                self._asked[number] = request
                vehicle = request.vehicles[0]
                self.tasks[number] = s.TaskInfo(number, vehicle, "plan", "console-test", "queued", 0, 10, "", 0.0)
                results = (m.VehicleResult(vehicle, True, ""),)
                return s.ServiceReply(ok=True, results=results, tasks=(self.tasks[number],))
            case s.CompareMission():
                results = tuple(
                    m.VehicleResult(v, v not in self.meets, self.meets.get(v, "")) for v in request.vehicles
                )
                return s.ServiceReply(ok=True, text=self.not_compared, results=results)
            case s.GetTasks():
                return s.ServiceReply(ok=True, tasks=tuple(self._further(n) for n in request.numbers))
            case s.GetTaskResult():
                asked = cast(s.DownloadPlan, self._asked[request.number])
                plan = self.held.get((asked.vehicles[0], asked.kind), ())
                return s.ServiceReply(ok=True, result=s.TaskResult(plan=plan))
            case s.CancelTask():
                self._state(request.number, "cancelled", 5, "cancelled")
                return s.ServiceReply(ok=True)
        return super()._reply(request)

    def _further(self, number: int) -> s.TaskInfo:
        info, asked = self.tasks[number], self._asked[number]
        if info.over or self.hangs:
            return info
        if info.state == "queued":
            return self._state(number, "running", 5)
        key = (info.vehicle, asked.kind)
        if isinstance(asked, s.UploadPlan) and key in self.fails:
            return self._state(number, "failed", 5, self.fails[key])
        if isinstance(asked, s.UploadPlan):
            self.held[key] = asked.items
        return self._state(number, "done", 10)

    def _state(self, number: int, state: str, done: int, text: str = "") -> s.TaskInfo:
        self.tasks[number] = msgspec.structs.replace(self.tasks[number], state=state, done=done, text=text)
        return self.tasks[number]


class MissionConsole(PlanConsole):
    """A console on its missions screen."""

    @property
    def missions(self) -> MissionsScreen:
        return next(screen for screen in self.app.screen_stack if isinstance(screen, MissionsScreen))

    @property
    def mission_station(self) -> MissionStation:
        return cast(MissionStation, self.station)

    def commands(self, vehicle: int = 1) -> list[int]:
        """Of the mission that is planned for a vehicle."""
        return [item.command for item in self.missions.editor.history.draft.of(vehicle).mission]

    async def type_into(self, name: str, text: str) -> None:
        """Replace what stands in a field, key by key."""
        for widget in self.missions.query("FormField, ChoiceField"):
            if getattr(widget, "field", "") == name and widget.focusable:
                widget.focus()
                await self.pilot.pause()
                break
        await self.press("ctrl+u", *(KEYS.get(character, character) for character in text))

    async def compared(self) -> None:
        """As if the operator had paused."""
        self.missions.compare_ways()
        await self.settle()

    def said(self) -> str:
        return self.missions.edit_line.text()

    def verdict(self) -> str:
        return " ".join(self.missions.verdict.text().split())


@asynccontextmanager
async def mission_console(
    size: tuple[int, int] = WIDE,
    prepare: Callable[[MissionStation], None] = lambda station: None,
    *,
    glyphs: GlyphSet = UNICODE,
    folder: Path | None = None,
) -> AsyncIterator[MissionConsole]:
    """A console showing the missions screen."""
    bus = MemoryBus()
    station = MissionStation(bus)
    prepare(station)
    clock = VirtualClock()
    app = ConsoleApp(bus, "console-test", options=ConsoleOptions(glyphs=glyphs, folder=folder), clock=clock)
    async with app.run_test(size=size):
        attached = MissionConsole(app, QuietPilot(app), station, clock)
        await attached.settle()
        await attached.tick()
        app.switch_mode("missions")  # by keys it is `p`, `m`: the plan screen would cost as much as all the rest
        await attached.settle()
        yield attached
