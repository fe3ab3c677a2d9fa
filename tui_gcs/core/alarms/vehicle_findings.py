"""Finds what is wrong with one vehicle by its own telemetry alone, in flight and in a recording of it.

Limits have a dead-band: a finding ends only when its value is clearly better.
"""

import math
from collections.abc import Iterator

from tui_gcs.core.alarms.alarm_table import AlarmFinding, AlarmTable
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.failsafe_texts import is_news
from tui_gcs.core.protocol.common import Freshness

# `fleet.telemetry` (events), `firmware.health` and `flight.return_home` have limits of 25 and 15 %, too; for a start
# `preflight.readiness.MIN_BATTERY_PCT` counts.
BATTERY_LOW_PCT, BATTERY_CRITICAL_PCT, BATTERY_BAND_PCT = 25.0, 15.0, 3.0
# The second number of each pair is the band by which a value must be better before its alarm ends: none flutters.
POOR_POSITION_M, POOR_POSITION_BAND_M = 10.0, 3.0
LOSS_PCT, LOSS_BAND_PCT = 25.0, 10.0
MIN_FIX = 3
"""The value of GPS_FIX_TYPE_3D_FIX in MAVLink."""
FAILSAFE_STATES = {5: "CRITICAL: a failsafe is active", 6: "EMERGENCY: out of control", 8: "flight was TERMINATED"}
"""Values of MAV_STATE that mean a failsafe, with their text."""
SAID_BEFORE_S, SAID_AFTER_S = 3.0, 3.0
"""Status texts about the reason of a failsafe count in this time before and after the heartbeat shows it."""


class VehicleAlarmMonitor:
    """Finds what is wrong with single vehicles; keeps the reasons of failsafes as long as these last."""

    def __init__(self, alarms: AlarmTable) -> None:
        self._alarms = alarms
        self._failsafes: dict[int, tuple[float, str]] = {}
        """By vehicle: since when its failsafe is active, and the reason in its own words."""

    def findings(
        self, vehicle: Vehicle, now: float, *, in_flight: bool, failed_link: str = ""
    ) -> Iterator[AlarmFinding]:
        """All that is wrong with it; `failed_link` names the only link it was heard on, if that link has failed."""
        if problem := vehicle.identity_problem:
            yield AlarmFinding("identity", vehicle.id, problem)
        # The next failsafe has its own reason: one of an earlier flight must not be shown for it.
        if not in_flight or vehicle.telemetry.system_status not in FAILSAFE_STATES:
            self._failsafes.pop(vehicle.id, None)
        if not in_flight:
            return
        freshness = vehicle.freshness(now)
        if freshness is Freshness.LOST:
            yield AlarmFinding("link-lost" if failed_link else "lost", vehicle.id, failed_link)
        elif freshness is Freshness.STALE:
            yield AlarmFinding("stale", vehicle.id)
        if vehicle.telemetry.system_status in FAILSAFE_STATES:
            yield AlarmFinding("failsafe", vehicle.id, self._failsafe(vehicle, now))
        if vehicle.telemetry.airborne:
            yield from self._battery(vehicle)
            yield from self._position(vehicle)
            if self.beyond("poor-link", vehicle, vehicle.loss_pct, LOSS_PCT, LOSS_BAND_PCT):
                yield AlarmFinding(
                    "poor-link", vehicle.id, f"{10 * round(vehicle.loss_pct / 10)} % of its frames are lost"
                )

    def _failsafe(self, vehicle: Vehicle, now: float) -> str:
        """The mode of the failsafe and the reason in the vehicle's own words; without one, the meaning of its state."""
        since_s, why = self._failsafes.get(vehicle.id, (now, ""))
        # Texts come around the heartbeat that shows the failsafe, before and after it.
        if now - since_s <= SAID_AFTER_S:
            why = vehicle.failsafe_words(since_s - SAID_BEFORE_S)
        elif is_news(news := vehicle.failsafe_words(now - SAID_BEFORE_S)):
            why = news
        self._failsafes[vehicle.id] = (since_s, why)
        does = vehicle.mode_name
        if _has_no_fix(vehicle):
            does += " without a GPS fix"
        return f"{does}: {why}" if why else FAILSAFE_STATES[vehicle.telemetry.system_status]

    def beyond(self, cause: str, vehicle: Vehicle, value: float, limit: float, band: float) -> bool:
        """Whether `value` is above its limit; while the alarm is up, above a lower one."""
        return value > (limit - band if self._alarms.is_up(cause, vehicle.id) else limit)

    def _battery(self, vehicle: Vehicle) -> Iterator[AlarmFinding]:
        charge_pct = vehicle.telemetry.battery_pct
        # NaN: an unknown charge is an alarm of its own, not a low one.
        if charge_pct != charge_pct:
            yield AlarmFinding("battery-unknown", vehicle.id)
        elif self.beyond("battery-critical", vehicle, -charge_pct, -BATTERY_CRITICAL_PCT, BATTERY_BAND_PCT):
            yield AlarmFinding("battery-critical", vehicle.id, f"{charge_pct:.0f} %")
        elif self.beyond("battery-low", vehicle, -charge_pct, -BATTERY_LOW_PCT, BATTERY_BAND_PCT):
            yield AlarmFinding("battery-low", vehicle.id, f"{charge_pct:.0f} %")

    def _position(self, vehicle: Vehicle) -> Iterator[AlarmFinding]:
        if _has_no_fix(vehicle):
            yield AlarmFinding("position", vehicle.id, "no GPS fix")
        elif self.beyond(
            "poor-position", vehicle, vehicle.integrity.position_error_m, POOR_POSITION_M, POOR_POSITION_BAND_M
        ):
            error_m = min(vehicle.integrity.position_error_m, 999.0)
            yield AlarmFinding("poor-position", vehicle.id, f"±{5 * max(1, round(error_m / 5))} m")


def _has_no_fix(vehicle: Vehicle) -> bool:
    return math.isinf(vehicle.integrity.position_error_m) or 0 < vehicle.telemetry.gps_fix < MIN_FIX
