"""Tells what is refused on the links, and of whom: a line per cause, seldom, with how often (security.md B.6).

The counters know everything at once; this is for who reads the log afterwards.
"""

import math
from collections import Counter
from collections.abc import Iterable

from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.mavlink.intake import Intake
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, EventLog

CHECK_S = 1.0
REPORT_INTERVAL_S = 30.0
"""The same cause again at the earliest."""
EXPECTED_CAUSES = frozenset(
    {
        "unknown message id",
        "before its first heartbeat",
        "not a vehicle",
        "copy over a second link",
        "late position",
        "radio status from a stranger",
    }
)
"""What well-behaved traffic brings, too: counted only."""
REPORTED_ELSEWHERE = frozenset(
    {
        "our own system id",
        "second source of one system id",
        "implausible position",
        "implausible home",
        "message table full",
    }
)
"""With an event of their own that says more."""


class RejectionReporter:
    """Looks at the counters once a second."""

    def __init__(self, events: EventLog, dropped: RejectionCounter, intakes: Iterable[Intake]) -> None:
        """`dropped` and the counters of `intakes` are watched; nothing is told of what they hold now."""
        self._events = events
        self._intakes = tuple(intakes)
        self._tallies = (dropped, *(intake.dropped for intake in self._intakes))
        self._next_look_s = -math.inf
        self._told: dict[tuple[str, str], tuple[float, int]] = {}
        """(source, cause): when it was told, and how many that were."""

    def tick(self, now: float) -> None:
        """Tell what is new, if it is time."""
        if now < self._next_look_s - 1e-9:
            return
        self._next_look_s = now + CHECK_S
        counts: Counter[tuple[str, str]] = Counter()
        for tally in self._tallies:
            counts.update({("station", cause): count for cause, count in tally.items()})
        for intake in self._intakes:
            counts.update(_of_links(intake))
        for (source, cause), count in counts.items():
            if cause not in EXPECTED_CAUSES and cause not in REPORTED_ELSEWHERE:
                self._tell(source, cause, count, now)

    def _tell(self, source: str, cause: str, count: int, now: float) -> None:
        told_s, told = self._told.get((source, cause), (-math.inf, 0))
        if count <= told or now - told_s < REPORT_INTERVAL_S:
            return
        self._told[(source, cause)] = (now, count)
        text = f"frames not taken: {cause} ({count - told} more)" if told else f"frames not taken: {cause} ({count})"
        whose = {vehicle for tally in self._tallies for vehicle in tally.take_vehicles(cause)}
        if len(whose) == 1:
            source = f"vehicle {whose.pop()}"
        elif whose:
            text += f": {vehicles_words(whose)}"
        self._events.report(EventClass.CONNECTION, source, text, NOTICE)


def _of_links(intake: Intake) -> Counter[tuple[str, str]]:
    """Junk and wrong checksums per link; of sources that are forgotten, too."""
    found: Counter[tuple[str, str]] = Counter()
    for source in intake.sources.values():
        if source.junk_bytes:
            found[(f"link {source.link}", "junk bytes")] += source.junk_bytes
        if source.bad_crc:
            found[(f"link {source.link}", "bad CRC")] += source.bad_crc
    for key, count in intake.past.items():
        link, _, cause = key.partition(" ")
        if cause in ("junk bytes", "bad CRC"):
            found[(f"link {link}", cause)] += count
    return found
