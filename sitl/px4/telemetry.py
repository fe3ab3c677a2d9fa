"""Messages that PX4 reports in its own way."""

import math
from collections.abc import Callable
from typing import Any, ClassVar

from sitl.common.outbox import Fields
from sitl.common.platform import Platform
from sitl.common.states import LANDED_STATE, Phase, Stage
from sitl.common.telemetry import COMMON_BUILDERS, Telemetry, course_cdeg
from sitl.physics.px4_position_control import SetpointKind
from sitl.px4.commander import Commander
from sitl.px4.ftp import METADATA_CRC, METADATA_URI
from sitl.px4.modes import AUTO_MAIN, ORBIT, base_mode
from sitl.px4.parts import Px4Parts

CAPABILITIES = 59647
"""Measured: without the bit of SET_POSITION_TARGET_GLOBAL_INT, although that works."""
SW_VERSION = 17891392  # 1.17.0 alpha
# SITL's battery has four cells and reports 16.2 V when full.
CELLS, FULL_V, EMPTY_V = 4, 4.05, 3.6
# -1 A: what a PX4 without a current sensor sends.
UNKNOWN_CURRENT = -100
RESET_S = 10.0
"""CURRENT_EVENT_SEQUENCE has the reset flag for this long after power-on."""

# SYS_STATUS bits as recorded.
_PRESENT, _ENABLED, _HEALTH, _BIT_PREARM = 33570863, 33636399, 52480063, 0x10000000
_BIT_BATTERY, _BIT_GPS = 0x2000000, 0x20


class Px4Telemetry(Telemetry):
    """Reports the state of one PX4."""

    def __init__(self, platform: Platform, parts: Px4Parts, commander: Commander) -> None:
        super().__init__(platform)
        self._parts, self._commander = parts, commander

    def _heartbeat(self) -> Fields:
        return {
            "type": 2,
            "autopilot": 12,
            "base_mode": base_mode(self.state.mode, armed=self.state.armed),
            "custom_mode": self.state.mode,
            "system_status": self._commander.system_status,
            "mavlink_version": 3,
        }

    def voltage_mv(self) -> int:
        """Return the battery's voltage in millivolts."""
        return round(1000 * CELLS * (EMPTY_V + (FULL_V - EMPTY_V) * self._parts.battery.charge))

    def _sys_status(self) -> Fields:
        health = _HEALTH
        if self.state.armed or self._parts.checks.can_arm(self.state.mode):
            health |= _BIT_PREARM
        if self._parts.battery.warning:
            health &= ~_BIT_BATTERY
        if self._parts.inputs.position_lost:
            health &= ~_BIT_GPS
        return {
            "onboard_control_sensors_present": _PRESENT,
            "onboard_control_sensors_enabled": _ENABLED,
            "onboard_control_sensors_health": health,
            "load": 176,
            "voltage_battery": self.voltage_mv(),
            "current_battery": UNKNOWN_CURRENT,
            "battery_remaining": math.ceil(100.0 * self._parts.battery.charge),
            "onboard_control_sensors_health_extended": 1,
        }

    def _battery_status(self) -> Fields:
        state = {"": 1, "low": 2, "critical": 3, "emergency": 4}[self._parts.battery.warning]
        return {
            "battery_function": 1,
            "type": 1,
            "temperature": 32767,
            "voltages": (self.voltage_mv(), *(65535,) * 9),
            "current_battery": UNKNOWN_CURRENT,
            "current_consumed": -1,
            "energy_consumed": -1,
            "battery_remaining": math.ceil(100.0 * self._parts.battery.charge),
            "charge_state": state,
        }

    def _gps_raw_int(self) -> Fields:
        if self.state.stage < Stage.GPS_FIX or self.state.gps_lost_us is not None:
            return {"eph": 9999, "epv": 9999}
        quality = {"fix_type": 3, "eph": 70, "epv": 110, "h_acc": 900, "v_acc": 1780, "vel_acc": 400}
        return {**self.gps_fix(), **quality}

    def _quaternion(self) -> tuple[float, float, float, float]:
        angles = self.attitude()
        (cr, sr), (cp, sp), (cy, sy) = (
            (math.cos(angles[name] / 2.0), math.sin(angles[name] / 2.0)) for name in ("roll", "pitch", "yaw")
        )
        return (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )

    def _attitude_quaternion(self) -> Fields:
        q = self._quaternion()
        return {"time_boot_ms": self.clock.boot_ms, "q1": q[0], "q2": q[1], "q3": q[2], "q4": q[3]}

    def _attitude_target(self) -> Fields:
        thrust = 0.0 if self.state.landed else 0.5
        return {"time_boot_ms": self.clock.boot_ms, "q": self._quaternion(), "thrust": thrust}

    def _servo_output_raw(self) -> Fields:
        level = 1500 if not self.state.landed else 1000 if self.state.armed else 900
        outputs = {n: level if n <= 4 else 900 for n in range(1, 17)} | self._parts.calibration.motor_test.outputs_us()
        return {"time_usec": self.clock.boot_ms * 1000, **{f"servo{n}_raw": value for n, value in outputs.items()}}

    def _altitude(self) -> Fields:
        _, _, amsl_m, relative_m = self.place()
        z = self.body.seen_m()[2]
        return {
            "time_usec": self.clock.boot_ms * 1000,
            "altitude_monotonic": amsl_m,
            "altitude_amsl": amsl_m,
            "altitude_local": z,
            "altitude_relative": relative_m,
            "altitude_terrain": math.nan,
            "bottom_clearance": math.nan,
        }

    def _position_target_local(self) -> Fields:
        k, control = self._parts.navigator.k, self._parts.navigator.control
        head = {"time_boot_ms": self.clock.boot_ms, "coordinate_frame": 1, "type_mask": 63 if self.state.landed else 0}
        if self.state.landed:
            return head | dict.fromkeys(("x", "y", "z", "vx", "vy", "vz"), math.nan) | {"afz": 100.0}
        x, y, z = control.goal_m[k].tolist()
        vx, vy, vz = control.velocity_feed_m_s[k].tolist()
        if control.follow[k] == SetpointKind.VELOCITY:
            x = y = math.nan
        z = z if control.hold_z[k] else math.nan
        return head | {"x": y, "y": x, "z": -z, "vx": vy, "vy": vx, "vz": -vz, "yaw": self.body.yaw_rad}

    def _position_target_global(self) -> Fields | None:
        # As recorded: only in the automatic modes, in the air.
        if not self.state.armed or self.state.landed or self.state.mode >> 16 & 0xFF != AUTO_MAIN:
            return None
        x, y, z = self._parts.navigator.control.goal_m[self._parts.navigator.k].tolist()
        no_velocity = dict.fromkeys(("vx", "vy", "vz"), math.nan)
        head = {"coordinate_frame": 5, "afz": 100.0, "yaw": self.body.yaw_rad}
        return {**head, **no_velocity, **self.global_target((x, y, z))}

    def _vfr_hud(self) -> Fields:
        return {**self.vfr_hud(), "airspeed": math.nan}

    def _extended_sys_state(self) -> Fields:
        phase = self.state.phase
        return {"vtol_state": 0, "landed_state": 3 if phase == Phase.TAKEOFF else LANDED_STATE[phase]}

    def _current_mode(self) -> Fields:
        intended = self._commander.intended
        return {"standard_mode": 0, "custom_mode": self.state.mode, "intended_custom_mode": intended}

    def _estimator_status(self) -> Fields:
        known = self.state.stage >= Stage.HOME_SET and not self._parts.inputs.position_lost
        return {
            "time_usec": self.clock.boot_ms * 1000,
            "flags": 1023 if known else 0xA7,
            "pos_horiz_accuracy": 0.3 if known else 30.0,
            "pos_vert_accuracy": 0.1,
            "tas_ratio": math.nan,
        }

    def _link_node_status(self) -> Fields:
        return {"timestamp": self.clock.boot_ms * 1000, "tx_rate": 22055, "rx_rate": 20}

    def _open_drone_id_location(self) -> Fields:
        lat, lon, amsl_m, relative_m = self.place()
        vx, vy, vz = self.body.velocity_m_s()
        return {
            "id_or_mac": (0,) * 20,
            "status": 1 if self.state.landed else 2,
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

    def _open_drone_id_system(self) -> Fields:
        lat_deg, lon_deg = self.body.to_geodetic(*self.state.home_m[:2])
        return {
            "operator_latitude": round(lat_deg * 1e7),
            "operator_longitude": round(lon_deg * 1e7),
            "operator_altitude_geo": self.state.home_m[2] + self.spec.ground_amsl_m,
            "area_count": 1,
            "area_ceiling": -1000.0,
            "area_floor": -1000.0,
        }

    def _orbit_execution_status(self) -> Fields | None:
        orbit = self._parts.navigator.orbit
        if self.state.mode != ORBIT or orbit is None:
            return None
        lat_deg, lon_deg = self.body.to_geodetic(orbit.x_m, orbit.y_m)
        return {
            "time_usec": self.clock.boot_ms * 1000,
            "radius": orbit.radius_m,
            "frame": 0,
            "x": round(lat_deg * 1e7),
            "y": round(lon_deg * 1e7),
            "z": orbit.z_m + self.spec.ground_amsl_m,
        }

    def _time_estimate(self) -> Fields:
        return {"safe_return": 0, "land": -1, "mission_next_item": -1, "mission_end": -1, "commanded_action": -1}

    def _current_event_sequence(self) -> Fields:
        return {"sequence": self._parts.announcer.log.sequence, "flags": int(self.clock.boot_ms < RESET_S * 1000)}

    def _autopilot_version(self) -> Fields:
        return {
            "capabilities": CAPABILITIES,
            "flight_sw_version": SW_VERSION,
            "middleware_sw_version": SW_VERSION,
            "os_sw_version": 101854463,
            "board_version": 1,
            "flight_custom_version": tuple(self.identity.token),
            "middleware_custom_version": tuple(self.identity.token),
            "uid": int(self.identity.uid[:16], 16),
        }

    def _wind_cov(self) -> Fields | None:
        wind = self.wind_m_s()
        if wind is None:
            return None
        # WIND_COV reports where the wind goes, WIND of ArduCopter where it comes from.
        return {"time_usec": self.clock.boot_ms * 1000, "wind_x": wind[1], "wind_y": wind[0], "var_horiz": 0.1}

    def _component_metadata(self) -> Fields:
        return {"time_boot_ms": self.clock.boot_ms, "file_crc": METADATA_CRC, "uri": METADATA_URI}

    def _component_information(self) -> Fields:
        return {
            "time_boot_ms": self.clock.boot_ms,
            "general_metadata_file_crc": METADATA_CRC,
            "general_metadata_uri": METADATA_URI,
        }

    BUILDERS: ClassVar[dict[str, Callable[[Any], Fields | None]]] = {
        **COMMON_BUILDERS,
        "GIMBAL_DEVICE_ATTITUDE_STATUS": lambda self: self._parts.payload.attitude(),
        "GIMBAL_MANAGER_INFORMATION": lambda self: self._parts.payload.information(),
        "GIMBAL_MANAGER_STATUS": lambda self: self._parts.payload.status(),
        "COMPONENT_INFORMATION": _component_information,
        "COMPONENT_METADATA": _component_metadata,
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
        "MISSION_CURRENT": lambda self: self._commander.mission.fields(),
        "CURRENT_MODE": _current_mode,
        "ESTIMATOR_STATUS": _estimator_status,
        "LINK_NODE_STATUS": _link_node_status,
        "OPEN_DRONE_ID_LOCATION": _open_drone_id_location,
        "OPEN_DRONE_ID_SYSTEM": _open_drone_id_system,
        "ORBIT_EXECUTION_STATUS": _orbit_execution_status,
        "TIME_ESTIMATE_TO_TARGET": _time_estimate,
        "CURRENT_EVENT_SEQUENCE": _current_event_sequence,
        "VIBRATION": lambda self: {"time_usec": self.clock.boot_ms * 1000},
        "PING": lambda self: {"time_usec": self.clock.boot_ms * 1000},
        "PROTOCOL_VERSION": lambda _: {"version": 200, "min_version": 100, "max_version": 200},
        "WIND_COV": _wind_cov,
        "AUTOPILOT_VERSION": _autopilot_version,
    }
