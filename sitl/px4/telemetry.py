"""Field values of what PX4 reports in its own way."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from sitl.common.autopilot import Fields
from sitl.common.states import LANDED_STATE, Phase, Stage
from sitl.common.telemetry import COMMON, attitude, course_cdeg, place, wind_m_s
from sitl.physics.px4_position_control import Follow
from sitl.px4.ftp import component_information, component_metadata
from sitl.px4.modes import AUTO_MAIN, ORBIT
from sitl.services.payload import px4_attitude, px4_manager, px4_manager_status

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

CAPABILITIES = 59647
"""As measured: without SET_POSITION_TARGET_GLOBAL_INT, though it works."""
SW_VERSION = 17891392  # 1.17.0 alpha
CELLS, FULL_V, EMPTY_V = 4, 4.05, 3.6
UNKNOWN_CURRENT = -100
RESET_S = 10.0
"""CURRENT_EVENT_SEQUENCE says for so long that the numbers began anew."""

# SYS_STATUS bits as recorded.
_PRESENT, _ENABLED, _HEALTH, _BIT_PREARM = 33570863, 33636399, 52480063, 0x10000000
_BIT_BATTERY, _BIT_GPS = 0x2000000, 0x20


def _heartbeat(ap: "Px4") -> Fields:
    return {
        "type": 2,
        "autopilot": 12,
        "base_mode": ap.base_mode(),
        "custom_mode": ap.mode,
        "system_status": ap.system_status(),
        "mavlink_version": 3,
    }


def _voltage_mv(ap: "Px4") -> int:
    return round(1000 * CELLS * (EMPTY_V + (FULL_V - EMPTY_V) * ap.charge))


def _sys_status(ap: "Px4") -> Fields:
    health = _HEALTH
    if ap.armed or ap.can_arm:
        health |= _BIT_PREARM
    if ap.battery_warning:
        health &= ~_BIT_BATTERY
    if ap.gps_gone:
        health &= ~_BIT_GPS
    return {
        "onboard_control_sensors_present": _PRESENT,
        "onboard_control_sensors_enabled": _ENABLED,
        "onboard_control_sensors_health": health,
        "load": 176,
        "voltage_battery": _voltage_mv(ap),
        "current_battery": UNKNOWN_CURRENT,
        "battery_remaining": math.ceil(100.0 * ap.charge),
        "onboard_control_sensors_health_extended": 1,
    }


def _battery_status(ap: "Px4") -> Fields:
    state = {"": 1, "low": 2, "critical": 3, "emergency": 4}[ap.battery_warning]
    return {
        "battery_function": 1,
        "type": 1,
        "temperature": 32767,
        "voltages": (_voltage_mv(ap), *(65535,) * 9),
        "current_battery": UNKNOWN_CURRENT,
        "current_consumed": -1,
        "energy_consumed": -1,
        "battery_remaining": math.ceil(100.0 * ap.charge),
        "charge_state": state,
    }


def _gps_raw_int(ap: "Px4") -> Fields:
    if ap.stage < Stage.GPS_FIX or ap.gps_lost_us is not None:
        return {"eph": 9999, "epv": 9999}
    lat, lon, amsl_m, _ = place(ap)
    vx, vy, _ = ap.vehicles.velocity_m_s[ap.index].tolist()
    return {
        "fix_type": 3,
        "lat": lat,
        "lon": lon,
        "alt": round(amsl_m * 1000),
        "alt_ellipsoid": round(amsl_m * 1000),
        "eph": 70,
        "epv": 110,
        "vel": round(math.hypot(vx, vy) * 100),
        "cog": course_cdeg(vx, vy),
        "satellites_visible": 10,
        "h_acc": 900,
        "v_acc": 1780,
        "vel_acc": 400,
    }


def _quaternion(ap: "Px4") -> tuple[float, float, float, float]:
    angles = attitude(ap)
    (cr, sr), (cp, sp), (cy, sy) = (
        (math.cos(angles[name] / 2.0), math.sin(angles[name] / 2.0)) for name in ("roll", "pitch", "yaw")
    )
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _attitude_quaternion(ap: "Px4") -> Fields:
    q = _quaternion(ap)
    return {"time_boot_ms": ap.boot_ms, "q1": q[0], "q2": q[1], "q3": q[2], "q4": q[3]}


def _attitude_target(ap: "Px4") -> Fields:
    return {"time_boot_ms": ap.boot_ms, "q": _quaternion(ap), "thrust": 0.0 if ap.landed else 0.5}


def _servo_output_raw(ap: "Px4") -> Fields:
    level = 1500 if not ap.landed else 1000 if ap.armed else 900
    outputs = {n: level if n <= 4 else 900 for n in range(1, 17)} | ap.stores.calibration.outputs_us(ap.now_us)
    return {"time_usec": ap.boot_ms * 1000, **{f"servo{n}_raw": value for n, value in outputs.items()}}


def _altitude(ap: "Px4") -> Fields:
    _, _, amsl_m, relative_m = place(ap)
    z = ap.vehicles.seen(ap.index)[2]
    return {
        "time_usec": ap.boot_ms * 1000,
        "altitude_monotonic": amsl_m,
        "altitude_amsl": amsl_m,
        "altitude_local": z,
        "altitude_relative": relative_m,
        "altitude_terrain": math.nan,
        "bottom_clearance": math.nan,
    }


def _position_target_local(ap: "Px4") -> Fields:
    k, control = ap.k, ap.control
    head = {"time_boot_ms": ap.boot_ms, "coordinate_frame": 1, "type_mask": 63 if ap.landed else 0}
    if ap.landed:
        return head | dict.fromkeys(("x", "y", "z", "vx", "vy", "vz"), math.nan) | {"afz": 100.0}
    x, y, z = control.goal_m[k].tolist()
    vx, vy, vz = control.feed_m_s[k].tolist()
    if control.follow[k] == Follow.VELOCITY:
        x = y = math.nan
    z = z if control.hold_z[k] else math.nan
    return head | {"x": y, "y": x, "z": -z, "vx": vy, "vy": vx, "vz": -vz, "yaw": float(ap.vehicles.yaw_rad[ap.index])}


def _position_target_global(ap: "Px4") -> Fields | None:
    if not ap.armed or ap.landed or ap.mode >> 16 & 0xFF != AUTO_MAIN:
        return None
    x, y, z = ap.control.goal_m[ap.k].tolist()
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, x, y)
    return {
        "time_boot_ms": ap.boot_ms,
        "coordinate_frame": 5,
        "lat_int": round(lat_deg * 1e7),
        "lon_int": round(lon_deg * 1e7),
        "alt": z + ap.spec.ground_amsl_m,
        "vx": math.nan,
        "vy": math.nan,
        "vz": math.nan,
        "afz": 100.0,
        "yaw": float(ap.vehicles.yaw_rad[ap.index]),
    }


def _vfr_hud(ap: "Px4") -> Fields | None:
    fields = COMMON["VFR_HUD"](ap)
    return fields and {**fields, "airspeed": math.nan}


def _extended_sys_state(ap: "Px4") -> Fields:
    return {"vtol_state": 0, "landed_state": 3 if ap.phase == Phase.TAKEOFF else LANDED_STATE[ap.phase]}


def _mission_current(ap: "Px4") -> Fields:
    return ap.mission.fields()


def _current_mode(ap: "Px4") -> Fields:
    return {"standard_mode": 0, "custom_mode": ap.mode, "intended_custom_mode": ap.intended}


def _estimator_status(ap: "Px4") -> Fields:
    known = ap.stage >= Stage.HOME_SET and not ap.gps_gone
    return {
        "time_usec": ap.boot_ms * 1000,
        "flags": 1023 if known else 0xA7,
        "pos_horiz_accuracy": 0.3 if known else 30.0,
        "pos_vert_accuracy": 0.1,
        "tas_ratio": math.nan,
    }


def _link_node_status(ap: "Px4") -> Fields:
    return {"timestamp": ap.boot_ms * 1000, "tx_rate": 22055, "rx_rate": 20}


def _open_drone_id_location(ap: "Px4") -> Fields:
    lat, lon, amsl_m, relative_m = place(ap)
    vx, vy, vz = ap.vehicles.velocity_m_s[ap.index].tolist()
    return {
        "id_or_mac": (0,) * 20,
        "status": 1 if ap.landed else 2,
        "direction": course_cdeg(vx, vy),
        "speed_horizontal": round(math.hypot(vx, vy) * 100),
        "speed_vertical": round(vz * 100),
        "latitude": lat,
        "longitude": lon,
        "altitude_barometric": amsl_m,
        "altitude_geodetic": amsl_m,
        "height": relative_m,
        "timestamp": 65535.0,
        "horizontal_accuracy": 12,
        "vertical_accuracy": 5,
        "speed_accuracy": 3,
    }


def _open_drone_id_system(ap: "Px4") -> Fields:
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, *ap.home_m[:2])
    return {
        "operator_latitude": round(lat_deg * 1e7),
        "operator_longitude": round(lon_deg * 1e7),
        "operator_altitude_geo": ap.home_m[2] + ap.spec.ground_amsl_m,
        "area_count": 1,
        "area_ceiling": -1000.0,
        "area_floor": -1000.0,
    }


def _orbit_execution_status(ap: "Px4") -> Fields | None:
    circle = ap.flight.circle
    if ap.mode != ORBIT or circle is None:
        return None
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, circle.x_m, circle.y_m)
    return {
        "time_usec": ap.boot_ms * 1000,
        "radius": circle.radius_m,
        "frame": 0,
        "x": round(lat_deg * 1e7),
        "y": round(lon_deg * 1e7),
        "z": circle.z_m + ap.spec.ground_amsl_m,
    }


def _time_estimate(_: "Px4") -> Fields:
    return {"safe_return": 0, "land": -1, "mission_next_item": -1, "mission_end": -1, "commanded_action": -1}


def _current_event_sequence(ap: "Px4") -> Fields:
    return {"sequence": ap.log.sequence, "flags": int(ap.boot_ms < RESET_S * 1000)}


def _autopilot_version(ap: "Px4") -> Fields:
    return {
        "capabilities": CAPABILITIES,
        "flight_sw_version": SW_VERSION,
        "middleware_sw_version": SW_VERSION,
        "os_sw_version": 101854463,
        "board_version": 1,
        "flight_custom_version": tuple(ap.token),
        "middleware_custom_version": tuple(ap.token),
        "uid": int(ap.uid[:16], 16),
    }


def _wind_cov(ap: "Px4") -> Fields | None:
    """Where it goes to."""
    wind = wind_m_s(ap)
    if wind is None:
        return None
    return {"time_usec": ap.boot_ms * 1000, "wind_x": wind[1], "wind_y": wind[0], "var_horiz": 0.1}


BUILDERS: "dict[str, Callable[[Px4], Fields | None]]" = {
    **COMMON,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": px4_attitude,
    "GIMBAL_MANAGER_INFORMATION": px4_manager,
    "GIMBAL_MANAGER_STATUS": px4_manager_status,
    "COMPONENT_INFORMATION": component_information,
    "COMPONENT_METADATA": component_metadata,
    "HEARTBEAT": _heartbeat,
    "SYS_STATUS": _sys_status,
    "BATTERY_STATUS": _battery_status,
    "GPS_RAW_INT": _gps_raw_int,
    "ATTITUDE_QUATERNION": _attitude_quaternion,
    "ATTITUDE_TARGET": _attitude_target,
    "SERVO_OUTPUT_RAW": _servo_output_raw,
    "ALTITUDE": _altitude,
    "POSITION_TARGET_LOCAL_NED": _position_target_local,
    "POSITION_TARGET_GLOBAL_INT": _position_target_global,
    "VFR_HUD": _vfr_hud,
    "EXTENDED_SYS_STATE": _extended_sys_state,
    "MISSION_CURRENT": _mission_current,
    "CURRENT_MODE": _current_mode,
    "ESTIMATOR_STATUS": _estimator_status,
    "LINK_NODE_STATUS": _link_node_status,
    "OPEN_DRONE_ID_LOCATION": _open_drone_id_location,
    "OPEN_DRONE_ID_SYSTEM": _open_drone_id_system,
    "ORBIT_EXECUTION_STATUS": _orbit_execution_status,
    "TIME_ESTIMATE_TO_TARGET": _time_estimate,
    "CURRENT_EVENT_SEQUENCE": _current_event_sequence,
    "VIBRATION": lambda ap: {"time_usec": ap.boot_ms * 1000},
    "PING": lambda ap: {"time_usec": ap.boot_ms * 1000},
    "PROTOCOL_VERSION": lambda _: {"version": 200, "min_version": 100, "max_version": 200},
    "WIND_COV": _wind_cov,
    "AUTOPILOT_VERSION": _autopilot_version,
}
