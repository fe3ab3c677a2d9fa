"""Messages that both autopilots report alike, and the table from which each autopilot reports.

A builder returns the field values of one message, or None when there is nothing to report yet.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from sitl.common.outbox import Fields
from sitl.common.platform import Platform
from sitl.common.states import LANDED_STATE, Stage
from sitl.links.wire import LAYOUTS
from sitl.physics.point_masses import Point
from sitl.physics.quantities import GRAVITY_M_S2

HOVER_THROTTLE_PERCENT = 36


class Telemetry:
    """Reports the state of one vehicle, message by message."""

    BUILDERS: ClassVar[Mapping[str, Callable[[Any], Fields | None]]]
    """The builder of every message that the autopilot can report."""
    AT_ANY_STAGE: ClassVar[frozenset[str]] = frozenset({"HEARTBEAT", "AUTOPILOT_VERSION"})
    """Messages that exist before the autopilot has booted."""

    def __init__(self, platform: Platform) -> None:
        self.spec, self.clock, self.body, self.state = platform.spec, platform.clock, platform.body, platform.state
        self.identity = platform.identity
        self._streams, self._send = platform.streams, platform.outbox.send

    def report(self, name: str) -> bool:
        """Send message `name` now; False if there is nothing to send."""
        if self.state.stage < Stage.READY and name not in self.AT_ANY_STAGE:
            return False
        fields = self.BUILDERS[name](self)
        if fields is None:
            return False
        self._send(name, **fields)
        return True

    def name_of(self, msgid: int) -> str | None:
        """Return the name of a message that the autopilot can report; None for all others."""
        layout = LAYOUTS.get(msgid)
        return layout.name if layout is not None and layout.name in self.BUILDERS else None

    def place(self) -> tuple[int, int, float, float]:
        """Return latitude and longitude in 1e-7 degrees, altitude AMSL and above home in metres."""
        x, y, z = self.body.seen_m()
        lat_deg, lon_deg = self.body.to_geodetic(x, y)
        return round(lat_deg * 1e7), round(lon_deg * 1e7), z + self.spec.ground_amsl_m, z - self.state.home_m[2]

    def gps_fix(self) -> Fields:
        """Return the fields of GPS_RAW_INT that both autopilots report alike."""
        lat, lon, amsl_m, _ = self.place()
        vx, vy, _ = self.body.velocity_m_s()
        return {
            "lat": lat,
            "lon": lon,
            "alt": round(amsl_m * 1000),
            "alt_ellipsoid": round(amsl_m * 1000),
            "vel": round(math.hypot(vx, vy) * 100),
            "cog": course_cdeg(vx, vy),
            "satellites_visible": 10,
        }

    def global_target(self, place_m: Point) -> Fields:
        """Return the fields of POSITION_TARGET_GLOBAL_INT that name the place."""
        lat_deg, lon_deg = self.body.to_geodetic(place_m[0], place_m[1])
        return {
            "time_boot_ms": self.clock.boot_ms,
            "lat_int": round(lat_deg * 1e7),
            "lon_int": round(lon_deg * 1e7),
            "alt": place_m[2] + self.spec.ground_amsl_m,
        }

    def report_interval(self, msgid: int) -> None:
        """Send the MESSAGE_INTERVAL of a message: 0 if the autopilot does not have it, -1 if it is not sent."""
        name = self.name_of(msgid)
        interval_us = 0 if name is None else self._streams.interval_ms(name) * 1000 or -1
        # MESSAGE_INTERVAL has 16 bits for an id of 24.
        self._send("MESSAGE_INTERVAL", message_id=msgid & 0xFFFF, interval_us=interval_us)

    def heading_cdeg(self) -> int:
        """Return the heading of the nose in centidegrees."""
        return round(math.degrees(self.body.yaw_rad) * 100) % 36000

    def ground_speed(self, east_m_s: float, north_m_s: float) -> tuple[float, float]:
        """Return speed over ground in m/s, and course in degrees."""
        return math.hypot(east_m_s, north_m_s), math.degrees(math.atan2(east_m_s, north_m_s)) % 360.0

    def attitude(self) -> Fields:
        """Return ATTITUDE: the vehicle leans as it accelerates."""
        east, north, _ = self.body.accel_m_s2()
        yaw = self.body.yaw_rad
        forward = east * math.sin(yaw) + north * math.cos(yaw)
        right = east * math.cos(yaw) - north * math.sin(yaw)
        return {
            "time_boot_ms": self.clock.boot_ms,
            "roll": math.remainder(math.atan(right / GRAVITY_M_S2) + self.body.tumble_rad, 2.0 * math.pi),
            "pitch": -math.atan(forward / GRAVITY_M_S2),
            "yaw": yaw - 2.0 * math.pi if yaw > math.pi else yaw,
        }

    def wind_m_s(self) -> tuple[float, float] | None:
        """Return the wind (east, north) as an estimator has learned it; None in calm air and before the flight."""
        weather = self.body.masses.weather
        # An estimator learns the wind from how the vehicle leans: on the ground it leans on its legs.
        if self.state.landed or not weather.windy:
            return None
        east, north = (weather.wind_m_s - weather.surprise_m_s)[self.body.index].tolist()
        return east, north

    def vfr_hud(self) -> Fields:
        """Return the fields of VFR_HUD."""
        vx, vy, vz = self.body.velocity_m_s()
        speed = math.hypot(vx, vy)
        return {
            "airspeed": speed,
            "groundspeed": speed,
            "alt": self.place()[2] if self.state.stage >= Stage.HOME_SET else 0.0,
            "climb": vz,
            "heading": self.heading_cdeg() // 100,
            "throttle": 0 if self.state.landed else HOVER_THROTTLE_PERCENT,
        }

    def _system_time(self) -> Fields:
        # Before its GPS has a fix an autopilot does not know the date, and reports 0.
        unix_us = self.spec.unix_epoch_us + self.clock.now_us if self.state.stage >= Stage.GPS_FIX else 0
        return {"time_unix_usec": unix_us, "time_boot_ms": self.clock.boot_ms}

    def _global_position_int(self) -> Fields:
        if self.state.stage < Stage.HOME_SET:
            return {"time_boot_ms": self.clock.boot_ms, "hdg": self.heading_cdeg()}
        lat, lon, amsl_m, relative_m = self.place()
        vx, vy, vz = self.body.velocity_m_s()
        return {
            "time_boot_ms": self.clock.boot_ms,
            "lat": lat,
            "lon": lon,
            "alt": round(amsl_m * 1000),
            "relative_alt": round(relative_m * 1000),
            "vx": round(vy * 100),
            "vy": round(vx * 100),
            "vz": round(-vz * 100),
            "hdg": self.heading_cdeg(),
        }

    def _local_position_ned(self) -> Fields | None:
        if self.state.stage < Stage.POSITION_OK:
            return None
        x, y, z = self.body.seen_m()
        vx, vy, vz = self.body.velocity_m_s()
        return {"time_boot_ms": self.clock.boot_ms, "x": y, "y": x, "z": -z, "vx": vy, "vy": vx, "vz": -vz}

    def _extended_sys_state(self) -> Fields:
        return {"vtol_state": 3, "landed_state": LANDED_STATE[self.state.phase]}

    def _home_position(self) -> Fields | None:
        if self.state.stage < Stage.HOME_SET:
            return None
        x, y, z = self.state.home_m
        lat_deg, lon_deg = self.body.to_geodetic(x, y)
        return {
            "latitude": round(lat_deg * 1e7),
            "longitude": round(lon_deg * 1e7),
            "altitude": round((z + self.spec.ground_amsl_m) * 1000),
            "x": y,
            "y": x,
            "z": -z,
            "q": (math.nan,) * 4,
            "time_usec": self.clock.since_power_on_us,
        }

    def _gps_global_origin(self) -> Fields | None:
        if self.state.stage < Stage.HOME_SET:
            return None
        return {
            "latitude": round(self.spec.lat_deg * 1e7),
            "longitude": round(self.spec.lon_deg * 1e7),
            "altitude": round(self.spec.ground_amsl_m * 1000),
            "time_usec": self.clock.since_power_on_us,
        }


def course_cdeg(vx: float, vy: float) -> int:
    """Return the direction of travel in centidegrees."""
    return round(math.degrees(math.atan2(vx, vy)) * 100) % 36000


COMMON_BUILDERS: dict[str, Callable[[Telemetry], Fields | None]] = {
    "SYSTEM_TIME": Telemetry._system_time,
    "ATTITUDE": Telemetry.attitude,
    "GLOBAL_POSITION_INT": Telemetry._global_position_int,
    "LOCAL_POSITION_NED": Telemetry._local_position_ned,
    "VFR_HUD": Telemetry.vfr_hud,
    "EXTENDED_SYS_STATE": Telemetry._extended_sys_state,
    "HOME_POSITION": Telemetry._home_position,
    "GPS_GLOBAL_ORIGIN": Telemetry._gps_global_origin,
}
