"""What an ArduCopter writes into its log: texts, modes, arming, failsafes, and once a second where it is."""

from sitl.ardupilot.battery import CopterBattery
from sitl.common.dataflash import gps_time, message
from sitl.common.logs import Log
from sitl.common.platform import Part, Platform
from sitl.common.states import Stage
from sitl.common.telemetry import Telemetry

SAMPLE_US = 1_000_000
"""A vehicle writes ten times as often; a log here is read for what happened, and costs less."""
_SUBSYSTEMS = {"battery": 6, "gcs": 8, "ekf": 17}
"""LogErrorSubsystem of AP_Logger for the names in `FlightState.failsafes`."""
OCCURRED, RESOLVED = 1, 0


class LogWriter(Part):
    """Writes into the log of the flight, while there is one."""

    def __init__(self, platform: Platform, battery: CopterBattery, telemetry: Telemetry) -> None:
        super().__init__(platform)
        self._battery, self._telemetry = battery, telemetry
        self._log: Log | None = None
        self._mode, self._armed = -1, False
        self._failsafes: frozenset[str] = frozenset()
        self._sample_us = 0
        platform.outbox.on_text = self._text

    def watch(self) -> None:
        """Write what has changed since the last tick, and once a second where the vehicle is."""
        now_us, state = self._clock.now_us, self._state
        log = self._logs.written_at(now_us)
        if log is None:
            return
        if log is not self._log:
            self._begin(log)
        if state.armed != self._armed:
            self._armed = state.armed
            self._write("ARM", int(state.armed), 0, 0, 0)
        if state.mode != self._mode:
            self._mode = state.mode
            self._write("MODE", state.mode, state.mode, 2)
        failsafes = frozenset(state.failsafes)
        for name in sorted(failsafes ^ self._failsafes):
            if name in _SUBSYSTEMS:
                self._write("ERR", _SUBSYSTEMS[name], OCCURRED if name in failsafes else RESOLVED)
        self._failsafes = failsafes
        if now_us >= self._sample_us and state.stage >= Stage.HOME_SET:
            self._sample_us = now_us + SAMPLE_US
            self._sample(log)

    def _begin(self, log: Log) -> None:
        self._log, self._mode, self._armed, self._failsafes = log, -1, False, frozenset()
        self._write("PARM", b"MAV_SYSID", float(self._spec.system_id))
        self._text("ArduCopter V4.7.0-dev (cef8bcef)")

    def _text(self, text: str) -> None:
        if self._log is not None and self._logs.written_at(self._clock.now_us) is self._log:
            self._write("MSG", text.encode()[:64])

    def _write(self, name: str, *values: float | bytes) -> None:
        if self._log is not None:
            now_us = self._clock.now_us
            self._log.record(message(name, self._clock.since_power_on_us, *values), now_us)

    def _sample(self, log: Log) -> None:
        time_us = self._clock.since_power_on_us
        lat, lon, amsl_m, relative_m = self._telemetry.place()
        east, north, up = self._body.velocity_m_s()
        gps_ms, week = gps_time(self._spec.unix_epoch_us + self._clock.now_us)
        heading_deg = self._telemetry.heading_cdeg() / 100.0
        speed, course_deg = self._telemetry.ground_speed(east, north)
        gps = (0, 3, gps_ms, week, 10, 120, lat, lon, round(amsl_m * 100), speed, course_deg, -up, heading_deg)
        log.record(
            b"".join(
                (
                    message("GPS", time_us, *gps),
                    message("POS", time_us, lat, lon, amsl_m, relative_m, relative_m),
                    message("ATT", time_us, 0.0, 0.0, heading_deg),
                    message("BAT", time_us, 0, self._battery.voltage_v, self._state.current_a, self._battery.percent),
                )
            ),
            self._clock.now_us,
        )
