"""Rejection report: frames that are refused on the links become events, one line per cause, seldom, with the number.

The counters are always up to date; the events are for reading the log afterwards (docs/threats.md B.6).
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
"""The same cause is reported again after this long at the earliest."""
EXPECTED_CAUSES = frozenset(
    {
        "unknown message id",
        "before its first heartbeat",
        "not a vehicle",
        "copy over a second link",
        "late position",
        "position before its first fix",
        "radio status from a stranger",
    }
)
"""Causes that well-behaved traffic has, too: they are counted only."""
REPORTED_ELSEWHERE = frozenset(
    {
        "our own system id",
        "second source of one system id",
        "implausible position",
        "implausible home",
        "message table full",
    }
)
"""Causes with an event of their own that holds more."""


class RejectionReporter:
    """Reads the counters once a second and reports what is new."""

    def __init__(self, events: EventLog, dropped: RejectionCounter, intakes: Iterable[Intake]) -> None:
        """Read `dropped` and the counters of `intakes`."""
        self._events = events
        self._intakes = tuple(intakes)
        self._counters = (dropped, *(intake.dropped for intake in self._intakes))
        self._next_look_s = -math.inf
        self._reported: dict[tuple[str, str], tuple[float, int]] = {}
        """By (source, cause): when it was reported, and the count then."""

    def tick(self, now: float) -> None:
        """Report what is new, if it is time."""
        if now < self._next_look_s - 1e-9:
            return
        self._next_look_s = now + CHECK_S
        counts: Counter[tuple[str, str]] = Counter()
        for counter in self._counters:
            counts.update({("station", cause): count for cause, count in counter.items()})
        for intake in self._intakes:
            counts.update(_of_links(intake))
        for (source, cause), count in counts.items():
            if cause not in EXPECTED_CAUSES and cause not in REPORTED_ELSEWHERE:
                self._report(source, cause, count, now)

    def _report(self, source: str, cause: str, count: int, now: float) -> None:
        reported_s, reported = self._reported.get((source, cause), (-math.inf, 0))
        if count <= reported or now - reported_s < REPORT_INTERVAL_S:
            return
        self._reported[(source, cause)] = (now, count)
        text = (
            f"frames not taken: {cause} ({count - reported} more)"
            if reported
            else f"frames not taken: {cause} ({count})"
        )
        vehicles = {vehicle for counter in self._counters for vehicle in counter.take_vehicles(cause)}
        if len(vehicles) == 1:
            source = f"vehicle {vehicles.pop()}"
        elif vehicles:
            text += f": {vehicles_words(vehicles)}"
        self._events.report(EventClass.CONNECTION, source, text, NOTICE)


def _of_links(intake: Intake) -> Counter[tuple[str, str]]:
    """Return junk bytes and wrong checksums by link, those of forgotten sources included."""
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
