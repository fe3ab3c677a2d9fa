"""The parts of a PX4 that do not decide what is flown, in the order in which they need each other."""

from sitl.common.fence import Fence
from sitl.common.missions import Item
from sitl.common.platform import Platform
from sitl.px4.announcer import Announcer
from sitl.px4.arming_checks import ArmingChecks
from sitl.px4.battery import Px4Battery
from sitl.px4.calibration import Px4Calibration
from sitl.px4.delayed_answers import DelayedAnswers
from sitl.px4.inputs import ControlInputs
from sitl.px4.navigator import Navigator
from sitl.px4.sd_log import SdLog
from sitl.services.payload import Px4Payload


class Px4Fence(Fence):
    """The fence in force of one vehicle: the shapes of the stored plan that have passed their checks."""

    def lists(self) -> list[list[Item]]:
        """Return the shapes that contain home."""
        return self._plans.in_force


class Px4Parts:
    """Parts that are new after every power-on."""

    def __init__(self, platform: Platform) -> None:
        self.announcer = Announcer(platform)
        self.answers = DelayedAnswers(platform)
        self.inputs = ControlInputs(platform)
        self.battery = Px4Battery(platform)
        self.fence = Px4Fence(platform)
        self.navigator = Navigator(platform, self.announcer, self.inputs)
        self.sd_log = SdLog(platform, self.announcer)
        self.checks = ArmingChecks(platform, self.announcer, self.inputs, self.battery, self.sd_log)
        self.calibration = Px4Calibration(platform, self.announcer, self.answers)
        self.payload = Px4Payload(platform)
