"""The telemetry log survives what disks do, and other programs can read it."""

import os
from pathlib import Path

import pytest
from pymavlink import mavutil

from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.records.appender import FileAppender
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.records.tlog_writer import TlogWriter


def frames(count: int) -> list[bytes]:
    encoder = Encoder(1, 1)
    return [encoder.encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=n) for n in range(count)]


def test_a_log_holds_time_and_frame_of_both_directions(tmp_path: Path) -> None:
    log = TlogWriter(tmp_path / "runs" / "new.tlog")
    raw = frames(2)
    log.write(1_700_000_000.25, raw[0])
    log.write(1_700_000_000.5, raw[1])
    log.close()
    data = log.path.read_bytes()
    assert (
        data
        == (1_700_000_000_250_000).to_bytes(8, "big") + raw[0] + (1_700_000_000_500_000).to_bytes(8, "big") + raw[1]
    )
    assert (log.error, log.dropped, log.frames) == ("", 0, 2)


def test_many_frames_at_once_are_written_as_one_by_one(tmp_path: Path) -> None:
    one, many = TlogWriter(tmp_path / "one.tlog"), TlogWriter(tmp_path / "many.tlog")
    for raw in frames(5):
        one.write(1_700_000_000.25, raw)
    many.write_many(1_700_000_000.25, frames(5))
    many.write_many(1_700_000_001.0, [])
    one.close()
    many.close()
    assert many.path.read_bytes() == one.path.read_bytes()
    assert many.frames == one.frames == 5


def test_mavlogdump_reads_it(tmp_path: Path) -> None:
    log = TlogWriter(tmp_path / "a.tlog")
    for n, raw in enumerate(frames(20)):
        log.write(1_700_000_000 + n, raw)
    log.close()
    reader = mavutil.mavlink_connection(str(log.path))
    messages = [reader.recv_match() for _ in range(20)]
    assert [message.time_boot_ms for message in messages] == list(range(20))
    assert messages[3]._timestamp == 1_700_000_003
    reader.close()


def setup_signing() -> bytes:
    return Encoder(255, 190).encode(
        "SETUP_SIGNING", target_system=1, target_component=1, secret_key=[7] * 32, initial_timestamp=1
    )


def test_the_signing_key_is_never_recorded(tmp_path: Path) -> None:
    log = TlogWriter(tmp_path / "a.tlog")
    log.write(1.0, setup_signing())
    log.write(2.0, frames(1)[0])
    log.write_many(3.0, [frames(1)[0], setup_signing(), frames(1)[0]])
    log.write_many(4.0, [setup_signing()])
    log.close()
    assert [frame.msgid for _, frame in read_tlog(log.path)] == [2, 2, 2]
    assert (log.frames, b"\7" * 32 in log.path.read_bytes()) == (3, False)


def test_an_old_frame_with_the_same_bytes_inside_is_no_signing_key(tmp_path: Path) -> None:
    body = bytes([4, 0, 1, 1, 100]) + b"\xee\x00\x01\x00"  # an unknown message of version 1
    raw = b"\xfe" + body + b"\x12\x34"
    log = TlogWriter(tmp_path / "a.tlog")
    log.write_many(1.0, [raw])
    log.close()
    assert log.path.read_bytes()[8:] == raw


@pytest.mark.parametrize("wall_s", [float("nan"), float("inf"), -1.0, 1e300])
def test_an_absurd_clock_does_not_stop_the_recording(tmp_path: Path, wall_s: float) -> None:
    log = TlogWriter(tmp_path / "a.tlog")
    log.write(wall_s, frames(1)[0])
    log.close()
    assert len(list(read_tlog(log.path))) == 1


def test_a_log_is_continued_after_a_restart(tmp_path: Path) -> None:
    for n in range(2):
        log = TlogWriter(tmp_path / "a.tlog")
        log.write(1_700_000_000 + n, frames(1)[0])
        log.close()
    assert len(list(read_tlog(log.path))) == 2


def test_a_missing_disk_is_told_and_used_when_it_comes_back(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("a file where a directory should be")
    log = TlogWriter(tmp_path / "disk" / "a.tlog")
    for n, raw in enumerate(frames(3)):
        log.write(n, raw)
    log.flush()
    assert str(log.path) in log.error
    (tmp_path / "disk").unlink()
    log.flush()
    assert log.error == ""
    log.close()
    assert len(list(read_tlog(log.path))) == 3


def test_memory_is_bounded_and_the_newest_records_stay(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("")
    file = FileAppender(tmp_path / "disk" / "a", max_waiting_bytes=100)
    for n in range(50):
        file.put(f"{n:010d}".encode())
        file.flush()
    assert file.dropped == 40
    (tmp_path / "disk").unlink()
    file.close()
    assert (tmp_path / "disk" / "a").read_bytes() == b"".join(f"{n:010d}".encode() for n in range(40, 50))


def test_every_lost_frame_of_a_batch_is_counted(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("")
    file = FileAppender(tmp_path / "disk" / "a", max_waiting_bytes=100)
    for n in range(5):
        file.put(f"{n:050d}".encode(), records=10)
        file.flush()
    assert file.dropped == 30


def test_a_full_disk_tears_no_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room = 25
    real_write = os.write

    def write(fd: int, data: bytes) -> int:
        nonlocal room
        if room == 0:
            raise OSError(28, "No space left on device")
        written = real_write(fd, data[:room])
        room -= written
        return written

    monkeypatch.setattr(os, "write", write)
    file = FileAppender(tmp_path / "a", max_waiting_bytes=30)
    records = [f"{n:010d}".encode() for n in range(8)]
    for record in records:
        file.put(record)
        file.flush()
    assert "No space left on device" in file.error
    room = 1000
    file.close()
    assert (tmp_path / "a").read_bytes() == b"".join(records[:3] + records[5:])
    assert file.dropped == 2


def test_nothing_is_written_after_close(tmp_path: Path) -> None:
    file = FileAppender(tmp_path / "a")
    file.put(b"x")
    file.close()
    file.put(b"y")
    file.close()
    assert (tmp_path / "a").read_bytes() == b"x"
    assert file.dropped == 1
