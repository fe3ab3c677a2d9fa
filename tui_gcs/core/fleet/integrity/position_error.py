"""How far a vehicle's position may be wrong, by what its GPS receivers say of themselves and of each other (B.6-105).

Which of two receivers that disagree is right, only the autopilot may know: so the position may be wrong by as much as
they are apart, whatever accuracy each claims.
"""

import math

from tui_gcs.core.fleet.identity.path_correlation import distance_m
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.mavlink.sources import Slot

GPS2_RAW = 124
MIN_FIX = 3
"""GPS_FIX_TYPE_3D_FIX."""
WARNING_M = 10.0
"""A position error worth telling."""
M_PER_HDOP = 2.5
"""Metres of position error per unit of HDOP: what plain GPS is good for (RTCA DO-229's user range error is less)."""
MAX_TIME_APART_S = 3.0
"""A second receiver that has said nothing for so long says nothing of the first any more."""


def reported_error_m(fix_type: int, eph: int, h_acc: int) -> float:
    """What a receiver says of its horizontal accuracy, of the fields of GPS_RAW_INT: h_acc in mm, else HDOP x 100.

    Infinite without a fix, NaN if it does not say.
    """
    if fix_type < MIN_FIX:
        return math.inf
    if h_acc:
        return h_acc / 1e3
    return M_PER_HDOP * eph / 100 if eph != 65535 else NAN


def receiver_distance_m(vehicle: Vehicle, first: Slot) -> float:
    """Metres between what `first` (GPS_RAW_INT) and the second receiver say, less what the vehicle flew meanwhile.

    NaN if there is no second one with a fix, or nothing new of it.
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
