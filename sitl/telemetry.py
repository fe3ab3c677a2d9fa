"""Field values of everything a vehicle reports. A builder returns None when there is nothing to report yet."""

import math
from collections.abc import Callable
from typing import Any

from sitl.autopilot import Autopilot
from sitl.modes import AUTO, GUIDED, LANDED_STATE, POSITION_CONTROLLED, RETURN_MODES, Stage
from sitl.vehicle import GRAVITY_M_S2

Fields = dict[str, Any]

CAPABILITIES = 64495
FLIGHT_SW_VERSION = 0x04070000
VOLTAGE_MV = 12_600
HOVER_THROTTLE_PERCENT = 36
UNIX_EPOCH_US = 1_700_000_000_000_000
"""Simulated GPS time at the start of a run."""

# SYS_STATUS bits as recorded; the base values are those of a booted vehicle without GPS.
_PRESENT, _ENABLED, _HEALTH = 1399979023, 1380031503, 1196530703
_BIT_GPS, _BITS_POSITION_CONTROL, _BIT_AHRS = 0x20, 0x6000, 0x200000
_BIT_LOGGING, _BIT_PREARM = 0x1000000, 0x10000000

_EKF_FLAGS: dict[Stage, int] = {Stage.EKF_ACTIVE: 0}
_EKF_UNINITIALISED, _EKF_ALIGNED, _EKF_READY = 1024, 167, 831


def _heartbeat(ap: Autopilot) -> Fields:
    base_mode = 0x51 | (0x80 if ap.armed else 0)
    if ap.mode in POSITION_CONTROLLED or ap.stage < Stage.READY or (ap.armed and ap.mode in {*RETURN_MODES, AUTO}):
        base_mode |= 0x08
    status = 1 if ap.stage < Stage.READY else 5 if ap.failsafes else 3 if ap.landed else 4
    return {
        "type": 2,
        "autopilot": 3,
        "base_mode": base_mode,
        "custom_mode": ap.mode,
        "system_status": status,
        "mavlink_version": 3,
    }


def _battery_percent(ap: Autopilot) -> int:
    return max(0, math.ceil(100.0 * (1.0 - ap.consumed_mah / max(ap.params["BATT_CAPACITY"], 1.0))))


def _sys_status(ap: Autopilot) -> Fields:
    present, enabled, health = _PRESENT, _ENABLED, _HEALTH
    if ap.mode in POSITION_CONTROLLED or not ap.landed:
        enabled |= _BITS_POSITION_CONTROL
        health |= _BITS_POSITION_CONTROL
    if ap.stage >= Stage.GPS_FOUND:
        present, enabled, health = present | _BIT_GPS, enabled | _BIT_GPS, health | _BIT_GPS
    if ap.stage >= Stage.HOME_SET:
        enabled, health = enabled | _BIT_AHRS, health | _BIT_AHRS
    if ap.armed:
        enabled |= _BIT_LOGGING
    if ap.armed or not ap.prearm_problems():
        health |= _BIT_PREARM
    return {
        "onboard_control_sensors_present": present,
        "onboard_control_sensors_enabled": enabled,
        "onboard_control_sensors_health": health,
        "voltage_battery": VOLTAGE_MV,
        "current_battery": round(ap.current_a * 100),
        "battery_remaining": _battery_percent(ap),
    }


def _battery_status(ap: Autopilot) -> Fields:
    return {
        "temperature": 32767,
        "voltages": (VOLTAGE_MV, *(65535,) * 9),
        "current_battery": round(ap.current_a * 100),
        "current_consumed": round(ap.consumed_mah),
        "energy_consumed": round(ap.consumed_mah * 3.6 * VOLTAGE_MV / 1e5),
        "battery_remaining": _battery_percent(ap),
        "charge_state": 2 if "battery" in ap.failsafes else 1,
    }


def _system_time(ap: Autopilot) -> Fields:
    unix_us = UNIX_EPOCH_US + ap.now_us if ap.stage >= Stage.GPS_FIX else 0
    return {"time_unix_usec": unix_us, "time_boot_ms": ap.boot_ms}


def _place(ap: Autopilot) -> tuple[int, int, float, float]:
    """Latitude and longitude in 1e-7 degrees, altitude AMSL and above home in metres."""
    x, y, z = ap.vehicles.position_m[ap.index].tolist()
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, x, y)
    return round(lat_deg * 1e7), round(lon_deg * 1e7), z + ap.spec.ground_amsl_m, z - ap.home_m[2]


def _course_cdeg(vx: float, vy: float) -> int:
    return round(math.degrees(math.atan2(vx, vy)) * 100) % 36000


def _gps_raw_int(ap: Autopilot) -> Fields:
    if ap.stage < Stage.GPS_FIX:
        return {"fix_type": 1 if ap.stage >= Stage.GPS_FOUND else 0, "eph": 65535, "epv": 65535}
    lat, lon, amsl_m, _ = _place(ap)
    vx, vy, _ = ap.vehicles.velocity_m_s[ap.index].tolist()
    return {
        "time_usec": ap.now_us - ap.power_on_us,
        "fix_type": 6,
        "lat": lat,
        "lon": lon,
        "alt": round(amsl_m * 1000),
        "alt_ellipsoid": round(amsl_m * 1000),
        "eph": 121,
        "epv": 200,
        "vel": round(math.hypot(vx, vy) * 100),
        "cog": _course_cdeg(vx, vy),
        "satellites_visible": 10,
        "h_acc": 300,
        "v_acc": 300,
    }


def _attitude(ap: Autopilot) -> Fields:
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


def _heading_cdeg(ap: Autopilot) -> int:
    return round(math.degrees(float(ap.vehicles.yaw_rad[ap.index])) * 100) % 36000


def _global_position_int(ap: Autopilot) -> Fields:
    if ap.stage < Stage.HOME_SET:
        return {"time_boot_ms": ap.boot_ms, "hdg": _heading_cdeg(ap)}
    lat, lon, amsl_m, relative_m = _place(ap)
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
        "hdg": _heading_cdeg(ap),
    }


def _local_position_ned(ap: Autopilot) -> Fields | None:
    if ap.stage < Stage.POSITION_OK:
        return None
    x, y, z = ap.vehicles.position_m[ap.index].tolist()
    vx, vy, vz = ap.vehicles.velocity_m_s[ap.index].tolist()
    return {"time_boot_ms": ap.boot_ms, "x": y, "y": x, "z": -z, "vx": vy, "vy": vx, "vz": -vz}


def _vfr_hud(ap: Autopilot) -> Fields:
    vx, vy, vz = ap.vehicles.velocity_m_s[ap.index].tolist()
    speed = math.hypot(vx, vy)
    return {
        "airspeed": speed,
        "groundspeed": speed,
        "alt": _place(ap)[2] if ap.stage >= Stage.HOME_SET else 0.0,
        "climb": vz,
        "heading": _heading_cdeg(ap) // 100,
        "throttle": 0 if ap.landed else HOVER_THROTTLE_PERCENT,
    }


def _ekf_status_report(ap: Autopilot) -> Fields:
    if ap.stage >= Stage.POSITION_OK:
        flags = _EKF_READY
    elif ap.stage >= Stage.EKF_ALIGNED:
        flags = _EKF_ALIGNED
    else:
        flags = _EKF_FLAGS.get(ap.stage, _EKF_UNINITIALISED)
    return {"flags": flags}


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


def _position_target(ap: Autopilot) -> Fields | None:
    if ap.mode != GUIDED or ap.shown_target_m is None:
        return None
    x, y, z = ap.shown_target_m
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, x, y)
    return {
        "time_boot_ms": ap.boot_ms,
        "coordinate_frame": 0,
        "type_mask": 0xFDF8,
        "lat_int": round(lat_deg * 1e7),
        "lon_int": round(lon_deg * 1e7),
        "alt": z + ap.spec.ground_amsl_m,
    }


def _mission_current(ap: Autopilot) -> Fields:
    return {"seq": 0, "total": 0, "mission_state": 1, "mission_mode": int(ap.mode == AUTO)}


def _autopilot_version(ap: Autopilot) -> Fields:
    return {
        "capabilities": CAPABILITIES,
        "flight_sw_version": FLIGHT_SW_VERSION,
        "flight_custom_version": tuple(ap.token),
        "uid2": (*ap.uid.encode("ascii")[:17], 0),
    }


BUILDERS: dict[str, Callable[[Autopilot], Fields | None]] = {
    "HEARTBEAT": _heartbeat,
    "SYS_STATUS": _sys_status,
    "BATTERY_STATUS": _battery_status,
    "SYSTEM_TIME": _system_time,
    "GPS_RAW_INT": _gps_raw_int,
    "ATTITUDE": _attitude,
    "GLOBAL_POSITION_INT": _global_position_int,
    "LOCAL_POSITION_NED": _local_position_ned,
    "VFR_HUD": _vfr_hud,
    "EKF_STATUS_REPORT": _ekf_status_report,
    "EXTENDED_SYS_STATE": _extended_sys_state,
    "HOME_POSITION": _home_position,
    "GPS_GLOBAL_ORIGIN": _gps_global_origin,
    "POSITION_TARGET_GLOBAL_INT": _position_target,
    "MISSION_CURRENT": _mission_current,
    "AUTOPILOT_VERSION": _autopilot_version,
}

_NEED_BOOT = frozenset(BUILDERS) - {"HEARTBEAT", "AUTOPILOT_VERSION"}


def report(ap: Autopilot, name: str) -> bool:
    """Send message `name` now; False if there is nothing to send."""
    if ap.stage < Stage.READY and name in _NEED_BOOT:
        return False
    fields = BUILDERS[name](ap)
    if fields is None:
        return False
    ap.send(name, **fields)
    return True
