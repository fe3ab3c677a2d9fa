"""What is being set up, or was and has to be rebooted, is not started; stops go out whatever it is at."""

from pathlib import Path

import pytest

from tests.core.rigs.calibration_rig import FAILED_RESULT, START_MAG, Calibrated, begun, make, service
from tests.core.rigs.param_peer import ParamServer
from tests.core.rigs.service_rig import Fields, ServiceRig
from tests.core.services.setup.test_calibration_compass import Compasses
from tests.core.services.setup.test_tuning import COPTER
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.guard.permission import OrderClass
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

ARM, TAKE_OFF = "arm", "take-off"
REBOOT_FIRST = "compass calibration done: reboot it before it flies"


def outcome(rig: ServiceRig, what: str) -> tuple[Outcome, str]:
    """What becomes of an order to the vehicle."""
    ended: list[tuple[Outcome, str]] = []

    def done(_: VehicleAction, outcome: Outcome, why: str) -> None:
        ended.append((outcome, why))

    vehicle, firmware = rig.vehicle(), rig.station.comms.firmware.of(rig.vehicle())
    action = firmware.arm(vehicle, done) if what == ARM else firmware.take_off(vehicle, 10.0, done)
    rig.station.comms.commands.submit(action)
    rig.until(lambda: bool(ended), 20.0)
    return ended[0]


def orders(peer: Calibrated, command: int) -> list[Fields]:
    return [f for f in peer.got("COMMAND_LONG") if f["command"] == command]


@pytest.mark.parametrize(("what", "command"), [(ARM, 400), (TAKE_OFF, 22)])
def test_no_start_while_it_is_calibrated(tmp_path: Path, what: str, command: int) -> None:
    peer = Compasses()
    rig = make(tmp_path, peer)
    begun(rig, Sensor.COMPASS)
    rig.run(2.0)
    assert outcome(rig, what) == (Outcome.REFUSED, "compass calibration is under way")
    assert orders(peer, command) == [], "nothing left for the vehicle"
    health = rig.station.services.health.of(rig.vehicle())
    assert not health.ready and "compass calibration is under way" in [p.text for p in health.problems]
    disarm = rig.station.comms.firmware.of(rig.vehicle()).disarm(rig.vehicle())
    assert disarm.order is not None
    assert rig.station.comms.command_encoder.send_command(1, disarm.as_order(), disarm.order, 0) == ""


def test_after_a_compass_calibration_only_a_reboot_lets_it_start(tmp_path: Path) -> None:
    peer = Compasses()
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 60.0)
    assert outcome(rig, ARM) == (Outcome.REFUSED, REBOOT_FIRST)
    rig.vehicle().forget_boot()
    rig.until(lambda: not rig.vehicle().why_not_started, 1.0)
    assert outcome(rig, ARM)[0] is not Outcome.REFUSED and orders(peer, 400)


def test_a_compass_calibration_that_was_cancelled_needs_the_reboot_too(tmp_path: Path) -> None:
    """Measured: ArduCopter refuses to arm from its beginning on."""
    rig = make(tmp_path, Compasses())
    job = begun(rig, Sensor.COMPASS)
    rig.run(2.0)
    assert service(rig).cancel(1) == ""
    rig.until(lambda: job.over, 10.0)
    assert outcome(rig, ARM) == (Outcome.REFUSED, "compass calibration begun: reboot it before it flies")


def test_one_that_was_refused_leaves_nothing_behind(tmp_path: Path) -> None:
    peer = Compasses()
    peer.on_order[START_MAG] = lambda fields: peer.ack(START_MAG, FAILED_RESULT)
    rig = make(tmp_path, peer)
    job = begun(rig, Sensor.COMPASS)
    rig.until(lambda: job.over, 10.0)
    assert "refused" in job.error and rig.vehicle().why_not_started == ""


def test_after_a_change_of_airframe_only_a_reboot_lets_it_start(tmp_path: Path) -> None:
    peer = Calibrated()
    ParamServer(peer, COPTER)
    rig = make(tmp_path, peer)
    ended: list[object] = []
    rig.station.services.airframes.choose(1, {"FRAME_CLASS": 2}, ended.append)
    rig.until(lambda: bool(ended), 10.0)
    assert outcome(rig, ARM) == (Outcome.REFUSED, "airframe changed: reboot it before it flies")


def test_an_airframe_that_is_set_as_a_plain_parameter_is_one_too(tmp_path: Path) -> None:
    peer = Calibrated()
    ParamServer(peer, COPTER)
    rig = make(tmp_path, peer)
    same = rig.station.services.params.set(1, "FRAME_CLASS", 1)
    rig.until(lambda: same.over, 10.0)
    assert (same.error, rig.vehicle().why_not_started) == ("", "")
    other = rig.station.services.params.set(1, "FRAME_CLASS", 2)
    rig.until(lambda: other.over, 10.0)
    assert outcome(rig, ARM) == (Outcome.REFUSED, "airframe changed: reboot it before it flies")


def test_a_transmitter_that_is_calibrated_is_set_up(tmp_path: Path) -> None:
    rig = make(tmp_path, Calibrated())
    rig.station.services.rc_calibrations.start(1)
    assert outcome(rig, ARM) == (Outcome.REFUSED, "radio calibration is under way")
    rig.station.services.rc_calibrations.cancel(1)
    assert rig.vehicle().why_not_started == ""


def test_in_the_air_nothing_of_that_stands_in_the_way(tmp_path: Path) -> None:
    peer = Calibrated()
    rig = make(tmp_path, peer)
    rig.vehicle().reboot_first = "airframe changed"
    peer.armed, peer.alt_rel_mm = True, 20_000
    rig.until(lambda: rig.vehicle().telemetry.airborne, 5.0)
    start = rig.station.comms.firmware.of(rig.vehicle()).mission_start(rig.vehicle())
    assert start.order is not None and start.as_order().order_class is OrderClass.START
    assert rig.station.comms.command_encoder.send_command(1, start.as_order(), start.order, 0) == ""
