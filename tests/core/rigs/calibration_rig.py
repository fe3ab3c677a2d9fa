"""A vehicle that is calibrated, and how a test begins that."""

from pathlib import Path
from typing import Any

from tests.core.rigs.service_rig import ARDUPILOT, Fields, Peer, ServiceRig
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.services.setup.calibration import CalibrationJob, CalibrationService

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
