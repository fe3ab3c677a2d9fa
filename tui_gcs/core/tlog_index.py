"""Index of a telemetry log: where each record lies, when it was written and whose message it holds.

An hour of fifty vehicles, 6.7 million records, takes about a second. Everything that looks like a record is found at
once with numpy; taken are those that a chain of records leads to, beginning at a good one, as long as each ends where
the next begins and their times fit. Where the chain breaks the reader's own rules decide, CRC included (`tlog.py`),
until it holds again. So of an undamaged log the index has exactly the reader's records and times. A damaged payload
alone breaks no chain: such a record is listed, and its CRC shows it to who decodes it.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tui_gcs.core.tlog import _HOPELESS_BYTES as HOPELESS_BYTES
from tui_gcs.core.tlog import _LOOK_AHEAD, JUMP_US, TlogError
from tui_gcs.core.tlog import _frame_at as frame_at
from tui_gcs.core.wire.frames import MAGIC_V1, MAGIC_V2, SIGNATURE_BYTES

Array = npt.NDArray[Any]

_CHUNK_BYTES = 1 << 19
"""Fits a processor's cache, with what is computed from it."""
_MARGIN_BYTES = 300
"""Read beyond each chunk, and looked at where a chain breaks: a record and the beginning of the next always fit."""
_PADDING = bytes(16)
"""Behind the file's end, so that the header of the shortest record can be read in words."""
_TIME_BYTES = 8
_NO_TIMES = np.empty(0, np.uint64)
_OVERHEAD_V1, _OVERHEAD_V2 = 8, 12
_LATEST_US = (1 << 63) - 1
"""Columns are signed; a time beyond is damaged anyway."""


@dataclass(frozen=True)
class TlogIndex:
    """Columns of a log's records, or of every n-th of them; all have the same length."""

    path: Path
    every: int
    """Entry i of a column is record number i * every."""
    records: int
    """How many records the log has."""
    skipped_bytes: int
    """Bytes that belong to no record."""
    offset: npt.NDArray[np.int64]
    """Where the record begins in the file, with its time."""
    time_us: npt.NDArray[np.int64]
    """Microseconds since 1970. As for the reader, a time that fits no neighbour is replaced by one that does."""
    newest_us: npt.NDArray[np.int64]
    """Highest time up to this record, left out ones included: times go backwards where a clock was set."""
    system: npt.NDArray[np.uint8]
    component: npt.NDArray[np.uint8]
    msgid: npt.NDArray[np.uint32]

    def seek(self, time_us: int) -> int:
        """Number of the first record that is not older than `time_us`; `records` if all are.

        Raises:
            TlogError: the file cannot be read any more.
        """
        entry = int(np.searchsorted(self.newest_us, time_us))  # the first one that is not older
        if self.every == 1 or entry == 0:
            return entry
        first = (entry - 1) * self.every
        for number, (record_us, _) in enumerate(islice(self.frames(first), self.every), first):
            if record_us >= time_us:
                return number
        return min(entry * self.every, self.records)

    def frames(self, first: int = 0) -> Iterator[tuple[int, bytes]]:
        """(time in microseconds, raw frame) of record number `first` and all behind it. No CRC is checked.

        Raises:
            TlogError: the file cannot be read any more.
        """
        if not 0 <= first < self.records:
            return
        entry, skipped = divmod(first, self.every)
        batches = _batches(self.path, _Place(int(self.offset[entry]), proven=True))
        for batch in _with_trusted_times(batches, int(self.time_us[entry])):
            times_us, begins, ends = batch.time_us.tolist(), batch.begin.tolist(), batch.end.tolist()
            for i in range(skipped, len(begins)):
                yield times_us[i], batch.data[begins[i] + _TIME_BYTES : ends[i]]
            skipped = max(0, skipped - len(begins))


def index_tlog(path: Path | str, every: int = 1) -> TlogIndex:
    """Index a log: 30 bytes of memory per record, or per `every`-th record.

    A file without a single record gives an index without records.

    Raises:
        TlogError: the file cannot be read.
    """
    path = Path(path)
    columns: list[list[Array]] = [[] for _ in range(6)]
    records = newest_us = 0
    place = _Place(0)
    for batch in _with_trusted_times(_batches(path, place), None):
        newest = np.maximum.accumulate(np.maximum(batch.time_us, newest_us))
        newest_us = int(newest[-1])
        kept = slice(-records % every, None, every)
        values = (batch.start + batch.begin[kept], batch.time_us[kept], newest[kept], *_senders(batch, kept))
        for column, value in zip(columns, values, strict=True):
            column.append(value)
        records += len(batch.begin)
    types: list[Any] = [np.int64, np.int64, np.int64, np.uint8, np.uint8, np.uint32]
    whole: list[Any] = []
    for kind in types:
        parts = columns.pop(0)  # and let go of, so that no more than one column is in memory twice
        whole.append(np.concatenate([np.empty(0, kind), *parts]))
    return TlogIndex(path, every, records, place.skipped_bytes, *whole)


class _Batch(NamedTuple):
    """Records of one chunk of the file, at least one. `begin` and `end` count from the chunk's start."""

    data: bytes
    start: int
    begin: Array
    end: Array
    time_us: Array
    """As read: unsigned 64 bits. Behind `_with_trusted_times`: signed."""


@dataclass
class _Place:
    """How far the search has come."""

    at: int
    """Where a record is expected, or looked for; counted from the chunk's start while a chunk is searched."""
    proven: bool = False
    """A good record ends here, so that one which looks like a record is one."""
    in_sync: bool = True
    """Nothing was skipped just before."""
    time_us: int = -1
    """Of the record before; -1 if there is none."""
    skipped_bytes: int = 0

    def is_near(self, time_us: int) -> bool:
        """Whether a record of this time may follow."""
        return self.time_us < 0 or abs(time_us - self.time_us) <= JUMP_US

    def skip_to(self, at: int) -> None:
        """No record begins before `at`."""
        if at > self.at:
            self.skipped_bytes += at - self.at
            self.at, self.proven, self.in_sync = at, False, False


def _senders(batch: _Batch, kept: slice) -> tuple[Array, Array, Array]:
    """System, component and message id of a batch's records."""
    begin = batch.begin[kept]
    words = _words(batch.data, "<u8")[begin + _TIME_BYTES + 2]  # version 2: flags, flags, seq, system, component, id
    system, component, msgid = words >> 24 & 0xFF, words >> 32 & 0xFF, words >> 40
    old = np.frombuffer(batch.data, np.uint8)[begin + _TIME_BYTES] == MAGIC_V1
    if old.any():  # version 1: seq, system, component, id
        system = np.where(old, words >> 8 & 0xFF, system)
        component = np.where(old, words >> 16 & 0xFF, component)
        msgid = np.where(old, words >> 24 & 0xFF, msgid)
    return system.astype(np.uint8), component.astype(np.uint8), msgid.astype(np.uint32)


def _words(data: bytes, kind: str) -> Array:
    """`data` as overlapping numbers: the n-th is the one that begins at byte n."""
    size = np.dtype(kind).itemsize
    return np.ndarray((max(0, len(data) - size + 1),), kind, data, strides=(1,))


# ---------------------------------------------------------------- records


def _batches(path: Path, place: _Place) -> Iterator[_Batch]:
    """The records from `place` on."""
    try:
        with path.open("rb") as file:
            start, hopeless, found = place.at, place.at + HOPELESS_BYTES, False
            while True:
                file.seek(start)
                data = file.read(_CHUNK_BYTES + _MARGIN_BYTES)
                if not data or (start > hopeless and not found):
                    return
                place.at = 0
                batch = _search(data, start, place)
                if len(batch.begin):
                    found = True
                    yield batch
                start += place.at
    except OSError as error:
        raise TlogError(f"{path}: cannot be read: {error.strerror or error}") from None


def _search(data: bytes, start: int, place: _Place) -> _Batch:
    """The records that begin in the first `_CHUNK_BYTES` of `data`; moves `place` behind the last of them."""
    limit = min(len(data), _CHUNK_BYTES)
    heads, begin, end, time_us = _lookalikes(data)
    breaks = _breaks(begin, end, time_us)
    chosen = np.zeros(len(begin), bool)
    single: list[tuple[int, int]] = []
    while place.at < limit:
        if not place.proven:
            head = int(heads.searchsorted(place.at))
            place.skip_to(int(heads[head]) if head < len(heads) else limit)
        i = int(begin.searchsorted(place.at))
        if place.proven and i < len(begin) and begin[i] == place.at and place.is_near(int(time_us[i])):
            last = int(breaks[breaks.searchsorted(i)])
            chosen[i : last + 1] = True
            place.at, place.time_us = int(end[last]), int(time_us[last])
        elif place.at < limit:
            found = place.at
            if _step(data, place):
                single.append((found, place.at))
    if not chosen.all():
        begin, end = begin[chosen], end[chosen]
    if single:
        begin, end = np.concatenate([np.column_stack((begin, end)), np.array(single)]).T
        order = np.argsort(begin)
        begin, end = begin[order], end[order]
    if len(data) < _CHUNK_BYTES + _MARGIN_BYTES:
        data += _PADDING
    return _Batch(data, start, begin, end, _times(data, begin))


def _lookalikes(data: bytes) -> tuple[Array, Array, Array, Array]:
    """Where a header may be; begin, end and time of those that have a frame's first byte where the next would begin."""
    octets = np.frombuffer(data, np.uint8)
    begin = np.flatnonzero(
        octets[_TIME_BYTES : min(len(data) - 3, _TIME_BYTES + _CHUNK_BYTES)] - np.uint8(MAGIC_V2) < 2
    )
    head = _words(data, "<u4")[begin + _TIME_BYTES]  # first byte, length; version 2: incompatibility flags
    old, flags = head & 0xFF == MAGIC_V1, head >> 16 & 0xFF
    size = np.where(old, _TIME_BYTES + _OVERHEAD_V1, _TIME_BYTES + _OVERHEAD_V2 + SIGNATURE_BYTES * flags)
    end = begin + size + (head >> 8 & 0xFF)
    sound = old | (flags < 2)
    following = end + _TIME_BYTES
    chained = sound & (following < len(data)) & _is_magic(octets.take(following, mode="clip"))
    heads, begin, end = begin[sound], begin[chained], end[chained]
    return heads, begin, end, _times(data, begin)


def _is_magic(octets: Array) -> Array:
    first: Array = octets - np.uint8(MAGIC_V2) < 2
    return first


def _breaks(begin: Array, end: Array, time_us: Array) -> Array:
    """Which lookalikes do not lead to the next one: it begins elsewhere, or its time is far away; always the last."""
    apart = np.maximum(time_us[1:], time_us[:-1]) - np.minimum(time_us[1:], time_us[:-1])
    return np.append(np.flatnonzero((end[:-1] != begin[1:]) | (apart > JUMP_US)), len(begin) - 1)


def _times(data: bytes, begin: Array) -> Array:
    return _words(data, ">u8")[begin].astype(np.uint64)


def _step(data: bytes, place: _Place) -> bool:
    """Take the record at `place` if the reader would, else look one byte further.

    Behind damage a good CRC alone is not believed, as one in 65,536 is good by chance: its time has to fit as well, or
    another frame to follow.
    """
    window = data[place.at : place.at + _MARGIN_BYTES]
    frame = frame_at(window, _TIME_BYTES, in_sync=place.in_sync)
    if frame is not None:
        time_us = int.from_bytes(window[:_TIME_BYTES], "big")
        following = window[2 * _TIME_BYTES + len(frame.raw) :][:1]
        if place.in_sync or not following or following[0] in (MAGIC_V1, MAGIC_V2) or place.is_near(time_us):
            place.at += _TIME_BYTES + len(frame.raw)
            place.time_us = time_us
            place.proven = place.in_sync = True
            return True
    place.skip_to(place.at + 1)
    return False


# ---------------------------------------------------------------- times


def _with_trusted_times(batches: Iterator[_Batch], first_us: int | None) -> Iterator[_Batch]:
    """Replace times that fit neither the one before nor the two behind (the reader's rule), and make them signed.

    `first_us` is the first record's time where it is known already.
    """
    waiting: deque[_Batch] = deque()
    before_us = -1
    for batch in chain(batches, [None]):
        if batch is not None:
            waiting.append(batch)
        while waiting and (batch is None or sum(len(later.begin) for later in islice(waiting, 1, None)) >= _LOOK_AHEAD):
            taken = waiting.popleft()
            behind = [later.time_us[:_LOOK_AHEAD] for later in waiting]
            times_us = _trusted(taken.time_us, np.concatenate([*behind, _NO_TIMES])[:_LOOK_AHEAD], before_us, first_us)
            before_us, first_us = int(times_us[-1]), None
            yield taken._replace(time_us=np.minimum(times_us, np.uint64(_LATEST_US)).astype(np.int64))


def _trusted(times_us: Array, behind_us: Array, before_us: int, first_us: int | None) -> Array:
    """`times_us` without the damaged ones. `before_us` is -1 if none is before."""
    following = np.concatenate([times_us, behind_us])
    apart = np.maximum(times_us[1:], times_us[:-1]) - np.minimum(times_us[1:], times_us[:-1])
    suspects = [0, *(np.flatnonzero(apart > JUMP_US) + 1).tolist()]
    trusted = times_us.copy()
    if first_us is not None:
        trusted[0] = first_us
        suspects = suspects[1:]
    for i in suspects:
        before = [int(trusted[i - 1])] if i else [before_us] if before_us >= 0 else []
        neighbours = before + following[i + 1 : i + 1 + _LOOK_AHEAD].tolist()
        if neighbours and all(abs(int(times_us[i]) - other_us) > JUMP_US for other_us in neighbours):
            trusted[i] = neighbours[0]
    return trusted
