"""The injected clock: all waiting in the core goes through it.

A station reads monotonic time from a `Clock`. Tests and lock-step runs use `VirtualClock`, which moves only by
`advance`, so an hour of retries is a test of milliseconds.
"""

import time
from typing import Protocol

MAX_CORRECTION_S = 1.0
"""A time service corrects by less at once; a larger step of the wall clock is reported."""


class Clock(Protocol):
    """Where the core takes time from."""

    def now(self) -> float:
        """Return monotonic seconds; the origin means nothing."""
        ...

    def wall(self) -> float:
        """Return seconds since the Unix epoch, for logs only; they may jump."""
        ...

    def steady_wall(self) -> float:
        """Return Unix seconds that never jump, for logs: `wall` as if it had not been set since the beginning."""
        ...


def wall_offset_s() -> float:
    """Return what to add to monotonic time to get Unix time.

    It is the same for all processes of this machine until it boots.
    """
    return time.time() - time.monotonic()


class MonotonicClock:
    """The clocks of this machine."""

    def __init__(self, offset_s: float | None = None) -> None:
        """Trust the wall clock as it is now, or as it was when a `wall_offset_s` was taken."""
        self._offset_s = wall_offset_s() if offset_s is None else offset_s

    def now(self) -> float:
        """Return monotonic seconds, shared by all processes of this machine."""
        return time.monotonic()

    def wall(self) -> float:
        """Return seconds since the Unix epoch."""
        return time.time()

    def steady_wall(self) -> float:
        """Return Unix seconds as they would be had the clock never been set."""
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
        """Return monotonic seconds."""
        return self._start_s + self._elapsed_s

    def wall(self) -> float:
        """Return Unix seconds, which move with `now` and by `set_wall`."""
        return self._wall_start_s + self._set_s + self._elapsed_s

    def steady_wall(self) -> float:
        """Return Unix seconds without the steps of `set_wall`."""
        return self._wall_start_s + self._elapsed_s

    def set_wall(self, by_s: float) -> None:
        """Set the wall clock forward by `by_s` seconds, as an administrator may do."""
        self._set_s += by_s

    def advance(self, dt_s: float) -> None:
        """Move time forward by `dt_s` seconds (>= 0); ValueError if negative."""
        if dt_s < 0:
            raise ValueError(f"time cannot go back: advance({dt_s})")
        self._elapsed_s += dt_s


class WallClockMonitor:
    """Notices when the wall clock is set while a station runs, so that times of day before and after do not fit."""

    def __init__(self, clock: Clock) -> None:
        """Compare with the time at which `steady_wall` began, which may be in an earlier station of this run."""
        self._clock = clock
        self._offset_s = clock.steady_wall() - clock.now()

    def was_set_by(self) -> float:
        """Return by how many seconds the clock was set since the last call; 0 for a mere correction."""
        # The wall clock may be set at any time; nothing in a station waits by it, so a step is only reported.
        before, self._offset_s = self._offset_s, self._clock.wall() - self._clock.now()
        by_s = self._offset_s - before
        return by_s if abs(by_s) > MAX_CORRECTION_S else 0.0


def wall_clock_warning(by_s: float) -> str:
    """Return the warning for the operator."""
    far = f"{abs(by_s) / 3600:.1f} h" if abs(by_s) >= 3600 else f"{abs(by_s):.0f} s"
    way = "ahead" if by_s > 0 else "back"
    return f"this computer's clock was set {way} by {far}: times of day before that differ; nothing waits by it"
