"""Flight points: of telemetry logs, of ArduPilot's and of PX4's own logs; damaged logs."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.core.records.onboard_log_files import GPS_WEEK_1900_S, copter_log, px4_log
from tui_gcs.core.records.flight_points import TlogPoints
from tui_gcs.core.records.onboard_logs import DataFlashPoints, OnboardLogError, ULogPoints

TLOG = Path(__file__).parents[2] / "data/arducopter-8.tlog"


def test_a_real_log_of_eight_copters() -> None:
    reader = TlogPoints(TLOG)
    points = list(reader)
    assert {point.vehicle for point in points} == set(range(1, 9))
    assert max(point.above_home_m for point in points) > 10.0
    modes = {point.mode for point in points}
    assert modes and "" not in modes
    assert all(0 <= point.battery_pct <= 100 for point in points[len(points) // 2 :])
    assert all(abs(point.lat_deg) > 1.0 for point in points)


def test_an_ardupilot_log(tmp_path: Path) -> None:
    path = tmp_path / "00000042.BIN"
    path.write_bytes(copter_log())
    first, second = DataFlashPoints(path)
    assert (first.vehicle, first.mode, first.armed, first.battery_pct) == (7, "LOITER", True, 81.0)
    assert (first.lat_deg, first.lon_deg, first.amsl_m, first.above_home_m) == (
        47.3977,
        pytest.approx(8.6456),
        498.0,
        10.0,
    )
    assert (first.north_m_s, first.east_m_s, first.up_m_s) == (pytest.approx(0.0, abs=1e-6), 5.0, -1.0)
    assert first.heading_deg == 92.5
    assert second.wall_s - first.wall_s == pytest.approx(0.2)
    # GPS time is ahead of UTC by the leap seconds, which the reader takes off.
    assert first.wall_s == pytest.approx(GPS_WEEK_1900_S + 1.0, abs=20.0)


def test_a_px4_log(tmp_path: Path) -> None:
    path = tmp_path / "log.ulg"
    path.write_bytes(px4_log())
    reader = ULogPoints(path)
    first, second = reader
    assert reader.left_out.without_place == 1
    assert (first.vehicle, first.mode, first.armed, first.battery_pct) == (3, "HOLD", True, 50.0)
    assert (first.lat_deg, first.lon_deg, first.amsl_m, first.above_home_m) == (47.5, 8.5, 500.0, 12.0)
    assert (first.north_m_s, first.up_m_s, first.heading_deg) == (2.0, 0.5, pytest.approx(270.0))
    assert (first.wall_s, second.wall_s) == (1_700_000_000.0, 1_700_000_000.5)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(cut=st.integers(0, 2000), at=st.integers(0, 1500), junk=st.binary(max_size=20), is_px4=st.booleans())
def test_a_damaged_log_gives_points_or_one_line(tmp_path: Path, cut: int, at: int, junk: bytes, is_px4: bool) -> None:
    whole = px4_log() if is_px4 else copter_log()
    data = (whole[:at] + junk + whole[at + len(junk) :])[: len(whole) - cut % len(whole)]
    path = tmp_path / "damaged"
    path.write_bytes(data)
    try:
        assert len(list(ULogPoints(path) if is_px4 else DataFlashPoints(path))) <= 4
    except OnboardLogError as error:
        assert str(error) and "\n" not in str(error)


@pytest.mark.parametrize("data", [b"", b"no log at all", b"\xa3\x95\x80"])
def test_a_file_that_is_no_log(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "none"
    path.write_bytes(data)
    for reader in (DataFlashPoints(path), ULogPoints(path)):
        try:
            assert list(reader) == []
        except OnboardLogError as error:
            assert "not a log of" in str(error)
