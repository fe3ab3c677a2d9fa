"""The frontend of a station: its checks before a start and its request handlers, built on a station's parts."""

from collections.abc import Sequence
from typing import Any

from tui_gcs.core.preflight.checklist import PreflightChecklist
from tui_gcs.core.preflight.readiness import Readiness
from tui_gcs.core.protocol.bus import OnQuestion
from tui_gcs.core.protocol.common import PreviewResult
from tui_gcs.core.protocol.preflight import Check
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.request_router import RequestRouter
from tui_gcs.core.station.station import Station


def attach_frontend(station: Station) -> "Frontend":
    """Let `station` answer requests; every part of the program that builds a station calls it."""
    frontend = Frontend(station)
    station.attach(frontend)
    return frontend


class Frontend:
    """Implements `StationFrontend`, which describes each method."""

    def __init__(self, station: Station) -> None:
        parts = station.parts
        self.readiness = Readiness(parts)
        self.checklist = PreflightChecklist(parts, self.readiness)
        self.requests = RequestRouter(RequestContext(parts, station.publisher, self.readiness, self.checklist))

    @property
    def in_control(self) -> str:
        """The principal of the newest command."""
        return self.requests.in_control

    @property
    def on_question(self) -> OnQuestion:
        """Answers a question of the bus: does what it asks, or replies why not."""
        return self.requests.answer

    def take_preview(self, worker: str, result: PreviewResult) -> None:
        """Take what a planner worker found out about an edited scenario."""
        self.requests.planners.take(worker, result)

    def why_not_start(self, vehicle: int) -> str:
        """Why this vehicle cannot be started now; "" if it can."""
        return self.readiness.why_not_start(vehicle)

    def checks(self) -> tuple[Check, ...]:
        """The list of checks before a start, the worst first."""
        return self.checklist.checks()

    def unfinished_tasks(self) -> list[tuple[int, str]]:
        """(vehicle, what) of tasks under way that change something on a vehicle."""
        return self.requests.tasks.unfinished()

    def acknowledged_checks(self) -> list[list[str | int]]:
        """What operators acknowledged of the checks, as the state file keeps it."""
        return self.checklist.memory()

    def recall_checks(self, held: Sequence[list[Any]]) -> None:
        """Take back what `acknowledged_checks` returned in an earlier run."""
        self.checklist.recall(list(held))
