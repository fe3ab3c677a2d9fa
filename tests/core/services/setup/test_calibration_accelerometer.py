"""ArduPilot's accelerometers: six poses, as the real one was heard to ask for them."""

from pathlib import Path

import pytest

from tests.core.rigs.calibration_rig import CALIBRATE, FAILED_RESULT, POSE, Calibrated, begun, make, service
from tests.core.rigs.service_rig import Fields, ServiceRig
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.services.setup.calibration import CalibrationJob
from tui_gcs.core.services.setup.calibration_accelerometer import FAILED, SUCCESS, PoseCalibration
from tui_gcs.core.uplink.jobs import JobState


class Poses(Calibrated):
    """Sends the wanted pose every second, takes what the station confirms, and repeats its end for ever."""

    def __init__(self, *, good: bool = True, latched: int = 0) -> None:
        super().__init__()
        self.pose, self.good = latched, good
        self.on_order = {CALIBRATE: self.begin, POSE: self.posed}
        if latched:
            self.tell()

    def begin(self, fields: Fields) -> None:
        self.ack(CALIBRATE)
        running = self.pose != 0
        self.pose = self.pose if 1 <= self.pose <= 6 else 1
        if not running:
            self.tell()

    def tell(self) -> None:
        if self.pose:
            values = {f"param{i}": 0.0 for i in range(2, 8)} | {"param1": float(self.pose)}
            self.say("COMMAND_LONG", target_system=0, target_component=0, command=POSE, confirmation=0, **values)
        self.after(1.05, self.tell)

    def posed(self, fields: Fields) -> None:
        if fields["param1"] != self.pose:
            self.ack(POSE, FAILED_RESULT)
            return
        self.ack(POSE)
        if self.pose == 3 and not self.good:
            self.pose = FAILED
        else:
            self.after(0.6, self.next)

    def next(self) -> None:
        self.pose = self.pose + 1 if self.pose < 6 else SUCCESS


def lead(rig: ServiceRig, job: CalibrationJob, limit_s: float = 60.0) -> list[str]:
    """An operator follows the prompts; returns the prompts."""
    prompts: list[str] = []

    def step() -> bool:
        if job.prompt and job.prompt not in prompts:
            prompts.append(job.prompt)
        if job.waits:
            assert service(rig).confirm(1) == ""
        return job.over

    rig.until(step, limit_s)
    return prompts


def test_six_poses_one_after_the_other(tmp_path: Path) -> None:
    peer = Poses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.ACCEL)
    prompts = lead(rig, job)
    assert job.state is JobState.DONE and job.needs_reboot
    asked = [p for p in prompts if p.startswith("place the vehicle")]
    assert [p.removeprefix("place the vehicle ").split(",")[0] for p in asked] == [
        "level",
        "on its left side",
        "on its right side",
        "nose down",
        "nose up",
        "on its back",
    ]
    assert any("reboot the vehicle" in text for text in rig.texts("vehicle 1"))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 3))])
def test_poses_over_a_link_that_loses(tmp_path: Path, seed: int) -> None:
    rig = make(tmp_path, Poses(), loss=0.3, duplicate=0.1, seed=seed)
    job = begun(rig, Sensor.ACCEL)
    lead(rig, job, 120.0)
    assert job.state is JobState.DONE, job.error


def test_an_end_of_last_time_is_not_taken_for_this_one(tmp_path: Path) -> None:
    """It repeats its end every second until it is rebooted."""
    peer = Poses(latched=SUCCESS)
    rig = make(tmp_path, peer)
    peer.on_order[CALIBRATE] = lambda fields: peer.ack(CALIBRATE)
    job = begun(rig, Sensor.ACCEL)
    rig.run(5.0)
    assert not job.over
    peer.pose = 1
    lead(rig, job)
    assert job.state is JobState.DONE


def test_a_pose_that_did_not_change_fails(tmp_path: Path) -> None:
    rig = make(tmp_path, Poses(good=False))
    job = begun(rig, Sensor.ACCEL)
    lead(rig, job)
    assert job.state is JobState.FAILED and "were all poses right" in job.error and not job.needs_reboot


def test_confirming_too_early_is_of_no_use_and_cancelling_impossible(tmp_path: Path) -> None:
    peer = Poses()
    rig = make(tmp_path, peer)
    assert service(rig).confirm(1) == service(rig).cancel(1) == "no calibration is under way"
    job = begun(rig, Sensor.ACCEL)
    assert service(rig).confirm(1) == "the vehicle does not wait for you"
    rig.until(lambda: job.waits, 3.0)
    assert "reboot" in service(rig).cancel(1)
    assert not job.over and isinstance(job, PoseCalibration) and job.pose == 1


def test_poses_that_cease_are_noticed(tmp_path: Path) -> None:
    peer = Poses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.ACCEL)
    rig.until(lambda: job.waits, 3.0)
    peer.pose = 0
    rig.until(lambda: job.over, 20.0)
    assert "stopped asking" in job.error


@pytest.mark.parametrize("code", [float("nan"), float("inf"), -1.0, 7.0, 1e30])
def test_poses_that_are_none_change_nothing(tmp_path: Path, code: float) -> None:
    peer = Poses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.ACCEL)
    rig.until(lambda: job.waits, 3.0)
    values = {f"param{i}": 0.0 for i in range(2, 8)} | {"param1": code}
    peer.say("COMMAND_LONG", target_system=0, target_component=0, command=POSE, confirmation=0, **values)
    rig.run(0.2)
    assert not job.over and job.waits
