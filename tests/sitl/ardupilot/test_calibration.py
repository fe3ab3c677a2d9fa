"""ArduCopter's calibration dialogues, as measured."""

import pytest

from tests.sitl.conftest import Ground

GYRO, BARO, RADIO = (1,), (0, 0, 1), (0, 0, 0, 1)
FULL, LEVEL, SIMPLE, STORED = (0, 0, 0, 0, 1), (0, 0, 0, 0, 2), (0, 0, 0, 0, 4), (0, 0, 0, 0, 76)
COMPASSMOT, ESC = (0, 0, 0, 0, 0, 1), (0, 0, 0, 0, 0, 0, 1)
TICK_S = 0.01


@pytest.fixture
def ground(booted) -> Ground:
    ground = booted()
    ground.heard.clear()
    return ground


def acks(ground: Ground, command: int = 241) -> list[tuple[float, int]]:
    found = [(t, f.fields) for t, _, f in ground.heard if f.name == "COMMAND_ACK"]
    return [(round(t - 3.2, 2), fields["result"]) for t, fields in found if fields["command"] == command]


@pytest.mark.parametrize(
    ("asked", "after_s", "texts"),
    [
        (GYRO, 0.5, ["Initialising ArduPilot"]),
        (LEVEL, 1.08, ["Initialising ArduPilot", "Trim OK: roll=0.00 pitch=-0.00 yaw=0.00"]),
        (SIMPLE, 1.04, []),
    ],
)
def test_the_acknowledgement_comes_when_it_is_done(ground, asked, after_s, texts):
    assert ground.command(241, *asked) is None
    ground.run(1.5, TICK_S)
    assert acks(ground) == [(pytest.approx(after_s, abs=0.02), 0)]
    assert [text for text in ground.texts() if "PreArm" not in text] == texts


def test_barometer_says_in_progress_first(ground):
    assert ground.command(241, *BARO) == 5
    assert ground.texts() == ["Updating barometer calibration", "Barometer calibration complete"]
    ground.run(1.0, TICK_S)
    assert acks(ground) == [(0.0, 5), (pytest.approx(0.75, abs=0.02), 0)]


@pytest.mark.parametrize(("asked", "result"), [(RADIO, 3), ((), 3), (ESC, 3), (STORED, 0), ((0, 76), 0)])
def test_answers_at_once(ground, asked, result):
    assert ground.command(241, *asked) == result


def test_a_second_accelerometer_calibration_has_to_wait_and_arming_too(ground):
    ground.command(241, *LEVEL)
    ground.run(1.5)
    assert ground.command(241, *SIMPLE) == 1
    assert "Arm: GPS 1: not healthy" in " ".join(ground.answers(400, 1))
    ground.run(5.0)
    assert ground.command(241, *SIMPLE) is None
    ground.run(5.0)
    assert ground.command(400, 1) == 0


def test_armed_it_is_refused(ground):
    ground.command(400, 1)
    assert ground.answers(241, 1) == ["ack 4", "5 Disarm to allow calibration"]
    assert ground.answers(42424) == ["ack 4", "5 Disarm to allow compass calibration"]


def poses(ground: Ground) -> list[int]:
    return [int(f["param1"]) for f in ground.of("COMMAND_LONG") if f["command"] == 42429]


class TestAccelerometers:
    def test_six_poses(self, ground):
        ground.command(241, *FULL)
        ground.run(3.0)
        assert acks(ground) == [(pytest.approx(0.5, abs=0.06), 0)]
        assert poses(ground) == [1, 1, 1]
        request = ground.of("COMMAND_LONG")[0]
        assert (request["target_system"], request["target_component"]) == (0, 0)
        assert ground.texts().count("Place vehicle level and press any key.") == 1
        for pose in range(1, 7):
            assert ground.command(42429, pose % 6 + 1) == 4
            assert ground.command(42429, pose) == 0
            ground.run(1.0)
        assert ground.texts()[-1] == "Calibration successful"
        ground.run(10.0)
        assert poses(ground)[-5:] == [16_777_215] * 5
        assert "2 Arm: Accels calibrated requires reboot" in ground.answers(400, 1)
        assert ground.command(246, 1) == 0
        ground.heard.clear()
        ground.run(5.0)
        assert not poses(ground)

    def test_there_is_no_cancel_asking_again_goes_on(self, ground):
        ground.command(241, *FULL)
        ground.run(1.0)
        ground.command(42429, 1)
        ground.run(1.0)
        assert ground.command(241) == 3
        ground.command(241, *FULL)
        ground.run(2.0)
        assert poses(ground)[-1] == 2

    def test_a_pose_that_does_not_change_fails(self, ground):
        ground.fleet._pilots[0].calibration.pose_stuck = True
        ground.command(241, *FULL)
        ground.run(1.0)
        ground.command(42429, 1)
        ground.run(1.0)
        ground.command(42429, 2)
        ground.run(3.0)
        assert "Calibration FAILED" in ground.texts()
        assert poses(ground)[-2:] == [16_777_216] * 2


class TestCompasses:
    def test_nothing_is_told_unless_asked_for(self, ground):
        assert ground.command(42424) == 0
        ground.run(5.0)
        assert not ground.of("MAG_CAL_PROGRESS")
        assert "2 Arm: Compass calibration running" in ground.answers(400, 1)

    def test_progress_then_reports_until_accepted(self, ground):
        assert ground.ask("MAG_CAL_PROGRESS", 2) == 0
        assert ground.ask("MAG_CAL_REPORT", 2) == 0
        ground.command(42424, 0, 1, 1)
        ground.run(20.0)
        progress = ground.of("MAG_CAL_PROGRESS")
        assert {f["compass_id"] for f in progress} == {0, 1, 2}
        assert [f["completion_pct"] for f in progress] == sorted(f["completion_pct"] for f in progress)
        assert {f["cal_status"] for f in progress} == {2, 3}
        ground.run(28.0)
        assert not ground.of("MAG_CAL_REPORT")
        ground.run(5.0)
        assert {(f["compass_id"], f["cal_status"]) for f in ground.of("MAG_CAL_REPORT")} == {(0, 4), (1, 4), (2, 4)}
        assert ground.command(42425) == 0
        ground.heard.clear()
        ground.run(3.0)
        assert not ground.of("MAG_CAL_REPORT")
        assert "2 Arm: Compass calibrated requires reboot" in ground.answers(400, 1)

    def test_one_compass_takes_39_s_and_cancel_says_nothing(self, ground):
        ground.ask("MAG_CAL_REPORT", 2)
        ground.command(42424, 1)
        ground.run(38.5)
        assert not ground.of("MAG_CAL_REPORT")
        ground.run(1.5)
        assert {f["compass_id"] for f in ground.of("MAG_CAL_REPORT")} == {0}
        ground.command(42424, 2)
        ground.heard.clear()
        assert ground.command(42426) == 0
        ground.run(45.0)
        assert not ground.of("MAG_CAL_REPORT")
        assert "2 Arm: Compass calibrated requires reboot" in ground.answers(400, 1), "also after a cancel"

    @pytest.mark.parametrize("command", [42424, 42425, 42426, 42006])
    def test_everything_is_acknowledged(self, ground, command):
        assert ground.command(command) == 0
        assert ground.command(command) == 0


class TestMotors:
    def test_a_motor_test_looks_armed(self, ground):
        assert ground.command(209, 1, 0, 5, 2.5) == 0
        ground.run(2.0)
        assert ground.of("HEARTBEAT")[-1]["base_mode"] & 0x80
        ground.run(2.0)
        assert not ground.of("HEARTBEAT")[-1]["base_mode"] & 0x80
        assert not ground.fleet.armed[0]

    @pytest.mark.parametrize(("motor", "driven"), [(1, 3), (4, 2), (5, 0), (9, 0)])
    def test_a_motor_that_is_not_there_is_accepted_and_drives_nothing(self, ground, motor, driven):
        assert ground.command(209, motor, 0, 15, 2.0, 1) == 0
        ground.command(512, 36)
        outputs = ground.of("SERVO_OUTPUT_RAW")[-1]
        assert [n for n in range(1, 9) if outputs[f"servo{n}_raw"] == 1150] == ([driven] if driven else [])
        ground.run(2.5)
        ground.command(512, 36)
        assert 1150 not in ground.of("SERVO_OUTPUT_RAW")[-1].values()

    def test_compassmot_looks_armed_until_a_station_sends_an_acknowledgement(self, ground):
        assert ground.command(241, *COMPASSMOT) == 0
        assert ground.of("COMMAND_ACK")[-1]["target_system"] == 0
        ground.run(7.0)
        assert ground.of("HEARTBEAT")[-1]["base_mode"] & 0x80
        assert ground.answers(241, *GYRO) == ["ack 4", "5 Disarm to allow calibration"]
        assert ground.texts().count("Initialising ArduPilot") == 1
        ground.say("COMMAND_ACK", command=0, result=1)
        ground.run(1.5)
        assert "Failed" in ground.texts()
        assert not ground.of("HEARTBEAT")[-1]["base_mode"] & 0x80
