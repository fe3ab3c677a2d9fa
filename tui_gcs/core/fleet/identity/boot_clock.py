"""A vehicle's boot clock tells reboots, and two vehicles that use one id: then two clocks alternate.

The clock is compared with ours loosely only (a loaded simulator drifts by percents); steps count, and what comes ever
later. A time that is not what follows may be late, of a rebooted vehicle, or of another one: what comes next tells
which.
"""

import math
from enum import Enum

TOLERANCE_MS = 1500
"""How well a time must fit a timeline to be taken for its continuation."""
MAX_LEAP_MS = 600_000
"""Ahead by more than any gap explains: the clock was set, everything known is void (B.6-103)."""
MAX_AGE_AFTER_REBOOT_MS = 2000
"""A vehicle that rebooted since it was last heard has run for no longer than that, and a slow link."""
REPLACED_AFTER_S, REPLACED_NEAR_AFTER_S = 1.0, 3.0
"""Another timeline on which the clock goes on while the known one is silent for so long has replaced it; the second
where it might be late frames of the same."""
MAX_JITTER_MS = 5000
"""Links of 2 s delay, doubled by jitter, deliver frames so late. Two clocks farther apart are two vehicles."""
MIN_APART_MS, MAX_STEADY_ERROR_MS, MIN_STEADY_ALTERNATIONS = 600, 120, 10
"""Two clocks nearer to each other, but not so near, are two vehicles if both go on so steadily, so often by turns:
late frames of one vehicle are late by this and by that."""
MIN_DELAY_S = 2.0
"""Frames that come later by this than the quickest did are late: more than jitter."""
MAX_CLOCK_DRIFT = 0.03
"""So much slower than ours the vehicle's clock may run. A delay that grows no faster is not noticed, and one that
stays for long is taken for the way's own in the end: a simulator that was stopped for a while looks the same."""
WRAP_MS = 2**32
NEAR_WRAP_MS = 60_000


class BootTimeResult(Enum):
    """What a new boot time means."""

    CONTINUES = "goes on"
    LATE = "older than the newest, or not known yet what it is"
    REBOOT = "rebooted"
    OTHER_CLOCK = "another clock with the same id"


class BootClock:
    """One vehicle's boot clock as heard over one path."""

    __slots__ = ("_least_s", "_other", "_since_s", "at_s", "boot_ms", "delay_s", "reported_s")

    def __init__(self, boot_ms: int = -1, at_s: float = 0.0) -> None:
        """Nothing heard yet; or go on from `boot_ms` heard at `at_s`."""
        self.boot_ms = boot_ms
        """The newest time."""
        self.at_s = at_s
        """When it was received."""
        self.delay_s = 0.0
        """How much later than the quickest the newest time came, at the last `measure_delay`; 0 for what is jitter."""
        self.reported_s = -math.inf
        """When that was last told."""
        self._least_s, self._since_s = math.inf, at_s
        """Our time minus this clock's, of the quickest frame, and when that came."""
        self._other: _SecondClock | None = None

    def measure_delay(self) -> float:
        """`delay_s`, measured anew."""
        if self.boot_ms < 0:
            return 0.0
        offset_s = self.at_s - self.boot_ms / 1e3
        late_s = offset_s - self._least_s - MAX_CLOCK_DRIFT * (self.at_s - self._since_s)
        if late_s <= 0.0:
            self._least_s, self._since_s = offset_s, self.at_s
        self.delay_s = late_s if late_s > MIN_DELAY_S else 0.0
        return self.delay_s

    def check(self, boot_ms: int, now: float) -> BootTimeResult:
        """Take a time_boot_ms received at `now` (monotonic seconds)."""
        step_ms = boot_ms - self.boot_ms
        if (step_ms >= 0 and step_ms - (now - self.at_s) * 1e3 <= TOLERANCE_MS) or self.boot_ms < 0:
            self.boot_ms, self.at_s = boot_ms, now
            return _ON
        return self._step(boot_ms, step_ms, now)

    def _step(self, boot_ms: int, step_ms: int, now: float) -> BootTimeResult:
        """The time is not what follows."""
        elapsed_ms = (now - self.at_s) * 1e3
        if (
            self.boot_ms > WRAP_MS - NEAR_WRAP_MS and 0 <= step_ms + WRAP_MS <= elapsed_ms + TOLERANCE_MS
        ):  # after 49.7 days
            self.boot_ms, self.at_s = boot_ms, now
            self._least_s += WRAP_MS / 1e3
            return _ON
        other = self._other
        if other is not None and other.misses_by_ms(boot_ms, now) <= TOLERANCE_MS:
            return self._goes_on(other, boot_ms, now)
        ahead_ms = step_ms - elapsed_ms
        if self.boot_ms < NEAR_WRAP_MS and boot_ms > WRAP_MS - NEAR_WRAP_MS:
            return BootTimeResult.LATE
        if step_ms >= 0:  # held up on the way, or a simulator in a hurry; if it leaps, who knows
            self._replace(boot_ms, now)
            return _ON if ahead_ms <= MAX_LEAP_MS else BootTimeResult.REBOOT
        if boot_ms <= elapsed_ms + MAX_AGE_AFTER_REBOOT_MS and ahead_ms < -TOLERANCE_MS:
            self._replace(boot_ms, now)
            return BootTimeResult.REBOOT
        self._other = _SecondClock(boot_ms, now)
        return BootTimeResult.LATE

    def _goes_on(self, other: "_SecondClock", boot_ms: int, now: float) -> BootTimeResult:
        """The second timeline again: by turns with the first, or instead of it."""
        steady = other.misses_by_ms(boot_ms, now) <= MAX_STEADY_ERROR_MS
        by_turns = self.at_s >= other.at_s
        other.turns = other.turns + 1 if steady and by_turns else 0
        apart_ms = abs(self.boot_ms + (now - self.at_s) * 1e3 - boot_ms)
        other.boot_ms, other.at_s = boot_ms, now
        other.is_twin |= by_turns and apart_ms > MAX_JITTER_MS  # the first was heard after it: both are alive
        alone = now - self.at_s >= (REPLACED_AFTER_S if apart_ms > MAX_JITTER_MS else REPLACED_NEAR_AFTER_S)
        if alone:
            self._replace(boot_ms, now, is_twin=other.is_twin)
        elif not by_turns or not (
            other.is_twin or (apart_ms > MIN_APART_MS and other.turns >= MIN_STEADY_ALTERNATIONS)
        ):
            return BootTimeResult.LATE
        return BootTimeResult.OTHER_CLOCK if other.is_twin or not alone else BootTimeResult.REBOOT

    def _replace(self, boot_ms: int, now: float, *, is_twin: bool = False) -> None:
        self._other = _SecondClock(self.boot_ms, self.at_s, is_twin)
        self.boot_ms, self.at_s = boot_ms, now
        self.delay_s, self._least_s = 0.0, math.inf


class _SecondClock:
    """A second timeline."""

    __slots__ = ("at_s", "boot_ms", "is_twin", "turns")

    def __init__(self, boot_ms: int, at_s: float, is_twin: bool = False) -> None:
        self.boot_ms, self.at_s, self.turns, self.is_twin = boot_ms, at_s, 0, is_twin

    def misses_by_ms(self, boot_ms: int, now: float) -> float:
        return abs(boot_ms - self.boot_ms - (now - self.at_s) * 1e3)


_ON = BootTimeResult.CONTINUES
