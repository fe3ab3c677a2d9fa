"""Names of flight modes: HEARTBEAT.custom_mode means something else in every firmware.

ArduPilot numbers: enum Mode::Number of each vehicle (mode.h of ArduCopter, ArduPlane, Rover, ArduSub). PX4: main mode
in bits 16-23, sub mode in bits 24-31 (px4_custom_mode.h).
"""

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

# MAV_TYPE: which of ArduPilot's vehicles a type flies as, since each numbers its modes in its own way.
_COPTER_TYPES = frozenset({2, 3, 4, 13, 14, 15, 29, 35, 43})
_PLANE_TYPES = frozenset({1, 7, 16, 17, 19, 20, 21, 22, 23, 24, 25, 28})
_ROVER_TYPES = frozenset({10, 11})
_SUB_TYPES = frozenset({12})

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
    16: "INITIALISING",
    17: "QSTABILIZE",
    18: "QHOVER",
    19: "QLOITER",
    20: "QLAND",
    21: "QRTL",
    22: "QAUTOTUNE",
    23: "QACRO",
    24: "THERMAL",
    25: "LOITER_ALT_QLAND",
    26: "AUTOLAND",
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
    16: "INITIALISING",
}
_SUB = {
    0: "STABILIZE",
    1: "ACRO",
    2: "ALT_HOLD",
    3: "AUTO",
    4: "GUIDED",
    7: "CIRCLE",
    9: "SURFACE",
    16: "POSHOLD",
    19: "MANUAL",
    20: "MOTOR_DETECT",
    21: "SURFTRAK",
}
_ARDUPILOT = ((_COPTER_TYPES, _COPTER), (_PLANE_TYPES, _PLANE), (_ROVER_TYPES, _ROVER), (_SUB_TYPES, _SUB))
# PX4: custom_mode is main mode << 16 | sub mode << 24 (docs/autopilots.md "Modes of PX4").
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
_PX4_POSCTL_MAIN, _PX4_AUTO_MAIN = 3, 4
_PX4_NAV_STATES = {
    0: "MANUAL",
    1: "ALTCTL",
    2: "POSCTL",
    3: "MISSION",
    4: "HOLD",
    5: "RTL",
    6: "SLOW",
    10: "ACRO",
    12: "DESCEND",
    13: "TERMINATION",
    14: "OFFBOARD",
    15: "STABILIZED",
    17: "TAKEOFF",
    18: "LAND",
    19: "FOLLOW",
    20: "PRECLAND",
    21: "ORBIT",
    22: "VTOL_TAKEOFF",
}
"""vehicle_status.nav_state of PX4, which its own logs hold in place of a custom mode."""
_PX4_OTHER_WORDS = {
    "POSITION": "POSCTL",
    "ALTITUDE": "ALTCTL",
    "LOITER": "HOLD",
    "RETURN": "RTL",
    "ALTITUDECRUISE": "ALTITUDE_CRUISE",
}
"""Names of PX4's documents and of other stations."""
_NOT_CHOSEN = frozenset({"READY", "TERMINATION", "RATTITUDE", "INITIALISING", "MOTOR_DETECT"})
"""Modes that an autopilot enters by itself, or no longer has."""

STANDARD_MODES = {
    1: "POSITION HOLD",
    2: "ORBIT",
    3: "CRUISE",
    4: "ALTITUDE HOLD",
    5: "RTL",
    6: "MISSION",
    7: "LAND",
    8: "TAKEOFF",
}
"""MAV_STANDARD_MODE, the same in every firmware. PX4 leaves the names of these modes empty
(docs/autopilots.md "Modes of PX4")."""


def mode_name(autopilot: int, vehicle_type: int, custom_mode: int) -> str:
    """Return the pilot's word for a mode, e.g. "GUIDED"; "mode 99" for one without a name.

    `autopilot` is MAV_AUTOPILOT, `vehicle_type` MAV_TYPE, `custom_mode` HEARTBEAT's field.
    """
    if autopilot == AUTOPILOT_PX4:
        return _px4_name(custom_mode)
    return _ardupilot_modes(autopilot, vehicle_type).get(custom_mode, f"mode {custom_mode}")


def ardupilot_mode_name(vehicle_type: int, number: int) -> str:
    """Return the pilot's word for a mode of ArduPilot, as its own logs number them; `vehicle_type` is MAV_TYPE."""
    return mode_name(AUTOPILOT_ARDUPILOT, vehicle_type, number)


def px4_nav_state_name(nav_state: int) -> str:
    """Return the pilot's word for a nav_state of PX4; "mode 99" for one without a name."""
    return _PX4_NAV_STATES.get(nav_state, f"mode {nav_state}")


def is_named(autopilot: int, vehicle_type: int, custom_mode: int) -> bool:
    """Return whether our tables name a mode. PX4's external modes are named by the vehicle only."""
    return not mode_name(autopilot, vehicle_type, custom_mode).startswith(("mode ", "AUTO ", "POSCTL ", "EXTERNAL"))


def known_modes(autopilot: int, vehicle_type: int) -> dict[int, str]:
    """Return custom_mode and name of the modes an operator may choose, for vehicles that do not list theirs."""
    if autopilot == AUTOPILOT_PX4:
        modes = {main << 16: name for main, name in _PX4_MAIN.items() if main != _PX4_AUTO_MAIN}
        modes |= {_PX4_POSCTL_MAIN << 16 | sub << 24: name for sub, name in _PX4_POSCTL.items()}
        modes |= {_PX4_AUTO_MAIN << 16 | sub << 24: name for sub, name in _PX4_AUTO.items()}
    else:
        modes = _ardupilot_modes(autopilot, vehicle_type)
    return {
        number: name for number, name in modes.items() if name not in _NOT_CHOSEN and not name.startswith("EXTERNAL")
    }


def other_word(autopilot: int, name: str) -> str:
    """Return our word for what pilots of that autopilot also call a mode; `name` itself if there is none."""
    return _PX4_OTHER_WORDS.get(name.upper(), name) if autopilot == AUTOPILOT_PX4 else name


def _ardupilot_modes(autopilot: int, vehicle_type: int) -> dict[int, str]:
    if autopilot == AUTOPILOT_ARDUPILOT:
        for types, names in _ARDUPILOT:
            if vehicle_type in types:
                return names
    return {}


def _px4_name(custom_mode: int) -> str:
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
    if main == _PX4_AUTO_MAIN and sub:
        return _PX4_AUTO.get(sub, f"AUTO {sub}")
    if main == _PX4_POSCTL_MAIN and sub:
        return _PX4_POSCTL.get(sub, f"POSCTL {sub}")
    return _PX4_MAIN.get(main, f"mode {custom_mode}")
