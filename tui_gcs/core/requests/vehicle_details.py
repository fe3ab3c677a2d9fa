"""Details of one vehicle from its newest telemetry; nothing is asked of it."""

import math
from collections.abc import Callable

from tui_gcs.core.firmware import health as h
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.protocol.services import Details
from tui_gcs.core.station.assembly import StationParts

# Message ids (common.xml).
ATTITUDE, VFR_HUD = 30, 74
FAST_S, SLOW_S = 5.0, 30.0
"""Telemetry older than this is not shown: of attitude and speed, and of values that change slowly."""


def details(parts: StationParts, vehicle: Vehicle) -> Details:
    """The details of one vehicle, as far as they are known and fresh; the rest is NaN or empty."""
    now = parts.records.clock.now()

    def newest(msgid: int, most_s: float) -> Fields | None:
        message = parts.picture.fleet.newest(vehicle, msgid) if vehicle.silent_s(msgid, now) <= most_s else None
        return message.fields if message is not None else None

    attitude, hud = newest(ATTITUDE, FAST_S), newest(VFR_HUD, FAST_S)
    battery, gps = newest(h.BATTERY_STATUS, SLOW_S), newest(h.GPS_RAW_INT, FAST_S)
    angles = [math.degrees(attitude[name]) for name in ("roll", "pitch", "yaw")] if attitude is not None else [NAN] * 3
    return Details(
        roll_deg=angles[0],
        pitch_deg=angles[1],
        yaw_deg=angles[2] % 360.0,
        airspeed_m_s=hud["airspeed"] if hud is not None else NAN,
        throttle_pct=float(hud["throttle"]) if hud is not None else NAN,
        battery_a=_current_a(battery, newest(h.SYS_STATUS, FAST_S)),
        battery_left_s=_left_s(battery),
        hdop=gps["eph"] / 100 if gps is not None and gps["eph"] != 65535 else NAN,
        position_error_m=vehicle.integrity.position_error_m,
        estimator=_estimator(newest),
        home_m=vehicle.telemetry.home_m,
    )


def _left_s(battery: Fields | None) -> float:
    """Seconds of flight left by the battery's own estimate; NaN where it reports none (0)."""
    left_s = battery["time_remaining"] if battery is not None else 0
    return float(left_s) if left_s > 0 else NAN


def _current_a(battery: Fields | None, status: Fields | None) -> float:
    """The battery current: BATTERY_STATUS before SYS_STATUS, both in centiamperes, -1 if unknown."""
    for fields in (battery, status):
        if fields is not None and fields["current_battery"] >= 0:
            return float(fields["current_battery"]) / 100
    return NAN


def _estimator(newest: Callable[[int, float], Fields | None]) -> str:
    """The worst innovation as a share of what its estimator accepts, e.g. `0.21 compass`; "" if it reports none."""
    report, status = newest(h.EKF_STATUS_REPORT, SLOW_S), newest(h.ESTIMATOR_STATUS, SLOW_S)
    if report is not None:
        values = {word: float(report[name]) for word, name in h.EKF_VARIANCES.items()}
    elif status is not None:
        values = {word: float(status[name]) for word, name in h.PX4_RATIOS.items()}
    else:
        return ""
    word, worst = max(values.items(), key=lambda item: item[1] if math.isfinite(item[1]) else math.inf)
    return f"{worst:.2f} {word}"
