"""Position error: how far a position may be wrong, by what the GPS receivers report of themselves and of each other.

Only the autopilot may know which of two receivers that disagree is right. So the position may be wrong by as much as
they are apart, whatever accuracy each reports (docs/threats.md B.6-105).
"""

import math

from tui_gcs.core.fleet.identity.path_correlation import distance_m
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.mavlink.sources import Slot

# Message id: a vehicle with two receivers flies by the other one where the first has no fix.
GPS2_RAW = 124
MIN_FIX = 3
"""GPS_FIX_TYPE_3D_FIX."""
WARNING_M = 10.0
"""A larger position error is reported to the operator."""
M_PER_HDOP = 2.5
"""Metres of position error per unit of HDOP for plain GPS (the user range error of RTCA DO-229 is smaller)."""
MAX_TIME_APART_S = 3.0
"""Reports of two receivers farther apart in time are not compared."""


def reported_error_m(fix_type: int, eph: int, h_acc: int) -> float:
    """Return the horizontal accuracy that a receiver reports, metres; infinite without a fix, NaN if not reported.

    The arguments are fields of GPS_RAW_INT: `h_acc` in mm is used if set, else `eph` (HDOP * 100).
    """
    if fix_type < MIN_FIX:
        return math.inf
    if h_acc:
        return h_acc / 1e3
    return M_PER_HDOP * eph / 100 if eph != 65535 else NAN


def receiver_distance_m(vehicle: Vehicle, first: Slot) -> float:
    """Return the metres between the two receivers less what was flown meanwhile; NaN without a recent fix of both.

    `first` is the slot of GPS_RAW_INT; the second receiver is GPS2_RAW.
    """
    second = vehicle.path.slots.get(GPS2_RAW)
    if second is None or not second.raw or abs(first.t_s - second.t_s) > MAX_TIME_APART_S:
        return NAN
    a, b = first.fields(), second.fields()
    if a["fix_type"] < MIN_FIX or b["fix_type"] < MIN_FIX:
        return NAN
    gap_m = distance_m((0, a["lat"], a["lon"], 0), (0, b["lat"], b["lon"], 0))
    speed_m_s = vehicle.telemetry.ground_speed_m_s if vehicle.telemetry.fix else 0.0
    return max(0.0, gap_m - speed_m_s * abs(first.t_s - second.t_s))
