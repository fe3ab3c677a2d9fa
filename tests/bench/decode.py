"""Decoding: our frames and messages against pymavlink's parser, on a recorded flight, same bytes, same messages."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega

from tests.bench.row import NotMeasured, Row
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.records.tlog_reader import read_tlog

FLIGHT = Path(__file__).parents[1] / "data" / "arducopter-8.tlog"


def decoder(_: Path) -> Iterator[Row]:
    """Microseconds per message, best of five."""
    if not FLIGHT.exists():
        raise NotMeasured(f"there is no {FLIGHT.name}")
    frames = [frame.raw for _, frame in read_tlog(FLIGHT)]
    known = [raw for raw in frames if cut_datagram(raw).frames and decode(cut_datagram(raw).frames[0]) is not None]
    ours_us, theirs_us = best_us(ours, known), best_us(pymavlinks, known)
    yield Row(f"decoder, {len(known)} messages: ours per message", ours_us, "us")
    yield Row("decoder: pymavlink per message", theirs_us, "us")
    yield Row("decoder: times faster than pymavlink", theirs_us / ours_us, "x")


def best_us(read: Callable[[list[bytes]], int], datagrams: list[bytes]) -> float:
    taken_s = []
    for _ in range(5):
        began_s = time.perf_counter()
        count = read(datagrams)
        taken_s.append(time.perf_counter() - began_s)
        if count != len(datagrams):
            raise NotMeasured(f"{read.__name__} decoded {count} of {len(datagrams)} messages")
    return 1e6 * min(taken_s) / len(datagrams)


def ours(datagrams: list[bytes]) -> int:
    return sum(decode(frame) is not None for data in datagrams for frame in cut_datagram(data).frames)


def pymavlinks(datagrams: list[bytes]) -> int:
    parser = ardupilotmega.MAVLink(None)
    parser.robust_parsing = True
    return sum(len(parser.parse_buffer(data) or []) for data in datagrams)
