"""Telemetry: decodes messages into a vehicle's telemetry record and checks every number once, here.

What is not finite or not plausible is shown as unknown and counted (docs/threats.md B.6-100…107). Messages arrive as
slots, which hold the newest frame; it is decoded here only.
"""

import math
import struct
from collections.abc import Callable, Iterable
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.fleet.identity.boot_clock import TOLERANCE_MS, BootTimeResult
from tui_gcs.core.fleet.integrity import home_check
from tui_gcs.core.fleet.integrity.position_error import GPS2_RAW, WARNING_M, receiver_distance_m, reported_error_m
from tui_gcs.core.fleet.vehicle import NAN, POSITION_AT, POSITION_BYTES, Vehicle, position_frame
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.mavlink import high_latency
from tui_gcs.core.mavlink.enum_names import FLAG_ARMED
from tui_gcs.core.mavlink.frames import MAGIC_V2
from tui_gcs.core.mavlink.sources import Slot
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT, WARNING, EventLog

MAX_SPEED_M_S = 150.0
"""A faster move between two positions is a jump, not flight."""
MIN_CONSISTENT_FIXES = 3
"""After a jump this many consistent positions are needed (docs/threats.md B.6-100)."""
MIN_FLICKERS, FLICKER_WINDOW_S = 4, 2.0
"""Four changes of the armed bit within 2 s are a fault: the vehicle is taken as armed (docs/threats.md B.6-104)."""
HIGH_LATENCY_AFTER_S = 3.0
"""HIGH_LATENCY2 fills in only what the normal streams have not brought for this long (docs/threats.md B.6-107)."""

MAX_SATELLITE_DELAY_MS = 600_000
"""A boot time farther behind than this did not take a satellite link: it is another boot clock."""

MAX_UNCHECKED_STEP_M2 = 20.0**2
"""Square of a step from a good position that needs no further check: 20 m; 20 Hz at 150 m/s are less."""
DELAY_WARNING_INTERVAL_S = 30.0
"""Delayed positions are reported at most this often."""
_PLACE = struct.Struct("<Iii4xi").unpack_from
"""Boot time, latitude, longitude and height above home of a GLOBAL_POSITION_INT payload."""
PREARM_CHECK = 0x10000000
"""MAV_SYS_STATUS_PREARM_CHECK."""
NO_CELL_MV = 65535
"""Value of BATTERY_STATUS.voltages for a cell that does not exist."""
NO_CELLS = b"\xff" * 18
"""Cells 2 to 10 of a BATTERY_STATUS that reports one voltage only, as ArduPilot's does."""

USED_RESULTS = (BootTimeResult.CONTINUES, BootTimeResult.REBOOT)
"""Positions with these boot times are used."""

CheckBootTime = Callable[[Vehicle, int, float], BootTimeResult]
Handler = Callable[[Slot, float], None]


def struct_reader(layout: str) -> Callable[[Slot], tuple[Any, ...]]:
    """Return a function that reads some of the first fields of a slot's newest frame.

    `layout` is as for `struct`, in wire order, with "x" for each byte that is not needed: what a handler does not use
    is not decoded. Fields that the frame does not bring are zero (see `mavlink.dialect.payload_values`).
    """
    made = struct.Struct("<" + layout)
    size, unpack_from = made.size, made.unpack_from

    def values(slot: Slot) -> tuple[Any, ...]:
        raw = slot.raw
        if raw[1] >= size and raw[0] == MAGIC_V2:
            return unpack_from(raw, 10)
        start = 10 if raw[0] == MAGIC_V2 else 6
        return unpack_from(raw[start : start + raw[1]].ljust(size, b"\0"))

    return values


_HEARTBEAT = struct_reader("IBBBB")
_GPS = struct_reader("20xH6xBB4xI")
_SYS_STATUS = struct_reader("8xI2xH14xb")
_BATTERY = struct_reader("10xH18s2xB2xb")
_CELLS = struct.Struct("<9H").unpack
_EXTENDED_STATE = struct_reader("xB")


class TelemetryDecoder:
    """Decodes messages into vehicles' telemetry records. `frame` converts degrees into the scenario's ENU metres."""

    def __init__(
        self,
        clock: Clock,
        events: EventLog,
        frame: LocalFrame,
        dropped: RejectionCounter,
        check_boot_time: CheckBootTime,
    ) -> None:
        """Refused values are counted in `dropped`; `check_boot_time` checks the boot time of every position."""
        self._set_frame(frame)
        self._events = events
        self._dropped = dropped
        self._check_boot_time = check_boot_time
        self.newest: dict[int, Handler] = {
            33: self._position,  # GLOBAL_POSITION_INT
            24: self._gps,  # GPS_RAW_INT
            1: self._sys_status,  # SYS_STATUS
            245: self._extended_state,  # EXTENDED_SYS_STATE
            242: self._home,  # HOME_POSITION
        }
        """Handlers by message id, for messages of which only the newest counts: called when the station ticks."""
        self.every: dict[int, Handler] = {
            0: self._heartbeat,  # HEARTBEAT
            147: self._battery,  # BATTERY_STATUS
            235: self._high_latency,  # HIGH_LATENCY2
        }
        """Handlers by message id, for messages of which each one counts."""

    def reframe(self, frame: LocalFrame, vehicles: list[Vehicle]) -> None:
        """Use another ENU frame: positions and homes are computed anew."""
        before = self.frame
        self._set_frame(frame)
        for vehicle in vehicles:
            if vehicle.telemetry.has_position():
                x, y = frame.to_enu(vehicle.telemetry.lat_deg, vehicle.telemetry.lon_deg)
                vehicle.telemetry.position_m = (float(x), float(y), vehicle.telemetry.alt_rel_m)
            if vehicle.telemetry.home_m is not None:
                x, y = frame.to_enu(*before.to_geodetic(vehicle.telemetry.home_m[0], vehicle.telemetry.home_m[1]))
                vehicle.telemetry.home_m = (float(x), float(y), 0.0)

    def _set_frame(self, frame: LocalFrame) -> None:
        self.frame = frame
        self._lat_deg, self._lon_deg = frame.origin.lat_deg, frame.origin.lon_deg
        self._east_m, self._north_m = frame.east_m_per_deg, frame.north_m_per_deg

    def _position(self, slot: Slot, now: float) -> None:
        """Take GLOBAL_POSITION_INT, a quarter of all traffic: no calls on the path of one that follows the last."""
        vehicle: Vehicle = slot.owner
        telemetry = vehicle.telemetry
        raw = slot.raw
        if raw[1] < POSITION_BYTES or raw[0] != MAGIC_V2:
            raw = position_frame(slot.values())
        boot_ms, lat, lon, alt_rel_mm = _PLACE(raw, 10)
        boot = vehicle.path.boot_clock
        if 0 < boot_ms - boot.boot_ms <= TOLERANCE_MS:
            boot.boot_ms, boot.at_s = boot_ms, now
        # The boot time did not change: a copy, or a clock that stands still.
        elif boot_ms == boot.boot_ms:
            if raw[POSITION_AT] == telemetry.position_raw[POSITION_AT]:
                self._dropped["repeated position"] += 1
                return
        elif self._check_boot_time(vehicle, boot_ms, now) not in USED_RESULTS:
            self._dropped["late position"] += 1
            return
        # The same as LocalFrame.to_enu, without the call. Dividing two integers is the faster division.
        x = (lon / 10_000_000 - self._lon_deg) * self._east_m
        y = (lat / 10_000_000 - self._lat_deg) * self._north_m
        before_x, before_y, _ = telemetry.position_m
        step_x, step_y = x - before_x, y - before_y
        if step_x * step_x + step_y * step_y < MAX_UNCHECKED_STEP_M2 and not vehicle.integrity.suspect_jumps:
            place = (x, y, alt_rel_mm / 1000)
        else:
            if not self._is_place(vehicle, lat / 1e7, lon / 1e7):
                return
            x, y = self.frame.to_enu(lat / 1e7, lon / 1e7)
            place = (x, y, alt_rel_mm / 1000)
            if telemetry.has_position() and self._is_jump(vehicle, place, now):
                self._dropped["implausible position"] += 1
                return
        telemetry.position_raw = raw
        telemetry.position_m = place
        telemetry.position_s = now

    def report_delays(self, vehicles: Iterable[Vehicle], now: float) -> None:
        """Report positions that arrive late; to be called once a second.

        A modem that buffers delivers old positions, each of which looks new. It is reported and no more: a simulator on
        a loaded machine looks the same, so freshness stays the time of arrival (docs/architecture.md).
        """
        for vehicle in vehicles:
            boot = vehicle.path.boot_clock
            late_s = boot.measure_delay()
            if late_s and vehicle.identity.confirmed and now - boot.reported_s >= DELAY_WARNING_INTERVAL_S:
                boot.reported_s = now
                text = f"positions come {late_s:.0f} s late, or its clock runs slow"
                self._events.report(EventClass.CONNECTION, _name(vehicle), text, WARNING)

    def _is_place(self, vehicle: Vehicle, lat_deg: float, lon_deg: float) -> bool:
        if lat_deg == 0 and lon_deg == 0 and not vehicle.telemetry.has_position():
            # ArduCopter and PX4 send 0,0 from power-up to their first fix: every fleet does, and it is no fault.
            self._dropped["position before its first fix"] += 1
            return False
        if (lat_deg == 0 and lon_deg == 0) or abs(lat_deg) > 90 or abs(lon_deg) > 180:
            self._dropped.count("invalid position", vehicle.id)
            return False
        return True

    def _is_jump(self, vehicle: Vehicle, place: tuple[float, float, float], now: float) -> bool:
        """Return whether `place` is farther from the last position than flight allows, and is not confirmed yet."""
        reach_m = 50.0 + MAX_SPEED_M_S * max(0.0, now - vehicle.telemetry.position_s)
        if math.dist(place, vehicle.telemetry.position_m) <= reach_m:
            vehicle.integrity.suspect_jumps = 0
            return False
        # A jump that stays is believed after enough consistent positions (docs/threats.md B.6-100).
        consistent = vehicle.integrity.suspect_jumps > 0 and math.dist(place, vehicle.integrity.suspect_m) <= reach_m
        vehicle.integrity.suspect_jumps = vehicle.integrity.suspect_jumps + 1 if consistent else 1
        vehicle.integrity.suspect_m = place
        text = "position jumped: not used until confirmed"
        self._events.report(EventClass.SENSOR, _name(vehicle), text, WARNING, every_s=10)
        return vehicle.integrity.suspect_jumps <= MIN_CONSISTENT_FIXES

    def _gps(self, slot: Slot, now: float) -> None:
        vehicle: Vehicle = slot.owner
        eph, fix_type, satellites, h_acc = _GPS(slot)
        vehicle.telemetry.gps_fix = fix_type
        vehicle.telemetry.satellites = satellites if satellites != 255 else -1
        error_m, why = reported_error_m(fix_type, eph, h_acc), ""
        if GPS2_RAW in vehicle.path.slots:
            gap_m = receiver_distance_m(vehicle, slot)
            # `not >=` also covers NaN: a receiver that reports no accuracy.
            if gap_m > WARNING_M and not error_m >= gap_m:
                error_m, why = gap_m, f"its GPS receivers are {gap_m:.0f} m apart"
        was_bad = vehicle.integrity.position_error_m > WARNING_M
        vehicle.integrity.position_error_m = error_m
        if error_m > WARNING_M and not was_bad and vehicle.telemetry.armed:
            why = why or ("no GPS fix" if math.isinf(error_m) else f"±{error_m:.0f} m")
            self._events.report(EventClass.SENSOR, _name(vehicle), f"position degraded: {why}", WARNING, every_s=10)

    def _home(self, slot: Slot, now: float) -> None:
        vehicle: Vehicle = slot.owner
        latitude, longitude, altitude_mm = slot.values()[:3]
        if not self._is_place(vehicle, latitude / 1e7, longitude / 1e7):
            return
        x_m, y_m = map(float, self.frame.to_enu(latitude / 1e7, longitude / 1e7))
        why = home_check.refusal(vehicle, x_m, y_m)
        if why:
            self._dropped["implausible home"] += 1
            self._events.report(EventClass.SENSOR, _name(vehicle), why, ALERT, every_s=30)
            # On the ground the home before is no better than the refused one.
            if not vehicle.telemetry.armed:
                vehicle.telemetry.home_m, vehicle.telemetry.home_amsl_m = None, NAN
            return
        text = home_check.change(vehicle, x_m, y_m, altitude_mm / 1e3)
        if text:
            self._events.report(EventClass.SENSOR, _name(vehicle), text, ALERT, every_s=10)
        vehicle.telemetry.home_m, vehicle.telemetry.home_amsl_m = (x_m, y_m, 0.0), altitude_mm / 1e3

    def _heartbeat(self, slot: Slot, now: float) -> None:
        vehicle: Vehicle = slot.owner
        custom_mode, kind, autopilot, base_mode, system_status = _HEARTBEAT(slot)[:5]
        vehicle.heartbeats.add(slot.raw)
        vehicle.telemetry.heartbeat_s = now
        vehicle.autopilot, vehicle.type = autopilot, kind
        vehicle.telemetry.custom_mode = custom_mode
        vehicle.telemetry.system_status = system_status
        self._armed(vehicle, bool(base_mode & FLAG_ARMED), now)

    def _armed(self, vehicle: Vehicle, armed: bool, now: float) -> None:
        """Take the armed bit. While it flickers the vehicle counts as armed: the safe assumption."""
        if armed != vehicle.integrity.armed_bit:
            vehicle.integrity.armed_bit = armed
            vehicle.integrity.flickers_s = [*vehicle.integrity.flickers_s[1 - MIN_FLICKERS :], now]
        vehicle.telemetry.armed = armed
        if (
            len(vehicle.integrity.flickers_s) == MIN_FLICKERS
            and now - vehicle.integrity.flickers_s[0] < FLICKER_WINDOW_S
        ):
            vehicle.telemetry.armed = True
            text = "armed state flickers: taken as armed"
            self._events.report(EventClass.SENSOR, _name(vehicle), text, ALERT, every_s=10)

    def _extended_state(self, slot: Slot, now: float) -> None:
        vehicle: Vehicle = slot.owner
        (vehicle.telemetry.landed_state,) = _EXTENDED_STATE(slot)

    def _sys_status(self, slot: Slot, now: float) -> None:
        vehicle: Vehicle = slot.owner
        health, voltage_mv, percent = _SYS_STATUS(slot)
        vehicle.telemetry.prearm_ok = bool(health & PREARM_CHECK)
        # Once BATTERY_STATUS has come only that counts: the two would alternate.
        if not vehicle.telemetry.has_battery_status:
            self._set_battery(vehicle, _percent(percent))
            vehicle.telemetry.battery_v = _millivolt(voltage_mv)

    def _battery(self, slot: Slot, now: float) -> None:
        vehicle: Vehicle = slot.owner
        first_mv, others, number, percent = _BATTERY(slot)
        # Only the first battery is shown.
        if number != 0:
            return
        vehicle.telemetry.has_battery_status = True
        if percent != vehicle.telemetry.battery_pct:
            self._set_battery(vehicle, _percent(percent))
        all_mv = 0 if first_mv == NO_CELL_MV else first_mv
        if others != NO_CELLS:
            all_mv += sum(mv for mv in _CELLS(others) if mv != NO_CELL_MV)
        vehicle.telemetry.battery_v = all_mv / 1000 if all_mv else NAN

    def _set_battery(self, vehicle: Vehicle, percent: float) -> None:
        before = vehicle.telemetry.battery_pct
        if percent == before:
            return
        vehicle.telemetry.battery_pct = percent
        if math.isnan(percent) and not math.isnan(before) and vehicle.telemetry.airborne:
            self._events.report(EventClass.SENSOR, _name(vehicle), "battery unknown", WARNING, every_s=30)
        # The limits of the alarms, too: see `alarms.vehicle_findings`.
        for limit, severity in ((15.0, ALERT), (25.0, WARNING)):
            if percent < limit:
                # `not <` also covers NaN: a battery that was unknown and is low is reported.
                if not before < limit:
                    text = f"battery below {limit:.0f} %"
                    self._events.report(EventClass.SENSOR, _name(vehicle), text, severity, every_s=30)
                break

    def _high_latency(self, slot: Slot, now: float) -> None:
        """Take HIGH_LATENCY2, one message for everything, used over satellite links. The normal streams come first."""
        vehicle: Vehicle = slot.owner
        boot_ms, latitude, longitude, mode, altitude, *rest = slot.values()
        heading, speed, climb, battery, custom0 = rest[6], rest[11], rest[17], rest[18], rest[19]
        vehicle.telemetry.high_latency_s = now
        # It may have been a minute on its way: the normal stream brought newer values before it ceased.
        if any(0 <= path.boot_clock.boot_ms - boot_ms < MAX_SATELLITE_DELAY_MS for path in vehicle.paths):
            return
        if now - vehicle.telemetry.heartbeat_s > HIGH_LATENCY_AFTER_S:
            vehicle.telemetry.custom_mode = high_latency.mode_number(vehicle.autopilot, mode)
            armed = high_latency.is_armed(vehicle.autopilot, custom0)
            if armed is not None:
                self._armed(vehicle, armed, now)
            elif vehicle.telemetry.heartbeat_s == -math.inf:
                vehicle.telemetry.armed = True
        if now - vehicle.telemetry.position_s <= HIGH_LATENCY_AFTER_S or not self._is_place(
            vehicle, latitude / 1e7, longitude / 1e7
        ):
            return
        x, y = self.frame.to_enu(latitude / 1e7, longitude / 1e7)
        course, speed_cm_s = math.radians(2.0 * heading), 20 * speed
        north, east = round(speed_cm_s * math.cos(course)), round(speed_cm_s * math.sin(course))
        # HIGH_LATENCY2 has no height above home: it is counted from the last known one, and stays unknown if that
        # was.
        climbed_m = altitude - vehicle.telemetry.alt_amsl_m
        fix = (boot_ms, latitude, longitude, 1000 * altitude, 0, north, east, -10 * climb, 200 * heading)
        vehicle.telemetry.position_raw = position_frame(fix)
        vehicle.telemetry.position_m = (float(x), float(y), vehicle.telemetry.alt_rel_m + climbed_m)
        vehicle.telemetry.battery_pct = _percent(battery)
        vehicle.telemetry.position_s = now


def _name(vehicle: Vehicle) -> str:
    return f"vehicle {vehicle.id}"


def _percent(value: int) -> float:
    """Return battery remaining, 0…100; NaN for anything else."""
    return float(value) if 0 <= value <= 100 else NAN


def _millivolt(value: int) -> float:
    return value / 1e3 if 0 < value < 65535 else NAN
