"""The event log: everything worth telling, numbered without gaps, kept for those who join later."""

import math
from collections import deque
from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.common import Event, EventClass

MAX_EVENTS = 2000
"""Events in memory; older ones are in the journal."""

EMERGENCY, ALERT, CRITICAL, ERROR, WARNING, NOTICE, INFO, DEBUG = range(8)
"""MAV_SEVERITY."""


class EventLog:
    """Numbers events, keeps the newest, hands each to listeners."""

    def __init__(self, clock: Clock) -> None:
        """An empty log."""
        self._clock = clock
        self._events: deque[Event] = deque(maxlen=MAX_EVENTS)
        self._seq = 0
        self._listeners: list[Callable[[Event], None]] = []
        self._last_said: dict[tuple[str, str], tuple[float, int, float]] = {}
        """(source, text, or what counts as the same): when it was told, how often not since, for how long not again."""
        self.suppressed = 0
        """Repeats that `report` did not tell because of `every_s`."""

    def listen(self, listener: Callable[[Event], None]) -> None:
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
        """Record an event; the same text of the same source at most once per `every_s` seconds. Whether it was told.

        `same`: what counts as the same text, where it holds numbers that always change. `seldom_s`: what goes on being
        said is told after twice the time each time, up to this.
        When it is told again it says how often it was not: "... (12 more)".
        """
        now = self._clock.now()
        if every_s > 0:
            key = (source, same or text)
            told_s, more, gap_s = self._last_said.get(key, (-math.inf, 0, every_s))
            if now - told_s < gap_s:
                self.suppressed += 1
                self._last_said[key] = (told_s, more + 1, gap_s)
                return False
            if len(self._last_said) > MAX_EVENTS:
                self._last_said.clear()
            goes_on = now - told_s <= 2 * gap_s
            self._last_said[key] = (now, 0, max(every_s, min(2 * gap_s, seldom_s)) if goes_on else every_s)
            if more:
                text = f"{text} … ({more} more)"
        self._tell(cls, source, text, severity)
        return True

    def _tell(self, cls: EventClass, source: str, text: str, severity: int) -> None:
        self._seq += 1
        now, wall_s = self._clock.now(), self._clock.wall()
        event = Event(seq=self._seq, t_s=now, wall_s=wall_s, cls=cls, severity=severity, source=source, text=text)
        self._events.append(event)
        for listener in self._listeners:
            listener(event)

    def since(self, seq: int, most: int = 500) -> tuple[Event, ...]:
        """Events after `seq`, the newest `most`."""
        return tuple(event for event in self._events if event.seq > seq)[-most:]
