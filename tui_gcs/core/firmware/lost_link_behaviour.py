"""What a vehicle does by itself when it hears nothing, in numbers for the guard; `failsafes` describes it in words.

Parameters that were not read count as shipped: both autopilots ship with the failsafe for a lost ground station
switched off, and PX4 leaves OFFBOARD for a mode of its pilot's, in which it returns or sinks without one.
"""

import math

from tui_gcs.core.firmware.failsafes import Values
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.protocol.common import Vec3

_GCS_RETURNS, _GCS_SINKS = frozenset({1, 2, 3, 4, 6}), frozenset({4, 5, 7})
"""FS_GCS_ENABLE; SmartRTL counts as a straight return, at the height of RTL."""
_OBL_RETURNS, _OBL_SINKS = frozenset({0, 1, 2, 3}), frozenset({0, 1, 2, 4, 6, 7})
"""COM_OBL_RC_ACT."""
_DLL_RETURNS, _DLL_SINKS = frozenset({2}), frozenset({3, 5, 6})
"""NAV_DLL_ACT."""
FAILSAFE_DELAY_S = 3.0
"""A failsafe comes this much later than its time is set to (measured: PX4 up to 2.7 s, ArduCopter up to 0 s)."""


def lost_link_behaviour(vehicle: Vehicle, values: Values, home_m: Vec3) -> LostLinkBehaviour | None:
    """What its parameters make it do; None if it stays where it is, or goes on to where it was sent."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return _px4(vehicle, values, home_m)
    return _copter(values, home_m) if vehicle.autopilot == AUTOPILOT_ARDUPILOT else None


def _copter(values: Values, home_m: Vec3) -> LostLinkBehaviour | None:
    action = values.get("FS_GCS_ENABLE", 0)
    height_m = values.get("RTL_ALT_M", values.get("RTL_ALT", 1500.0) / 100.0)
    leaves_s = values.get("FS_GCS_TIMEOUT", 5.0) + FAILSAFE_DELAY_S
    return _behaviour(home_m, leaves_s, height_m, returns=action in _GCS_RETURNS, sinks=action in _GCS_SINKS)


def _px4(vehicle: Vehicle, values: Values, home_m: Vec3) -> LostLinkBehaviour | None:
    """COM_OBL_RC_ACT is about a vehicle that was in OFFBOARD."""
    # COM_OBL_RC_ACT is about a vehicle that was in OFFBOARD.
    in_offboard = vehicle.mode_name == "OFFBOARD"
    offboard, link = values.get("COM_OBL_RC_ACT", 0) if in_offboard else None, values.get("NAV_DLL_ACT", 0)
    acts_on_link = link in _DLL_RETURNS | _DLL_SINKS
    link_s = values.get("COM_DL_LOSS_T", 10.0) + values.get("COM_FAIL_ACT_T", 5.0)
    leaves_s = (link_s if acts_on_link else values.get("COM_OF_LOSS_T", 1.0)) + FAILSAFE_DELAY_S
    returns, sinks = offboard in _OBL_RETURNS or link in _DLL_RETURNS, offboard in _OBL_SINKS or link in _DLL_SINKS
    return _behaviour(home_m, leaves_s, values.get("RTL_RETURN_ALT", 60.0), returns=returns, sinks=sinks)


def _behaviour(
    home_m: Vec3, leaves_s: float, height_m: float, *, returns: bool, sinks: bool
) -> LostLinkBehaviour | None:
    if not (returns or sinks):
        return None
    return LostLinkBehaviour(home_m, leaves_s, height_m if returns else math.nan, sinks)
