"""What a station needs of the floors above it, which check starts and answer requests."""

from collections.abc import Sequence
from typing import Any, Protocol

from tui_gcs.core.protocol.bus import OnQuestion
from tui_gcs.core.protocol.common import PreviewResult
from tui_gcs.core.protocol.preflight import Check


class StationFrontend(Protocol):
    """Answers requests of the bus and checks vehicles before a start; `core/requests/frontend.py` is the real one.

    The station only knows this protocol, so its floor does not import those of preflight checks and requests.
    """

    @property
    def in_control(self) -> str:
        """The principal of the newest command; "" before the first."""
        ...

    @property
    def on_question(self) -> OnQuestion:
        """Answers a question of the bus: does what it asks, or replies why not."""
        ...

    def take_preview(self, worker: str, result: PreviewResult) -> None:
        """Take what the planner worker of a team found out about an edited scenario."""
        ...

    def why_not_start(self, vehicle: int) -> str:
        """Why this vehicle cannot be started now; "" if it can."""
        ...

    def checks(self) -> tuple[Check, ...]:
        """The list of checks before a start, the worst first."""
        ...

    def unfinished_tasks(self) -> list[tuple[int, str]]:
        """(vehicle, what) of tasks under way that change something on a vehicle."""
        ...

    def acknowledged_checks(self) -> list[list[str | int]]:
        """What operators acknowledged of the checks, as the state file keeps it."""
        ...

    def recall_checks(self, held: Sequence[list[Any]]) -> None:
        """Take back what `acknowledged_checks` returned in an earlier run."""
        ...
