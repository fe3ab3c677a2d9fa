"""The event log: what the operator should know, numbered without gaps, kept for consoles that join later."""

import math
from collections import deque
from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.common import EventClass, JournalEvent

MAX_EVENTS = 2000
"""Events in memory; older ones are in the journal."""

EMERGENCY, ALERT, CRITICAL, ERROR, WARNING, NOTICE, INFO, DEBUG = range(8)
"""MAV_SEVERITY."""


class EventLog:
    """Numbers events, keeps the newest, and hands each to listeners."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._events: deque[JournalEvent] = deque(maxlen=MAX_EVENTS)
        self._seq = 0
        self._listeners: list[Callable[[JournalEvent], None]] = []
        self._last_reported: dict[tuple[str, str], tuple[float, int, float]] = {}
        """By (source, text or `same`): when it was reported, how many repeats since, and for how long not again, s."""

    def listen(self, listener: Callable[[JournalEvent], None]) -> None:
        """Call `listener` for every event from now on."""
        self._listeners.append(listener)

    def report(
        self,
        cls: EventClass,
        source: str,
        text: str,
        severity: int = INFO,
        *,
        every_s: float = 0.0,
        same: str = "",
        seldom_s: float = 0.0,
    ) -> bool:
        """Record an event, the same text of one source at most every `every_s` seconds; return whether it was recorded.

        `same` is what counts as the same text, where the text holds numbers that always change. `seldom_s`: a text that
        goes on is recorded after twice the time each time, up to this. The next record holds the number of repeats: "…
        (12 more)".
        """
        now = self._clock.now()
        if every_s > 0:
            key = (source, same or text)
            reported_s, more, gap_s = self._last_reported.get(key, (-math.inf, 0, every_s))
            if now - reported_s < gap_s:
                self._last_reported[key] = (reported_s, more + 1, gap_s)
                return False
            # A flood of different texts must not grow the table without bound; after clearing each text is reported
            # once more.
            if len(self._last_reported) > MAX_EVENTS:
                self._last_reported.clear()
            goes_on = now - reported_s <= 2 * gap_s
            self._last_reported[key] = (now, 0, max(every_s, min(2 * gap_s, seldom_s)) if goes_on else every_s)
            if more:
                text = f"{text} … ({more} more)"
        self._add(cls, source, text, severity)
        return True

    def _add(self, cls: EventClass, source: str, text: str, severity: int) -> None:
        self._seq += 1
        now, wall_s = self._clock.now(), self._clock.wall()
        event = JournalEvent(
            seq=self._seq, t_s=now, wall_s=wall_s, cls=cls, severity=severity, source=source, text=text
        )
        self._events.append(event)
        for listener in self._listeners:
            listener(event)

    @property
    def newest_seq(self) -> int:
        """The number of the newest event; 0 if there is none."""
        return self._seq

    def since(self, seq: int, most: int = 500) -> tuple[JournalEvent, ...]:
        """Return the events after `seq`, the newest `most` of them."""
        return tuple(event for event in self._events if event.seq > seq)[-most:]
