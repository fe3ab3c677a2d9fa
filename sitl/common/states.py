"""ArduCopter's modes; results, severities, boot stages and flight phases of both autopilots."""

from enum import IntEnum

MODE_NAMES: dict[int, str] = {
    0: "STABILIZE",
    1: "ACRO",
    2: "ALT_HOLD",
    3: "AUTO",
    4: "GUIDED",
    5: "LOITER",
    6: "RTL",
    7: "CIRCLE",
    9: "LAND",
    11: "DRIFT",
    13: "SPORT",
    14: "FLIP",
    15: "AUTOTUNE",
    16: "POSHOLD",
    17: "BRAKE",
    18: "THROW",
    19: "AVOID_ADSB",
    20: "GUIDED_NOGPS",
    21: "SMARTRTL",
    22: "FLOWHOLD",
    23: "FOLLOW",
    24: "ZIGZAG",
    25: "SYSTEMID",
    27: "AUTO RTL",
    28: "TURTLE",
}

STABILIZE, ACRO, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE, SMARTRTL, AUTO_RTL = 0, 1, 3, 4, 5, 6, 9, 17, 21, 27

OFFERED = (27, 3, 1, 0, 2, 7, 5, 4, 9, 6, 11, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 28)
"""AVAILABLE_MODES, in the order of its indices."""

NEED_POSITION = frozenset({AUTO, GUIDED, LOITER, RTL, 7, 11, 16, BRAKE, 18, 19, SMARTRTL, 23, 24})
NOT_ARMABLE = frozenset({RTL, 7, LAND, 14, 15, BRAKE, SMARTRTL, AUTO_RTL})
RETURN_MODES = frozenset({RTL, SMARTRTL})
LANDING_MODES = frozenset({RTL, LAND, SMARTRTL})
"""Modes that disarm soon after touch-down."""
MANUAL_THROTTLE = frozenset({STABILIZE, ACRO, 20, 25, 28})
"""The throttle stick (at the bottom in SITL) goes straight to the motors."""
POSITION_CONTROLLED = frozenset({GUIDED, LOITER, LAND, BRAKE})
"""Modes whose heartbeat has the GUIDED_ENABLED bit, disarmed too (measured; AUTO and RTL only while armed)."""


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


class Severity(IntEnum):
    """MAV_SEVERITY, as far as used."""

    EMERGENCY = 0
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class Stage(IntEnum):
    """What has happened since power-on, in the order of the real boot."""

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
    """Where in a flight."""

    GROUND = 0
    SPOOL_UP = 1
    TAKEOFF = 2
    AIRBORNE = 3
    RTL_CLIMB = 4
    RTL_HOME = 5
    RTL_LOITER = 6
    LANDING = 7


LANDED_STATE: dict[Phase, int] = {
    Phase.GROUND: 1,
    Phase.SPOOL_UP: 1,
    Phase.TAKEOFF: 3,
    Phase.AIRBORNE: 2,
    Phase.RTL_CLIMB: 2,
    Phase.RTL_HOME: 2,
    Phase.RTL_LOITER: 2,
    Phase.LANDING: 4,
}
"""MAV_LANDED_STATE."""
