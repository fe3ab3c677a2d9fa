"""Files of vehicles: read whole whatever the link does, whatever the size that was announced."""

import random
import zlib
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.ftp_peer import ACK, BURST, CREATE, NAK, OPEN, READ, RESET, TERMINATE, FtpServer
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer, ServiceRig
from tui_gcs.core.base.safe_files import RESERVED_BYTES, SafeFolder
from tui_gcs.core.services.files.ftp_codec import crc32, crc_fits
from tui_gcs.core.uplink.jobs import MAX_LONG_RUNNING_S, MAX_RUNNING_S, PAUSE_AFTER_S, JobState

FILE = random.Random(7).randbytes(14_605)
"""As long as ArduPilot's param.pck."""


def make(tmp_path: Path, autopilot: int = ARDUPILOT, files: dict[str, bytes] | None = None, **how: Any):
    """A rig with one vehicle and its server."""
    traits = {
        key: how.pop(key)
        for key in list(how)
        if key in ("announced", "burst_packets", "bursts", "same_block", "listing")
    }
    peer = Peer(1, autopilot=autopilot)
    server = FtpServer(peer, files if files is not None else {"/f": FILE}, **traits)
    return ServiceRig(tmp_path, peer, **how).heard(), server


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_a_file_is_read_in_one_burst_after_a_reset(tmp_path: Path, autopilot: int) -> None:
    rig, server = make(tmp_path, autopilot)
    job = rig.station.services.ftp.read(1, "/f")
    took_s = rig.until(lambda: job.over, 5.0)
    assert job.data == FILE and job.state is JobState.DONE
    assert server.ops()[:3] == [RESET, OPEN, BURST]
    assert server.ops()[-1] == TERMINATE and server.session is None
    assert took_s < 0.5
    assert {size for _, op, _, size, _ in server.asked if op == BURST} == {239}


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 6))])
def test_lost_doubled_and_swapped_packets_change_nothing(tmp_path: Path, autopilot: int, seed: int) -> None:
    rig, _ = make(tmp_path, autopilot, loss=0.2, duplicate=0.1, reorder=0.1, seed=seed, same_block=True)
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 60.0)
    assert job.data == FILE, job.error


@pytest.mark.parametrize("announced", [0, 1, 12 * 1327, 1_048_576, 0xFFFFFFFF])
def test_the_announced_size_is_not_believed(tmp_path: Path, announced: int) -> None:
    rig, _ = make(tmp_path, announced=announced)
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 5.0)
    assert job.data == FILE


def test_bursts_that_end_early_are_asked_for_again(tmp_path: Path) -> None:
    big = random.Random(1).randbytes(150_000)
    rig, server = make(tmp_path, PX4, {"/f": big}, burst_packets=168)
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 10.0)
    assert job.data == big
    assert [offset for _, op, offset, _, _ in server.asked if op == BURST] == [0, 40_152, 80_304, 120_456]


def test_without_bursts_it_is_read_block_by_block(tmp_path: Path) -> None:
    rig, server = make(tmp_path, bursts=False)
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 10.0)
    assert job.data == FILE
    assert server.ops().count(READ) == 63


def test_the_sequence_trap_after_a_burst_with_a_lost_end(tmp_path: Path) -> None:
    """A question with the number of the last answer less one is taken for a repetition, and never heard."""
    rig, server = make(tmp_path)
    lost = [0]

    def send(raw: bytes) -> None:
        end_of_burst = raw[5] == BURST and (raw[3] == NAK or int.from_bytes(raw[8:12], "little") > 14_000)
        if end_of_burst and lost[0] < 3:
            lost[0] += 1
        else:
            FtpServer.send(server, raw)

    server.send = send
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 10.0)
    assert job.data == FILE and lost[0] == 3
    assert server.session is None, "the end of the session was heard, too"


def test_a_repeated_answer_to_something_else_is_noticed_and_the_question_asked_anew(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    done: list[int] = []

    def trap(server: FtpServer, request: tuple[Any, ...]) -> bool:
        if request[2] == TERMINATE and not done:
            done.append(request[0])
            server.send(server.raw(request[0] + 1, NAK, BURST, b"\x06", 14_605))
            return True
        return False

    server.sabotage = trap
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 5.0)
    assert job.data == FILE and server.session is None
    assert rig.station.services.ftp.ignored["file answer repeated"] == 1


def test_another_stations_session_is_waited_for(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.session, server.used_s = 0, rig.clock.now()
    job = rig.station.services.ftp.read(1, "/f")
    took_s = rig.until(lambda: job.over, 10.0)
    assert job.data == FILE and took_s > 3.0


def test_px4s_forgotten_session_is_ended_by_the_reset(tmp_path: Path) -> None:
    rig, server = make(tmp_path, PX4)
    server.session, server.used_s = 0, rig.clock.now()
    job = rig.station.services.ftp.read(1, "/f")
    assert rig.until(lambda: job.over, 10.0) < 1.0
    assert job.data == FILE


def test_refusals_are_words(tmp_path: Path) -> None:
    rig, _ = make(tmp_path)
    ftp = rig.station.services.ftp
    jobs = [
        ftp.read(1, "/none"),
        ftp.list(1, "@PARAM"),
        ftp.read(1, "/../etc/passwd"),
        ftp.read(1, "/f", max_bytes=5000),
    ]
    rig.until(lambda: all(job.over for job in jobs), 5.0)
    assert [job.error for job in jobs] == [
        "no such file",
        "no such file",
        "a path with .. is never asked for",
        "larger than 5000 bytes: not read on",
    ]
    assert jobs[3].data == b""


def test_a_vehicle_that_never_answers_is_given_up_on(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.sabotage = lambda server, request: True
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 25.0)
    assert job.error == "no answer"
    assert len(server.asked) == 11, "ten retries"


def test_a_server_that_dies_in_the_middle_is_given_up_on(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.sabotage = lambda server, request: len(server.asked) > 2
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 90.0)
    assert job.error in ("no answer", "only 0 bytes in 30 s")


def test_cancelling_ends_the_session(tmp_path: Path) -> None:
    rig, server = make(tmp_path, loss=0.0, delay_s=0.3)
    job = rig.station.services.ftp.read(1, "/f")
    rig.run(1.5)
    rig.station.comms.jobs.cancel(1)
    rig.run(1.0)
    assert job.state is JobState.CANCELLED
    assert server.session is None


BIG = random.Random(3).randbytes(400_000)


def slowly(server: FtpServer) -> None:
    """Each burst has one packet, and a new one begins only with the station's next tick: 12 kB/s."""
    server.burst_packets = 1


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_a_long_download_gives_way_and_is_gone_on_with(tmp_path: Path, autopilot: int) -> None:
    rig, server = make(tmp_path, autopilot, {"/f": BIG, "/g": b"short"})
    slowly(server)
    job = rig.station.services.ftp.download(1, "/f")
    rig.run(PAUSE_AFTER_S - 1.0)
    other = rig.station.services.ftp.read(1, "/g")
    rig.run(0.5)
    assert (job.state, other.state) == (JobState.RUNNING, JobState.QUEUED)
    rig.until(lambda: other.over, 3.0)
    assert other.data == b"short" and 0 < job.done < len(BIG)
    rig.until(lambda: job.over, 60.0)
    assert job.state is JobState.DONE, job.error
    assert (tmp_path / "state" / job.path).read_bytes() == BIG
    begins = [offset for _, op, offset, _, _ in server.asked if op == BURST]
    assert begins.count(0) == 2, "each file was begun once"


def test_a_paused_download_that_is_cancelled_leaves_the_other_alone(tmp_path: Path) -> None:
    rig, server = make(tmp_path, files={"/f": BIG, "/g": BIG[:60_000]})
    slowly(server)
    job = rig.station.services.ftp.download(1, "/f")
    rig.run(PAUSE_AFTER_S - 1.0)
    other = rig.station.services.ftp.read(1, "/g")
    rig.until(lambda: other.state is JobState.RUNNING, 3.0)
    rig.station.comms.jobs.cancel_job(job)
    rig.until(lambda: other.over, 20.0)
    assert job.state is JobState.CANCELLED and other.data == BIG[:60_000]


def test_a_file_that_changed_during_the_pause_is_bad(tmp_path: Path) -> None:
    rig, server = make(tmp_path, files={"/f": BIG, "/g": b"short"})
    slowly(server)
    job = rig.station.services.ftp.download(1, "/f")
    rig.run(PAUSE_AFTER_S - 1.0)
    rig.station.services.ftp.read(1, "/g")
    rig.until(lambda: job.state is JobState.QUEUED, 3.0)
    server.files["/f"] = BIG[::-1]
    rig.until(lambda: job.over, 60.0)
    assert "its checksum is wrong" in job.error and job.path.endswith(".bad")


def test_a_file_larger_than_the_free_space_ends_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The announced size is not believed: the bytes that came are counted."""
    rig, _ = make(tmp_path, files={"/f": BIG}, announced=10)
    monkeypatch.setattr(SafeFolder, "free_bytes", lambda self: RESERVED_BYTES + 100_000)
    job = rig.station.services.ftp.download(1, "/f")
    rig.until(lambda: job.over, 10.0)
    assert job.error == "no room for more than 0 MB: free space in the state directory"
    assert not list((tmp_path / "state/files/vehicle-1").iterdir())


@pytest.mark.parametrize("kind", ["read", "download"])
def test_a_file_that_never_ends_is_ended(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """300 bytes in 30 s are enough for the reader: 64 MB would take 70 days."""
    rig, server = make(tmp_path, files={"/f": BIG})
    slowly(server)
    job = getattr(rig.station.services.ftp, kind)(1, "/f")
    assert job.max_running_s in (MAX_RUNNING_S, MAX_LONG_RUNNING_S)
    monkeypatch.setattr(job, "max_running_s", 3.0)
    rig.until(lambda: job.over, 4.0)
    assert job.error.startswith("not complete after") and server.ops()[-1] == TERMINATE


def test_small_blocks_over_a_radio(tmp_path: Path) -> None:
    rig, server = make(tmp_path, bytes_per_s=4000)
    job = rig.station.services.ftp.read(1, "/f")
    rig.until(lambda: job.over, 10.0)
    assert job.data == FILE
    assert {size for _, op, _, size, _ in server.asked if op == BURST} == {110}


def test_a_directory_is_listed_with_its_skipped_entries(tmp_path: Path) -> None:
    entries = [b"D.", b"S", b"Dlogs", b"S", b"Fout.log\t1234", *[b"F%05d.BIN\t%d" % (i, i) for i in range(40)]]
    rig, _ = make(tmp_path, PX4, listing={"/": entries})
    job = rig.station.services.ftp.list(1, "/")
    rig.until(lambda: job.over, 5.0)
    assert [(e.name, e.is_directory, e.size) for e in job.task.entries[:2]] == [
        ("logs", True, None),
        ("out.log", False, 1234),
    ]
    assert len(job.task.entries) == 42


@pytest.mark.parametrize("loss", [0.0, 0.25])
def test_a_file_is_written_checked_and_removed(tmp_path: Path, loss: float) -> None:
    rig, server = make(tmp_path, PX4, loss=loss)
    ftp = rig.station.services.ftp
    write = ftp.write(1, "/new", FILE[:5000])
    rig.until(lambda: write.over, 60.0)
    assert write.state is JobState.DONE, write.error
    assert server.files["/new"] == FILE[:5000]
    check = ftp.crc32(1, "/new")
    rig.until(lambda: check.over, 20.0)
    assert check.task.number == crc32(FILE[:5000]) and crc_fits(FILE[:5000], check.task.number)
    remove = ftp.remove(1, "/new")
    rig.until(lambda: remove.over, 20.0)
    assert "/new" not in server.files


def test_what_arrived_otherwise_is_found_by_the_checksum(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.crc = lambda *_: server.ack((0).to_bytes(4, "little"))
    job = rig.station.services.ftp.write(1, "/new", b"important")
    rig.until(lambda: job.over, 5.0)
    assert job.error == "what the vehicle holds differs: checksum"


def test_a_write_is_one_journal_line_and_counted_parts(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    job = rig.station.services.ftp.write(1, "/new", FILE)
    rig.until(lambda: job.over, 5.0)
    rig.run(1.5)
    lines = [line for line in (tmp_path / "run.jsonl").read_text().splitlines() if '"write /new"' in line]
    assert 2 <= len(lines) <= 4
    assert server.ops().count(CREATE) == 1


def test_a_vehicle_that_must_not_be_commanded_is_not_written_to(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    rig.vehicle().identity.blocked = "several vehicles use id 1"
    rig.vehicle().identity.blocked_s = rig.clock.now()
    job = rig.station.services.ftp.write(1, "/new", FILE)
    rig.until(lambda: job.over, 5.0)
    assert job.error and CREATE not in server.ops()


def test_the_checksum_is_px4s_not_zlibs() -> None:
    assert crc32(b"") == 0
    assert crc32(b"123456789") == zlib.crc32(b"123456789", 0xFFFFFFFF) ^ 0xFFFFFFFF == 0x2DFD2D88
    data = Path(__file__).read_bytes()
    assert crc_fits(data, zlib.crc32(data)) and crc_fits(data, crc32(data)) and not crc_fits(data, 1)
    assert ACK == 128
