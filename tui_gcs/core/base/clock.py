"""The injected clock: all waiting in the core goes through it.

A station reads monotonic time from a `Clock`; tests and lock-step runs use `VirtualClock`, which
moves only when told to, so an hour of retries is a test of milliseconds.
"""

import time
from typing import Protocol

MAX_CORRECTION_S = 1.0
"""A time service corrects by less at once."""


class Clock(Protocol):
    """Where the core takes time from."""

    def now(self) -> float:
        """Monotonic seconds; the origin means nothing."""
        ...

    def wall(self) -> float:
        """Seconds since the Unix epoch, for logs only; may jump."""
        ...

    def steady_wall(self) -> float:
        """As `wall` was at the beginning, and never set since: for logs in which time may not go back or leap."""
        ...


def wall_offset_s() -> float:
    """What to add to monotonic time, as of now, to have Unix time. Until it boots, the whole machine's."""
    return time.time() - time.monotonic()


class MonotonicClock:
    """The machine's clocks."""

    def __init__(self, offset_s: float | None = None) -> None:
        """The wall clock is believed as it is now, or as it was when somebody noted its `wall_offset_s`."""
        self._offset_s = wall_offset_s() if offset_s is None else offset_s

    def now(self) -> float:
        """Monotonic seconds, shared by all processes of this machine."""
        return time.monotonic()

    def wall(self) -> float:
        """Seconds since the Unix epoch."""
        return time.time()

    def steady_wall(self) -> float:
        """Unix seconds as they would be had nobody set the clock."""
        return time.monotonic() + self._offset_s


class VirtualClock:
    """A clock that stands still until `advance`; the same run gives the same times."""

    def __init__(self, start_s: float = 0.0, wall_start_s: float = 1_700_000_000.0) -> None:
        """Start at `start_s` monotonic and `wall_start_s` Unix seconds."""
        self._elapsed_s = 0.0
        self._start_s = start_s
        self._wall_start_s = wall_start_s
        self._set_s = 0.0

    def now(self) -> float:
        """Monotonic seconds."""
        return self._start_s + self._elapsed_s

    def wall(self) -> float:
        """Unix seconds, moving in step with `now`; `set_wall` moves them."""
        return self._wall_start_s + self._set_s + self._elapsed_s

    def steady_wall(self) -> float:
        """Unix seconds as if never set."""
        return self._wall_start_s + self._elapsed_s

    def set_wall(self, by_s: float) -> None:
        """Somebody sets the wall clock."""
        self._set_s += by_s

    def advance(self, dt_s: float) -> None:
        """Move time forward by `dt_s` seconds (>= 0)."""
        if dt_s < 0:
            raise ValueError(f"time cannot go back: advance({dt_s})")
        self._elapsed_s += dt_s


class WallClockMonitor:
    """Notices when the wall clock is set while a station runs: times before and after that do not fit together."""

    def __init__(self, clock: Clock) -> None:
        """It is right as it was when `steady_wall` began: in a run's first station, it may be, not in this one."""
        self._clock = clock
        self._offset_s = clock.steady_wall() - clock.now()

    def was_set_by(self) -> float:
        """By how many seconds since this was last asked; 0 for what is no more than a correction."""
        before, self._offset_s = self._offset_s, self._clock.wall() - self._clock.now()
        by_s = self._offset_s - before
        return by_s if abs(by_s) > MAX_CORRECTION_S else 0.0


def wall_clock_warning(by_s: float) -> str:
    """How an operator is told."""
    far = f"{abs(by_s) / 3600:.1f} h" if abs(by_s) >= 3600 else f"{abs(by_s):.0f} s"
    way = "ahead" if by_s > 0 else "back"
    return f"this computer's clock was set {way} by {far}: times of day before that differ; nothing waits by it"
