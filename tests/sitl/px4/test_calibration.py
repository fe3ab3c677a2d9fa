"""PX4's calibration dialogues, as measured."""

import pytest

from tests.sitl.conftest import Ground

GYRO, MAG, ACCEL, LEVEL = (1,), (0, 1), (0, 0, 0, 0, 1), (0, 0, 0, 0, 2)
AIRSPEED, UNKNOWN, CANCEL = (0, 0, 0, 0, 0, 1), (9,), ()
TICK_S = 0.01


@pytest.fixture
def ground(px4) -> Ground:
    ground = px4()
    ground.heard.clear()
    return ground


def calibrate(ground: Ground, p: tuple[float, ...], seconds: float = 0.02) -> list[int]:
    """Results that come within `seconds`."""
    ground.say("HEARTBEAT", type=6)
    since = len(ground.heard)
    ground.command(241, *p)
    ground.run(seconds, TICK_S)
    return [f.fields["result"] for _, _, f in ground.heard[since:] if f.name == "COMMAND_ACK"]


def said(ground: Ground) -> list[str]:
    return [text.removeprefix("[cal] ") for text in ground.texts() if text.startswith("[cal]")]


def wait(ground: Ground, seconds: float) -> None:
    ground.beat(seconds, tick_s=TICK_S)


def test_gyro_is_acknowledged_at_the_start_and_told_in_texts(ground):
    assert calibrate(ground, GYRO) == [0]
    wait(ground, 2.0)
    progress = [f"progress <{percent}>" for percent in range(0, 101, 10)]
    assert said(ground) == ["calibration started: 2 gyro", *progress, "calibration done: gyro"]
    assert 2 in {beat["system_status"] for beat in ground.of("HEARTBEAT")}
    assert len(ground.of("COMMAND_ACK")) == 1


def test_right_after_one_the_next_is_refused_without_a_reason(ground):
    """MAVSDK calibrates one sensor after the other, and goes on 0.6 s after the first has said that it is done."""
    calibrate(ground, GYRO)
    while "calibration done: gyro" not in said(ground):
        wait(ground, 0.05)
    assert calibrate(ground, LEVEL) == [1]
    wait(ground, 0.6)
    assert calibrate(ground, LEVEL) == [0]
    wait(ground, 3.0)
    assert said(ground)[-1] == "calibration done: level"


def test_a_compass_calibration_ends_when_somebody_turns_it_to_all_sides(ground):
    calibrate(ground, MAG)
    wait(ground, 100.0)
    assert said(ground).count("Rotate vehicle") == 6
    assert "back side calibration: progress <83>" in said(ground)
    assert said(ground)[-1] == "calibration done: mag"


def test_a_compass_calibration_does_not_end_where_nobody_turns_it(ground):
    ground.fleet._pilots[0].calibration.pose_stuck = True
    assert calibrate(ground, MAG) == [0]
    wait(ground, 10.0)
    assert said(ground)[:3] == [
        "calibration started: 2 mag",
        "pending: back front left right up down",
        "hold vehicle still on a pending side",
    ]
    assert said(ground)[-1] == "Rotate vehicle"
    assert said(ground).count("down orientation detected") == 2


def test_accelerometers_ask_for_all_sides(ground):
    calibrate(ground, ACCEL)
    wait(ground, 50.0)
    assert sum("orientation detected" in text for text in said(ground)) == 6
    assert said(ground).count("left side result: [0.000 9.807 0.000]") == 1 and "progress <102>" in said(ground)
    assert said(ground)[-1] == "calibration done: accel"


def test_without_a_sensor_it_fails_after_a_while(ground):
    calibrate(ground, AIRSPEED)
    wait(ground, 10.0)
    assert said(ground) == ["calibration started: 2 airspeed", "Ensure sensor is not measuring wind"]
    wait(ground, 26.0)
    assert said(ground)[-1] == "calibration failed: airspeed"


def test_cancelling_is_acknowledged_twice_in_either_order_and_the_text_is_the_truth(ground):
    orders = []
    for _ in range(2):
        calibrate(ground, MAG, 1.0)
        orders.append(calibrate(ground, CANCEL))
        wait(ground, 1.0)
        assert said(ground)[-1] == "calibration cancelled"
        wait(ground, 3.0)
    assert sorted(orders) == [[0, 1], [1, 0]]


def test_another_one_meanwhile_brings_a_storm_until_it_is_cancelled(ground):
    calibrate(ground, AIRSPEED, 1.0)
    results = calibrate(ground, ACCEL, 1.0)
    assert results.count(2) > 50
    assert results.count(1) == 1
    assert sum("command denied during calibration: 241" in text for text in ground.texts()) > 15
    calibrate(ground, CANCEL, 0.5)
    ground.heard.clear()
    wait(ground, 1.0)
    assert not ground.of("COMMAND_ACK")


def test_an_unknown_one_is_accepted_and_nothing_happens(ground):
    assert calibrate(ground, UNKNOWN) == [0]
    wait(ground, 2.0)
    assert not said(ground)


def test_it_cannot_be_armed_meanwhile(ground):
    calibrate(ground, MAG, 0.5)
    assert ground.command(400, 1) == 1
    ground.run(0.1)
    assert "Arming denied: calibrating\t" in ground.texts()
