"""The recordings on disk are listed without reading them whole, and removed with what belongs to them."""

import json
import math
import os
from pathlib import Path

import pytest

from tests.core.station.test_replay_player import DATA, heartbeats
from tui_gcs.core.records.flight_archive import FlightArchive, delete_flight, telemetry_times, utc_time
from tui_gcs.core.records.rehearsal_store import FILE, RehearsalRecord, remember

NOW_S = 1_800_000_000.0


def event(seq: int, cls: str, severity: int, source: str, text: str) -> dict[str, object]:
    return {
        **{"seq": seq, "t_s": 1.0, "wall_s": 1.7e9, "cls": cls},
        **{"severity": severity, "source": source, "text": text},
    }


def flown(folder: Path, name: str = "20261127-a", *, age_s: float = 1000.0) -> Path:
    """A flight of ten seconds with its journal, written so long before `NOW_S`."""
    folder.mkdir(parents=True, exist_ok=True)
    path = heartbeats(folder / f"{name}.tlog", [0.0, 5.0, 10.0])
    records = [
        {"station": "LIVE", "scenario": "swarm"},
        event(1, "connection", 6, "vehicle 3", "heard"),
        event(2, "connection", 6, "vehicle 7", 'it says "source":"vehicle 99"'),
        event(3, "alarm", 4, "alarm", "battery low: vehicle 7"),
        event(4, "alarm", 2, "alarm", "LOST in the air: vehicle 3"),
        event(5, "alarm", 6, "alarm", "over: LOST in the air: vehicle 3"),
    ]
    path.with_suffix(".jsonl").write_text("".join(json.dumps(r, separators=(",", ":")) + "\n" for r in records))
    os.utime(path, (NOW_S - age_s, NOW_S - age_s))
    return path


def test_a_flight_is_known_by_its_ends_and_its_journal(tmp_path: Path) -> None:
    flown(tmp_path / "live")
    (flight,) = FlightArchive({"LIVE": tmp_path / "live", "SIM": tmp_path / "none"}).scan()
    assert (flight.source, flight.scenario, flight.vehicles) == ("LIVE", "swarm", (3, 7))
    assert (flight.began_wall_s, flight.length_s) == (pytest.approx(1.7e9), pytest.approx(10.0))
    assert (flight.worst_alarm, flight.worst_severity) == ("LOST in the air: vehicle 3", 2)


def test_real_logs_of_a_hundred_thousand_frames_have_the_times_of_their_ends() -> None:
    first_s, last_s = telemetry_times(DATA / "arducopter-8.tlog")
    assert last_s - first_s == pytest.approx(229.0, abs=0.1)


def test_a_rehearsal_has_its_result_and_the_path_of_its_report(tmp_path: Path) -> None:
    sim = tmp_path / "sim"
    path = heartbeats_in(sim / "rehearsal-20261127-101010")
    one = RehearsalRecord("p", False, 1.0, "swarm", 11, 12, problem="vehicle 3 crashed", report="/tmp/r.html")
    remember(sim / FILE, one)  # of an earlier version: it has no folder
    remember(sim / FILE, RehearsalRecord(**{**_fields(one), "folder": path.parent.name}))
    (flight,) = FlightArchive({"SIM": sim}).scan()
    assert (flight.source, flight.scenario, flight.report) == ("rehearsal", "swarm", "/tmp/r.html")
    assert flight.result == "FAILED 11/12  vehicle 3 crashed"


def _fields(record: RehearsalRecord) -> dict[str, object]:
    return {name: getattr(record, name) for name in record.__struct_fields__}


def heartbeats_in(folder: Path) -> Path:
    folder.mkdir(parents=True)
    return heartbeats(folder / "run.tlog", [0.0, 1.0])


def test_downloaded_logs_and_files_that_are_opened_are_listed_too(tmp_path: Path) -> None:
    folder = tmp_path / "live/logs/vehicle-7"
    folder.mkdir(parents=True)
    (folder / "log-00012.bin").write_bytes(b"\xa3\x95\x80")
    (folder / "log-00013.bin.part").write_bytes(b"")
    archive = FlightArchive({"LIVE": tmp_path / "live"})
    assert archive.open_file(DATA / "px4-8.tlog") == ""
    found = {flight.source: flight for flight in archive.scan()}
    assert found["log of 7"].vehicles == (7,)
    assert found["file"].length_s > 100
    assert len(found) == 2


def test_what_is_no_flight_is_not_opened(tmp_path: Path) -> None:
    archive = FlightArchive({})
    assert "no flight: .tlog, .bin, .ulg" in archive.open_file(tmp_path / "a.txt")
    assert "cannot be read" in archive.open_file(tmp_path / "missing.tlog")
    (tmp_path / "folder.tlog").mkdir()
    assert "cannot be read" in archive.open_file(tmp_path / "folder.tlog")
    assert archive.scan() == ()


def test_an_empty_or_foreign_file_is_listed_without_times(tmp_path: Path) -> None:
    (tmp_path / "a.tlog").write_bytes(b"")
    (tmp_path / "b.tlog").write_bytes(b"\xfe" * 5000)
    (tmp_path / "b.jsonl").write_bytes(b'\xff\n{"cls":"alarm"}\n"cls":"alarm"\n')
    flights = FlightArchive({"SIM": tmp_path}).scan()
    assert [math.isnan(flight.length_s) for flight in flights] == [True, True]
    assert [flight.worst_alarm for flight in flights] == ["", ""]


def test_a_file_that_changed_is_read_again(tmp_path: Path) -> None:
    path = flown(tmp_path)
    archive = FlightArchive({"SIM": tmp_path})
    assert archive.scan() == archive.scan()
    heartbeats(path, [20.0])
    assert archive.scan()[0].length_s == pytest.approx(20.0)


def test_a_flight_goes_with_its_journal_and_its_folder(tmp_path: Path) -> None:
    path = heartbeats_in(tmp_path / "rehearsal-1")
    path.with_suffix(".jsonl").write_text("")
    (flight,) = FlightArchive({"SIM": tmp_path}).scan()
    assert delete_flight(flight, flight.changed_wall_s + 100.0) == ""
    assert list(tmp_path.iterdir()) == []


def test_what_may_still_be_recorded_and_what_was_opened_is_not_deleted(tmp_path: Path) -> None:
    flown(tmp_path, age_s=10.0)
    archive = FlightArchive({"SIM": tmp_path})
    (flight,) = archive.scan()
    assert "may still be recorded" in delete_flight(flight, NOW_S)
    other = FlightArchive({})
    other.open_file(flight.path)
    assert "opened by its path" in delete_flight(other.scan()[0], NOW_S + 1e6)
    assert flight.path.exists()
    assert delete_flight(flight, NOW_S + 1e6) == ""
    assert "No such file" in delete_flight(flight, NOW_S + 1e6)


def test_times_that_no_calendar_has_are_not_known() -> None:
    assert [utc_time(s) for s in (math.nan, -1.0, 1e18)] == ["--"] * 3
    assert utc_time(1.7e9) == "2023-11-14 22:13"
