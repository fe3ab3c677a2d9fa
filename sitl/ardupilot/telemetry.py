"""Field values of what ArduCopter reports in its own way."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from sitl.ardupilot.calibration import mag_cal_progress, mag_cal_report
from sitl.ardupilot.remote_id import arm_status
from sitl.ardupilot.traffic import adsb_vehicle
from sitl.common.autopilot import Fields
from sitl.common.manual import RELEASE, RELEASED
from sitl.common.states import AUTO, GUIDED, POSITION_CONTROLLED, RETURN_MODES, Stage
from sitl.common.telemetry import COMMON, course_cdeg, place, wind_m_s
from sitl.services.payload import ardupilot_attitude, ardupilot_camera, ardupilot_manager, ardupilot_manager_status

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter

CAPABILITIES = 64495
FLIGHT_SW_VERSION = 0x04070000
MISSING = 65535
RC_NEUTRAL_US, RC_DOWN_US = 1500, 1000

_BREACH_TYPES = {1: 2, 8: 1, 2: 3, 4: 3}
"""FENCE_BREACH by FENCE_TYPE: highest, lowest, boundary."""

# SYS_STATUS bits as recorded; the base values are those of a booted vehicle without GPS.
_PRESENT, _ENABLED, _HEALTH = 1399979023, 1380031503, 1196530703
_BIT_GPS, _BITS_POSITION_CONTROL, _BIT_AHRS = 0x20, 0x6000, 0x200000
_BIT_FENCE, _BIT_LOGGING, _BIT_PREARM = 0x100000, 0x1000000, 0x10000000

_EKF_FLAGS: dict[Stage, int] = {Stage.EKF_ACTIVE: 0}
_EKF_UNINITIALISED, _EKF_ALIGNED, _EKF_READY, _EKF_LOST = 1024, 167, 831, 0x25


def _battery_percent(ap: "ArduCopter") -> int:
    return max(0, math.ceil(100.0 * (1.0 - ap.consumed_mah / max(ap.params["BATT_CAPACITY"], 1.0))))


def _heartbeat(ap: "ArduCopter") -> Fields:
    looks_armed = ap.armed or ap.stores.calibration.motors_turn(ap.now_us)
    base_mode = 0x51 | (0x80 if looks_armed else 0)
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
    if ap.fence_on:
        present, enabled = present | _BIT_FENCE, enabled | _BIT_FENCE
        health = health & ~_BIT_FENCE if ap.breached else health | _BIT_FENCE
    if ap.armed:
        enabled |= _BIT_LOGGING
    if ap.armed or ap.checks_passed():
        health |= _BIT_PREARM
    return {
        "onboard_control_sensors_present": present,
        "onboard_control_sensors_enabled": enabled,
        "onboard_control_sensors_health": health,
        "voltage_battery": round(ap.voltage_v * 1000),
        "current_battery": round(ap.current_a * 100),
        "battery_remaining": _battery_percent(ap),
    }


def _battery_status(ap: "ArduCopter") -> Fields:
    return {
        "temperature": 32767,
        "voltages": (round(ap.voltage_v * 1000), *(MISSING,) * 9),
        "current_battery": round(ap.current_a * 100),
        "current_consumed": round(ap.consumed_mah),
        "energy_consumed": round(ap.consumed_mah * 36.0 * ap.voltage_v / 1e3),
        "battery_remaining": _battery_percent(ap),
        "charge_state": 1 + ap.battery_level,
    }


def _gps_raw_int(ap: "ArduCopter") -> Fields:
    if ap.stage < Stage.GPS_FIX or ap.gps_lost_us is not None:
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
    if ap.position_lost:
        flags = _EKF_LOST
    elif ap.stage >= Stage.POSITION_OK:
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
    return dict(ap.mission.fields())


def _rc_channels(ap: "ArduCopter") -> Fields:
    """SITL's receiver: the throttle stick is down; a joystick overrides it."""
    sticks = [RC_NEUTRAL_US, RC_NEUTRAL_US, RC_DOWN_US, RC_NEUTRAL_US]
    x, y, z, r = ap.sticks if ap.sticks_us is not None else RELEASED
    for channel, value, up in ((0, y, 0.5), (1, -x if x != RELEASE else x, 0.5), (3, r, 0.5)):
        if value != RELEASE:
            sticks[channel] = RC_NEUTRAL_US + round(value * up)
    if z != RELEASE:
        sticks[2] = RC_DOWN_US + z
    fields: Fields = {f"chan{n}_raw": 0 for n in range(1, 19)}
    fields |= {f"chan{n}_raw": RC_NEUTRAL_US for n in range(5, 9)} | {
        f"chan{n + 1}_raw": v for n, v in enumerate(sticks)
    }
    return fields | {"time_boot_ms": ap.boot_ms, "chancount": 16, "rssi": 255}


def _servo_output_raw(ap: "ArduCopter") -> Fields:
    """Four motors; in the air somewhere above idling."""
    level = 1500 if not ap.landed else 1000
    outputs = dict.fromkeys(range(1, 5), level) | ap.stores.calibration.outputs_us(ap.now_us)
    return {"time_usec": ap.boot_ms * 1000, **{f"servo{n}_raw": value for n, value in outputs.items()}}


def _fence_status(ap: "ArduCopter") -> Fields | None:
    if not ap.fence_on:
        return None
    kind = next((shown for bit, shown in _BREACH_TYPES.items() if ap.breached & bit), 0)
    return {"breach_status": int(bool(ap.breached)), "breach_count": ap.breaches, "breach_type": kind}


def _wind(ap: "ArduCopter") -> Fields:
    """Where it comes from; zeros while nothing is estimated."""
    wind = wind_m_s(ap)
    if wind is None:
        return {}
    east, north = wind
    return {"direction": math.degrees(math.atan2(-east, -north)), "speed": math.hypot(east, north)}


def _autopilot_version(ap: "ArduCopter") -> Fields:
    return {
        "capabilities": CAPABILITIES,
        "flight_sw_version": FLIGHT_SW_VERSION,
        "flight_custom_version": tuple(ap.token),
        "uid2": (*ap.uid.encode("ascii")[:17], 0),
    }


BUILDERS: "dict[str, Callable[[ArduCopter], Fields | None]]" = {
    **COMMON,
    "ADSB_VEHICLE": adsb_vehicle,
    "CAMERA_INFORMATION": ardupilot_camera,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": ardupilot_attitude,
    "GIMBAL_MANAGER_INFORMATION": ardupilot_manager,
    "GIMBAL_MANAGER_STATUS": ardupilot_manager_status,
    "OPEN_DRONE_ID_ARM_STATUS": arm_status,
    "MAG_CAL_PROGRESS": mag_cal_progress,
    "MAG_CAL_REPORT": mag_cal_report,
    "HEARTBEAT": _heartbeat,
    "SYS_STATUS": _sys_status,
    "BATTERY_STATUS": _battery_status,
    "GPS_RAW_INT": _gps_raw_int,
    "EKF_STATUS_REPORT": _ekf_status_report,
    "POSITION_TARGET_GLOBAL_INT": _position_target,
    "MISSION_CURRENT": _mission_current,
    "RC_CHANNELS": _rc_channels,
    "SERVO_OUTPUT_RAW": _servo_output_raw,
    "FENCE_STATUS": _fence_status,
    "POWER_STATUS": lambda _: {"Vcc": 5000},
    "MEMINFO": lambda _: {"freemem": MISSING, "freemem32": 131072},
    "VIBRATION": lambda ap: {"time_usec": ap.boot_ms * 1000},
    "WIND": _wind,
    "AUTOPILOT_VERSION": _autopilot_version,
}
