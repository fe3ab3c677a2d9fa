"""What a summary says about real flights of eight ArduCopters and eight PX4 vehicles (excerpts, see thin_tlog.py)."""

import json
from pathlib import Path

import msgspec
import pytest
from pymavlink import mavutil

from tui_gcs.core.judging.extent import ExtentCollector, Place
from tui_gcs.core.judging.summary_text import summary_text
from tui_gcs.core.judging.tlog_summary import Summary, SystemSummary, summarize
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.mode_names import mode_name
from tui_gcs.core.records.tlog_reader import TlogError
from tui_gcs.core.records.tlog_writer import TlogWriter

DATA = Path(__file__).parents[2] / "data"
ARDUCOPTER, PX4 = DATA / "arducopter-8.tlog", DATA / "px4-8.tlog"
EIGHT = range(1, 9)
UNKNOWN_TO_PYMAVLINK = {
    "LINK_NODE_STATUS": "UNKNOWN_8",
    "TIME_ESTIMATE_TO_TARGET": "UNKNOWN_380",
    "EVENT": "UNKNOWN_410",
    "CURRENT_EVENT_SEQUENCE": "UNKNOWN_411",
}
"""Messages of PX4 that it sends by their numbers to who does not know them."""


@pytest.fixture(scope="module")
def arducopter() -> Summary:
    return summarize(ARDUCOPTER)


@pytest.fixture(scope="module")
def px4() -> Summary:
    return summarize(PX4)


def system(summary: Summary, number: int) -> SystemSummary:
    return next(one for one in summary.systems if one.system == number)


def armed_s(summary: Summary, number: int) -> list[tuple[float, float]]:
    """Armed spans in seconds from the first frame."""
    start = summary.first_wall_s
    spans = system(summary, number).armed
    return [(round(s.from_wall_s - start, 1), round(s.to_wall_s - start, 1)) for s in spans]


def modes(summary: Summary, number: int) -> list[str]:
    return [span.mode for span in system(summary, number).modes]


@pytest.mark.parametrize(("path", "autopilot"), [(ARDUCOPTER, "ArduPilot"), (PX4, "PX4")])
def test_eight_vehicles_and_the_station(path: Path, autopilot: str) -> None:
    summary = summarize(path)
    assert [one.system for one in summary.systems] == [*EIGHT, 255]
    for number in EIGHT:
        vehicle = system(summary, number)
        assert (vehicle.kind, vehicle.autopilot, vehicle.vehicle_type) == ("vehicle", autopilot, "quadrotor")
        assert vehicle.frames == sum(vehicle.messages.values())
    station = system(summary, 255)
    assert (station.kind, station.components, station.extent) == ("station", (190,), None)
    assert (station.modes, station.armed) == ((), ())
    assert summary.frames == sum(one.frames for one in summary.systems)
    assert (summary.skipped_bytes, summary.truncated, summary.warnings) == (0, False, ())


def test_arducopter_flights(arducopter: Summary) -> None:
    assert modes(arducopter, 1) == ["STABILIZE", "AUTO", "LOITER", "STABILIZE", "GUIDED", "AUTO"]
    for number in (2, 3, 4, 5):
        assert modes(arducopter, number) == ["STABILIZE", "GUIDED", "RTL"]
    for number in (6, 7, 8):
        assert modes(arducopter, number) == ["STABILIZE", "GUIDED", "LAND"]
    assert {number: armed_s(arducopter, number) for number in EIGHT} == {
        1: [(47.0, 153.0)],
        2: [(47.0, 202.0)],
        3: [(47.0, 225.0)],
        4: [(47.0, 202.0)],
        5: [(47.0, 202.0)],
        6: [(47.0, 195.1)],
        7: [(47.0, 195.1)],
        8: [(47.0, 195.1)],
    }
    assert system(arducopter, 1).messages["PARAM_VALUE"] > 0
    assert system(arducopter, 1).signed_frames == 0


def test_px4_flights(px4: Summary) -> None:
    for number in (1, 2):
        assert modes(px4, number) == ["HOLD", "TAKEOFF", "HOLD", "MISSION", "RTL", "HOLD"]
    for number in (3, 4):
        assert modes(px4, number) == ["HOLD", "TAKEOFF", "MISSION", "RTL", "LAND", "HOLD"]
    for number in (5, 6):
        assert modes(px4, number) == ["HOLD", "TAKEOFF", "HOLD", "LAND", "HOLD"]
    for number in (7, 8):
        assert modes(px4, number) == ["HOLD", "TAKEOFF", "OFFBOARD", "RTL", "LAND", "OFFBOARD"]
    assert armed_s(px4, 1) == [(1.6, 107.9)]
    assert armed_s(px4, 8) == [(2.8, 94.9)]
    assert all(len(system(px4, number).armed) == 1 for number in EIGHT)


def test_px4_signs_every_frame_and_uses_messages_that_pymavlink_does_not_know(px4: Summary) -> None:
    for number in EIGHT:
        vehicle = system(px4, number)
        assert vehicle.signed_frames == vehicle.frames
        assert set(UNKNOWN_TO_PYMAVLINK) <= set(vehicle.messages)


def test_only_valid_positions_count(arducopter: Summary) -> None:
    """Logs start at 0, 0 before a fix; take-off was to 15…20 m at one airfield in Australia."""
    for number in EIGHT:
        vehicle = system(arducopter, number)
        extent = vehicle.extent
        assert extent is not None
        assert 0 < extent.positions < vehicle.messages["GLOBAL_POSITION_INT"]
        assert -35.364 < extent.lat_min_deg < extent.lat_max_deg < -35.361
        assert 149.165 < extent.lon_min_deg < extent.lon_max_deg < 149.168
        assert 584 <= extent.alt_amsl_min_m < extent.alt_amsl_max_m < 605
        assert extent.alt_rel_min_m is not None and extent.alt_rel_max_m is not None
        assert -0.5 < extent.alt_rel_min_m < 0.5 < 15 <= extent.alt_rel_max_m <= 20.1


def test_status_texts_are_whole(arducopter: Summary, px4: Summary) -> None:
    texts = [(text.severity, text.text) for text in system(arducopter, 1).texts]
    assert (2, "Arm: Hardware safety switch") in texts
    assert (6, "ArduPilot Ready") in texts
    px4_texts = [text.text for number in EIGHT for text in system(px4, number).texts]
    assert "Landing detected" in px4_texts  # without the tab that marks a text that is an event, too
    assert not any("␉" in text for text in px4_texts)
    assert any(len(text) > 50 for text in px4_texts), "chunks are put together"


@pytest.mark.long
@pytest.mark.parametrize("path", [ARDUCOPTER, PX4])
def test_pymavlink_counts_the_same(path: Path) -> None:
    reader = mavutil.mavlink_connection(str(path), dialect="all")
    counts: dict[str, int] = {}
    while (message := reader.recv_msg()) is not None:
        counts[message.get_type()] = counts.get(message.get_type(), 0) + 1
    reader.close()
    ours: dict[str, int] = {}
    for one in summarize(path).systems:
        for name, count in one.messages.items():
            name = UNKNOWN_TO_PYMAVLINK.get(name, name)
            ours[name] = ours.get(name, 0) + count
    assert ours == counts


def test_text_form_is_plain_lines(px4: Summary) -> None:
    text = summary_text(px4, width=100)
    assert "px4-8.tlog: " in text.splitlines()[0]
    assert "  1  vehicle  PX4        quadrotor" in text
    assert "armed     1.6…107.9 s" in text
    assert "EVENT" in text.replace(",", " ").split()
    assert "\x1b" not in text and "\t" not in text
    messages = [line for line in text.splitlines() if "GLOBAL_POSITION_INT" in line]
    assert messages and all(len(line) <= 100 for line in messages)


def test_json_form_is_the_same_summary(arducopter: Summary) -> None:
    read = json.loads(msgspec.json.encode(arducopter))
    assert read["frames"] == arducopter.frames
    assert [one["system"] for one in read["systems"]] == [*EIGHT, 255]
    assert read["systems"][0]["armed"][0]["ended"] is True
    assert read["systems"][8]["extent"] is None


def test_a_truncated_log_is_summarised_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "cut.tlog"
    path.write_bytes(ARDUCOPTER.read_bytes()[:300_000])
    summary = summarize(path)
    assert summary.truncated
    assert summary.warnings == (
        f"{path} ends inside a record: {summary.skipped_bytes} byte(s) skipped, all else is here",
    )
    assert [one.system for one in summary.systems] == [*EIGHT, 255]
    assert not system(summary, 2).armed[0].ended
    assert "still armed at the end" in summary_text(summary)
    assert "warning: " in summary_text(summary)


def test_no_log_is_one_clear_line(tmp_path: Path) -> None:
    path = tmp_path / "x.tlog"
    path.write_text("no telemetry")
    with pytest.raises(TlogError, match="not a telemetry log"):
        summarize(path)


def test_systems_that_are_no_vehicles_are_told_apart(tmp_path: Path) -> None:
    log = TlogWriter(tmp_path / "a.tlog")
    beat = {"base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    log.write(1.0, Encoder(10, 100).encode("HEARTBEAT", type=30, autopilot=8, **beat))
    log.write(1.0, Encoder(11, 1).encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=1))
    log.write(1.0, Encoder(12, 1).encode("HEARTBEAT", type=10, autopilot=3, **beat))
    log.write(1.1, Encoder(12, 191).encode("HEARTBEAT", type=18, autopilot=8, **beat))
    log.close()
    summary = summarize(log.path)
    assert [(one.system, one.kind) for one in summary.systems] == [
        (10, "component"),
        (11, "unknown"),
        (12, "vehicle"),
    ]
    assert system(summary, 12).components == (1, 191)
    assert system(summary, 12).vehicle_type == "ground rover"
    assert "no valid position" in summary_text(summary)


def test_positions_that_jump_are_believed_only_when_others_agree() -> None:
    collector = ExtentCollector()
    for second in range(5):
        collector.add(Place(second, 52.0, -0.6, 110.0))
    collector.add(Place(5.0, 10.0, 10.0, 110.0))
    collector.add(Place(5.5, 95.0, 0.0, 0.0))
    collector.add(Place(6.0, 0.0, 0.0, 0.0))
    collector.add(Place(7.0, 52.0001, -0.6, 120.0))
    extent = collector.result()
    assert extent is not None
    assert (extent.positions, extent.lat_min_deg, extent.lat_max_deg) == (6, 52.0, 52.0001)
    for second in (8, 9, 10):
        collector.add(Place(second, -35.0, 149.0, 600.0))
    moved = collector.result()
    assert moved is not None
    assert (moved.positions, moved.lat_min_deg) == (9, -35.0)


def test_mode_names_of_each_firmware() -> None:
    assert mode_name(3, 2, 4) == "GUIDED"
    assert mode_name(3, 1, 11) == "RTL"
    assert mode_name(3, 10, 4) == "HOLD"
    assert mode_name(3, 2, 0xFFFFFFFF) == "mode 4294967295"
    assert mode_name(12, 2, 4 << 16 | 5 << 24) == "RTL"
    assert mode_name(12, 2, 3 << 16 | 1 << 24) == "ORBIT"
    assert mode_name(12, 2, 4 << 16 | 99 << 24) == "AUTO 99"
    assert mode_name(12, 2, 6 << 16) == "OFFBOARD"
    assert mode_name(0, 2, 7) == "mode 7"
