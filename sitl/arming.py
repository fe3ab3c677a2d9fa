"""The arming checks, with ArduCopter's texts."""

from collections.abc import Set

from sitl.boot import NOT_BOOTED
from sitl.modes import AUTO, NEED_POSITION, Stage
from sitl.parameters import ParameterTable

MIN_ANGLE_CD, MAX_ANGLE_CD = 1000, 8000


def problems(stage: Stage, mode: int, params: ParameterTable, failsafes: Set[str]) -> list[str]:
    """Why a vehicle in this state cannot be armed; also what clears the PREARM bit of SYS_STATUS.

    The position is only needed by modes that use it: the same vehicle is ready in STABILIZE long before GUIDED.
    """
    if stage < Stage.READY:
        return list(NOT_BOOTED)
    found: list[str] = []
    if mode in NEED_POSITION and stage < Stage.ALL_OK:
        found.append("Need Position Estimate")
    elif stage < Stage.PREARM_OK:
        found.append("AHRS: waiting for home")
    if not MIN_ANGLE_CD <= params["ANGLE_MAX"] <= MAX_ANGLE_CD:
        found.append("Check ANGLE_MAX")
    if mode == AUTO:
        found.append("Mode requires mission")
    if "gcs" in failsafes:
        found.append("GCS failsafe on")
    if "battery" in failsafes:
        found.append("Battery failsafe")
    return found
