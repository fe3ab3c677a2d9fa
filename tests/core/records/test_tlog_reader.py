"""Reading telemetry logs: good frames are returned, everything else is counted."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import Frame
from tui_gcs.core.records.tlog_reader import TlogError, read_tlog

START_US = 1_700_000_000_000_000
DAY_US = 24 * 3600 * 1_000_000


def record(time_us: int, raw: bytes) -> bytes:
    return time_us.to_bytes(8, "big") + raw


def records(count: int, step_us: int = 1_000_000) -> list[bytes]:
    encoder = Encoder(1, 1)
    return [
        record(START_US + n * step_us, encoder.encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=n + 1))
        for n in range(count)
    ]


def unknown_message() -> bytes:
    return bytes([0xFD, 3, 0, 0, 9, 7, 1]) + (70001).to_bytes(3, "little") + b"abc\x12\x34"


def written(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "flight.tlog"
    path.write_bytes(data)
    return path


def boot_ms(frame: Frame) -> int:
    return int.from_bytes(frame.payload[8:12], "little")


def test_times_and_frames_in_order(tmp_path: Path) -> None:
    reader = read_tlog(written(tmp_path, b"".join(records(3))))
    assert [(wall_s, boot_ms(frame)) for wall_s, frame in reader] == [(1.7e9, 1), (1.7e9 + 1, 2), (1.7e9 + 2, 3)]
    assert (reader.frames, reader.skipped_bytes, reader.truncated) == (3, 0, False)


@pytest.mark.parametrize("kept", [1, 5, 8, 9, 10, 20, 28])
def test_a_torn_last_record_is_counted(tmp_path: Path, kept: int) -> None:
    whole = records(3)
    reader = read_tlog(written(tmp_path, whole[0] + whole[1] + whole[2][:kept]))
    assert [boot_ms(frame) for _, frame in reader] == [1, 2]
    assert (reader.skipped_bytes, reader.truncated) == (kept, True)


def test_a_record_torn_in_the_middle_costs_only_itself(tmp_path: Path) -> None:
    whole = records(4)
    reader = read_tlog(written(tmp_path, whole[0] + whole[1][:15] + whole[2] + whole[3]))
    assert [boot_ms(frame) for _, frame in reader] == [1, 3, 4]
    assert (reader.skipped_bytes, reader.truncated) == (15, False)


def test_flipped_bits_cost_one_record(tmp_path: Path) -> None:
    whole = records(4)
    broken = bytearray(whole[1])
    broken[-1] ^= 0x10
    reader = read_tlog(written(tmp_path, whole[0] + bytes(broken) + whole[2] + whole[3]))
    assert [boot_ms(frame) for _, frame in reader] == [1, 3, 4]
    assert reader.skipped_bytes == len(broken)


def test_unknown_messages_are_given_but_not_found_in_damage(tmp_path: Path) -> None:
    whole = records(2)
    unknown = record(START_US, unknown_message())
    reader = read_tlog(written(tmp_path, whole[0] + unknown + whole[1] + b"damage!" + unknown))
    assert [frame.msgid for _, frame in reader] == [2, 70001, 2]
    assert reader.skipped_bytes == 7 + len(unknown)


def test_a_damaged_time_is_replaced_by_its_neighbour(tmp_path: Path) -> None:
    whole = records(4)
    for place, expected_s in ((0, 1.7e9 + 1), (1, 1.7e9), (3, 1.7e9 + 2)):
        damaged = list(whole)
        damaged[place] = record(START_US + 400 * DAY_US, whole[place][8:])
        times = [wall_s for wall_s, _ in read_tlog(written(tmp_path, b"".join(damaged)))]
        assert times[place] == expected_s
        assert len(times) == 4


def test_a_clock_that_was_set_while_recording_is_no_damage(tmp_path: Path) -> None:
    encoder = Encoder(1, 1)
    times_us = [5, 1_000_000, START_US, START_US + 1_000_000]
    data = b"".join(record(t, encoder.encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=1)) for t in times_us)
    assert [round(wall_s * 1e6) for wall_s, _ in read_tlog(written(tmp_path, data))] == times_us


def test_mavproxys_link_number_in_the_time_is_harmless(tmp_path: Path) -> None:
    data = b"".join(record(START_US | n, records(1)[0][8:]) for n in range(4))
    assert all(abs(wall_s - 1.7e9) < 1e-5 for wall_s, _ in read_tlog(written(tmp_path, data)))


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "empty, no telemetry in it"),
        (b"QGC WPL 110\n0\t1\t0\t16", "not a telemetry log, no MAVLink frame in it"),
        (bytes(range(256)) * 40, "not a telemetry log"),
        (b"\xfd" * 3000, "not a telemetry log"),
    ],
)
def test_what_is_no_log_says_so_in_one_line(tmp_path: Path, data: bytes, why: str) -> None:
    path = written(tmp_path, data)
    with pytest.raises(TlogError) as caught:
        list(read_tlog(path))
    assert str(caught.value).startswith(f"{path}: {why}")
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_says_why(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "none.tlog", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(TlogError, match=why):
            list(read_tlog(path))


def test_records_are_found_across_the_readers_chunks(tmp_path: Path) -> None:
    whole = b"".join(records(60_000, step_us=1000))
    assert len(whole) > 1 << 20
    assert sum(1 for _ in read_tlog(written(tmp_path, whole))) == 60_000


@settings(max_examples=50)
@given(st.lists(st.one_of(st.sampled_from(records(5)), st.binary(max_size=50)), max_size=12))
def test_any_file_is_read_without_another_error(tmp_path_factory: pytest.TempPathFactory, pieces: list[bytes]) -> None:
    data = b"".join(pieces)
    reader = read_tlog(written(tmp_path_factory.mktemp("log"), data))
    try:
        used = sum(8 + len(frame.raw) for _, frame in reader)
    except TlogError:
        used = 0
    assert used + reader.skipped_bytes == len(data)
