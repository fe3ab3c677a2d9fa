"""Flight logs of a vehicle: when a log exists, how it grows, and what is in it.

A log grows at the rate that was measured. Of its bytes those of `record` have a meaning; between them stands filler.
"""

from bisect import bisect_right
from dataclasses import dataclass, field

from sitl.common import ulog
from sitl.common.dataflash import FILLER_BYTES, FORMATS, filler
from sitl.common.vehicle_spec import VehicleSpec

ARDUPILOT_BYTES_S, PX4_BYTES_S = 70_000.0, 229_000.0


@dataclass
class Log:
    """One log file that may still be growing."""

    number: int
    utc_s: int
    rate_bytes_s: float
    head: bytes
    """First bytes of the file."""
    filler: bytes
    """What stands between records, again and again."""
    unit: int = 1
    """A record begins after a multiple of so many bytes of filler: the length of one message of it."""
    size: int = 0
    """Bytes written before `growing_since_us`."""
    growing_since_us: int | None = None
    flushed_us: int | None = None
    """When the buffered bytes are in the file, too."""
    buffered: int = 0
    _starts: list[int] = field(default_factory=lambda: [0])
    _records: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._records.append(self.head)

    def size_at(self, now_us: int) -> int:
        """Return the number of bytes in the file."""
        size = self.size
        if self.growing_since_us is not None:
            size += round((now_us - self.growing_since_us) / 1e6 * self.rate_bytes_s)
        elif self.flushed_us is not None and now_us >= self.flushed_us:
            size += self.buffered
        return size

    def record(self, messages: bytes, now_us: int) -> None:
        """Write messages at the end of the file, as of now; they are whole where the file grows on."""
        end = self._starts[-1] + len(self._records[-1])
        units = -(-max(0, self.size_at(now_us) - end) // self.unit)
        self._starts.append(end + units * self.unit)
        self._records.append(messages)

    def read(self, offset: int, count: int, now_us: int) -> bytes:
        """Return up to `count` bytes, fewer at the end of the file."""
        end = min(offset + count, self.size_at(now_us))
        at, out = bisect_right(self._starts, offset) - 1, bytearray()
        while offset < end:
            start, record = self._starts[at], self._records[at]
            following = self._starts[at + 1] if at + 1 < len(self._starts) else end
            inside = offset - start
            if inside < len(record):
                piece = record[inside : inside + end - offset]
            else:
                piece = self._filler(inside - len(record), min(end, following) - offset)
            out += piece
            offset += len(piece)
            at += offset >= following
        return bytes(out)

    def _filler(self, offset: int, count: int) -> bytes:
        offset %= len(self.filler)
        return (self.filler[offset:] + self.filler * (1 + count // len(self.filler)))[:count]


class Logs:
    """The logs of one vehicle. They grow while the motors are on, and outlive a reboot."""

    def __init__(self, spec: VehicleSpec) -> None:
        self.px4 = spec.autopilot == "px4"
        self.files: list[Log] = []
        self.downloading = False
        """ArduPilot: a log is being downloaded, and arming is refused meanwhile."""
        self.listed = False
        """PX4: the logs were listed; without that it sends no data."""
        self.warned = False
        """ArduPilot: the refusal to download while armed was reported."""
        self._epoch_s, self._system_id = spec.unix_epoch_us // 1_000_000, spec.system_id

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

    def written_at(self, now_us: int) -> Log | None:
        """Return the log that takes records now: that of the flight, and a moment longer what was buffered."""
        log = self.files[-1] if self.files else None
        if log is None or log.growing_since_us is not None:
            return log
        return log if log.flushed_us is not None and now_us < log.flushed_us else None

    def _start(self, now_us: int) -> None:
        number, utc_s = len(self.files) + 1, self._epoch_s + now_us // 1_000_000
        if self.px4:
            log = Log(number, utc_s, PX4_BYTES_S, ulog.head(self._system_id), ulog.filler(number), ulog.FILLER_BYTES)
        else:
            log = Log(number, utc_s, ARDUPILOT_BYTES_S, FORMATS, filler(number), FILLER_BYTES)
        log.growing_since_us = now_us
        self.files.append(log)

    def _stop(self, now_us: int) -> None:
        for log in self.files:
            if log.growing_since_us is not None:
                log.size = log.size_at(now_us)
                log.growing_since_us = None
                log.buffered, log.flushed_us = (0 if self.px4 else round(log.rate_bytes_s)), now_us + 1_000_000

    def erase(self) -> None:
        """Erase all logs but the one that is being written."""
        self.files = [log for log in self.files if log.growing_since_us is not None]
