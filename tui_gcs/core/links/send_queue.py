"""Send queue: frames on their way into a byte stream that may take only a part of them now."""

import errno
from collections import deque
from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import Link

STALL_TIMEOUT_S = 5.0
"""A partner that takes nothing for this long is gone."""


class SendQueue:
    """Whole frames that wait, bounded. A stream never carries half a frame of ours unless it breaks."""

    def __init__(self, limit_bytes: int, counts: Link, clock: Clock) -> None:
        """Queue at most `limit_bytes`; what is sent and refused is counted in `counts`."""
        self._limit_bytes = limit_bytes
        self._counts = counts
        self._clock = clock
        self._frames: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._moved_s = clock.now()

    @property
    def stalled(self) -> bool:
        """Whether frames wait and none moved for `STALL_TIMEOUT_S`."""
        return bool(self._frames) and self._clock.now() - self._moved_s >= STALL_TIMEOUT_S

    def put(self, frame: bytes, write: Callable[[bytes], int]) -> None:
        """Send `frame` behind those that wait; where there is no room it is refused and counted.

        Raises as `flush` does.
        """
        # The new frame is refused, not the oldest dropped: a part of the oldest may be on the wire already.
        if self._waiting_bytes + len(frame) > self._limit_bytes:
            self._counts.send_refused += 1
            return
        if not self._frames:
            self._moved_s = self._clock.now()
        self._frames.append(frame)
        self._waiting_bytes += len(frame)
        self.flush(write)

    def flush(self, write: Callable[[bytes], int]) -> None:
        """Write as much as `write` takes.

        Raises:
            OSError: the stream is broken.
        """
        while self._frames:
            try:
                taken = write(self._frames[0])
            except OSError as error:
                if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK, errno.EINTR):
                    return
                raise
            if taken <= 0:
                return
            self._moved_s = self._clock.now()
            self._counts.bytes_out += taken
            self._waiting_bytes -= taken
            rest = self._frames.popleft()[taken:]
            if rest:
                self._frames.appendleft(rest)

    def give_up(self) -> None:
        """Drop the waiting frames and count them as refused, because the stream is gone."""
        self._counts.send_refused += len(self._frames)
        self._frames.clear()
        self._waiting_bytes = 0
