"""The injected clock: all waiting in the core goes through it.

A station reads monotonic time from a `Clock`; tests and lock-step runs use `VirtualClock`, which
moves only when told to, so an hour of retries is a test of milliseconds.
"""

import time
from typing import Protocol


class Clock(Protocol):
    """Where the core takes time from."""

    def now(self) -> float:
        """Monotonic seconds; the origin means nothing."""
        ...

    def wall(self) -> float:
        """Seconds since the Unix epoch, for logs only; may jump."""
        ...


class MonotonicClock:
    """The machine's clocks."""

    def now(self) -> float:
        """Monotonic seconds, shared by all processes of this machine."""
        return time.monotonic()

    def wall(self) -> float:
        """Seconds since the Unix epoch."""
        return time.time()


class VirtualClock:
    """A clock that stands still until `advance`; the same run gives the same times."""

    def __init__(self, start_s: float = 0.0, wall_start_s: float = 1_700_000_000.0) -> None:
        """Start at `start_s` monotonic and `wall_start_s` Unix seconds."""
        self._elapsed_s = 0.0
        self._start_s = start_s
        self._wall_start_s = wall_start_s

    def now(self) -> float:
        """Monotonic seconds."""
        return self._start_s + self._elapsed_s

    def wall(self) -> float:
        """Unix seconds, moving in step with `now`."""
        return self._wall_start_s + self._elapsed_s

    def advance(self, dt_s: float) -> None:
        """Move time forward by `dt_s` seconds (>= 0)."""
        if dt_s < 0:
            raise ValueError(f"time cannot go back: advance({dt_s})")
        self._elapsed_s += dt_s
