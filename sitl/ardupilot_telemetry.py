"""Field values of what ArduCopter reports in its own way."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from sitl.autopilot import Fields
from sitl.modes import AUTO, GUIDED, POSITION_CONTROLLED, RETURN_MODES, Stage
from sitl.telemetry import COMMON, course_cdeg, place

if TYPE_CHECKING:
    from sitl.ardupilot import ArduCopter

CAPABILITIES = 64495
FLIGHT_SW_VERSION = 0x04070000
VOLTAGE_MV = 12_600

# SYS_STATUS bits as recorded; the base values are those of a booted vehicle without GPS.
_PRESENT, _ENABLED, _HEALTH = 1399979023, 1380031503, 1196530703
_BIT_GPS, _BITS_POSITION_CONTROL, _BIT_AHRS = 0x20, 0x6000, 0x200000
_BIT_LOGGING, _BIT_PREARM = 0x1000000, 0x10000000

_EKF_FLAGS: dict[Stage, int] = {Stage.EKF_ACTIVE: 0}
_EKF_UNINITIALISED, _EKF_ALIGNED, _EKF_READY = 1024, 167, 831


def _battery_percent(ap: "ArduCopter") -> int:
    return max(0, math.ceil(100.0 * (1.0 - ap.consumed_mah / max(ap.params["BATT_CAPACITY"], 1.0))))


def _heartbeat(ap: "ArduCopter") -> Fields:
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


def _sys_status(ap: "ArduCopter") -> Fields:
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


def _battery_status(ap: "ArduCopter") -> Fields:
    return {
        "temperature": 32767,
        "voltages": (VOLTAGE_MV, *(65535,) * 9),
        "current_battery": round(ap.current_a * 100),
        "current_consumed": round(ap.consumed_mah),
        "energy_consumed": round(ap.consumed_mah * 3.6 * VOLTAGE_MV / 1e5),
        "battery_remaining": _battery_percent(ap),
        "charge_state": 2 if "battery" in ap.failsafes else 1,
    }


def _gps_raw_int(ap: "ArduCopter") -> Fields:
    if ap.stage < Stage.GPS_FIX:
        return {"fix_type": 1 if ap.stage >= Stage.GPS_FOUND else 0, "eph": 65535, "epv": 65535}
    lat, lon, amsl_m, _ = place(ap)
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
        "cog": course_cdeg(vx, vy),
        "satellites_visible": 10,
        "h_acc": 300,
        "v_acc": 300,
    }


def _ekf_status_report(ap: "ArduCopter") -> Fields:
    if ap.stage >= Stage.POSITION_OK:
        flags = _EKF_READY
    elif ap.stage >= Stage.EKF_ALIGNED:
        flags = _EKF_ALIGNED
    else:
        flags = _EKF_FLAGS.get(ap.stage, _EKF_UNINITIALISED)
    return {"flags": flags}


def _position_target(ap: "ArduCopter") -> Fields | None:
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


def _mission_current(ap: "ArduCopter") -> Fields:
    return {"seq": 0, "total": 0, "mission_state": 1, "mission_mode": int(ap.mode == AUTO)}


def _autopilot_version(ap: "ArduCopter") -> Fields:
    return {
        "capabilities": CAPABILITIES,
        "flight_sw_version": FLIGHT_SW_VERSION,
        "flight_custom_version": tuple(ap.token),
        "uid2": (*ap.uid.encode("ascii")[:17], 0),
    }


BUILDERS: "dict[str, Callable[[ArduCopter], Fields | None]]" = {
    **COMMON,
    "HEARTBEAT": _heartbeat,
    "SYS_STATUS": _sys_status,
    "BATTERY_STATUS": _battery_status,
    "GPS_RAW_INT": _gps_raw_int,
    "EKF_STATUS_REPORT": _ekf_status_report,
    "POSITION_TARGET_GLOBAL_INT": _position_target,
    "MISSION_CURRENT": _mission_current,
    "AUTOPILOT_VERSION": _autopilot_version,
}
