"""PX4's calibrations, as the real one was heard to lead them by texts."""

import random
from pathlib import Path

import pytest

from tests.core.rigs.calibration_rig import (
    ACCEPTED,
    CALIBRATE,
    DENIED,
    TEMPORARILY_REJECTED,
    Calibrated,
    begun,
    make,
    service,
)
from tests.core.rigs.service_rig import PX4, Fields
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.setup.calibration_px4 import Side, TextCalibration
from tui_gcs.core.uplink.jobs import JobState


class Talker(Calibrated):
    """PX4: ACCEPTED at once, then texts; anything else meanwhile is a storm of refusals."""

    def __init__(self, texts: tuple[tuple[float, str], ...] = ()) -> None:
        super().__init__(PX4)
        self.texts = texts
        self.storms = 0
        self.begun = 0
        self.on_order = {CALIBRATE: self.begin}

    def begin(self, fields: Fields) -> None:
        cancel = not any(fields[f"param{i}"] for i in range(1, 7))
        if cancel:
            self.ack(CALIBRATE, TEMPORARILY_REJECTED if self.calibrating else ACCEPTED)
            if self.calibrating:
                self.after(0.3, self.cancelled)
            return
        if self.calibrating:
            self.storms += 1
            for number in range(20):
                self.after(0.012 * number, lambda: self.ack(CALIBRATE, DENIED))
            return
        self.begun += 1
        self.ack(CALIBRATE)
        if self.texts:
            self.calibrating = True
        for when, text in self.texts:
            self.after(when, lambda text=text: self.tell(text))

    def tell(self, text: str) -> None:
        if self.calibrating:
            self.text(f"[cal] {text}", 2 if "failed" in text else 6)
            self.calibrating = not text.startswith(("calibration done", "calibration failed"))

    def cancelled(self) -> None:
        if self.calibrating:
            self.ack(CALIBRATE)
            self.text("[cal] calibration cancelled", 2)
            self.calibrating = False


GYRO = (
    (0.0, "calibration started: 2 gyro"),
    *((0.05 + 0.1 * i, f"progress <{10 * i}>") for i in range(11)),
    (1.1, "calibration done: gyro"),
)
MAG = (
    (0.0, "calibration started: 2 mag"),
    (0.05, "pending: back front left right up down"),
    (0.1, "hold vehicle still on a pending side"),
    (1.9, "detected rest position, hold still..."),
    (2.4, "down orientation detected"),
    (2.45, "down orientation detected"),
    (2.5, "Rotate vehicle"),
    (2.7, "down side calibration: progress <5>"),
)
SIDE_DONE = (
    (4.0, "progress <17>"),
    (4.1, "down side done, rotate to a different side"),
    (4.2, "pending: back front left right up"),
)


def test_px4s_gyro_goes_by_its_texts(tmp_path: Path) -> None:
    peer = Talker(GYRO)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.run(0.6)
    assert 0 < job.done < 100 and not job.over, "ACCEPTED is only the beginning"
    rig.until(lambda: job.over, 2.0)
    assert job.state is JobState.DONE and peer.begun == 1 and peer.storms == 0


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 6))])
def test_px4_is_never_asked_twice_during_one(tmp_path: Path, seed: int) -> None:
    """A second 241 causes a storm of refusals; if the last text is lost, that is reported."""
    peer = Talker(GYRO)
    rig = make(tmp_path, peer, loss=0.3, seed=seed)
    job = begun(rig, Sensor.GYRO)
    rig.until(lambda: job.over, 60.0)
    assert peer.storms == 0
    assert job.state is JobState.DONE or "lost on the way" in job.error or "no answer" in job.error


def test_accepted_without_a_beginning_is_nothing(tmp_path: Path) -> None:
    rig = make(tmp_path, Talker())
    job = begun(rig, Sensor.AIRSPEED)
    rig.until(lambda: job.over, 6.0)
    assert job.state is JobState.FAILED and "did not begin" in job.error


def test_who_calibrates_without_a_word_is_not_asked_again(tmp_path: Path) -> None:
    """Its ACK and first texts were lost: its heartbeat is all there is to see, or not even that came yet."""
    peer = Talker(tuple((3.0 + when, text) for when, text in GYRO))
    rig = make(tmp_path, peer)
    begin, peer.ack = peer.begin, lambda *a, **k: None  # type: ignore[method-assign]
    peer.on_order = {CALIBRATE: begin}
    job = begun(rig, Sensor.GYRO)
    rig.until(lambda: job.over, 10.0)
    assert job.state is JobState.DONE and len(peer.orders(CALIBRATE)) == 1


def test_no_answer_is_reported_soon(tmp_path: Path) -> None:
    """PX4 acknowledges within milliseconds, so half a minute of waiting is not needed."""
    peer = Talker()
    rig = make(tmp_path, peer)
    peer.on_order = {CALIBRATE: lambda fields: None}
    job = begun(rig, Sensor.LEVEL)
    rig.until(lambda: job.over, 6.0)
    assert "no answer" in job.error and len(peer.orders(CALIBRATE)) > 1


def test_px4s_compass_prompts_for_each_side(tmp_path: Path) -> None:
    rig = make(tmp_path, Talker((*MAG, *SIDE_DONE)))
    job = begun(rig, Sensor.COMPASS)
    assert isinstance(job, TextCalibration)
    rig.run(1.0)
    assert set(job.sides.values()) == {Side.PENDING} and "on its left side" in job.prompt
    rig.run(2.0)
    assert job.sides["down"] is Side.DETECTED and job.prompt.startswith("turn it slowly"), "also while it gets on"
    assert job.done == 5
    rig.run(2.0)
    assert job.sides["down"] is Side.DONE and job.sides["up"] is Side.PENDING and job.done == 17
    assert "level" not in job.prompt and service(rig).confirm(1).startswith("nothing is to be confirmed")


def test_px4s_cancel_is_confirmed_by_its_text(tmp_path: Path) -> None:
    """It acknowledges a cancel twice, yes and no, in either order."""
    peer = Talker(MAG)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(3.0)
    assert service(rig).cancel(1) == "" and not job.over
    rig.until(lambda: job.over, 2.0)
    assert job.state is JobState.CANCELLED and not peer.calibrating
    (cancel,) = [f for f in peer.orders(CALIBRATE) if not f["param2"]]
    assert not any(cancel[f"param{i}"] for i in range(1, 8))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 4))])
def test_a_cancel_gets_through(tmp_path: Path, seed: int) -> None:
    peer = Talker(MAG)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(3.0)
    rig.loss, rig.random = 0.3, random.Random(seed)
    service(rig).cancel(1)
    rig.until(lambda: job.over, 15.0)
    assert job.state is JobState.CANCELLED and not peer.calibrating


def test_the_desks_cancel_reaches_the_vehicle_too(tmp_path: Path) -> None:
    peer = Talker(MAG)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(3.0)
    rig.station.services.context.jobs.cancel(1)
    assert job.over
    rig.run(2.0)
    assert not peer.calibrating


def test_px4s_failure_has_its_reason(tmp_path: Path) -> None:
    """Of its earlier texts only those that may be a reason: lying on its side all its other checks fail."""
    texts = ((0.0, "calibration started: 2 accel"), (0.5, "down side result: [0.004 -0.002 -9.808]"))
    peer = Talker((*texts, (1.0, "calibration failed: timeout: no motion")))
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.ACCEL)
    rig.run(0.7)
    assert "result" not in job.prompt
    peer.text("Preflight Fail: Attitude failure (pitch)", 2)
    peer.text("excess pitch angle", 2)
    rig.until(lambda: job.over, 3.0)
    assert job.state is JobState.FAILED
    assert job.error == "calibration failed: timeout: no motion; excess pitch angle"


def test_an_end_that_was_lost_is_seen_by_the_heartbeat(tmp_path: Path) -> None:
    peer = Talker(GYRO[:4])
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.run(1.5)
    peer.calibrating = False
    rig.until(lambda: job.over, 10.0)
    assert "lost on the way" in job.error


def test_two_calibrations_in_a_row_keep_their_distance(tmp_path: Path) -> None:
    """Right after one, PX4 refuses the next without a reason, and its heartbeat still shows CALIBRATING."""
    peer = Talker(GYRO)
    rig = make(tmp_path, peer)
    for _ in range(2):
        job = begun(rig, Sensor.GYRO)
        rig.until(lambda job=job: job.over, 10.0)
        assert job.state is JobState.DONE, job.error
    first, second = (t for t, name, f in peer.heard if name == "COMMAND_LONG" and f["command"] == CALIBRATE)
    assert second - first > 1.1 + 2.0


def test_another_stations_calibration_is_not_disturbed(tmp_path: Path) -> None:
    peer = Talker(MAG)
    peer.calibrating = True
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.run(0.5)
    assert job.over and job.error == "it is being calibrated already" and not peer.orders(CALIBRATE)


def test_texts_of_others_lead_nothing(tmp_path: Path) -> None:
    """Neither a camera of this vehicle nor another vehicle can end a calibration."""
    peer = Talker(MAG)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(1.0)
    text = {"severity": 6, "text": "[cal] calibration done: mag", "id": 0, "chunk_seq": 0}
    peer.out.append(Encoder(1, 100).encode("STATUSTEXT", **text))
    peer.out.append(Encoder(7, 1).encode("STATUSTEXT", **text))
    rig.run(0.5)
    assert not job.over


def test_an_unknown_text_is_shown_as_it_is(tmp_path: Path) -> None:
    texts = (*MAG[:1], (0.5, "Blow into front of pitot [/red]\x1b[2J"), (0.6, "progress <999>"))
    rig = make(tmp_path, Talker(texts))
    job = begun(rig, Sensor.AIRSPEED)
    rig.run(1.0)
    assert job.prompt.startswith("Blow into front of pitot") and "\x1b" not in job.prompt and job.done <= 99


def test_it_is_given_up_in_time(tmp_path: Path) -> None:
    peer = Talker(GYRO[:3])
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.until(lambda: job.over, 70.0)
    assert "not done within 60 s" in job.error
    rig.run(2.0)
    assert not peer.calibrating, "and cancelled on board"
