"""Tlog reader: reads telemetry logs (.tlog): 8 bytes big-endian microseconds since 1970, one raw frame, repeated.

Logs end in a torn record after a crash, and have damaged places. The reader returns every frame that is good and counts
what it skipped. MAVProxy keeps a link number in the two lowest bits of the time, which is 3 µs and harmless.
"""

import struct
from collections import deque
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.frames import MAGIC, MAGIC_V1, MAGIC_V2, Frame, check_frame, frame_end

JUMP_US = 3 * 24 * 3600 * 1_000_000
"""A time farther than this from its neighbours is damaged (Mission Planner and pymavlink use three days, too)."""
_LOOK_AHEAD = 2
_TIME = struct.Struct(">Q")
# A record is a big-endian time in microseconds since 1970, and one frame: what Mission Planner and MAVProxy write.
_TIME_BYTES = 8
_CHUNK_BYTES = 1 << 20
_MARGIN_BYTES = 512
"""A record (8 + 280 bytes at most) and the beginning of the next always fit into this."""
_HOPELESS_BYTES = 16 << 20
"""A file without one good frame in its first 16 MiB is no log."""


class TlogError(Exception):
    """The file cannot be read as a telemetry log: one line with file and reason."""


class TlogPosition(NamedTuple):
    """A place behind a good record, from which a reader goes on as if it had read all that is before it."""

    offset: int = 0
    """Bytes from the beginning of the file."""
    time_us: int = 0
    """The time of the record before it, microseconds since 1970."""
    frames: int = 0
    skipped_bytes: int = 0


BEGINNING = TlogPosition()


_Record = tuple[int, Frame, int, int]
"""Time in microseconds, frame, where the next record begins, and how many bytes were skipped up to there."""


class TlogReader:
    """Iterates over (Unix seconds, frame). After the end the counters show what was skipped.

    Raises (while iterating):
        TlogError: the file cannot be read, is empty, or holds not one good frame.
    """

    def __init__(self, path: Path | str, start: TlogPosition = BEGINNING) -> None:
        """Read `path`, which is opened at the first `next`, from a position of an earlier reader of the same file."""
        self.path = Path(path)
        self.frames = start.frames
        self.skipped_bytes = start.skipped_bytes
        """Bytes that belong to no good record."""
        self._behind = start.time_us, start.offset, start.skipped_bytes
        """Time of the record that was returned last, where it ends, and the bytes skipped before."""
        self.truncated = False
        """Whether the file ends inside a record."""
        self._iterator = self._iterate()

    def __iter__(self) -> Iterator[tuple[float, Frame]]:
        """Return the iterator over the frames not yet read."""
        return self._iterator

    def __next__(self) -> tuple[float, Frame]:
        """Return the next (Unix seconds, frame)."""
        return next(self._iterator)

    @property
    def position(self) -> TlogPosition:
        """Where the record begins that `next` returns next."""
        time_us, offset, skipped_bytes = self._behind
        return TlogPosition(offset, time_us, self.frames, skipped_bytes)

    def _iterate(self) -> Iterator[tuple[float, Frame]]:
        try:
            start = self.position
            before = [start.time_us] if start.frames else []
            for time_us, frame, end, skipped in _trusted_times(self._records(start.offset), before):
                self._behind = time_us, end, skipped
                yield time_us / 1e6, frame
        except OSError as error:
            raise TlogError(f"{self.path}: cannot be read: {error.strerror or error}") from None
        if not self.frames:
            raise TlogError(
                f"{self.path}: not a telemetry log, no MAVLink frame in it"
                if self.skipped_bytes
                else f"{self.path}: empty, no telemetry in it"
            )

    def _records(self, offset: int) -> Iterator[_Record]:
        """Yield good records with the times that stand in the file."""
        with open_plain(self.path) as file:
            file.seek(offset)
            data, at, ended, in_sync = b"", 0, False, True
            while True:
                if not ended and len(data) - at < _MARGIN_BYTES:
                    more = file.read(_CHUNK_BYTES)
                    data, at, ended, offset = data[at:] + more, 0, not more, offset + at
                    continue
                if at >= len(data):
                    break
                frame = _frame_at(data, at + _TIME_BYTES, in_sync=in_sync)
                if frame is not None:
                    self.frames += 1
                    time_us = _TIME.unpack_from(data, at)[0]
                    at += _TIME_BYTES + len(frame.raw)
                    yield time_us, frame, offset + at, self.skipped_bytes
                else:
                    skipped = _to_next_candidate(data, at)
                    self.skipped_bytes += skipped
                    at += skipped
                in_sync = frame is not None
                # Such a file is no log: its rest need not be searched.
                if not self.frames and self.skipped_bytes > _HOPELESS_BYTES:
                    break
            self.truncated = not in_sync


def read_tlog(path: Path | str, start: TlogPosition = BEGINNING) -> TlogReader:
    """Return an iterator over the frames of a telemetry log with their times; see `TlogReader`."""
    return TlogReader(path, start)


def _frame_at(data: bytes, start: int, *, in_sync: bool) -> Frame | None:
    """Return the good frame at `start`, or None. One of an unknown message counts only where another frame follows."""
    size = len(data)
    if start >= size:
        return None
    end = frame_end(data, start, size)
    if not start < end <= size:
        return None
    frame = check_frame(data[start:end])
    if frame is None or dialect.is_known(frame.msgid):
        return frame
    following = end + _TIME_BYTES
    fits = following >= size or data[following] in (MAGIC_V1, MAGIC_V2)
    return frame if in_sync and fits else None


def _to_next_candidate(data: bytes, at: int) -> int:
    """Return how many bytes to skip from a bad record at `at` to the next place where one may begin."""
    magic = MAGIC.search(data, at + _TIME_BYTES + 1)
    if magic is not None:
        return magic.start() - _TIME_BYTES - at
    return max(1, len(data) - _TIME_BYTES - at)


def _trusted_times(records: Iterator[_Record], before: list[int]) -> Iterator[_Record]:
    """Replace each time that fits neither the one before nor the two behind.

    A clock that was set while recording is no damage: its new time fits the records behind. `before` holds the time
    of the record before the first one, if there is one.
    """
    waiting = deque(islice(records, _LOOK_AHEAD + 1))
    while waiting:
        time_us, frame, end, skipped = waiting.popleft()
        neighbours = before + [behind[0] for behind in waiting]
        if neighbours and all(abs(time_us - other_us) > JUMP_US for other_us in neighbours):
            time_us = neighbours[0]
        yield time_us, frame, end, skipped
        before = [time_us]
        waiting.extend(islice(records, 1))
