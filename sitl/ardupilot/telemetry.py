"""Messages that ArduCopter reports in its own way."""

import math
from collections.abc import Callable
from typing import Any, ClassVar

from sitl.ardupilot.arming import Arming
from sitl.ardupilot.joystick import RELEASE
from sitl.ardupilot.modes import AUTO, GUIDED, POSITION_CONTROLLED, RETURN_MODES
from sitl.ardupilot.parts import CopterParts
from sitl.common.outbox import Fields
from sitl.common.platform import Platform
from sitl.common.states import Stage
from sitl.common.telemetry import COMMON_BUILDERS, Telemetry

# As the real binary reported them: without PARAM_ENCODE_C_CAST, although it casts.
CAPABILITIES = 64495
FLIGHT_SW_VERSION = 0x04070000
MISSING = 65535
"""A field without a value."""
# SITL's default sticks: the throttle is at the bottom, which LOITER and others read.
RC_NEUTRAL_US, RC_DOWN_US = 1500, 1000

_BREACH_TYPES = {1: 2, 8: 1, 2: 3, 4: 3}
"""FENCE_BREACH by FENCE_TYPE: highest, lowest, boundary."""

# SYS_STATUS bits as recorded; the base values are those of a booted vehicle without GPS.
_PRESENT, _ENABLED, _HEALTH = 1399979023, 1380031503, 1196530703
_BIT_GPS, _BITS_POSITION_CONTROL, _BIT_AHRS = 0x20, 0x6000, 0x200000
_BIT_FENCE, _BIT_LOGGING, _BIT_PREARM = 0x100000, 0x1000000, 0x10000000

_EKF_FLAGS: dict[Stage, int] = {Stage.EKF_ACTIVE: 0}
# EKF_STATUS_REPORT.flags as seen on the real binary, from boot to a lost GPS.
_EKF_UNINITIALISED, _EKF_ALIGNED, _EKF_READY, _EKF_LOST = 1024, 167, 831, 0x25


class CopterTelemetry(Telemetry):
    """Reports the state of one ArduCopter."""

    def __init__(self, platform: Platform, parts: CopterParts, arming: Arming) -> None:
        super().__init__(platform)
        self._parts, self._arming = parts, arming

    def _heartbeat(self) -> Fields:
        state, booting = self.state, self.state.stage < Stage.READY
        # A motor test looks like an armed vehicle to stations: they must not take it for one that flies.
        looks_armed = state.armed or self._parts.calibration.motors_turn
        base_mode = 0x51 | (0x80 if looks_armed else 0)
        # As recorded: the GUIDED_ENABLED bit is set while booting, too.
        if state.mode in POSITION_CONTROLLED or booting or (state.armed and state.mode in {*RETURN_MODES, AUTO}):
            base_mode |= 0x08
        status = 1 if booting else 5 if state.failsafes else 3 if state.landed else 4
        return {
            "type": 2,
            "autopilot": 3,
            "base_mode": base_mode,
            "custom_mode": state.mode,
            "system_status": status,
            "mavlink_version": 3,
        }

    def _sys_status(self) -> Fields:
        fence = self._parts.fence
        present, enabled, health = _PRESENT, _ENABLED, _HEALTH
        if self.state.mode in POSITION_CONTROLLED or not self.state.landed:
            enabled |= _BITS_POSITION_CONTROL
            health |= _BITS_POSITION_CONTROL
        if self.state.stage >= Stage.GPS_FOUND:
            present, enabled, health = present | _BIT_GPS, enabled | _BIT_GPS, health | _BIT_GPS
        if self.state.stage >= Stage.HOME_SET:
            enabled, health = enabled | _BIT_AHRS, health | _BIT_AHRS
        if fence.is_on:
            present, enabled = present | _BIT_FENCE, enabled | _BIT_FENCE
            health = health & ~_BIT_FENCE if fence.breached else health | _BIT_FENCE
        if self.state.armed:
            enabled |= _BIT_LOGGING
        if self.state.armed or self._arming.checks_passed():
            health |= _BIT_PREARM
        return {
            "onboard_control_sensors_present": present,
            "onboard_control_sensors_enabled": enabled,
            "onboard_control_sensors_health": health,
            "voltage_battery": round(self._parts.battery.voltage_v * 1000),
            "current_battery": round(self.state.current_a * 100),
            "battery_remaining": self._parts.battery.percent,
        }

    def _battery_status(self) -> Fields:
        return {
            "temperature": 32767,
            "voltages": (round(self._parts.battery.voltage_v * 1000), *(MISSING,) * 9),
            "current_battery": round(self.state.current_a * 100),
            "current_consumed": round(self._parts.battery.consumed_mah),
            "energy_consumed": round(self._parts.battery.consumed_mah * 36.0 * self._parts.battery.voltage_v / 1e3),
            "battery_remaining": self._parts.battery.percent,
            "charge_state": 1 + self._parts.battery.level,
        }

    def _gps_raw_int(self) -> Fields:
        if self.state.stage < Stage.GPS_FIX or self.state.gps_lost_us is not None:
            return {"fix_type": 1 if self.state.stage >= Stage.GPS_FOUND else 0, "eph": 65535, "epv": 65535}
        quality = {"fix_type": 6, "eph": 121, "epv": 200, "h_acc": 300, "v_acc": 300}
        return {"time_usec": self.clock.since_power_on_us, **self.gps_fix(), **quality}

    def _ekf_status_report(self) -> Fields:
        if self._parts.position.lost:
            flags = _EKF_LOST
        elif self.state.stage >= Stage.POSITION_OK:
            flags = _EKF_READY
        elif self.state.stage >= Stage.EKF_ALIGNED:
            flags = _EKF_ALIGNED
        else:
            flags = _EKF_FLAGS.get(self.state.stage, _EKF_UNINITIALISED)
        return {"flags": flags}

    def _position_target(self) -> Fields | None:
        if self.state.mode != GUIDED or self._parts.guided.shown_target_m is None:
            return None
        return {"coordinate_frame": 0, "type_mask": 0xFDF8, **self.global_target(self._parts.guided.shown_target_m)}

    def _rc_channels(self) -> Fields:
        """Return RC_CHANNELS: SITL's receiver has its throttle stick down, and a joystick overrides it."""
        sticks = [RC_NEUTRAL_US, RC_NEUTRAL_US, RC_DOWN_US, RC_NEUTRAL_US]
        x, y, z, r = self._parts.joystick.shown
        for channel, value, up in ((0, y, 0.5), (1, -x if x != RELEASE else x, 0.5), (3, r, 0.5)):
            if value != RELEASE:
                sticks[channel] = RC_NEUTRAL_US + round(value * up)
        if z != RELEASE:
            sticks[2] = RC_DOWN_US + z
        fields: Fields = {f"chan{n}_raw": 0 for n in range(1, 19)}
        fields |= {f"chan{n}_raw": RC_NEUTRAL_US for n in range(5, 9)} | {
            f"chan{n + 1}_raw": v for n, v in enumerate(sticks)
        }
        return fields | {"time_boot_ms": self.clock.boot_ms, "chancount": 16, "rssi": 255}

    def _servo_output_raw(self) -> Fields:
        level = 1500 if not self.state.landed else 1000
        outputs = dict.fromkeys(range(1, 5), level) | self._parts.calibration.motor_test.outputs_us()
        return {"time_usec": self.clock.boot_ms * 1000, **{f"servo{n}_raw": value for n, value in outputs.items()}}

    def _fence_status(self) -> Fields | None:
        fence = self._parts.fence
        if not fence.is_on:
            return None
        kind = next((shown for bit, shown in _BREACH_TYPES.items() if fence.breached & bit), 0)
        return {"breach_status": int(bool(fence.breached)), "breach_count": fence.breaches, "breach_type": kind}

    def _wind(self) -> Fields:
        wind = self.wind_m_s()
        if wind is None:
            return {}
        # WIND reports where the wind comes from, WIND_COV of PX4 where it goes.
        east, north = wind
        return {"direction": math.degrees(math.atan2(-east, -north)), "speed": math.hypot(east, north)}

    def _autopilot_version(self) -> Fields:
        return {
            "capabilities": CAPABILITIES,
            "flight_sw_version": FLIGHT_SW_VERSION,
            "flight_custom_version": tuple(self.identity.token),
            "uid2": (*self.identity.uid.encode("ascii")[:17], 0),
        }

    BUILDERS: ClassVar[dict[str, Callable[[Any], Fields | None]]] = {
        **COMMON_BUILDERS,
        "ADSB_VEHICLE": lambda self: self._parts.traffic.next_aircraft(),
        "CAMERA_INFORMATION": lambda self: self._parts.payload.camera(),
        "GIMBAL_DEVICE_ATTITUDE_STATUS": lambda self: self._parts.payload.attitude(),
        "GIMBAL_MANAGER_INFORMATION": lambda self: self._parts.payload.information(),
        "GIMBAL_MANAGER_STATUS": lambda self: self._parts.payload.status(),
        "OPEN_DRONE_ID_ARM_STATUS": lambda self: self._parts.remote_id.arm_status(),
        "MAG_CAL_PROGRESS": lambda self: self._parts.calibration.mag_cal_progress(),
        "MAG_CAL_REPORT": lambda self: self._parts.calibration.mag_cal_report(),
        "HEARTBEAT": _heartbeat,
        "SYS_STATUS": _sys_status,
        "BATTERY_STATUS": _battery_status,
        "GPS_RAW_INT": _gps_raw_int,
        "EKF_STATUS_REPORT": _ekf_status_report,
        "POSITION_TARGET_GLOBAL_INT": _position_target,
        "MISSION_CURRENT": lambda self: self._parts.auto.fields(),
        "RC_CHANNELS": _rc_channels,
        "SERVO_OUTPUT_RAW": _servo_output_raw,
        "FENCE_STATUS": _fence_status,
        "POWER_STATUS": lambda _: {"Vcc": 5000},
        "MEMINFO": lambda _: {"freemem": MISSING, "freemem32": 131072},
        "VIBRATION": lambda self: {"time_usec": self.clock.boot_ms * 1000},
        "WIND": _wind,
        "AUTOPILOT_VERSION": _autopilot_version,
    }
