"""The index of an hour's telemetry log of fifty vehicles, against pymavlink opening the same file."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink import mavutil

from tests.bench.row import NotMeasured, Row
from tests.bench.stream import UNIX_S, frames_of, stream
from tui_gcs.core.tlog_index import index_tlog

VEHICLES, BLOCK_S, BLOCKS = 50, 60.0, 60


def tlog(folder: Path) -> Iterator[Row]:
    """CPU seconds; pymavlink once, because it takes a quarter of a minute."""
    path = folder / "hour.tlog"
    records = write_hour(path)
    size_mb = path.stat().st_size / 1e6
    yield Row(f"tlog, {records / 1e6:.1f} million records, {size_mb:.0f} MB: index", best_s(path, 1, records), "s", 2)
    yield Row("tlog: index of every 1000th record", best_s(path, 1000, records), "s")
    theirs_s, reader = timed(lambda: mavutil.mavmmaplog(str(path)))
    if sum(reader.counts.values()) != records:
        raise NotMeasured(f"pymavlink found {sum(reader.counts.values())} of {records} records")
    yield Row("tlog: pymavlink mavmmaplog opens it in", theirs_s, "s")
    yield Row("tlog: times faster than pymavlink", theirs_s / best_s(path, 1, records), "x")
    index = index_tlog(path, 1000)
    middle_us = int(index.time_us[len(index.time_us) // 2])
    seek_s = min(timed(lambda: index.seek(middle_us + 12_345))[0] for _ in range(5))
    yield Row("tlog: seek to a time with the small index", 1000 * seek_s, "ms")


def best_s(path: Path, every: int, records: int) -> float:
    taken_s = []
    for _ in range(3):
        seconds, index = timed(lambda: index_tlog(path, every))
        taken_s.append(seconds)
        if (index.records, index.skipped_bytes) != (records, 0):
            raise NotMeasured(f"the index has {index.records} of {records} records")
    return min(taken_s)


def timed(what: Callable[[], Any]) -> tuple[float, Any]:
    began_s = time.process_time()
    result = what()
    return time.process_time() - began_s, result


def write_hour(path: Path) -> int:
    """One minute of the stream, sixty times with the time going on; how many records that are."""
    times_us, raws = [], []
    for sent in stream(VEHICLES, BLOCK_S):
        for raw in frames_of(sent.data):
            times_us.append(round(sent.t_s * 1e6) + sent.vehicle)
            raws.append(bytes(8) + raw)
    block = np.frombuffer(bytearray(b"".join(raws)), np.uint8)
    begins = np.cumsum([0, *(len(raw) for raw in raws[:-1])])
    with path.open("wb") as file:
        for number in range(BLOCKS):
            begin_us = UNIX_S * 1_000_000 + round(number * BLOCK_S * 1e6)
            stamps = (begin_us + np.array(times_us)).astype(">u8").view(np.uint8).reshape(-1, 8)
            block[begins[:, None] + np.arange(8)] = stamps
            file.write(block.tobytes())
    return BLOCKS * len(raws)
