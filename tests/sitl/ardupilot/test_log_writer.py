"""What is in the log of a simulated ArduCopter, as pymavlink's reader of such logs finds it."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from pymavlink.DFReader import DFReader_binary

from tests.sitl.ardupilot.test_failsafes import low_battery

EPOCH_S = 1_700_000_000.0


@pytest.fixture
def log(booted, tmp_path: Path) -> Any:
    """The log of a flight that a low battery ended; with the time of the failsafe, seconds since 1970."""
    ground = booted()
    low_battery(ground)
    while "Battery Failsafe" not in ground.texts():
        ground.run(0.05)
    failed_s = EPOCH_S + ground.fleet.now_s
    ground.run(60.0)
    vehicle = ground.fleet._pilots[0].platform
    (written,) = vehicle.logs.files
    now_us = vehicle.clock.now_us
    path = tmp_path / "00000001.BIN"
    # In pieces as a download asks for them: the same bytes as at once.
    size = written.size_at(now_us)
    path.write_bytes(b"".join(written.read(at, 90, now_us) for at in range(0, size, 90)))
    assert path.read_bytes() == written.read(0, size, now_us)
    return DFReader_binary(str(path)), failed_s


def messages(reader: Any, kind: str) -> list[Any]:
    reader.rewind()
    found = []
    while (message := reader.recv_match(type=[kind])) is not None:
        found.append(message)
    return found


def test_the_texts_are_in_it_and_the_moment_of_the_failsafe(log) -> None:
    reader, failed_s = log
    texts = {message.Message: message._timestamp for message in messages(reader, "MSG")}
    assert texts["Battery Failsafe"] == pytest.approx(failed_s, abs=1.0)
    (error,) = messages(reader, "ERR")
    assert (error.Subsys, error.ECode) == (6, 1)


def test_modes_arming_and_the_vehicle_itself(log) -> None:
    reader, _ = log
    assert [message.ModeNum for message in messages(reader, "MODE")][-2:] == [4, 6]
    assert [message.ArmState for message in messages(reader, "ARM")] == [1, 0]
    assert reader.params["MAV_SYSID"] == 1


def test_a_place_each_second_with_the_time_of_gps(log) -> None:
    reader, _ = log
    places = messages(reader, "POS")
    assert len(places) > 40
    assert max(place.RelHomeAlt for place in places) > 5.0
    steps = [b._timestamp - a._timestamp for a, b in itertools.pairwise(places)]
    assert max(steps) == pytest.approx(1.0, abs=0.1)
    assert all(EPOCH_S < place._timestamp < EPOCH_S + 1000.0 for place in places)
