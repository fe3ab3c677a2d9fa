"""Logs that vehicles write themselves: ArduPilot's DataFlash logs (.bin) and PX4's ULog (.ulg), as flight points.

`.bin` is read by pymavlink's DFReader, `.ulg` by pyulog, an extra of this package (`pip install "tui-gcs[ulg]"`). Times
are absolute where the log holds a GPS time; else they count from the vehicle's boot, see `has_gps_time`.
"""

import bisect
import contextlib
import io
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tui_gcs.core.mavlink.mode_names import ardupilot_mode_name, px4_nav_state_name
from tui_gcs.core.records.flight_points import FlightPoint, LeftOut, ReportedState

EARLIEST_WALL_S = 946_684_800.0
"""The year 2000: an earlier time counts from the vehicle's boot."""
FIX_3D = 3
ARM_EVENT, DISARM_EVENTS = 10, (11, 12)
"""LogEvent of AP_Logger: armed, disarmed, disarmed automatically."""
READ = ["POS", "GPS", "MODE", "EV", "ARM", "BAT", "ATT"]
"""The messages of an ArduPilot log that are looked at."""
DAMAGED = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, EOFError, struct.error)
"""What a damaged log makes the readers raise."""
ID_PARAMETERS = ("MAV_SYSID", "SYSID_THISMAV")
"""ArduPilot's names for its MAVLink system id; the second one before version 4.7."""
PX4_ARMED = 2
"""vehicle_status.arming_state of PX4."""
Topics = dict[str, dict[str, Any]]
"""The first instance of each topic of a ULog: arrays by field."""


class OnboardLogError(Exception):
    """The log cannot be read: one line without the path."""


@dataclass
class DataFlashPoints:
    """Reads the points of an ArduPilot log: a point for each POS, or for each GPS where the log has no POS."""

    path: Path
    left_out: LeftOut = field(default_factory=LeftOut)

    def __iter__(self) -> Iterator[FlightPoint]:
        """Yield the points. Raises OnboardLogError."""
        log = open_dataflash(self.path)
        with dataflash_errors():
            yield from self._points(log)

    def _points(self, log: Any) -> Iterator[FlightPoint]:
        place = "POS" if any(form.name == "POS" for form in log.formats.values()) else "GPS"
        state, heading_deg = ReportedState(), math.nan
        velocity = (math.nan, math.nan, math.nan)
        while (message := _next(log)) is not None:
            kind = message.get_type()
            if kind == "ATT":
                heading_deg = float(message.Yaw) % 360.0
            elif kind == "BAT":
                state.battery_pct = float(getattr(message, "RemPct", math.nan))
            elif kind == "MODE":
                number = getattr(message, "ModeNum", message.Mode)
                state.mode = ardupilot_mode_name(log.mav_type, int(number)) if _is_number(number) else ""
            elif kind == "ARM":
                state.armed = bool(message.ArmState)
            elif kind == "EV":
                state.armed = True if message.Id == ARM_EVENT else False if message.Id in DISARM_EVENTS else state.armed
            elif kind == "GPS" and getattr(message, "I", 0) == 0:
                velocity = _gps_velocity(message)
            if kind == place and getattr(message, "I", 0) == 0:
                if self._has_place(message):
                    above_m = getattr(message, "RelHomeAlt", getattr(message, "RelAlt", math.nan))
                    yield FlightPoint(
                        float(message._timestamp),
                        system_id(log.params),
                        float(message.Lat),
                        float(message.Lng),
                        float(message.Alt),
                        float(above_m),
                        *velocity,
                        heading_deg,
                        state.mode,
                        state.armed,
                        state.battery_pct,
                    )
                else:
                    self.left_out.without_place += 1

    def _has_place(self, message: Any) -> bool:
        fixed = message.get_type() == "POS" or message.Status >= FIX_3D
        return bool(fixed and (message.Lat or message.Lng) and abs(message.Lat) <= 90 and abs(message.Lng) <= 180)


def open_dataflash(path: Path) -> Any:
    """Return pymavlink's reader of an ArduPilot log. Raises OnboardLogError."""
    from pymavlink.DFReader import DFReader_binary

    with dataflash_errors(), wordless():
        return DFReader_binary(str(path))


@contextlib.contextmanager
def dataflash_errors() -> Iterator[None]:
    """Raise OnboardLogError for what DFReader raises within."""
    try:
        yield
    except OSError as error:
        raise OnboardLogError(error.strerror or "cannot be read") from None
    except Exception as error:
        # DFReader raises plain Exception for a format that it does not know.
        if type(error) is not Exception and not isinstance(error, DAMAGED):
            raise
        raise OnboardLogError(f"not a log of ArduPilot, or damaged ({type(error).__name__})") from None


@contextlib.contextmanager
def wordless() -> Iterator[None]:
    """Drop what a reader prints: a line for each damaged place. Nothing may be yielded meanwhile."""
    with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
        yield


def _next(log: Any) -> Any:
    with wordless():
        return log.recv_match(type=READ)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _gps_velocity(message: Any) -> tuple[float, float, float]:
    """Return (north, east, up) of a GPS message in metres per second."""
    course = math.radians(message.GCrs)
    return message.Spd * math.cos(course), message.Spd * math.sin(course), -float(getattr(message, "VZ", math.nan))


def system_id(params: dict[str, float]) -> int:
    """Return the MAVLink system id of an ArduPilot vehicle with these parameters."""
    return int(next((params[name] for name in ID_PARAMETERS if name in params), 1))


def open_ulog(path: Path) -> Any:
    """Return pyulog's content of a PX4 log, which is in memory then. Raises OnboardLogError."""
    try:
        from pyulog import ULog
        from pyulog.exceptions import ULogException
    except ImportError:
        raise OnboardLogError('logs of PX4 are read by pyulog: pip install "tui-gcs[ulg]"') from None
    try:
        with wordless():
            return ULog(str(path))
    except OSError as error:
        raise OnboardLogError(error.strerror or "cannot be read") from None
    except (*DAMAGED, ULogException) as error:
        raise OnboardLogError(f"not a log of PX4, or damaged ({type(error).__name__})") from None


def first_instances(log: Any) -> Topics:
    """Return the first instance of each topic of a PX4 log."""
    return {data.name: data.data for data in reversed(log.data_list) if data.multi_id == 0}


@dataclass
class ULogPoints:
    """Reads the points of a PX4 log: one for each vehicle_global_position, or for each GPS position without those."""

    path: Path
    left_out: LeftOut = field(default_factory=LeftOut)

    def __iter__(self) -> Iterator[FlightPoint]:
        """Yield the points. Raises OnboardLogError."""
        log = open_ulog(self.path)
        try:
            yield from self._points(first_instances(log), int(log.initial_parameters.get("MAV_SYS_ID", 1)))
        except DAMAGED as error:
            raise OnboardLogError(f"not a log of PX4, or damaged ({type(error).__name__})") from None

    def _points(self, topics: Topics, vehicle: int) -> Iterator[FlightPoint]:
        rows = _global_rows(topics) or _gps_rows(topics)
        offset_s, home_m = time_offset_s(topics), _home_amsl_m(topics)
        local, status = topics.get("vehicle_local_position"), topics.get("vehicle_status")
        battery = topics.get("battery_status")
        for time_us, lat_deg, lon_deg, amsl_m in rows:
            if not (lat_deg or lon_deg) or not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
                self.left_out.without_place += 1
                continue
            north, east, down = (_at(local, time_us, name) for name in ("vx", "vy", "vz"))
            yaw = _at(local, time_us, "heading", "yaw")
            nav_state, arming = _at(status, time_us, "nav_state"), _at(status, time_us, "arming_state")
            yield FlightPoint(
                time_us / 1e6 + offset_s,
                vehicle,
                lat_deg,
                lon_deg,
                amsl_m,
                amsl_m - home_m,
                north,
                east,
                -down,
                math.degrees(yaw) % 360.0,
                px4_nav_state_name(int(nav_state)) if nav_state == nav_state else "",
                arming == PX4_ARMED if arming == arming else None,
                100.0 * _at(battery, time_us, "remaining"),
            )


def _global_rows(topics: Topics) -> list[tuple[int, float, float, float]]:
    """Return (microseconds since boot, degrees, degrees, metres above sea level) of the estimated positions."""
    found = topics.get("vehicle_global_position")
    if found is None:
        return []
    columns = (found["timestamp"], found["lat"], found["lon"], found["alt"])
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _gps_rows(topics: Topics) -> list[tuple[int, float, float, float]]:
    """Return the same of the receiver's positions with a fix. Their units changed with PX4 1.14."""
    found = topics.get("vehicle_gps_position") or topics.get("sensor_gps")
    if found is None:
        return []
    fixed = found["fix_type"] >= FIX_3D
    if "latitude_deg" in found:
        places = (found["latitude_deg"], found["longitude_deg"], found["altitude_msl_m"])
    else:
        places = (found["lat"] / 1e7, found["lon"] / 1e7, found["alt"] / 1e3)
    return list(zip(*(column[fixed].tolist() for column in (found["timestamp"], *places)), strict=True))


def time_offset_s(topics: Topics) -> float:
    """Return what is added to a time since boot for the seconds since 1970; 0 where the log does not say."""
    found = topics.get("vehicle_gps_position") or topics.get("sensor_gps")
    if found is None or "time_utc_usec" not in found:
        return 0.0
    pairs = zip(found["timestamp"].tolist(), found["time_utc_usec"].tolist(), strict=True)
    known = [(utc_us - boot_us) / 1e6 for boot_us, utc_us in pairs if utc_us / 1e6 > EARLIEST_WALL_S]
    return known[-1] if known else 0.0


def _home_amsl_m(topics: Topics) -> float:
    found = topics.get("home_position")
    return float(found["alt"][-1]) if found is not None and len(found["alt"]) else math.nan


def _at(topic: dict[str, Any] | None, time_us: int, *names: str) -> float:
    """Return the newest value of a topic at a time, by the first of the names that it has; NaN if there is none."""
    name = next((name for name in names if topic is not None and name in topic), None)
    if topic is None or name is None:
        return math.nan
    index = bisect.bisect_right(topic["timestamp"], time_us) - 1
    return float(topic[name][index]) if index >= 0 else math.nan


def has_gps_time(point: FlightPoint) -> bool:
    """Return whether its time is absolute, not since the vehicle's boot."""
    return point.wall_s >= EARLIEST_WALL_S
