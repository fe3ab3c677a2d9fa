"""Recorded events: what the station reported during a recorded flight and its telemetry alone does not show.

A telemetry log holds what vehicles sent. That a vehicle held alone, what an operator ordered and what planners reported
stands in the journal beside it, with the time of the same clock.
"""

from pathlib import Path
from typing import Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.journal import EventClass, JournalEvent
from tui_gcs.core.records.journal_reader import journal_event

CLASSES = (EventClass.ALARM, EventClass.OPERATOR, EventClass.PLANNER, EventClass.MISSION)
"""Events of the other classes are found again in the telemetry (`ReplayedFlight`), or mean nothing in a replay."""
MAX_TEXT = 300
_MARKS = tuple(f'"cls":"{each}"'.encode() for each in CLASSES)


class RecordedEvents:
    """The journalled events of `CLASSES` in the order of their times; copies of a flight share them."""

    def __init__(self, log: Path) -> None:
        """Read the journal beside the telemetry log; without one there are no events."""
        self._events = tuple(sorted(_read(log.with_suffix(".jsonl")), key=lambda event: event.wall_s))

    def __deepcopy__(self, _memo: dict[int, Any]) -> "RecordedEvents":
        return self

    def __bool__(self) -> bool:
        return bool(self._events)

    def until(self, wall_s: float, begin: int) -> tuple[JournalEvent, ...]:
        """Return the events from number `begin` on that are not later than the Unix time `wall_s`."""
        end = begin
        while end < len(self._events) and self._events[end].wall_s <= wall_s:
            end += 1
        return self._events[begin:end]


def _read(journal: Path) -> list[JournalEvent]:
    events = []
    try:
        with journal.open("rb") as file:
            for line in file:
                event = journal_event(line) if any(mark in line for mark in _MARKS) else None
                if event is not None and event.cls in CLASSES:
                    events.append(event)
    except OSError:
        return []
    return events


def cleaned(event: JournalEvent) -> tuple[EventClass, str, str, int]:
    """Return class, source, text and severity of an event; a journal from elsewhere may hold anything."""
    return event.cls, clean(event.source, MAX_TEXT), clean(event.text, MAX_TEXT), event.severity
