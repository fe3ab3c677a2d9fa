"""The arming checks, with ArduCopter's texts."""

from typing import TYPE_CHECKING

from sitl.ardupilot import remote_id
from sitl.ardupilot.boot import NOT_BOOTED
from sitl.common.states import AUTO, NEED_POSITION, Stage

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter

MIN_ANGLE_CD, MAX_ANGLE_CD = 1000, 8000


def problems(ap: "ArduCopter") -> list[str]:
    """Why a vehicle cannot be armed; also what clears the PREARM bit of SYS_STATUS.

    The position is only needed by modes that use it: the same vehicle is ready in STABILIZE long before GUIDED.
    """
    if ap.stage < Stage.READY:
        return list(NOT_BOOTED)
    found: list[str] = []
    if ap.mode in NEED_POSITION and (ap.stage < Stage.ALL_OK or ap.position_lost):
        found.append("Need Position Estimate")
    elif ap.stage < Stage.PREARM_OK:
        found.append("AHRS: waiting for home")
    if not MIN_ANGLE_CD <= ap.params["ANGLE_MAX"] <= MAX_ANGLE_CD:
        found.append("Check ANGLE_MAX")
    if ap.mode == AUTO and not ap.mission.exists:
        found.append("Mode requires mission")
    if ap.voltage_v < ap.params["BATT_ARM_VOLT"]:
        found.append("Battery 1 below minimum arming voltage")
    if "gcs" in ap.failsafes:
        found.append("GCS failsafe on")
    if "battery" in ap.failsafes:
        found.append("Battery failsafe")
    if why := remote_id.problem(ap):
        found.append(why)
    return found
