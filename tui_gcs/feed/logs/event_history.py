"""The station's events in order, none missing: a gap in their numbers is filled by asking the station."""

from collections import deque
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

from tui_gcs.core.protocol.common import GetEvents, JournalEvent
from tui_gcs.feed.requests import ConsoleRequests

MAX_EVENTS = 500
"""Events that a console keeps for its screens; the journal screen asks the station for older ones."""
NO_EVENT = -1


class EventHistory:
    """Keeps the newest events, and gives them to `on_events` in the order of their numbers."""

    def __init__(
        self,
        requests: ConsoleRequests,
        spawn: Callable[[Coroutine[Any, Any, None]], None],
        on_events: Callable[[tuple[JournalEvent, ...]], None],
    ) -> None:
        """Begin empty and waiting for `fill`; `spawn` runs a coroutine in the background."""
        self._requests = requests
        self._spawn = spawn
        self._on_events = on_events
        self.kept: deque[JournalEvent] = deque(maxlen=MAX_EVENTS)
        """The newest events, oldest first."""
        self._waiting: list[JournalEvent] = []
        self._last = NO_EVENT
        self._is_filling = True
        self._beginnings = 0
        """How often everything was forgotten; an answer to a question from before then is dropped."""

    def begin_again(self, *, restarted: bool) -> None:
        """Hold events back until `fill`; a station that was `restarted` numbers them from 0 again."""
        self._is_filling = True
        self._last = NO_EVENT if restarted else self._last

    def forget(self) -> None:
        """Drop everything: a replay went back, and what came after that moment has not happened yet."""
        self._beginnings += 1
        self.kept.clear()
        self._waiting = []
        self.begin_again(restarted=True)

    def take(self, events: Sequence[JournalEvent]) -> None:
        """Pass events on in order; where one is missing, all wait until the station was asked for it."""
        self._waiting += events
        if self._is_filling or not self._waiting:
            return
        fresh = {event.seq: event for event in self._waiting if event.seq > self._last}
        # The bus may drop samples (congestion control DROP): a number that is missing shows it.
        if fresh and max(fresh) - self._last != len(fresh):
            self._is_filling = True
            self._spawn(self.fill())
            return
        self._waiting = []
        self._pass_on(fresh)

    async def fill(self) -> None:
        """Ask for missed events, then go on with what waited; what the station no longer has is skipped."""
        beginnings = self._beginnings
        reply = await self._requests.send(GetEvents(after=self._last))
        if beginnings != self._beginnings:
            return
        merged = {event.seq: event for event in (*reply.events, *self._waiting) if event.seq > self._last}
        self._waiting = []
        self._is_filling = False
        self._pass_on(merged)

    def _pass_on(self, events: dict[int, JournalEvent]) -> None:
        if events:
            ordered = tuple(events[seq] for seq in sorted(events))
            self._last = ordered[-1].seq
            self.kept.extend(ordered)
            self._on_events(ordered)
