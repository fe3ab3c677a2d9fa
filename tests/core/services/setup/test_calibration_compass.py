"""ArduPilot's compasses, as the real one was heard to report them."""

from pathlib import Path

import pytest

from tests.core.rigs.calibration_rig import CANCEL_MAG, INTERVAL, START_MAG, Calibrated, begun, make, service
from tests.core.rigs.service_rig import Fields
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.services.setup.calibration_compass import CompassCalibration
from tui_gcs.core.uplink.jobs import JobState


class Compasses(Calibrated):
    """Three compasses; reports them only on request, and goes on reporting."""

    def __init__(self, statuses: tuple[int, ...] = (4, 4, 4), autosaved: int = 1) -> None:
        super().__init__()
        self.statuses, self.autosaved = statuses, autosaved
        self.percent, self.running = 0, False
        self.asked: set[int] = set()
        self.on_order = {START_MAG: self.begin, CANCEL_MAG: self.stop, INTERVAL: self.interval}

    def begin(self, fields: Fields) -> None:
        self.ack(START_MAG)
        self.percent, was = 0, self.running
        self.running = True
        if not was:
            self.after(0.5, self.go_on)

    def stop(self, fields: Fields) -> None:
        self.ack(CANCEL_MAG)
        self.running = False

    def interval(self, fields: Fields) -> None:
        self.ack(INTERVAL)
        if fields["param1"] in (191, 192):
            (self.asked.add if fields["param2"] > 0 else self.asked.discard)(int(fields["param1"]))

    def go_on(self) -> None:
        if not self.running:
            return
        self.percent += 5
        for number, status in enumerate(self.statuses):
            if self.percent <= 100 and 191 in self.asked:
                self.progress(number)
            if self.percent > 100 and 192 in self.asked:
                self.report(number, status)
        self.after(0.5, self.go_on)

    def progress(self, number: int) -> None:
        mask = (1 << len(self.statuses)) - 1
        fields = {"completion_mask": [0] * 10, "direction_x": 0.0, "direction_y": 0.0, "direction_z": 0.0}
        self.say(
            "MAG_CAL_PROGRESS",
            compass_id=number,
            cal_mask=mask,
            cal_status=2,
            attempt=1,
            completion_pct=min(255, self.percent),
            **fields,
        )

    def report(self, number: int, status: int, fitness: float = 0.035) -> None:
        names = ("ofs", "diag", "offdiag")
        values = {f"{name}_{axis}": 0.0 for name in names for axis in "xyz"}
        self.say(
            "MAG_CAL_REPORT",
            compass_id=number,
            cal_mask=7,
            cal_status=status,
            autosaved=self.autosaved,
            fitness=fitness,
            **values,
        )


def test_three_compasses(tmp_path: Path) -> None:
    peer = Compasses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.done >= 50, 10.0)
    assert isinstance(job, CompassCalibration) and set(job.compasses) == {0, 1, 2}
    rig.until(lambda: job.over, 10.0)
    assert job.state is JobState.DONE and job.result == "3 compasses calibrated" and job.needs_reboot
    (start,) = peer.orders(START_MAG)
    assert (start["param1"], start["param2"], start["param3"]) == (0, 0, 1), "all, no silent retry, saved"
    rig.run(1.0)
    assert not peer.asked, "it is not to report for ever"


def test_a_report_of_last_time_is_not_taken_for_this_one(tmp_path: Path) -> None:
    peer = Compasses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(0.2)
    for number in range(3):
        peer.report(number, 4)
    rig.run(0.2)
    assert not job.over
    rig.until(lambda: job.over, 20.0)
    assert job.state is JobState.DONE


def test_one_bad_compass_is_named(tmp_path: Path) -> None:
    rig = make(tmp_path, Compasses((4, 6, 7)))
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 20.0)
    assert job.state is JobState.FAILED and job.needs_reboot, "also failed it refuses to arm until then (measured)"
    assert "compass 2: failed: wrong orientation" in job.error and "compass 3: failed: the field" in job.error


def test_what_was_not_saved_is_no_success(tmp_path: Path) -> None:
    rig = make(tmp_path, Compasses((4,), autosaved=0))
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 20.0)
    assert "not saved" in job.error


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 3))])
def test_compasses_over_a_link_that_loses(tmp_path: Path, seed: int) -> None:
    rig = make(tmp_path, Compasses(), loss=0.3, seed=seed)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 60.0)
    assert job.state is JobState.DONE, job.error


def test_compasses_are_cancelled_by_their_own_command(tmp_path: Path) -> None:
    peer = Compasses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.done > 10, 10.0)
    assert service(rig).cancel(1) == ""
    rig.until(lambda: job.over, 3.0)
    assert job.state is JobState.CANCELLED and not peer.running
    assert rig.vehicle().why_not_started == "compass calibration begun: reboot it before it flies"


def test_a_reboot_meanwhile_needs_no_other_one(tmp_path: Path) -> None:
    rig = make(tmp_path, Compasses())
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.done > 10, 10.0)
    service(rig)._rebooted(rig.vehicle())
    assert job.error == "it rebooted" and not job.needs_reboot


def test_compasses_are_asked_again_where_an_answer_was_of_another_question(tmp_path: Path) -> None:
    peer = Compasses()
    peer.on_order[INTERVAL] = lambda fields: peer.ack(INTERVAL)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(2.0)
    peer.on_order[INTERVAL] = peer.interval
    rig.until(lambda: job.over, 30.0)
    assert job.state is JobState.DONE, job.error


def test_compasses_that_fall_silent(tmp_path: Path) -> None:
    peer = Compasses()
    peer.on_order[INTERVAL] = lambda fields: peer.ack(INTERVAL)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 30.0)
    assert "stopped telling" in job.error and peer.orders(CANCEL_MAG)


def test_hostile_progress(tmp_path: Path) -> None:
    peer = Compasses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.done > 10, 10.0)
    peer.progress(200)
    peer.percent = 255
    peer.progress(0)
    peer.report(0, 99, float("nan"))
    rig.run(0.1)
    assert isinstance(job, CompassCalibration)
    assert job.done <= 99 and job.compasses[0] == (100, "failed with status 99")
