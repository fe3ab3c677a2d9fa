"""The planner log on the bus: what planners print and log, line by line, read a piece at a time.

Part of `core/protocol/services.py`. The station keeps it in a file (`core/records/planner_log.py`) and publishes none
of it: the planner log screen asks for it while it is shown.
"""

from dataclasses import dataclass
from enum import StrEnum

from tui_gcs.core.protocol.base import Message, Request

PLANNER_LOG_END = -1


class PlannerLogLevel(StrEnum):
    """Where a line comes from, or how severe its author called it."""

    STDOUT = "stdout"
    """Printed by the planner."""
    STDERR = "stderr"
    """Written to stderr, by the planner, a library or Python itself."""
    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"
    CRITICAL = "critical"
    """These five: a record of Python's `logging`."""
    EVENT = "event"
    """A note of the planner (`Output.notes`), or what the station found about it; it is in the journal, too."""
    STATION = "station"
    """What the station did: a worker started or ended, lines that were left out."""


RANKS = {
    PlannerLogLevel.DEBUG: 0,
    PlannerLogLevel.STDOUT: 1,
    PlannerLogLevel.INFO: 1,
    PlannerLogLevel.EVENT: 1,
    PlannerLogLevel.STDERR: 2,
    PlannerLogLevel.WARNING: 2,
    PlannerLogLevel.STATION: 2,
    PlannerLogLevel.ERROR: 3,
    PlannerLogLevel.CRITICAL: 3,
}
"""How severe the levels count for a filter. What is written to stderr is usually a warning or a traceback."""


class PlannerLogLine(Message, frozen=True, array_like=True):
    """One line; its texts are clean."""

    wall_s: float
    """When the station read it, Unix time."""
    team: str
    planner: str
    level: PlannerLogLevel
    text: str


@dataclass(frozen=True)
class PlannerLogFilter:
    """Which lines are shown: all parts of the filter must fit."""

    words: str = ""
    team: str = ""
    """Empty: lines of all teams."""
    least_rank: int = 0
    """See `RANKS`."""

    def passes(self, line: PlannerLogLine) -> bool:
        """Return whether a line fits every part of the filter."""
        if RANKS[line.level] < self.least_rank or (self.team and line.team != self.team):
            return False
        text = f"{line.team} {line.planner} {line.level} {line.text}".casefold()
        return all(word in text for word in self.words.casefold().split())


class PlannerLogPiece(Message, frozen=True):
    """Lines that follow each other, oldest first, and their places in the log."""

    lines: tuple[PlannerLogLine, ...]
    begin: int
    """Place of the first line: ask for what is older before it."""
    end: int
    """Place after the last line: ask for what is newer after it."""
    is_oldest: bool
    """Nothing older is kept."""
    left_out: int
    """Lines of floods that were counted instead of kept, since this station began."""
    path: str
    """The file on the station's computer."""


class GetPlannerLog(Request, frozen=True, tag="get-planner-log"):
    """A piece of the planner log (`ServiceReply.planner_log`): what lies before a place in it, or after it."""

    at: int = PLANNER_LOG_END
    newer: bool = False
    """The lines after `at`; else those before it."""
