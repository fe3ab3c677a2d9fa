"""Whether a PX4 writes a log (SDLOG_MODE 1), and how it reports a new one."""

from datetime import UTC, datetime

from sitl.common.platform import Part, Platform
from sitl.px4.announcer import Announcer

CLOSES_US = 4_000_000
"""Time between a disarming and the end of the log (measured 4.0 and 4.3 s)."""


class SdLog(Part):
    """The log of one vehicle: open from the boot on, closed after a disarming, opened by arming again."""

    def __init__(self, platform: Platform, announcer: Announcer) -> None:
        super().__init__(platform)
        self._announcer = announcer
        self._closes_us: int | None = None

    @property
    def is_open(self) -> bool:
        """Whether a log is written."""
        return self._closes_us is None or self._clock.now_us < self._closes_us

    def open(self) -> None:
        """Keep the log open, or open a new one and report it."""
        if not self.is_open:
            # The name of a log is the time at which it was opened.
            when = datetime.fromtimestamp((self._spec.unix_epoch_us + self._clock.now_us) / 1e6, tz=UTC)
            numbers = when.timetuple()[:6]
            self._announcer.announce(f"[logger] ./log/{when:%Y-%m-%d/%H_%M_%S}.ulg", "logger_open_file_time", *numbers)
        self._closes_us = None

    def close_soon(self) -> None:
        """Close the log after CLOSES_US."""
        self._closes_us = self._clock.now_us + CLOSES_US
