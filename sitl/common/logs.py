"""Flight logs of a vehicle: when a log exists and how it grows.

The bytes are pseudo-random, the same for the same log number.
"""

import random
from dataclasses import dataclass
from functools import cache

_PIECE_BYTES = 1 << 16


@cache
def _piece(seed: int) -> bytes:
    return random.Random(seed).randbytes(_PIECE_BYTES)


@dataclass
class Log:
    """One log file that may still be growing."""

    number: int
    utc_s: int
    rate_bytes_s: float
    head: bytes
    """First bytes of the file."""
    size: int = 0
    """Bytes written before `growing_since_us`."""
    growing_since_us: int | None = None
    flushed_us: int | None = None
    """When the buffered bytes are in the file, too."""
    buffered: int = 0

    def size_at(self, now_us: int) -> int:
        """Return the number of bytes in the file."""
        size = self.size
        if self.growing_since_us is not None:
            size += round((now_us - self.growing_since_us) / 1e6 * self.rate_bytes_s)
        elif self.flushed_us is not None and now_us >= self.flushed_us:
            size += self.buffered
        return size

    def read(self, offset: int, count: int, now_us: int) -> bytes:
        """Return up to `count` bytes, fewer at the end of the file."""
        count = max(min(count, self.size_at(now_us) - offset), 0)
        if offset < len(self.head):
            start = self.head[offset : offset + count]
            return start + self.read(offset + len(start), count - len(start), now_us) if start else b""
        piece = _piece(self.number)
        at = offset % _PIECE_BYTES
        return (piece[at:] + piece * (1 + count // _PIECE_BYTES))[:count]


class Logs:
    """The logs of one vehicle. They grow while the motors are on, and outlive a reboot."""

    def __init__(self, autopilot: str) -> None:
        self.px4 = autopilot == "px4"
        self.files: list[Log] = []
        self.downloading = False
        """ArduPilot: a log is being downloaded, and arming is refused meanwhile."""
        self.listed = False
        """PX4: the logs were listed; without that it sends no data."""
        self.warned = False
        """ArduPilot: the refusal to download while armed was reported."""

    def power_on(self, now_us: int) -> None:
        """Begin a log as PX4 does: it logs from the boot until it is disarmed."""
        self._stop(now_us)
        self.downloading = self.listed = False
        if self.px4:
            self._start(now_us)

    def motors(self, now_us: int, *, on: bool) -> None:
        """Start or stop logging as the motors are switched on or off."""
        if not on:
            self._stop(now_us)
        elif not self.files or self.px4:
            if not any(log.growing_since_us is not None for log in self.files):
                self._start(now_us)
        else:  # ArduPilot continues the file of this boot
            last = self.files[-1]
            last.size = last.size_at(now_us)
            last.buffered, last.growing_since_us = 0, now_us

    def _start(self, now_us: int) -> None:
        rate_bytes_s, head = (229_000.0, b"ULog\x01\x12\x35\x01") if self.px4 else (70_000.0, b"\xa3\x95\x80\x80\x59")
        number = len(self.files) + 1
        utc_s = 1_700_000_000 + now_us // 1_000_000
        self.files.append(Log(number, utc_s, rate_bytes_s, head, growing_since_us=now_us))

    def _stop(self, now_us: int) -> None:
        for log in self.files:
            if log.growing_since_us is not None:
                log.size = log.size_at(now_us)
                log.growing_since_us = None
                log.buffered, log.flushed_us = (0 if self.px4 else round(log.rate_bytes_s)), now_us + 1_000_000

    def erase(self) -> None:
        """Erase all logs but the one that is being written."""
        self.files = [log for log in self.files if log.growing_since_us is not None]
