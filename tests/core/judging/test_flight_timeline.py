"""What happened in a recording: from its telemetry, its journal and the vehicle's own log, joined by time."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.core.records.onboard_log_files import copter_log, dataflash
from tests.core.records.test_flight_archive import flown
from tests.core.station.test_replay_player import DATA
from tui_gcs.core.judging.flight_timeline import FlightReadError, timeline
from tui_gcs.core.records.flight_archive import FlightArchive, RecordedFlight
from tui_gcs.core.records.onboard_events import onboard_events


def of(path: Path) -> RecordedFlight:
    archive = FlightArchive({})
    assert archive.open_file(path) == ""
    return archive.scan()[0]


def test_a_telemetry_log_gives_modes_arming_and_texts_by_time() -> None:
    found = timeline(of(DATA / "arducopter-8.tlog"))
    texts = [(entry.source, entry.text) for entry in found.entries]
    assert ("vehicle 1", "mode GUIDED") in texts and ("vehicle 1", "armed") in texts
    assert ("vehicle 5", "PreArm: Check ANGLE_MAX") in texts
    times = [entry.wall_s for entry in found.entries]
    assert times == sorted(times) and times[0] >= found.first_wall_s
    assert "frames of" in found.summary[0] and len(found.summary) >= 10


def test_the_journal_beside_it_replaces_the_texts(tmp_path: Path) -> None:
    flown(tmp_path)
    (flight,) = FlightArchive({"SIM": tmp_path}).scan()
    texts = [entry.text for entry in timeline(flight).entries]
    assert "LOST in the air: vehicle 3" in texts
    assert any(text.startswith("mode ") for text in texts)


def test_a_vehicles_log_stands_beside_what_the_station_recorded_of_it(tmp_path: Path) -> None:
    path = tmp_path / "log-1.bin"
    path.write_bytes(copter_log())
    begin_s = onboard_events(path)[0].wall_s
    flown(tmp_path / "live")
    (flight,) = FlightArchive({"LIVE": tmp_path / "live"}).scan()
    assert flight.journal is not None
    moved = flight.journal.read_text().replace("1700000000.0", f"{begin_s:.1f}")
    flight.journal.write_text(moved)
    flight = replace(flight, began_wall_s=begin_s - 3.0)
    found = timeline(of(path), [flight])
    texts = [entry.text for entry in found.entries]
    assert {"ArduCopter V4.6.0", "battery low: vehicle 7"} <= set(texts)
    assert "LOST in the air: vehicle 3" not in texts  # the log is that of vehicle 7
    assert found.has_wall_time
    assert any("journals add" in line for line in found.summary)
    earlier = replace(flight, began_wall_s=begin_s - 1e6)
    assert "battery low: vehicle 7" not in [entry.text for entry in timeline(of(path), [earlier]).entries]


def test_without_gps_time_nothing_is_joined_and_it_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(dataflash([(143, "EV", "QB", "TimeUS,Id", (5_000_000, 10))]))
    found = timeline(of(path))
    assert not found.has_wall_time
    assert any("no GPS time in it" in line for line in found.summary)


def test_what_cannot_be_read_says_so_in_one_line(tmp_path: Path) -> None:
    for name in ("a.tlog", "a.bin", "a.ulg"):
        path = tmp_path / name
        path.write_bytes(b"no such thing")
        with pytest.raises(FlightReadError) as error:
            timeline(of(path))
        assert "\n" not in str(error.value)
