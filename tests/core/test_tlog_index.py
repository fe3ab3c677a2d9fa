"""The index of a telemetry log says what the reader says, and is not fooled by what looks like a record."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.core import tlog_index
from tui_gcs.core.tlog import TlogError, read_tlog
from tui_gcs.core.tlog_index import TlogIndex, index_tlog
from tui_gcs.core.wire.dialect import crc_extra

DATA = Path(__file__).parents[1] / "data"
START_US = 1_700_000_000_000_000
DAY_US = 24 * 3600 * 1_000_000
HEARTBEAT, SYSTEM_TIME, FILE_TRANSFER, UNKNOWN = 0, 2, 110, 70001
NO_EXTRA = b"\x5a"


def v1(msgid: int, payload: bytes, system: int = 1, component: int = 1) -> bytes:
    body = bytes([len(payload), 7, system, component, msgid]) + payload
    return b"\xfe" + body + mcrf4xx(body + (crc_extra(msgid) or NO_EXTRA)).to_bytes(2, "little")


def v2(msgid: int, payload: bytes, system: int = 1, component: int = 1, signature: bytes = b"") -> bytes:
    head = bytes([len(payload), 1 if signature else 0, 0, 7, system, component]) + msgid.to_bytes(3, "little")
    body = head + payload
    return b"\xfd" + body + mcrf4xx(body + (crc_extra(msgid) or NO_EXTRA)).to_bytes(2, "little") + signature


def record(time_us: int, raw: bytes) -> bytes:
    return time_us.to_bytes(8, "big") + raw


def beats(count: int, start_us: int = START_US) -> list[bytes]:
    return [
        record(start_us + n * 20_000, v2(HEARTBEAT, b"\x04\x00\x00\x00\x02\x03\x59\x03\x03", 1 + n))
        for n in range(count)
    ]


def written(folder: Path, data: bytes) -> Path:
    path = folder / "flight.tlog"
    path.write_bytes(data)
    return path


def rows(index: TlogIndex) -> list[tuple[float, int, int, int]]:
    times_s = [time_us / 1e6 for time_us in index.time_us.tolist()]
    return list(zip(times_s, *(c.tolist() for c in (index.system, index.component, index.msgid)), strict=True))


def reader_rows(path: Path) -> list[tuple[float, int, int, int]]:
    return [(wall_s, frame.system, frame.component, frame.msgid) for wall_s, frame in read_tlog(path)]


@contextmanager
def chunks_of(size: int) -> Iterator[None]:
    """Small chunks, so that short files have many of them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tlog_index, "_CHUNK_BYTES", size)
        yield


@pytest.mark.parametrize("name", ["arducopter-8.tlog", "px4-8.tlog"])
def test_of_a_real_flight_it_lists_what_the_reader_reads(name: str) -> None:
    index = index_tlog(DATA / name)
    assert rows(index) == reader_rows(DATA / name)
    assert [raw for _, raw in index.frames()] == [frame.raw for _, frame in read_tlog(DATA / name)]
    assert (index.records, index.skipped_bytes) == (len(index.offset), 0)


def test_a_sparse_index_answers_the_same_with_less_memory(tmp_path: Path) -> None:
    path = written(tmp_path, b"".join(beats(100)))
    full, sparse = index_tlog(path), index_tlog(path, every=7)
    assert sparse.records == 100
    assert sparse.offset.tolist() == full.offset[::7].tolist()
    for time_us in (0, START_US, START_US + 1, START_US + 20_000 * 42, START_US + 20_000 * 50 + 1, START_US + DAY_US):
        assert sparse.seek(time_us) == full.seek(time_us)
    for first in (0, 1, 6, 7, 50, 99, 100, 1000, -1):
        assert list(sparse.frames(first)) == list(full.frames(first))


def test_seek_finds_the_first_record_that_is_not_older(tmp_path: Path) -> None:
    times_us = [10, 20, 30, 25, 5, 40]  # the clock was set back
    index = index_tlog(written(tmp_path, b"".join(record(START_US + t, v2(HEARTBEAT, b"\1")) for t in times_us)))
    assert [index.seek(START_US + t) for t in (0, 10, 11, 25, 30, 31, 40, 41)] == [0, 0, 1, 2, 2, 5, 5, 6]
    assert [time_us - START_US for time_us, _ in index.frames(3)] == [25, 5, 40]


@pytest.mark.parametrize("step_us", [-20_000, 20_000])
def test_times_may_cross_a_boundary_of_their_upper_bytes(tmp_path: Path, step_us: int) -> None:
    begin_us = (1547 << 40) - 5 * step_us  # byte 2 changes every 12.7 days
    path = written(tmp_path, b"".join(record(begin_us + n * step_us, v2(HEARTBEAT, b"\1")) for n in range(10)))
    assert index_tlog(path).time_us.tolist() == [begin_us + n * step_us for n in range(10)]


def test_a_damaged_time_is_replaced_by_its_neighbour(tmp_path: Path) -> None:
    for place, expected_us in ((0, START_US + 20_000), (1, START_US), (3, START_US + 40_000)):
        whole = beats(4)
        whole[place] = record(START_US + 400 * DAY_US, whole[place][8:])
        assert index_tlog(written(tmp_path, b"".join(whole))).time_us.tolist()[place] == expected_us


@pytest.mark.parametrize("kept", [1, 5, 8, 9, 10, 20, 28])
def test_a_torn_last_record_is_left_out(tmp_path: Path, kept: int) -> None:
    whole = beats(3)
    index = index_tlog(written(tmp_path, whole[0] + whole[1] + whole[2][:kept]))
    assert (index.system.tolist(), index.skipped_bytes) == ([1, 2], kept)


@pytest.mark.parametrize("data", [b"", b"\xfd", b"QGC WPL 110\n0\t1\t0\t16", bytes(range(256)) * 40, b"\xfd" * 3000])
def test_what_is_no_log_has_no_records(tmp_path: Path, data: bytes) -> None:
    index = index_tlog(written(tmp_path, data))
    assert (index.records, index.skipped_bytes, list(index.frames())) == (0, len(data), [])
    assert index.seek(0) == 0


def test_a_file_that_cannot_be_read_says_why(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "none.tlog", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(TlogError, match=why):
            index_tlog(path)


def test_records_inside_a_payload_are_no_records(tmp_path: Path) -> None:
    """A log that is fetched over the link: its records travel in payloads, with good CRCs and fitting times."""
    inner = b"".join(beats(6))[:230]
    whole = [record(START_US + n, v2(FILE_TRANSFER, inner[n:] + b"\1", 9)) for n in range(40)]
    index = index_tlog(written(tmp_path, b"".join(whole)))
    assert (index.system.tolist(), index.skipped_bytes) == ([9] * 40, 0)


def test_a_crc_that_is_good_by_chance_makes_no_record(tmp_path: Path) -> None:
    good, chance = beats(2), v1(HEARTBEAT, b"\1")
    junk = b"junk, no time!" + chance + b"no beginning of a record"
    index = index_tlog(written(tmp_path, good[0] + junk + good[1]))
    assert index.offset.tolist() == [0, len(good[0] + junk)]


PAYLOADS = st.one_of(st.binary(min_size=1, max_size=40), st.just(b"".join(beats(2))), st.just(b"\xfd\x01\x00\xfe" * 9))
NODES = st.integers(1, 255)
FRAMES = st.one_of(
    st.builds(v1, st.sampled_from([HEARTBEAT, SYSTEM_TIME, 77]), PAYLOADS, NODES, NODES),
    st.builds(v2, st.sampled_from([HEARTBEAT, SYSTEM_TIME, FILE_TRANSFER, UNKNOWN]), PAYLOADS, NODES, NODES),
    st.builds(v2, st.just(FILE_TRANSFER), PAYLOADS, NODES, NODES, st.binary(min_size=13, max_size=13)),
)
TIMES_US = st.one_of(st.integers(START_US, START_US + DAY_US), st.integers(0, 1 << 62))
RECORDS = st.lists(st.builds(record, TIMES_US, FRAMES), max_size=20)


@settings(max_examples=200, deadline=None)
@given(RECORDS, st.sampled_from([16, 100, 1 << 19]), st.integers(1, 4))
def test_of_a_whole_file_it_lists_what_the_reader_reads(
    tmp_path_factory: pytest.TempPathFactory, records: list[bytes], chunk: int, every: int
) -> None:
    path = written(tmp_path_factory.mktemp("log"), b"".join(records))
    with chunks_of(chunk):
        index, sparse = index_tlog(path), index_tlog(path, every)
        assert (index.records, index.skipped_bytes) == (len(records), 0)
        if records:
            assert rows(index) == reader_rows(path)
        assert [raw for _, raw in index.frames()] == [whole[8:] for whole in records]
        times_us = index.time_us.tolist()
        assert [t for t, _ in sparse.frames(len(records) // 2)] == times_us[len(records) // 2 :]
        for wanted_us in times_us[:3]:
            first = next(n for n, time_us in enumerate(times_us) if time_us >= wanted_us)
            assert (index.seek(wanted_us), sparse.seek(wanted_us)) == (first, first)


def starts(records: list[bytes], at: int = 0) -> list[int]:
    return [at + sum(map(len, records[:n])) for n in range(len(records))]


@settings(max_examples=300, deadline=None)
@given(st.integers(1, 12), st.binary(max_size=300), st.integers(0, 28), st.sampled_from([16, 100, 1 << 19]))
def test_damage_costs_only_what_it_touches(
    tmp_path_factory: pytest.TempPathFactory, count: int, damage: bytes, torn: int, chunk: int
) -> None:
    """Good records, the beginning of one more, junk, good records."""
    before, after = beats(count), beats(20, START_US + DAY_US)
    junk = before[0][:torn] + damage
    path = written(tmp_path_factory.mktemp("log"), b"".join(before) + junk + b"".join(after))
    with chunks_of(chunk):
        listed = index_tlog(path).offset.tolist()
    middle = len(b"".join(before))
    expected = starts(before) + starts(after, middle + len(junk))
    assert set(listed) <= {*expected, middle}, "the torn one may be whole again by chance, but for its CRC"
    assert set(listed) >= set(starts(before))
    assert listed[-12:] == expected[-12:], "a length that is damaged costs at most 280 bytes"


@settings(max_examples=300, deadline=None)
@given(RECORDS, st.lists(st.tuples(st.integers(0, 2000), st.integers(1, 255)), max_size=6), st.integers(0, 2000))
def test_of_a_damaged_file_it_lists_only_records(
    tmp_path_factory: pytest.TempPathFactory, records: list[bytes], flips: list[tuple[int, int]], end: int
) -> None:
    whole = bytearray(b"".join(records))
    for at, bits in flips:
        if at < len(whole):
            whole[at] ^= bits
    data = bytes(whole)[:end] if end % 2 else bytes(whole)
    inner = [at for at in range(len(data)) if any(data.startswith(beat[8:], at + 8) for beat in beats(2))]
    with chunks_of(100):
        index = index_tlog(written(tmp_path_factory.mktemp("log"), data))
        assert set(index.offset.tolist()) <= {*starts(records), *inner}
        assert sum(8 + len(raw) for _, raw in index.frames()) + index.skipped_bytes == len(data)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.one_of(st.sampled_from(beats(5)), st.binary(max_size=50)), max_size=12))
def test_any_file_can_be_indexed(tmp_path_factory: pytest.TempPathFactory, pieces: list[bytes]) -> None:
    data = b"".join(pieces)
    index = index_tlog(written(tmp_path_factory.mktemp("log"), data))
    assert sum(8 + len(raw) for _, raw in index.frames()) + index.skipped_bytes == len(data)
