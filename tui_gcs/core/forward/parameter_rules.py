"""Which parameters other stations may set.

None of an armed vehicle, none that this station relies on, and none to a value outside of the range that the vehicle
describes.

Names as in ArduPilot 4.6/4.7 and PX4 1.17, by their beginnings.
"""

from tui_gcs.core.forward.request_checks import ForeignRefusal, ForeignRequest, Ruling

IDENTITY = ("MAV", "SYSID_", "SYS_", "FORMAT_", "FRAME_")
"""Ids, signing and message rates (MAV1_), and the airframe; FORMAT_VERSION wipes all parameters."""
LINKS = ("SERIAL", "SER_", "SR", "BRD_", "CAN_", "UAVCAN_", "NET_", "SCR_")
OUTPUTS = ("MOT_", "SERVO", "RC", "PWM_", "CA_", "RELAY", "CHUTE_")
"""Motors, servos, and what sticks and switches trigger."""
SAFETY = (
    *("FENCE_", "GF_", "ARMING_", "CBRK_", "FS_", "FD_", "BAT", "COM_", "NAV_", "CRASH_", "DISARM_"),
    *("AHRS_EKF", "EK3_ENABLE", "EK3_SRC", "SIM_", "SIH_"),
)
"""Fence, arming checks, failsafes (of batteries too), the estimate it flies by, faults of simulators."""
FLIGHT = ("RTL_", "WP", "LOIT_", "LAND_", "GUID_", "AUTO_", "MIS_", "MPC_XY_", "MPC_Z_", "MPC_LAND", "MPC_TKO")
"""How fast and how high it flies: separation is predicted from that."""
PROTECTED = (*IDENTITY, *LINKS, *OUTPUTS, *SAFETY, *FLIGHT)


def parameter(request: ForeignRequest) -> Ruling:
    """Check a parameter that is to be set. Raises `ForeignRefusal`."""
    name = request.fields["param_id"].upper()  # ArduPilot does not mind the case
    if request.vehicle.telemetry.armed:
        # Tuning, speeds, estimators and failsafes all bear on what the guard predicts and on what the stops of this
        # station do, and no list of names would stay complete over firmware releases.
        raise ForeignRefusal(f"parameter {name}: it is armed, and this station relies on its parameters in flight")
    if name.startswith(PROTECTED):
        raise ForeignRefusal(f"parameter {name}: this station relies on it")
    fields = request.fields
    why = request.parameter_problem(request.vehicle, fields["param_id"], fields["param_type"], fields["param_value"])
    if why:
        raise ForeignRefusal(f"parameter {name}: {why}")
    return Ruling(f"parameter {name}")
