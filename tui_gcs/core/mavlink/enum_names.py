"""Names of MAVLink's enumerations in plain words, without loading the dialect.

Numbers and words are MAVLink's own (minimal.xml: MAV_TYPE, MAV_AUTOPILOT; common.xml: MAV_SEVERITY).
"""

# MAV_TYPE (minimal.xml).
TYPE_GCS = 6
AUTOPILOT_INVALID = 8
"""MAV_AUTOPILOT_INVALID: the sender is no flight controller."""
# MAV_AUTOPILOT (minimal.xml).
AUTOPILOT_ARDUPILOT = 3
AUTOPILOT_PX4 = 12
FLAG_ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED in HEARTBEAT.base_mode."""

SEVERITIES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")

_AUTOPILOTS = {
    0: "generic",
    3: "ArduPilot",
    8: "none",
    9: "Paparazzi",
    12: "PX4",
    13: "SMACCMPilot",
    14: "AutoQuad",
    17: "ASLUAV",
    18: "SmartAP",
    19: "AirRails",
    20: "ReflexPilot",
}

_TYPES = (
    "generic",
    "fixed wing",
    "quadrotor",
    "coaxial",
    "helicopter",
    "antenna tracker",
    "ground station",
    "airship",
    "free balloon",
    "rocket",
    "ground rover",
    "surface boat",
    "submarine",
    "hexarotor",
    "octorotor",
    "tricopter",
    "flapping wing",
    "kite",
    "onboard controller",
    "VTOL duorotor",
    "VTOL quadrotor",
    "VTOL tiltrotor",
    "VTOL fixed rotor",
    "VTOL tailsitter",
    "VTOL tiltwing",
    "VTOL",
    "gimbal",
    "ADS-B",
    "parafoil",
    "dodecarotor",
    "camera",
    "charging station",
    "FLARM",
    "servo",
    "remote id",
    "decarotor",
    "battery",
    "parachute",
    "log",
    "OSD",
    "IMU",
    "GPS",
    "winch",
    "multirotor",
    "illuminator",
    "spacecraft",
    "quadruped",
    "VTOL gyrodyne",
    "gripper",
)

NOT_VEHICLES = frozenset({5, 6, 18, 26, 27, 30, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41, 42, 44, 48})
"""MAV_TYPE of stations, trackers, companions, cameras and other parts that do not move by themselves."""


def sends_integers_bytewise(autopilot: int) -> bool:
    """Whether the float of its PARAM_VALUE holds the bytes of a whole number, not its value (docs/autopilots.md C4)."""
    return autopilot == AUTOPILOT_PX4


def autopilot_name(autopilot: int) -> str:
    """Return a name for MAV_AUTOPILOT, e.g. "PX4"; "autopilot 7" for an unknown one."""
    return _AUTOPILOTS.get(autopilot, f"autopilot {autopilot}")


def type_name(vehicle_type: int) -> str:
    """Return a name for MAV_TYPE, e.g. "quadrotor"; "type 99" for an unknown one."""
    return _TYPES[vehicle_type] if 0 <= vehicle_type < len(_TYPES) else f"type {vehicle_type}"


def severity_name(severity: int) -> str:
    """Return a name for MAV_SEVERITY; a value out of range counts as a notice (docs/threats.md B.6-84)."""
    return SEVERITIES[severity] if 0 <= severity < len(SEVERITIES) else "notice"
