"""Logs: whole, or gone on with later; never in the way of arming."""

import errno
import random
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.log_peer import LogServer
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer, ServiceRig
from tui_gcs.core.base.safe_files import RESERVED_BYTES, PartFile, SafeFolder
from tui_gcs.core.services.files.log_download import LogDownloadJob
from tui_gcs.core.services.files.log_transfer import LogEntry
from tui_gcs.core.services.files.logs import LogService
from tui_gcs.core.uplink.jobs import PAUSE_AFTER_S, JobState

DATA = random.Random(3).randbytes(150_001)
T0 = 1_732_000_000


def make(tmp_path: Path, autopilot: int = ARDUPILOT, logs: dict[int, Any] | None = None, **how: Any):
    peer = Peer(1, autopilot=autopilot)
    server = LogServer(peer, logs if logs is not None else {1: (T0, b"short"), 2: (T0 + 60, DATA)})
    rig = ServiceRig(tmp_path, peer, **how).heard()
    return rig, server, rig.station.services.logs


def file(tmp_path: Path, path: str) -> bytes:
    return (tmp_path / "state" / path).read_bytes()


def listed(rig: ServiceRig, logs: LogService) -> list[LogEntry]:
    job = logs.list(1)
    rig.until(lambda: job.over, 30.0)
    assert job.state is JobState.DONE, job.error
    return job.entries


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_logs_are_listed_whatever_is_lost(tmp_path: Path, loss: float) -> None:
    many = {number: (T0 + number, bytes(number)) for number in range(1, 41)}
    rig, _, logs = make(tmp_path, logs=many, loss=loss)
    assert listed(rig, logs) == [LogEntry(n, n, T0 + n) for n in range(1, 41)]


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_no_logs_is_an_empty_list(tmp_path: Path, autopilot: int) -> None:
    """ArduPilot sends an empty entry, PX4 nothing at all."""
    rig, _, logs = make(tmp_path, autopilot, logs={})
    assert listed(rig, logs) == []


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_a_log_is_downloaded_in_windows(tmp_path: Path, autopilot: int) -> None:
    rig, _, logs = make(tmp_path, autopilot)
    job = logs.download(1, listed(rig, logs)[1])
    took_s = rig.until(lambda: job.over, 30.0)
    assert job.state is JobState.DONE, job.error
    assert file(tmp_path, job.path) == DATA
    assert job.path == f"logs/vehicle-1/log-00002-20241119T070740Z.{'ulg' if autopilot == PX4 else 'bin'}"
    assert took_s < 3.0
    asked = rig.peers[1].got("LOG_REQUEST_DATA")
    assert [(f["ofs"], f["count"]) for f in asked] == [(0, 65_520), (65_520, 65_520), (131_040, 18_961)]
    assert rig.peers[1].got("LOG_REQUEST_END")
    assert sorted(p.name for p in (tmp_path / "state/logs/vehicle-1").iterdir()) == [job.path.rsplit("/", 1)[1]]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 4))])
def test_what_is_lost_is_asked_for_again(tmp_path: Path, seed: int) -> None:
    rig, _, logs = make(tmp_path, loss=0.15, duplicate=0.05, reorder=0.1, seed=seed)
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.until(lambda: job.over, 120.0)
    assert job.state is JobState.DONE, job.error
    assert file(tmp_path, job.path) == DATA


def test_progress_is_shown(tmp_path: Path) -> None:
    rig, server, logs = make(tmp_path)
    server.gap_s = 1 / 200
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.run(4.5)
    assert 0.5 * 4.5 * 18_000 < job.done < len(DATA) == job.total


def test_a_broken_download_is_gone_on_with(tmp_path: Path) -> None:
    rig, server, logs = make(tmp_path)
    server.gap_s = 1 / 400
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.run(2.0)
    rig.station.comms.jobs.cancel(1)
    had = job.done
    assert had > 30_000 and job.state is JobState.CANCELLED
    later, server, logs = make(tmp_path)
    again = logs.download(1, LogEntry(2, 0, 0))
    later.until(lambda: again.over, 30.0)
    assert file(tmp_path, again.path) == DATA
    assert later.peers[1].got("LOG_REQUEST_DATA")[0]["ofs"] > had - 1200, "what was there was not asked for again"


@pytest.mark.parametrize("size", [len(DATA), 1000])
def test_another_logs_part_is_not_gone_on_with(tmp_path: Path, size: int) -> None:
    """Numbers begin anew after erasing: the last bytes that are there are fetched again and compared."""
    rig, server, logs = make(tmp_path)
    server.gap_s = 1 / 400
    logs.download(1, LogEntry(2, 0, 0))
    rig.run(2.0)
    rig.station.comms.jobs.cancel(1)
    new = bytes(reversed(DATA))[:size]
    later, _, logs = make(tmp_path, logs={2: (T0 + 60, new)})
    again = logs.download(1, LogEntry(2, 0, 0))
    later.until(lambda: again.over, 30.0)
    assert file(tmp_path, again.path) == new


def test_a_log_that_grew_is_gone_on_with_to_its_new_end(tmp_path: Path) -> None:
    """ArduPilot's LOG_ENTRY.size grows after disarming, and its time is that of the newest byte."""
    rig, server, logs = make(tmp_path, logs={2: (T0, DATA[:100_000])})
    server.gap_s = 1 / 400
    logs.download(1, LogEntry(2, 0, 0))
    rig.run(2.0)
    rig.station.comms.jobs.cancel(1)
    server.logs[2] = (T0 + 7, DATA)
    again = logs.download(1, LogEntry(2, 100_000, T0))
    rig.until(lambda: again.over, 30.0)
    assert file(tmp_path, again.path) == DATA


def test_ardupilot_refuses_while_armed_in_its_own_words(tmp_path: Path) -> None:
    rig, _, logs = make(tmp_path)
    rig.peers[1].armed = True
    rig.run(1.5)
    for job in (logs.list(1), logs.download(1, LogEntry(2, 10, 0))):
        took_s = rig.until(lambda job=job: job.over, 10.0)
        assert job.error == "Disarm for log download" and took_s < 1.0


def test_a_log_that_is_gone_is_reported(tmp_path: Path) -> None:
    rig, _, logs = make(tmp_path)
    job = logs.download(1, LogEntry(9, 100, T0))
    rig.until(lambda: job.over, 20.0)
    assert job.error == "the vehicle has no log of that number"


def test_a_vehicle_that_falls_silent_leaves_a_part(tmp_path: Path) -> None:
    rig, _, logs = make(tmp_path)
    rig.peers[1].answers["LOG_REQUEST_DATA"] = lambda peer, fields: None
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.until(lambda: job.over, 150.0)
    assert job.error == "no answer: what is there is kept"
    assert len(rig.peers[1].got("LOG_REQUEST_DATA")) == 11


def test_a_slow_link_keeps_room_for_telemetry(tmp_path: Path) -> None:
    rig, _, logs = make(tmp_path, bytes_per_s=4000)
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.run(30.0)
    assert 0.8 * 1600 * 28 < job.done < 1.2 * 1600 * 30


def test_a_full_disk_removes_the_part_and_alarms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig, _, logs = make(tmp_path)
    write = PartFile.write

    def full(part: PartFile, offset: int, data: bytes) -> None:
        if offset > 70_000:
            raise OSError(errno.ENOSPC, "No space left on device")
        write(part, offset, data)

    monkeypatch.setattr(PartFile, "write", full)
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.until(lambda: job.over, 10.0)
    assert job.error == "cannot be written here: No space left on device"
    assert list((tmp_path / "state/logs/vehicle-1").iterdir()) == []
    assert any("log 2 cannot be written" in text for text in rig.texts("vehicle 1"))


# ---------------------------------------------------------------- erasing


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_erasing_is_done_when_none_is_listed(tmp_path: Path, autopilot: int) -> None:
    rig, server, logs = make(tmp_path, autopilot)
    job = logs.erase(1)
    rig.until(lambda: job.over, 30.0)
    assert job.state is JobState.DONE and not server.logs
    assert '"erase logs"' in (tmp_path / "run.jsonl").read_text()


def test_erasing_is_done_when_only_the_log_is_left_that_is_being_written(tmp_path: Path) -> None:
    """A PX4 that logs from its boot on keeps that log: waiting for an empty list took 90 s and failed."""
    rig, server, logs = make(tmp_path, PX4)

    def erase(_peer: Peer, _fields: Any) -> None:
        server.logs = {2: (T0 + 60, bytes(len(server.logs[2][1]) + 1000))}

    rig.peers[1].answers["LOG_ERASE"] = erase
    job = logs.erase(1)
    assert rig.until(lambda: job.over, 120.0) < 20.0
    assert job.state is JobState.DONE, job.error


def test_logs_are_not_erased_while_armed_and_erasing_is_not_done_while_logs_are_listed(tmp_path: Path) -> None:
    rig, _, logs = make(tmp_path)
    rig.peers[1].armed = True
    rig.run(1.5)
    job = logs.erase(1)
    rig.run(0.1)
    assert job.error == "disarm it first: armed, it ignores this"
    assert not rig.peers[1].got("LOG_ERASE")
    rig.peers[1].armed = False
    rig.peers[1].answers["LOG_ERASE"] = lambda peer, fields: None
    rig.run(1.5)
    job = logs.erase(1)
    rig.until(lambda: job.over, 120.0)
    assert job.error == "2 logs are still there"


def test_a_log_that_is_announced_larger_than_the_free_space_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, _, logs = make(tmp_path)
    monkeypatch.setattr(SafeFolder, "free_bytes", lambda self: RESERVED_BYTES + 100_000)
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.until(lambda: job.over, 5.0)
    assert job.error == "0 MB announced, room for 0 MB: free space in the state directory"
    assert not rig.peers[1].got("LOG_REQUEST_DATA") and rig.peers[1].got("LOG_REQUEST_END")


def test_a_long_download_gives_way_and_is_gone_on_with(tmp_path: Path) -> None:
    rig, server, logs = make(tmp_path)
    server.gap_s = 1 / 100
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.run(PAUSE_AFTER_S - 1.0)
    other = logs.list(1)
    rig.run(0.5)
    assert (job.state, other.state) == (JobState.RUNNING, JobState.QUEUED)
    rig.until(lambda: other.over, 3.0)
    assert other.state is JobState.DONE and 0 < job.done < len(DATA)
    rig.until(lambda: job.over, 60.0)
    assert job.state is JobState.DONE and file(tmp_path, job.path) == DATA
    begins = [fields["ofs"] for fields in rig.peers[1].got("LOG_REQUEST_DATA")]
    assert begins.count(0) == 1, "what had come was not asked for again"


def test_a_download_that_never_ends_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LogDownloadJob, "max_running_s", 3.0)
    rig, server, logs = make(tmp_path)
    server.gap_s = 1 / 20
    job = logs.download(1, LogEntry(2, 0, 0))
    rig.until(lambda: job.over, 6.0)
    assert job.error.startswith("not complete after") and list((tmp_path / "state/logs/vehicle-1").glob("*.part"))
