"""What is in the log of a simulated PX4, as PX4's own reader of such logs finds it."""

from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog

from tests.sitl.conftest import px4_take_off

EPOCH_S = 1_700_000_000.0
COMMAND_LAND = 21


@pytest.fixture
def log(px4, tmp_path: Path) -> ULog:
    """The log of a short flight."""
    ground = px4()
    px4_take_off(ground)
    ground.run(5.0)
    ground.command(COMMAND_LAND)
    ground.run(40.0)
    vehicle = ground.fleet._pilots[0].platform
    assert not vehicle.state.armed
    written, now_us = vehicle.logs.files[0], vehicle.clock.now_us
    path = tmp_path / "1.ulg"
    path.write_bytes(written.read(0, written.size_at(now_us), now_us))
    found = ULog(str(path))
    assert not found.file_corruption
    return found


def columns(log: ULog, topic: str) -> dict[str, np.ndarray]:
    return log.get_dataset(topic).data


def test_it_says_which_vehicle_flew_and_its_texts(log) -> None:
    assert log.initial_parameters["MAV_SYS_ID"] == 1
    texts = [message.message for message in log.logged_messages]
    assert any(text.startswith("Takeoff detected") for text in texts)
    assert any(text.startswith("Landing detected") for text in texts)


def test_modes_and_arming_are_those_of_the_flight(log) -> None:
    status = columns(log, "vehicle_status")
    assert status["arming_state"][0] == 1 and set(status["arming_state"]) == {1, 2}
    hold, takeoff, land = 4, 17, 18
    modes = status["nav_state"].tolist()
    assert [m for at, m in enumerate(modes) if at == 0 or modes[at - 1] != m] == [hold, takeoff, hold, land]


def test_places_attitude_and_battery_twice_a_second_with_the_time_of_gps(log) -> None:
    place, gps = columns(log, "vehicle_global_position"), columns(log, "vehicle_gps_position")
    assert np.max(np.diff(place["timestamp"])) == pytest.approx(0.5e6, abs=0.1e6)
    assert np.ptp(place["alt"]) > 2.0
    assert np.all(np.abs(gps["time_utc_usec"] / 1e6 - EPOCH_S) < 1000.0)
    turn = columns(log, "vehicle_attitude")
    assert np.hypot(turn["q[0]"], turn["q[3]"]) == pytest.approx(np.ones(len(turn["q[0]"])))
    battery = columns(log, "battery_status")
    assert np.all((battery["remaining"] > 0.5) & (battery["remaining"] <= 1.0) & (battery["voltage_v"] > 10.0))
