"""The newest heartbeats of a vehicle, and whether those from another address only repeat them.

A replay of a vehicle's frames must not make it look like two. A real second vehicle sends the same few heartbeats, too,
but not in the order of the first one's: frames between them move the sequence number on.
"""

from collections import deque

MAX_HEARTBEATS = 300
"""Five minutes at 1 Hz: an older recording is not known as one."""
MAX_SKIPPED = 3
"""Heartbeats that a replay may leave out, or that were lost."""
MAX_LATE = 3
"""Heartbeats that a slow second link of the vehicle may be behind."""


class HeartbeatHistory:
    """Heartbeats as they came over accepted paths, byte for byte."""

    def __init__(self) -> None:
        self._frames: deque[bytes] = deque(maxlen=MAX_HEARTBEATS)
        self._first = 0
        """Number of the oldest frame that is kept."""

    def add(self, raw: bytes) -> None:
        """Keep a heartbeat of the vehicle; the newest one may come twice."""
        if self._frames and self._frames[-1] == raw:
            return
        if len(self._frames) == MAX_HEARTBEATS:
            self._first += 1
        self._frames.append(raw)

    def is_recent(self, raw: bytes) -> bool:
        """Whether it is among the newest heartbeats, as over a second link that is somewhat slower."""
        return raw in list(self._frames)[-MAX_LATE:]

    def find(self, raw: bytes, before: int | None) -> tuple[int | None, bool]:
        """Look for a heartbeat from another address; `before` is the number of the one before it, None at first.

        Returns its number, or `before` if it is not known, and whether it goes on with a replay.
        """
        if before is not None:
            low = max(0, before - self._first)
            for at in range(low, min(len(self._frames), before - self._first + MAX_SKIPPED + 1)):
                if self._frames[at] == raw:
                    return self._first + at, True
        for at in range(len(self._frames) - 1, -1, -1):
            if self._frames[at] == raw:
                return self._first + at, before is None
        return before, False
