"""Notes to the station's journal: what this console showed its operator."""

from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any

from tui_gcs.core.protocol.common import Note
from tui_gcs.feed.requests import ConsoleRequests

MAX_NOTES = 200


class JournalNotes:
    """Sends notes one after the other, and keeps those that the station did not take until it is heard again."""

    def __init__(
        self,
        requests: ConsoleRequests,
        spawn: Callable[[Coroutine[Any, Any, None]], None],
        is_station_lost: Callable[[], bool],
    ) -> None:
        """Begin empty; `spawn` runs a coroutine in the background."""
        self._requests = requests
        self._spawn = spawn
        self._is_station_lost = is_station_lost
        self._notes: deque[Note] = deque(maxlen=MAX_NOTES)
        self._is_sending = False

    def add(self, text: str, severity: int) -> None:
        """Have the journal know `text`, of a MAV_SEVERITY."""
        self._notes.append(Note(text=text, severity=severity))

    def send_soon(self) -> None:
        """Send what waits, in the background."""
        if self._notes and not self._is_sending:
            self._is_sending = True
            self._spawn(self._send())

    async def _send(self) -> None:
        while self._notes and not self._is_station_lost():
            # It stays in the queue until the station has taken it: one that is lost on the way is sent again.
            reply = await self._requests.send(self._notes[0])
            if not reply.ok:
                break
            self._notes.popleft()
        self._is_sending = False
