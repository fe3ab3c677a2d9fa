"""Sensor calibrations: started once, led by the vehicle's messages, at most one for each vehicle.

A calibration is a `Job`: `prompt` is what the operator does now, `waits` whether `confirm` is expected, `done` of
`total` is the progress. What differs between autopilots is in `core/firmware/calibration_setup`; the dialogues are in
`calibration_accelerometer`, `calibration_compass` and `calibration_px4`.
"""

import math
from collections import Counter
from collections.abc import Callable

from tui_gcs.core.firmware.calibration_setup import (
    CalibrationProcedure,
    Dialogue,
    Sensor,
    calibration,
    why_no_calibration,
)
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.status_text import TextAssembler
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.setup.calibration_accelerometer import PoseCalibration
from tui_gcs.core.services.setup.calibration_compass import CompassCalibration
from tui_gcs.core.services.setup.calibration_job import AckCalibration, CalibrationJob, CalibrationRequest
from tui_gcs.core.services.setup.calibration_px4 import TextCalibration
from tui_gcs.core.uplink.jobs import Job

KINDS: dict[Dialogue, type[CalibrationJob]] = {
    Dialogue.ACK: AckCalibration,
    Dialogue.POSES: PoseCalibration,
    Dialogue.COMPASSES: CompassCalibration,
    Dialogue.TEXTS: TextCalibration,
}

__all__ = ["CalibrationJob", "CalibrationService", "Sensor"]


class CalibrationService:
    """Starts, confirms and cancels the calibrations of all vehicles, and passes them their messages."""

    def __init__(self, context: ServiceContext) -> None:
        self.context = context
        self._jobs: dict[int, CalibrationJob] = {}
        self._ended: dict[int, tuple[float, Sensor]] = {}
        """When the last calibration of a vehicle ended, and of which sensor."""
        self._texts = TextAssembler()
        self.ignored: Counter[str] = Counter()
        fleet = context.fleet
        fleet.on_message("STATUSTEXT", self._on_text)
        fleet.on_message("COMMAND_LONG", self._on_command)
        fleet.on_message("MAG_CAL_PROGRESS", self._on_progress)
        fleet.on_message("MAG_CAL_REPORT", self._on_report)
        fleet.on_gone(self._forget)
        fleet.paths.on_reboot.append(self._rebooted)
        fleet.paths.on_replace.append(self._rebooted)

    def of(self, vehicle_id: int) -> CalibrationJob | None:
        """The vehicle's calibration, or its last one."""
        return self._jobs.get(vehicle_id)

    def start(
        self, vehicle_id: int, sensor: Sensor, on_done: Callable[[Job], None] | None = None
    ) -> CalibrationJob | str:
        """Begin a calibration, or return why not."""
        vehicle = self.context.fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return "unknown vehicle"
        procedure = calibration(vehicle, sensor)
        why = self._why_not(vehicle, sensor, procedure)
        if procedure is None or why:
            text = f"{sensor} calibration NOT STARTED: {why}"
            self.context.events.report(EventClass.SENSOR, f"vehicle {vehicle_id}", text, WARNING)
            return why
        ended_s, last = self._ended.get(vehicle_id, (-math.inf, sensor))
        # Shortly after another calibration this one would be refused silently (measured).
        begin_s = ended_s + (procedure.settle_s if last in procedure.unsettled_by else 0.0)
        request = CalibrationRequest(self.context, vehicle_id, sensor, procedure, begin_s, on_done)
        job = KINDS[procedure.dialogue](request)
        job.on_end = self._over
        self._jobs[vehicle_id] = job
        vehicle.set_up.add(job.name)
        return self.context.jobs.submit(job)

    def confirm(self, vehicle_id: int) -> str:
        """Report to the vehicle that the operator has followed the prompt; returns "" or why that is of no use now."""
        job, vehicle = self._running(vehicle_id), self.context.fleet.vehicles.get(vehicle_id)
        if job is None or vehicle is None:
            return "no calibration is under way"
        return job.confirm(vehicle)

    def cancel(self, vehicle_id: int) -> str:
        """Cancel the calibration; returns "" or why that is not possible.

        It ends when the vehicle has confirmed that.
        """
        job = self._running(vehicle_id)
        return job.cancel() if job is not None else "no calibration is under way"

    def _why_not(self, vehicle: Vehicle, sensor: Sensor, procedure: CalibrationProcedure | None) -> str:
        if procedure is None:
            return why_no_calibration(vehicle, sensor)
        if self._running(vehicle.id) is not None:
            return "another calibration of this vehicle is under way"
        if vehicle.telemetry.armed:
            return "it is armed"
        return vehicle.why_not_commanded

    def _running(self, vehicle_id: int) -> CalibrationJob | None:
        job = self._jobs.get(vehicle_id)
        return job if job is not None and not job.over else None

    def _over(self, job: CalibrationJob) -> None:
        self._ended[job.vehicle] = self.context.clock.now(), job.sensor
        vehicle = self.context.fleet.vehicles.get(job.vehicle)
        if vehicle is not None:
            vehicle.set_up.discard(job.name)
            if job.needs_reboot:
                vehicle.reboot_first = f"{job.name} {'begun' if job.error else 'done'}"
        if job.needs_reboot:
            text = f"{job.name}: {job.result or 'done'}; reboot the vehicle before it flies"
            self.context.events.report(EventClass.SENSOR, f"vehicle {job.vehicle}", text, NOTICE)

    def _on_text(self, vehicle: Vehicle, fields: Fields) -> None:
        job = self._running(vehicle.id)
        now = self.context.clock.now()
        # Texts longer than 50 characters arrive in chunks, of which some may be lost.
        for _ in self._texts.expired(now):
            self.ignored["text of a calibration cut short"] += 1
        text = self._texts.add(vehicle.id, fields, now) if job is not None else None
        if job is not None and text is not None:
            job.on_text(vehicle, text, now)

    def _on_command(self, vehicle: Vehicle, fields: Fields) -> None:
        job = self._running(vehicle.id)
        if isinstance(job, PoseCalibration) and self.context.is_for_us(fields):
            job.on_command(vehicle, fields, self.context.clock.now())

    def _on_progress(self, vehicle: Vehicle, fields: Fields) -> None:
        job = self._running(vehicle.id)
        if isinstance(job, CompassCalibration):
            job.on_progress(fields, self.context.clock.now())

    def _on_report(self, vehicle: Vehicle, fields: Fields) -> None:
        job = self._running(vehicle.id)
        if isinstance(job, CompassCalibration):
            job.on_report(vehicle, fields, self.context.clock.now())

    def _forget(self, vehicle: Vehicle) -> None:
        self._jobs.pop(vehicle.id, None)

    def _rebooted(self, vehicle: Vehicle) -> None:
        job = self._running(vehicle.id)
        if job is not None:
            job.began = False  # the reboot has ended it
            job.finish("it rebooted")
        self._ended.pop(vehicle.id, None)
