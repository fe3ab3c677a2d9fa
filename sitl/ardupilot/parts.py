"""The parts of an ArduCopter that decide nothing about mode and arming, in the order in which they need each other."""

from sitl.ardupilot.auto_mode import AutoMode
from sitl.ardupilot.battery import CopterBattery
from sitl.ardupilot.calibration import CopterCalibration
from sitl.ardupilot.fence import CopterFence
from sitl.ardupilot.flight import CopterFlight
from sitl.ardupilot.guided import GuidedController
from sitl.ardupilot.joystick import Joystick
from sitl.ardupilot.position_estimate import PositionEstimate
from sitl.ardupilot.remote_id import RemoteId
from sitl.ardupilot.traffic import Traffic
from sitl.common.platform import Platform
from sitl.services.payload import ArduPilotPayload


class CopterParts:
    """Parts that are new after every power-on; only the charge of the battery outlives it."""

    def __init__(self, platform: Platform, battery: CopterBattery) -> None:
        self.battery = battery
        self.calibration = CopterCalibration(platform)
        self.fence = CopterFence(platform)
        self.flight = CopterFlight(platform)
        self.auto = AutoMode(platform, self.flight)
        self.guided = GuidedController(platform, self.fence)
        self.joystick = Joystick(platform)
        self.payload = ArduPilotPayload(platform)
        self.position = PositionEstimate(platform)
        self.remote_id = RemoteId(platform)
        self.traffic = Traffic(platform)
