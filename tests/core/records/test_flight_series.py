"""Values over time in recorded flights: telemetry logs, and the logs of ArduPilot and PX4."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from tests.core.records.onboard_log_files import copter_log, px4_log
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.records.flight_series import SeriesKey, TlogSeries, with_gaps
from tui_gcs.core.records.onboard_logs import OnboardLogError
from tui_gcs.core.records.onboard_series import open_flight
from tui_gcs.core.records.tlog_reader import TlogError

START_S = 1_790_000_000.0
VEHICLE, OTHER, STATION = Encoder(1, 1), Encoder(2, 1), Encoder(255, 190)


def heartbeat(sender: Encoder, autopilot: int = 3) -> bytes:
    return sender.encode(
        "HEARTBEAT", type=2, autopilot=autopilot, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
    )


def attitude(sender: Encoder, roll: float) -> bytes:
    return sender.encode(
        "ATTITUDE", time_boot_ms=0, roll=roll, pitch=0.0, yaw=0.0, rollspeed=0.0, pitchspeed=0.0, yawspeed=0.0
    )


def param(sender: Encoder, name: str, value: float, kind: int = 9) -> bytes:
    return sender.encode("PARAM_VALUE", param_id=name, param_value=value, param_type=kind, param_count=2, param_index=0)


def tlog(path: Path, *records: tuple[float, bytes]) -> Path:
    data = b"".join(struct.pack(">Q", int((START_S + t_s) * 1e6)) + frame for t_s, frame in records)
    path.write_bytes(data)
    return path


def flight(tmp_path: Path) -> TlogSeries:
    records = [(0.0, heartbeat(VEHICLE)), (0.0, heartbeat(OTHER, 12)), (0.0, heartbeat(STATION, 8))]
    records += [(at * 0.1, attitude(VEHICLE, math.pi / 6)) for at in range(1, 11)]
    records += [(1.5, attitude(OTHER, math.nan)), (1.6, attitude(STATION, 9.0))]
    records += [(2.0, param(VEHICLE, "WPNAV_SPEED", 500.0)), (9.0, param(VEHICLE, "WPNAV_SPEED", 300.0))]
    bits = struct.unpack("<f", struct.pack("<i", 7))[0]
    records += [(9.5, param(OTHER, "NAV_RCL_ACT", bits, 6))]
    return TlogSeries(tlog(tmp_path / "flight.tlog", *records))


def test_every_number_of_every_message_of_vehicles_is_listed_with_its_unit(tmp_path: Path) -> None:
    names = {each.name: each for each in flight(tmp_path).names()}
    assert (names["ATTITUDE.roll"].unit, names["ATTITUDE.roll"].vehicles) == ("deg", (1, 2))
    assert names["WPNAV_SPEED"].is_parameter and names["WPNAV_SPEED"].vehicles == (1,)
    assert "PARAM_VALUE.param_value" not in names


def test_points_come_with_absolute_times_in_usual_units(tmp_path: Path) -> None:
    series = flight(tmp_path)
    assert (series.begin_s, series.end_s) == (START_S, START_S + 9.5)
    found = series.read([SeriesKey(1, "ATTITUDE.roll")])
    times_s, values = found[SeriesKey(1, "ATTITUDE.roll")]
    assert times_s == pytest.approx(START_S + np.arange(1, 11) * 0.1)
    assert values == pytest.approx(np.full(10, 30.0))


def test_parameters_are_values_over_time_and_px4_sends_their_bits(tmp_path: Path) -> None:
    speed, action = SeriesKey(1, "WPNAV_SPEED"), SeriesKey(2, "NAV_RCL_ACT")
    found = flight(tmp_path).read([speed, action])
    assert found[speed][1].tolist() == [500.0, 300.0]
    assert found[action][1].tolist() == [7.0]


def test_what_the_log_does_not_have_is_missing(tmp_path: Path) -> None:
    wanted = [SeriesKey(1, "NO_SUCH.field"), SeriesKey(9, "ATTITUDE.roll"), SeriesKey(1, "GPS_RAW_INT.lat")]
    assert flight(tmp_path).read(wanted) == {}
    nothing = flight(tmp_path).read([SeriesKey(1, "ATTITUDE.nothing")])
    assert all(np.isnan(values).all() for _, values in nothing.values())


def test_not_a_number_is_a_gap(tmp_path: Path) -> None:
    key = SeriesKey(2, "ATTITUDE.roll")
    assert np.isnan(flight(tmp_path).read([key])[key][1]).all()


def test_a_pause_is_a_gap() -> None:
    times_s, values = with_gaps(np.array([0.0, 1.0, 2.0, 60.0]), np.array([1.0, 2.0, 3.0, 4.0]))
    assert times_s.tolist() == [0.0, 1.0, 2.0, 31.0, 60.0]
    assert values[:3].tolist() == [1.0, 2.0, 3.0] and np.isnan(values[3]) and values[4] == 4.0


def test_times_that_run_backwards_are_left_out(tmp_path: Path) -> None:
    records = [(0.0, heartbeat(VEHICLE)), (1.0, attitude(VEHICLE, 0.1)), (0.5, attitude(VEHICLE, 0.2))]
    key = SeriesKey(1, "ATTITUDE.roll")
    assert len(TlogSeries(tlog(tmp_path / "f.tlog", *records)).read([key])[key][0]) == 1


def test_a_log_of_ardupilot(tmp_path: Path) -> None:
    path = tmp_path / "00000042.BIN"
    path.write_bytes(copter_log())
    series = open_flight(path)
    names = {each.name: each for each in series.names()}
    assert names["POS.RelHomeAlt"].vehicles == (7,) and names["SYSID_THISMAV"].is_parameter
    assert "MSG.Message" not in names and "POS.TimeUS" not in names
    key = SeriesKey(7, "POS.RelHomeAlt")
    times_s, values = series.read([key])[key]
    assert values.tolist() == [10.0, 10.0] and times_s[1] - times_s[0] == pytest.approx(0.2)
    assert series.begin_s <= times_s[0] <= series.end_s


def test_a_log_of_px4(tmp_path: Path) -> None:
    path = tmp_path / "log.ulg"
    path.write_bytes(px4_log())
    series = open_flight(path)
    names = {each.name: each for each in series.names()}
    assert names["battery_status.remaining"].vehicles == (3,) and names["MAV_SYS_ID"].is_parameter
    alt, own = SeriesKey(3, "vehicle_global_position.alt"), SeriesKey(3, "MAV_SYS_ID")
    found = series.read([alt, own, SeriesKey(3, "no.such"), SeriesKey(4, "vehicle_global_position.alt")])
    assert found[alt][1].tolist() == [0.0, 500.0, 500.5] and set(found[own][1]) == {3.0}
    assert len(found) == 2 and series.begin_s > 1.6e9


@pytest.mark.parametrize("ending", ["tlog", "bin", "ulg"])
@pytest.mark.parametrize("data", [b"", b"nothing of the kind" * 50, bytes(range(256)) * 40])
def test_what_is_no_flight_is_refused_in_one_line(tmp_path: Path, ending: str, data: bytes) -> None:
    path = tmp_path / f"flight.{ending}"
    path.write_bytes(data)
    try:
        series = open_flight(path)
    except (OnboardLogError, TlogError) as error:
        assert "\n" not in str(error)
    else:
        assert series.names() == [] or math.isnan(series.begin_s)


@pytest.mark.parametrize("seed", range(12))
def test_damaged_logs_are_read_or_refused(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    ending, whole = (("bin", copter_log()), ("ulg", px4_log()))[seed % 2]
    data = bytearray(whole[: int(rng.integers(20, len(whole)))])
    for at in rng.integers(0, len(data), 5):
        data[int(at)] = int(rng.integers(0, 256))
    path = tmp_path / f"flight.{ending}"
    path.write_bytes(bytes(data))
    try:
        series = open_flight(path)
        names = series.names()
        series.read([SeriesKey(vehicle, each.name) for each in names[:40] for vehicle in each.vehicles])
    except OnboardLogError as error:
        assert "\n" not in str(error)


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OnboardLogError, match=r"no flight: .tlog, .bin, .ulg"):
        open_flight(tmp_path / "flight.csv")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    for ending, error in (("tlog", TlogError), ("bin", OnboardLogError), ("ulg", OnboardLogError)):
        with pytest.raises(error):
            open_flight(tmp_path / f"missing.{ending}")
