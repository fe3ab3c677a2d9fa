"""ArduCopter's modes, by the numbers in HEARTBEAT.custom_mode."""

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

# Numbers of ArduCopter's modes: custom_mode of its heartbeat.
STABILIZE, ACRO, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE, SMARTRTL, AUTO_RTL = 0, 1, 3, 4, 5, 6, 9, 17, 21, 27

AVAILABLE = (27, 3, 1, 0, 2, 7, 5, 4, 9, 6, 11, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 28)
"""Modes in the order of their AVAILABLE_MODES index."""

# Without a position these are refused: "Mode change to GUIDED failed: requires position".
NEED_POSITION = frozenset({AUTO, GUIDED, LOITER, RTL, 7, 11, 16, BRAKE, 18, 19, SMARTRTL, 23, 24})
# In these a real one refuses to arm; the text is "Arm: RTL mode not armable".
NOT_ARMABLE = frozenset({RTL, 7, LAND, 14, 15, BRAKE, SMARTRTL, AUTO_RTL})
RETURN_MODES = frozenset({RTL, SMARTRTL})
LANDING_MODES = frozenset({RTL, LAND, SMARTRTL})
"""Modes in which the vehicle disarms soon after touch-down."""
MANUAL_THROTTLE = frozenset({STABILIZE, ACRO, 20, 25, 28})
"""Modes in which the throttle stick (down in SITL) drives the motors directly."""
STICK_MODES = frozenset({2, 5, 7, 16})
"""ALT_HOLD, LOITER, CIRCLE and POSHOLD: a joystick flies the vehicle."""
POSITION_CONTROLLED = frozenset({GUIDED, LOITER, LAND, BRAKE})
"""Modes with the GUIDED_ENABLED bit in the heartbeat while disarmed, too (AUTO and RTL: armed only)."""
