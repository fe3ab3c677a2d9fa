"""What the stores and dialogues of a vehicle need of it."""

from typing import Any, Protocol

from sitl.modes import Severity
from sitl.tasks import Tasks


class Host(Protocol):
    """The vehicle as its mission store, parameters, files and logs see it."""

    now_us: int
    power_on_us: int
    armed: bool
    tasks: Tasks

    def send(self, name: str, **fields: Any) -> None:
        """Queue one frame."""

    def text(self, severity: Severity, text: str) -> None:
        """Queue a STATUSTEXT."""
