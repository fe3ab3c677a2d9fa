"""Calibrations: when they may begin, and those that end with their ACK, as real autopilots do them."""

from pathlib import Path

from tests.core.rigs.calibration_rig import CALIBRATE, FAILED_RESULT, IN_PROGRESS, Calibrated, begun, make, service
from tests.core.rigs.service_rig import PX4, Fields, ServiceRig
from tui_gcs.core.firmware.calibration_setup import Sensor, calibration
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.setup.calibration import CalibrationJob
from tui_gcs.core.uplink.jobs import JobState


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
    assert calibration(rig.vehicle(), Sensor.BARO) is None
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


def test_a_refusal_has_its_reason(tmp_path: Path) -> None:
    peer = Calibrated()

    def refuse(fields: Fields) -> None:
        peer.ack(CALIBRATE, FAILED_RESULT)
        peer.text("Calibration FAILED: gyros moving", 4)

    peer.on_order[CALIBRATE] = refuse
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.LEVEL)
    rig.until(lambda: job.over, 2.0)
    assert job.state is JobState.FAILED and job.error == "refused: failed: Calibration FAILED: gyros moving"


def test_silence_is_asked_again_and_then_reported(tmp_path: Path) -> None:
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
