"""Names of flight modes: HEARTBEAT.custom_mode means something else in every firmware.

ArduPilot numbers: enum Mode::Number of each vehicle (ArduCopter/mode.h, ArduPlane/mode.h, Rover/mode.h).
PX4: main mode in bits 16-23, sub mode in bits 24-31 (px4_custom_mode.h).
"""

from tui_gcs.core.wire.mavlink import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

_COPTER_TYPES = frozenset({2, 3, 4, 13, 14, 15, 29, 35, 43})
_PLANE_TYPES = frozenset({1, 7, 16, 17, 19, 20, 21, 22, 23, 24, 25, 28})
_ROVER_TYPES = frozenset({10, 11})

_COPTER = {
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
    21: "SMART_RTL",
    22: "FLOWHOLD",
    23: "FOLLOW",
    24: "ZIGZAG",
    25: "SYSTEMID",
    26: "AUTOROTATE",
    27: "AUTO_RTL",
    28: "TURTLE",
    29: "RATE_ACRO",
}
_PLANE = {
    0: "MANUAL",
    1: "CIRCLE",
    2: "STABILIZE",
    3: "TRAINING",
    4: "ACRO",
    5: "FBWA",
    6: "FBWB",
    7: "CRUISE",
    8: "AUTOTUNE",
    10: "AUTO",
    11: "RTL",
    12: "LOITER",
    13: "TAKEOFF",
    14: "AVOID_ADSB",
    15: "GUIDED",
    17: "QSTABILIZE",
    18: "QHOVER",
    19: "QLOITER",
    20: "QLAND",
    21: "QRTL",
    22: "QAUTOTUNE",
    23: "QACRO",
    24: "THERMAL",
}
_ROVER = {
    0: "MANUAL",
    1: "ACRO",
    3: "STEERING",
    4: "HOLD",
    5: "LOITER",
    6: "FOLLOW",
    7: "SIMPLE",
    8: "DOCK",
    9: "CIRCLE",
    10: "AUTO",
    11: "RTL",
    12: "SMART_RTL",
    15: "GUIDED",
}
_PX4_MAIN = {
    1: "MANUAL",
    2: "ALTCTL",
    3: "POSCTL",
    4: "AUTO",
    5: "ACRO",
    6: "OFFBOARD",
    7: "STABILIZED",
    8: "RATTITUDE",
    10: "TERMINATION",
    11: "ALTITUDE_CRUISE",
}
_PX4_POSCTL = {1: "ORBIT", 2: "SLOW"}
_PX4_AUTO = {
    1: "READY",
    2: "TAKEOFF",
    3: "HOLD",
    4: "MISSION",
    5: "RTL",
    6: "LAND",
    8: "FOLLOW",
    9: "PRECLAND",
    10: "VTOL_TAKEOFF",
} | {10 + i: f"EXTERNAL{i}" for i in range(1, 9)}


def mode_name(autopilot: int, vehicle_type: int, custom_mode: int) -> str:
    """The pilot's word for a mode, e.g. "GUIDED"; "mode 99" for one we have no name for.

    `autopilot` is MAV_AUTOPILOT, `vehicle_type` MAV_TYPE, `custom_mode` HEARTBEAT's field.
    """
    if autopilot == AUTOPILOT_PX4:
        return _px4_name(custom_mode)
    if autopilot == AUTOPILOT_ARDUPILOT:
        for types, names in ((_COPTER_TYPES, _COPTER), (_PLANE_TYPES, _PLANE), (_ROVER_TYPES, _ROVER)):
            if vehicle_type in types:
                return names.get(custom_mode, f"mode {custom_mode}")
    return f"mode {custom_mode}"


def _px4_name(custom_mode: int) -> str:
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
    if main == 4 and sub:
        return _PX4_AUTO.get(sub, f"AUTO {sub}")
    if main == 3 and sub:
        return _PX4_POSCTL.get(sub, f"POSCTL {sub}")
    return _PX4_MAIN.get(main, f"mode {custom_mode}")
