"""ArduPilot's accelerometer calibration: the vehicle requests six poses, the operator confirms each.

The vehicle repeats the requested pose every second. The end is such a message, too: "success" or "failed", which it
then repeats until it is rebooted (measured). So an end counts only after a pose of this calibration.
"""

import math

from tui_gcs.core.firmware.calibration_setup import ACCELCAL_VEHICLE_POS
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.setup.calibration_job import CalibrationJob, CalibrationRequest
from tui_gcs.core.uplink.actions import MavCommand, Outcome

POSES = {
    1: "level",
    2: "on its left side",
    3: "on its right side",
    4: "nose down",
    5: "nose up",
    6: "on its back",
}
"""ACCELCAL_VEHICLE_POS."""
SUCCESS, FAILED = 16777215, 16777216
SILENT_S = 15.0
"""A vehicle that sent no pose for so long has stopped: it sends one every second."""


class PoseCalibration(CalibrationJob):
    """Follows the poses that the vehicle requests."""

    def __init__(self, request: CalibrationRequest) -> None:
        super().__init__(request)
        self.pose = 0
        """The pose that it requests now; 0 before the first."""
        self._received_s = 0.0
        self._sampling = False

    def accepted(self, now: float) -> None:
        """Expect poses from now on."""
        self._received_s = max(self._received_s, now)

    def is_led_by_others(self) -> bool:
        """Whether its poses show that it goes on."""
        return self.pose != 0

    def watch(self, vehicle: Vehicle, now: float) -> None:
        """End when it has stopped to send poses."""
        if self._received_s and now - self._received_s > SILENT_S:
            self.finish(f"it stopped asking for poses; {self.procedure.no_cancel}")

    def on_command(self, vehicle: Vehicle, fields: Fields, now: float) -> None:
        """Take the request for a pose, or the end."""
        if fields["command"] != ACCELCAL_VEHICLE_POS or not math.isfinite(fields["param1"]):
            return
        code = int(fields["param1"])
        if code in POSES:
            self.order_received, self._received_s = True, now
            if code != self.pose:
                self.pose, self._sampling = code, False
                self.done = 100 * (code - 1) // len(POSES)
            self.waits = not self._sampling
            self.prompt = (
                f"place the vehicle {POSES[code]}, keep it still, then confirm" if self.waits else "keep still"
            )
        # ArduPilot repeats the end of an earlier calibration until it is rebooted: without a pose it is not this one's.
        elif self.pose and code == SUCCESS:
            self.result = "accelerometers calibrated"
            self.finish()
        elif self.pose and code == FAILED:
            self.finish("the vehicle reports a failure: were all poses right, and still?")

    def confirm(self, vehicle: Vehicle) -> str:
        """Report to the vehicle that it is in the requested pose."""
        if not self.waits:
            return "the vehicle does not wait for you"
        pose, order = self.pose, MavCommand(ACCELCAL_VEHICLE_POS, (self.pose,))
        self._sampling, self.waits, self.prompt = True, False, "keep still"
        self.context.submit_order(
            self.vehicle,
            f"pose {POSES[pose]}",
            order,
            lambda _, outcome, why: self._posed(pose, outcome, why),
            confirmed=lambda: self.pose != pose or self.over,
        )
        return ""

    def _posed(self, pose: int, outcome: Outcome, why: str) -> None:
        """Take the result of a confirmation. A refused pose is not wanted any more, or not yet: the vehicle goes on."""
        if outcome is not Outcome.CONFIRMED and not self.over and self.pose == pose:
            self._sampling = False
            self.note(f"pose {POSES[pose]} not taken: {why or outcome.value}")
