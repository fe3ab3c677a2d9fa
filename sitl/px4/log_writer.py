"""What a PX4 writes into its log: its texts, its mode, and twice a second where it is and how it stands."""

import math

from sitl.common import ulog
from sitl.common.logs import Log
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Stage
from sitl.px4 import modes
from sitl.px4.commander import Commander
from sitl.px4.parts import Px4Parts
from sitl.px4.telemetry import Px4Telemetry

SAMPLE_US = 500_000
"""A vehicle writes ten times as often; a log here is read for what happened, and costs less."""
NAV_STATES = {
    modes.MANUAL: 0,
    modes.ALTCTL: 1,
    modes.POSCTL: 2,
    modes.MISSION: 3,
    modes.HOLD: 4,
    modes.RTL: 5,
    modes.ACRO: 10,
    modes.TERMINATION: 13,
    modes.OFFBOARD: 14,
    modes.STABILIZED: 15,
    modes.TAKEOFF: 17,
    modes.LAND: 18,
    modes.FOLLOW: 19,
    modes.PRECLAND: 20,
    modes.ORBIT: 21,
}
"""vehicle_status.nav_state of PX4 1.17 for HEARTBEAT.custom_mode."""
DISARMED, ARMED = 1, 2
"""vehicle_status.arming_state."""
GPS_FIX_3D, SATELLITES = 3, 10


class Px4LogWriter(Part):
    """Writes into the log that is open, from the boot to four seconds after the disarming."""

    def __init__(self, platform: Platform, parts: Px4Parts, commander: Commander, telemetry: Px4Telemetry) -> None:
        super().__init__(platform)
        self._battery, self._commander, self._telemetry = parts.battery, commander, telemetry
        parts.announcer.on_text = self._text
        self._log: Log | None = None
        self._status: tuple[int, int, int] | None = None
        self._sample_us = 0

    def watch(self) -> None:
        """Write what has changed since the last tick, and twice a second where the vehicle is."""
        log = self._logs.written_at(self._clock.now_us)
        if log is None:
            return
        if log is not self._log:
            self._log, self._status = log, None
        state = self._state
        arming = ARMED if state.armed else DISARMED
        status = NAV_STATES.get(state.mode, NAV_STATES[modes.HOLD]), arming, int(self._commander.failsafe is not None)
        if status != self._status:
            self._status = status
            self._write("vehicle_status", *status)
        if self._clock.now_us >= self._sample_us and state.stage >= Stage.HOME_SET:
            self._sample_us = self._clock.now_us + SAMPLE_US
            self._sample()

    def _text(self, severity: MavSeverity, words: str) -> None:
        if self._log is not None and self._logs.written_at(self._clock.now_us) is self._log:
            record = ulog.text(int(severity), self._clock.since_power_on_us, words)
            self._log.record(record, self._clock.now_us)

    def _write(self, topic: str, *values: float) -> None:
        if self._log is not None:
            self._log.record(ulog.data(topic, self._clock.since_power_on_us, *values), self._clock.now_us)

    def _sample(self) -> None:
        lat, lon, amsl_m, above_home_m = self._telemetry.place()
        lat_deg, lon_deg = lat / 1e7, lon / 1e7
        x_m, y_m, _ = self._body.seen_m()
        east, north, up = self._body.velocity_m_s()
        yaw = math.remainder(self._body.yaw_rad, math.tau)
        utc_us = self._spec.unix_epoch_us + self._clock.now_us
        home_lat_deg, home_lon_deg = self._body.to_geodetic(*self._state.home_m[:2])
        origin = self._body.to_geodetic(0.0, 0.0)
        self._write("vehicle_global_position", lat_deg, lon_deg, amsl_m)
        place = (y_m, x_m, self._spec.ground_amsl_m - amsl_m, north, east, -up, yaw)
        self._write("vehicle_local_position", *place, *origin, self._spec.ground_amsl_m)
        self._write("vehicle_attitude", math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        self._write("vehicle_gps_position", utc_us, lat_deg, lon_deg, amsl_m, GPS_FIX_3D, SATELLITES)
        self._write("battery_status", self._telemetry.voltage_mv() / 1000, self._battery.charge)
        self._write("home_position", home_lat_deg, home_lon_deg, amsl_m - above_home_m)
