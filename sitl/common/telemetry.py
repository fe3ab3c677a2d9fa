"""Field values of what all vehicles report alike. A builder returns None when there is nothing to report yet."""

import math
from collections.abc import Callable

from sitl.common.autopilot import Autopilot, Fields
from sitl.common.states import LANDED_STATE, Stage
from sitl.physics.quantities import GRAVITY_M_S2

HOVER_THROTTLE_PERCENT = 36
UNIX_EPOCH_US = 1_700_000_000_000_000
"""Simulated GPS time at the start of a run."""


def _system_time(ap: Autopilot) -> Fields:
    unix_us = UNIX_EPOCH_US + ap.now_us if ap.stage >= Stage.GPS_FIX else 0
    return {"time_unix_usec": unix_us, "time_boot_ms": ap.boot_ms}


def place(ap: Autopilot) -> tuple[int, int, float, float]:
    """Latitude and longitude in 1e-7 degrees, altitude AMSL and above home in metres."""
    x, y, z = ap.vehicles.seen(ap.index)
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, x, y)
    return round(lat_deg * 1e7), round(lon_deg * 1e7), z + ap.spec.ground_amsl_m, z - ap.home_m[2]


def course_cdeg(vx: float, vy: float) -> int:
    """Direction of travel in centidegrees."""
    return round(math.degrees(math.atan2(vx, vy)) * 100) % 36000


def attitude(ap: Autopilot) -> Fields:
    """ATTITUDE: leaning as it accelerates."""
    east, north, _ = ap.vehicles.accel_m_s2[ap.index].tolist()
    yaw = float(ap.vehicles.yaw_rad[ap.index])
    forward = east * math.sin(yaw) + north * math.cos(yaw)
    right = east * math.cos(yaw) - north * math.sin(yaw)
    return {
        "time_boot_ms": ap.boot_ms,
        "roll": math.atan(right / GRAVITY_M_S2),
        "pitch": -math.atan(forward / GRAVITY_M_S2),
        "yaw": yaw - 2.0 * math.pi if yaw > math.pi else yaw,
    }


def heading_cdeg(ap: Autopilot) -> int:
    """Where the nose points in centidegrees."""
    return round(math.degrees(float(ap.vehicles.yaw_rad[ap.index])) * 100) % 36000


def _global_position_int(ap: Autopilot) -> Fields:
    if ap.stage < Stage.HOME_SET:
        return {"time_boot_ms": ap.boot_ms, "hdg": heading_cdeg(ap)}
    lat, lon, amsl_m, relative_m = place(ap)
    vx, vy, vz = ap.vehicles.velocity_m_s[ap.index].tolist()
    return {
        "time_boot_ms": ap.boot_ms,
        "lat": lat,
        "lon": lon,
        "alt": round(amsl_m * 1000),
        "relative_alt": round(relative_m * 1000),
        "vx": round(vy * 100),
        "vy": round(vx * 100),
        "vz": round(-vz * 100),
        "hdg": heading_cdeg(ap),
    }


def _local_position_ned(ap: Autopilot) -> Fields | None:
    if ap.stage < Stage.POSITION_OK:
        return None
    x, y, z = ap.vehicles.seen(ap.index)
    vx, vy, vz = ap.vehicles.velocity_m_s[ap.index].tolist()
    return {"time_boot_ms": ap.boot_ms, "x": y, "y": x, "z": -z, "vx": vy, "vy": vx, "vz": -vz}


def _vfr_hud(ap: Autopilot) -> Fields:
    vx, vy, vz = ap.vehicles.velocity_m_s[ap.index].tolist()
    speed = math.hypot(vx, vy)
    return {
        "airspeed": speed,
        "groundspeed": speed,
        "alt": place(ap)[2] if ap.stage >= Stage.HOME_SET else 0.0,
        "climb": vz,
        "heading": heading_cdeg(ap) // 100,
        "throttle": 0 if ap.landed else HOVER_THROTTLE_PERCENT,
    }


def _extended_sys_state(ap: Autopilot) -> Fields:
    return {"vtol_state": 3, "landed_state": LANDED_STATE[ap.phase]}


def _home_position(ap: Autopilot) -> Fields | None:
    if ap.stage < Stage.HOME_SET:
        return None
    x, y, z = ap.home_m
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, x, y)
    return {
        "latitude": round(lat_deg * 1e7),
        "longitude": round(lon_deg * 1e7),
        "altitude": round((z + ap.spec.ground_amsl_m) * 1000),
        "x": y,
        "y": x,
        "z": -z,
        "q": (math.nan,) * 4,
        "time_usec": ap.now_us - ap.power_on_us,
    }


def _gps_global_origin(ap: Autopilot) -> Fields | None:
    if ap.stage < Stage.HOME_SET:
        return None
    return {
        "latitude": round(ap.spec.lat_deg * 1e7),
        "longitude": round(ap.spec.lon_deg * 1e7),
        "altitude": round(ap.spec.ground_amsl_m * 1000),
        "time_usec": ap.now_us - ap.power_on_us,
    }


def wind_m_s(ap: Autopilot) -> tuple[float, float] | None:
    """(east, north) as an estimator has learned it; None before it has been in the air, and where there is none."""
    weather = ap.vehicles.weather
    if ap.landed or not weather.windy:
        return None
    east, north = (weather.wind_m_s - weather.surprise_m_s)[ap.index].tolist()
    return east, north


COMMON: dict[str, Callable[[Autopilot], Fields | None]] = {
    "SYSTEM_TIME": _system_time,
    "ATTITUDE": attitude,
    "GLOBAL_POSITION_INT": _global_position_int,
    "LOCAL_POSITION_NED": _local_position_ned,
    "VFR_HUD": _vfr_hud,
    "EXTENDED_SYS_STATE": _extended_sys_state,
    "HOME_POSITION": _home_position,
    "GPS_GLOBAL_ORIGIN": _gps_global_origin,
}
