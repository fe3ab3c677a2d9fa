"""A vehicle's boot clock tells reboots, and two vehicles that use one id: then two clocks alternate.

The clock is never compared with ours for freshness (a loaded simulator drifts by percents); only steps count.
"""

from enum import Enum

REBOOT_STEP_MS = 1000
"""Older by less is reordering (two threads of PX4 send, links swap datagrams)."""
LEAP_MS = 600_000
"""Ahead by more than any gap explains: the clock was set, everything known is void (B.6-103)."""
FITS_MS = 1500
"""How well a time must fit a timeline that was left, to be taken for its continuation."""
WRAP_MS = 2**32
NEAR_WRAP_MS = 60_000


class Step(Enum):
    """What a new boot time means."""

    ON = "goes on"
    LATE = "older than the newest"
    REBOOT = "rebooted"
    TWIN = "another clock with the same id"


class BootClock:
    """One vehicle's boot clock as heard over one path."""

    __slots__ = ("_left", "at_s", "boot_ms")

    def __init__(self) -> None:
        """Nothing heard yet."""
        self.boot_ms = -1
        """The newest time."""
        self.at_s = 0.0
        """When it was received."""
        self._left: tuple[int, float] | None = None
        """The timeline before the newest step: a boot time and when it was received."""

    def seen(self, boot_ms: int, now: float) -> Step:
        """Take a timeboot_ms received at `now` (monotonic seconds)."""
        step_ms = boot_ms - self.boot_ms
        if (step_ms >= 0 and step_ms - (now - self.at_s) * 1e3 <= FITS_MS) or self.boot_ms < 0:
            self.boot_ms, self.at_s = boot_ms, now
            return _ON
        return self._step(boot_ms, step_ms, now)

    def _step(self, boot_ms: int, step_ms: int, now: float) -> Step:
        """The time is not what follows."""
        if self.boot_ms > WRAP_MS - NEAR_WRAP_MS and boot_ms < NEAR_WRAP_MS:  # after 49.7 days
            self.boot_ms, self.at_s = boot_ms, now
            return Step.ON
        if -REBOOT_STEP_MS <= step_ms < 0:
            return Step.LATE
        before = (self.boot_ms, self.at_s)
        left, ahead_ms = self._left, step_ms - (now - self.at_s) * 1e3
        self.boot_ms, self.at_s = boot_ms, now
        if left is not None and abs(boot_ms - left[0] - (now - left[1]) * 1e3) <= FITS_MS:
            self._left = before
            return Step.TWIN
        if step_ms >= 0 and ahead_ms <= LEAP_MS:  # held up on the way, or a vehicle that was suspended
            return Step.ON
        self._left = before
        return Step.REBOOT


_ON = Step.ON
