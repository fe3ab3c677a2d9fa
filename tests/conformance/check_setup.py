"""Setting up, and what a vehicle carries: on the ground, nothing turns but a gimbal."""

from collections.abc import Callable

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.report import check
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.services.payload.payload_commands import Done
from tui_gcs.core.services.setup.calibration import CalibrationJob
from tui_gcs.core.uplink.actions import Outcome

GYRO_S, ORDER_S = 60.0, 15.0
PITCH_DEG, YAW_DEG = -30.0, 20.0
"""Within the reach of every gimbal we know of."""


@check("calibration: gyro", takes_s=4.0)
def gyro(field: Field, vehicle: int) -> str:
    """It is calibrated to its end, as the vehicle tells it; the vehicle stands still for that."""
    job = field.station.services.calibrations.start(vehicle, Sensor.GYRO)
    if not isinstance(job, CalibrationJob):
        raise Failed(job)
    took_s = field.until(lambda: job.over, GYRO_S, "the end of its gyro's calibration")
    if job.error:
        raise Failed(job.error)
    return f"done after {took_s:.1f} s; it said: {'; '.join(job.notes) or 'nothing'}"


@check("gimbal: points where it is told to", takes_s=8.0)
def gimbal(field: Field, vehicle: int) -> str:
    """By its own angles, not by an ACK; afterwards control of it is given back."""
    payload, v = field.station.services.payload, field.vehicle(vehicle)
    _ended(field, lambda done: payload.ask(v, done))
    outcome, why = _ended(field, lambda done: payload.gimbal.point(v, PITCH_DEG, YAW_DEG, on_done=done))
    if not payload.devices.gimbals(v):
        raise NotApplicable(f"no gimbal was heard; an order to one: {outcome.value} ({why or 'no reason'})")
    _ended(field, lambda done: payload.gimbal.release(v, done))
    if outcome is not Outcome.CONFIRMED:
        raise Failed(f"pitch {PITCH_DEG:g}, yaw {YAW_DEG:g}: {outcome.value} ({why or 'no reason'})")
    return why


@check("camera: one picture", takes_s=5.0)
def camera(field: Field, vehicle: int) -> str:
    """One that is refused or not answered is of a vehicle without a camera."""
    payload, v = field.station.services.payload, field.vehicle(vehicle)
    outcome, why = _ended(field, lambda done: payload.camera.trigger(v, done))
    if outcome is not Outcome.CONFIRMED:
        raise NotApplicable(f"no camera: {outcome.value} ({why or 'no reason'})")
    return why


def _ended(field: Field, order: Callable[[Done], None]) -> tuple[Outcome, str]:
    ended: list[tuple[Outcome, str]] = []
    order(lambda outcome, why: ended.append((outcome, why)))
    field.until(lambda: bool(ended), ORDER_S, "an end of an order")
    return ended[0]
