"""States that ArduCopter and PX4 share: results, severities, stages of the boot, phases of a flight."""

from enum import IntEnum


class Result(IntEnum):
    """MAV_RESULT, with which a command is acknowledged."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


class MavSeverity(IntEnum):
    """MAV_SEVERITY of a STATUSTEXT, as far as the simulator uses it."""

    EMERGENCY = 0
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class Stage(IntEnum):
    """Stages between power-on and readiness, in the order of the real boot."""

    OFF = 0
    BEATING = 1
    READY = 2
    EKF_ACTIVE = 3
    EKF_ALIGNED = 4
    GPS_FOUND = 5
    GPS_FIX = 6
    HOME_SET = 7
    PREARM_OK = 8
    POSITION_OK = 9
    ALL_OK = 10


class Phase(IntEnum):
    """Phases of a flight; whatever comes after SPOOL_UP is in the air."""

    GROUND = 0
    SPOOL_UP = 1
    TAKEOFF = 2
    AIRBORNE = 3
    RTL_CLIMB = 4
    RTL_HOME = 5
    RTL_LOITER = 6
    LANDING = 7


# MAV_LANDED_STATE of EXTENDED_SYS_STATE.
_ON_GROUND, _IN_AIR, _TAKING_OFF, _LANDING = 1, 2, 3, 4
LANDED_STATE: dict[Phase, int] = {
    **dict.fromkeys(Phase, _IN_AIR),
    **dict.fromkeys((Phase.GROUND, Phase.SPOOL_UP), _ON_GROUND),
    **{Phase.TAKEOFF: _TAKING_OFF, Phase.LANDING: _LANDING},
}
"""MAV_LANDED_STATE by phase, as EXTENDED_SYS_STATE reports it."""
