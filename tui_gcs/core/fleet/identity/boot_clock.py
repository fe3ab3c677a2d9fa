"""Boot clock: finds reboots, and two vehicles that share a system id, in the time_boot_ms of positions.

Two vehicles with one id show as two clocks that alternate. The clock is compared only loosely with the station's,
because a loaded simulator drifts by percents: steps count, and delays that grow. A boot time that does not continue the
known clock may be a late frame, a reboot or another vehicle; the frames after it decide.
"""

import math
from enum import Enum

TOLERANCE_MS = 1500
"""A boot time within this of the expected one continues the clock."""
MAX_LEAP_MS = 600_000
"""A leap farther ahead than any gap explains: the clock was set, and what was known is void (docs/threats.md B.6-103).
"""
MAX_AGE_AFTER_REBOOT_MS = 2000
"""After a reboot the boot time is at most the time since it was last heard, plus this for a slow link."""
REPLACED_AFTER_S, REPLACED_NEAR_AFTER_S = 1.0, 3.0
"""A second clock that continues while the first is silent for this long has replaced it. The second value applies where
its frames might be late ones of the first."""
MAX_JITTER_MS = 5000
"""Links with 2 s of delay, doubled by jitter, deliver frames this late. Clocks farther apart belong to two vehicles."""
MIN_APART_MS, MAX_STEADY_ERROR_MS, MIN_STEADY_ALTERNATIONS = 600, 120, 10
"""Clocks at least 600 ms apart are of two vehicles if they alternate 10 times with errors below 120 ms: late frames of
one vehicle are late by varying amounts."""
MIN_DELAY_S = 2.0
"""Frames later than the quickest one by more than this are reported as late; less is jitter."""
MAX_CLOCK_DRIFT = 0.03
"""The vehicle's clock may run slower than the station's by this share, so a delay that grows no faster is not noticed.
A constant delay is taken for the path's own in the end, since a paused simulator looks the same."""
# time_boot_ms is an uint32: it begins again at 0 after 49.7 days, which is no reboot.
WRAP_MS = 2**32
# One minute before and after that moment a step back may be the wrap; at any other time it is a reboot.
NEAR_WRAP_MS = 60_000


class BootTimeResult(Enum):
    """What a new boot time means for the clock."""

    CONTINUES = "continues the clock"
    LATE = "older than the newest, or not known yet what it is"
    REBOOT = "rebooted"
    OTHER_CLOCK = "another clock with the same id"


class BootClock:
    """One vehicle's boot clock as it arrives over one path."""

    __slots__ = ("_min_offset_at_s", "_min_offset_s", "_second", "at_s", "boot_ms", "delay_s", "reported_s")

    def __init__(self, boot_ms: int = -1, at_s: float = 0.0) -> None:
        """Begin without a time, or continue from `boot_ms` received at `at_s`."""
        self.boot_ms = boot_ms
        """The newest boot time, ms; -1 before the first."""
        self.at_s = at_s
        """When it was received, station time."""
        self.delay_s = 0.0
        """Delay of the newest frame beyond the quickest one, s, at the last `measure_delay`; 0 while it is within
        jitter."""
        self.reported_s = -math.inf
        """When the delay was last reported, station time."""
        self._min_offset_s, self._min_offset_at_s = math.inf, at_s
        """Station time minus boot time of the quickest frame, and when that frame came."""
        self._second: _SecondClock | None = None

    def measure_delay(self) -> float:
        """Update and return `delay_s`."""
        if self.boot_ms < 0:
            return 0.0
        offset_s = self.at_s - self.boot_ms / 1e3
        late_s = offset_s - self._min_offset_s - MAX_CLOCK_DRIFT * (self.at_s - self._min_offset_at_s)
        if late_s <= 0.0:
            self._min_offset_s, self._min_offset_at_s = offset_s, self.at_s
        self.delay_s = late_s if late_s > MIN_DELAY_S else 0.0
        return self.delay_s

    def check(self, boot_ms: int, now: float) -> BootTimeResult:
        """Take a time_boot_ms received at `now` (station time) and return what it means."""
        step_ms = boot_ms - self.boot_ms
        if (step_ms >= 0 and step_ms - (now - self.at_s) * 1e3 <= TOLERANCE_MS) or self.boot_ms < 0:
            self.boot_ms, self.at_s = boot_ms, now
            return _CONTINUES
        return self._step(boot_ms, step_ms, now)

    def _step(self, boot_ms: int, step_ms: int, now: float) -> BootTimeResult:
        """Classify a boot time that does not continue the clock."""
        elapsed_ms = (now - self.at_s) * 1e3
        # time_boot_ms wraps after 49.7 days: that is no reboot.
        if self.boot_ms > WRAP_MS - NEAR_WRAP_MS and 0 <= step_ms + WRAP_MS <= elapsed_ms + TOLERANCE_MS:
            self.boot_ms, self.at_s = boot_ms, now
            self._min_offset_s += WRAP_MS / 1e3
            return _CONTINUES
        other = self._second
        if other is not None and other.error_ms(boot_ms, now) <= TOLERANCE_MS:
            return self._continue_second(other, boot_ms, now)
        ahead_ms = step_ms - elapsed_ms
        if self.boot_ms < NEAR_WRAP_MS and boot_ms > WRAP_MS - NEAR_WRAP_MS:
            return BootTimeResult.LATE
        # The frame was held up on its way, or a simulator runs fast. A leap cannot be explained: it counts as a
        # reboot.
        if step_ms >= 0:
            self._replace(boot_ms, now)
            return _CONTINUES if ahead_ms <= MAX_LEAP_MS else BootTimeResult.REBOOT
        if boot_ms <= elapsed_ms + MAX_AGE_AFTER_REBOOT_MS and ahead_ms < -TOLERANCE_MS:
            self._replace(boot_ms, now)
            return BootTimeResult.REBOOT
        # Unknown so far: the next frames show whether this is a late frame or another clock.
        self._second = _SecondClock(boot_ms, now)
        return BootTimeResult.LATE

    def _continue_second(self, other: "_SecondClock", boot_ms: int, now: float) -> BootTimeResult:
        """Classify a boot time that continues the second clock: it alternates with the first, or replaces it."""
        steady = other.error_ms(boot_ms, now) <= MAX_STEADY_ERROR_MS
        by_turns = self.at_s >= other.at_s
        other.turns = other.turns + 1 if steady and by_turns else 0
        apart_ms = abs(self.boot_ms + (now - self.at_s) * 1e3 - boot_ms)
        other.boot_ms, other.at_s = boot_ms, now
        # The first clock was heard after the second, so both are running.
        other.is_other_vehicle |= by_turns and apart_ms > MAX_JITTER_MS
        alone = now - self.at_s >= (REPLACED_AFTER_S if apart_ms > MAX_JITTER_MS else REPLACED_NEAR_AFTER_S)
        if alone:
            self._replace(boot_ms, now, is_other_vehicle=other.is_other_vehicle)
        elif not by_turns or not (
            other.is_other_vehicle or (apart_ms > MIN_APART_MS and other.turns >= MIN_STEADY_ALTERNATIONS)
        ):
            return BootTimeResult.LATE
        return BootTimeResult.OTHER_CLOCK if other.is_other_vehicle or not alone else BootTimeResult.REBOOT

    def _replace(self, boot_ms: int, now: float, *, is_other_vehicle: bool = False) -> None:
        self._second = _SecondClock(self.boot_ms, self.at_s, is_other_vehicle)
        self.boot_ms, self.at_s = boot_ms, now
        self.delay_s, self._min_offset_s = 0.0, math.inf


class _SecondClock:
    """A second clock that boot times fit, not the one in use."""

    __slots__ = ("at_s", "boot_ms", "is_other_vehicle", "turns")

    def __init__(self, boot_ms: int, at_s: float, is_other_vehicle: bool = False) -> None:
        self.boot_ms, self.at_s, self.turns, self.is_other_vehicle = boot_ms, at_s, 0, is_other_vehicle

    def error_ms(self, boot_ms: int, now: float) -> float:
        return abs(boot_ms - self.boot_ms - (now - self.at_s) * 1e3)


_CONTINUES = BootTimeResult.CONTINUES
