"""Calibrations, as real ArduPilot and PX4 binaries were heard to lead them."""

from pathlib import Path
from typing import Any

import pytest
from service_rig import ARDUPILOT, PX4, Fields, Peer, ServiceRig

from tui_gcs.core.firmware.setup import Sensor
from tui_gcs.core.services.calibration import CalibrationJob, CalibrationService
from tui_gcs.core.services.calibration_compass import CompassCalibration
from tui_gcs.core.services.calibration_poses import FAILED, SUCCESS, PoseCalibration
from tui_gcs.core.services.calibration_texts import Side, TextCalibration
from tui_gcs.core.services.jobs import JobState
from tui_gcs.core.wire.encode import Encoder

CALIBRATE, START_MAG, CANCEL_MAG, POSE, INTERVAL = 241, 42424, 42426, 42429, 511
ACCEPTED, TEMPORARILY_REJECTED, DENIED, FAILED_RESULT, IN_PROGRESS = 0, 1, 2, 4, 5


class Calibrated(Peer):
    """A vehicle that answers calibration commands as a test says."""

    def __init__(self, autopilot: int = ARDUPILOT) -> None:
        super().__init__(1, autopilot=autopilot)
        self.calibrating = False
        self.answers["COMMAND_LONG"] = Calibrated.order
        self.on_order: dict[int, Any] = {}

    def order(self, fields: Fields) -> None:
        handler = self.on_order.get(fields["command"])
        if handler is not None:
            handler(fields)
        elif fields["command"] in (511, 512):
            self.ack(fields["command"])

    def say(self, name: str, **fields: Any) -> None:
        if name == "HEARTBEAT" and self.calibrating:
            fields["system_status"] = 2
        super().say(name, **fields)

    def text(self, text: str, severity: int = 6) -> None:
        self.say("STATUSTEXT", severity=severity, text=text, id=0, chunk_seq=0)

    def orders(self, command: int) -> list[Fields]:
        return [fields for fields in self.got("COMMAND_LONG") if fields["command"] == command]


def make(tmp_path: Path, peer: Calibrated, **how: Any) -> ServiceRig:
    rig = ServiceRig(tmp_path, peer, **how).heard()
    return rig.run(1.0)


def service(rig: ServiceRig) -> CalibrationService:
    found: CalibrationService = rig.station.services.calibrations
    return found


def begun(rig: ServiceRig, sensor: Sensor) -> CalibrationJob:
    job = service(rig).start(1, sensor)
    assert isinstance(job, CalibrationJob), job
    return job


# ---------------------------------------------------------------- who may


def test_an_armed_vehicle_is_not_calibrated(tmp_path: Path) -> None:
    peer = Calibrated()
    peer.armed = True
    rig = make(tmp_path, peer)
    assert service(rig).start(1, Sensor.GYRO) == "it is armed"
    assert "gyro calibration NOT STARTED: it is armed" in rig.texts("vehicle 1")
    assert not peer.orders(CALIBRATE)


def test_one_calibration_per_vehicle(tmp_path: Path) -> None:
    peer = Calibrated()
    rig = make(tmp_path, peer)
    begun(rig, Sensor.GYRO)
    assert service(rig).start(1, Sensor.LEVEL) == "another calibration of this vehicle is under way"
    assert len(peer.orders(CALIBRATE)) <= 1


def test_what_an_autopilot_cannot_or_must_not_is_not_offered(tmp_path: Path) -> None:
    """PX4's barometer calibration hung for ever on the real thing; ArduPilot's compassmot crashed it."""
    rig = make(tmp_path, Calibrated(PX4))
    assert Sensor.BARO not in service(rig).sensors(rig.vehicle())
    assert "hang" in str(service(rig).start(1, Sensor.BARO))
    assert "no simple accelerometer calibration" in str(service(rig).start(1, Sensor.SIMPLE_ACCEL))
    assert service(rig).start(9, Sensor.GYRO) == "unknown vehicle"


def test_it_ends_when_the_vehicle_is_armed_or_reboots(tmp_path: Path) -> None:
    peer = Calibrated()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    peer.armed = True
    rig.until(lambda: job.over, 3.0)
    assert job.error == "it was armed meanwhile"


def test_it_takes_no_other_vehicles_place_on_the_link(tmp_path: Path) -> None:
    """It waits for people for minutes; parameters of others are fetched meanwhile."""
    peers = [Calibrated(), Calibrated(), Calibrated()]
    for system, peer in enumerate(peers, 1):
        peer.system, peer.encoder = system, Encoder(system, 1)
    rig = ServiceRig(tmp_path, *peers).heard()
    jobs = [service(rig).start(system, Sensor.ACCEL) for system in (1, 2, 3)]
    assert all(isinstance(job, CalibrationJob) and job.state is JobState.RUNNING for job in jobs)
    assert not rig.station.services.context.jobs.busy


# ---------------------------------------------------------------- ArduPilot: over when acknowledged


def test_ardupilots_gyro_is_done_with_its_ack(tmp_path: Path) -> None:
    peer = Calibrated()

    def gyro(fields: Fields) -> None:
        assert fields["param1"] == 1
        peer.text("Initialising ArduPilot")
        peer.after(0.53, lambda: peer.ack(CALIBRATE))

    peer.on_order[CALIBRATE] = gyro
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    assert job.prompt == "keep the vehicle still"
    took_s = rig.until(lambda: job.over, 3.0)
    assert job.state is JobState.DONE and took_s > 0.5 and job.done == job.total and not job.needs_reboot


def test_a_board_that_takes_long_is_waited_for_and_asked_once(tmp_path: Path) -> None:
    """A second copy would be answered "failed" while the first is at it."""
    peer = Calibrated()

    def gyro(fields: Fields) -> None:
        peer.text("Initialising ArduPilot")
        peer.after(20.0, lambda: peer.ack(CALIBRATE))

    peer.on_order[CALIBRATE] = gyro
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.until(lambda: job.over, 25.0)
    assert job.state is JobState.DONE and len(peer.orders(CALIBRATE)) == 1


def test_in_progress_is_not_the_end(tmp_path: Path) -> None:
    peer = Calibrated()

    def baro(fields: Fields) -> None:
        peer.ack(CALIBRATE, IN_PROGRESS)
        peer.after(0.75, lambda: peer.ack(CALIBRATE))

    peer.on_order[CALIBRATE] = baro
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.BARO)
    rig.run(0.5)
    assert not job.over
    rig.until(lambda: job.over, 1.0)
    assert job.state is JobState.DONE


def test_a_refusal_says_why(tmp_path: Path) -> None:
    peer = Calibrated()

    def refuse(fields: Fields) -> None:
        peer.ack(CALIBRATE, FAILED_RESULT)
        peer.text("Calibration FAILED: gyros moving", 4)

    peer.on_order[CALIBRATE] = refuse
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.LEVEL)
    rig.until(lambda: job.over, 2.0)
    assert job.state is JobState.FAILED and job.error == "refused: failed: Calibration FAILED: gyros moving"


def test_silence_is_asked_again_and_then_told_as_that(tmp_path: Path) -> None:
    peer = Calibrated()
    peer.on_order[CALIBRATE] = lambda fields: None
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.until(lambda: job.over, 60.0)
    assert "no answer" in job.error
    times = [t for t, name, f in peer.heard if name == "COMMAND_LONG" and f["command"] == CALIBRATE]
    assert 1 < len(times) <= 3 and times[-1] - times[0] <= 2.0


def test_accelerometers_are_left_alone_for_a_while_after_each_other(tmp_path: Path) -> None:
    """Within 5 s ArduPilot refuses a second one, and does not say why."""
    peer = Calibrated()
    peer.on_order[CALIBRATE] = lambda fields: peer.ack(CALIBRATE)
    rig = make(tmp_path, peer)
    for sensor in (Sensor.LEVEL, Sensor.SIMPLE_ACCEL):
        job = begun(rig, sensor)
        rig.until(lambda job=job: job.over, 10.0)
    first, second = (t for t, name, f in peer.heard if name == "COMMAND_LONG" and f["command"] == CALIBRATE)
    assert second - first > 5.5


# ---------------------------------------------------------------- ArduPilot: six poses


class Poses(Calibrated):
    """Says the wanted pose every second, takes what the station confirms; repeats its end for ever."""

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
    """An operator who does what he is asked; the prompts he saw."""
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


@pytest.mark.parametrize("seed", range(3))
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


# ---------------------------------------------------------------- ArduPilot: compasses


class Compasses(Calibrated):
    """Three compasses; tells of them only when asked to, and goes on reporting."""

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
    assert job.state is JobState.FAILED and not job.needs_reboot
    assert "compass 2: failed: wrong orientation" in job.error and "compass 3: failed: the field" in job.error


def test_what_was_not_saved_is_no_success(tmp_path: Path) -> None:
    rig = make(tmp_path, Compasses((4,), autosaved=0))
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 20.0)
    assert "not saved" in job.error


@pytest.mark.parametrize("seed", range(3))
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


# ---------------------------------------------------------------- PX4: led by texts


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


@pytest.mark.parametrize("seed", range(6))
def test_px4_is_never_asked_twice_during_one(tmp_path: Path, seed: int) -> None:
    """A second 241 is a storm of refusals; and if its last text is lost, that is told."""
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


def test_px4s_compass_says_what_to_do_with_which_side(tmp_path: Path) -> None:
    rig = make(tmp_path, Talker((*MAG, *SIDE_DONE)))
    job = begun(rig, Sensor.COMPASS)
    assert isinstance(job, TextCalibration)
    rig.run(1.0)
    assert set(job.sides.values()) == {Side.PENDING} and "on its left side" in job.prompt
    rig.run(2.0)
    assert job.sides["down"] is Side.DETECTED and job.prompt.startswith("turn it slowly")
    rig.run(2.0)
    assert job.sides["down"] is Side.DONE and job.sides["up"] is Side.PENDING and job.done == 17
    assert "level" not in job.prompt and service(rig).confirm(1).startswith("nothing is to be confirmed")


def test_px4s_cancel_is_what_its_text_says(tmp_path: Path) -> None:
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


@pytest.mark.parametrize("seed", range(4))
def test_a_cancel_gets_through(tmp_path: Path, seed: int) -> None:
    peer = Talker(MAG)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.run(3.0)
    rig.loss, rig.random = 0.3, __import__("random").Random(seed)
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


def test_px4s_failure_says_why(tmp_path: Path) -> None:
    texts = ((0.0, "calibration started: 2 accel"), (1.0, "calibration failed: timeout: no motion"))
    rig = make(tmp_path, Talker(texts))
    job = begun(rig, Sensor.ACCEL)
    rig.until(lambda: job.over, 3.0)
    assert job.state is JobState.FAILED and "timeout: no motion" in job.error


def test_an_end_that_was_lost_is_seen_by_the_heartbeat(tmp_path: Path) -> None:
    peer = Talker(GYRO[:4])
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.GYRO)
    rig.run(1.5)
    peer.calibrating = False
    rig.until(lambda: job.over, 10.0)
    assert "lost on the way" in job.error


def test_two_calibrations_in_a_row_keep_their_distance(tmp_path: Path) -> None:
    """Right after one, PX4 refuses the next without a reason; its heartbeat still says calibrating, too."""
    peer = Talker(GYRO)
    rig = make(tmp_path, peer)
    for _ in range(2):
        job = begun(rig, Sensor.GYRO)
        rig.until(lambda job=job: job.over, 10.0)
        assert job.state is JobState.DONE, job.error
    first, second = (t for t, name, f in peer.heard if name == "COMMAND_LONG" and f["command"] == CALIBRATE)
    assert second - first > 1.1 + 2.0


def test_somebody_elses_calibration_is_not_disturbed(tmp_path: Path) -> None:
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
