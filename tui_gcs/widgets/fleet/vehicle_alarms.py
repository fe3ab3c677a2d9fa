"""Alarms by vehicle: its severity on every screen, and three letters for the cause. The station alone judges."""

from collections.abc import Mapping, Sequence

from tui_gcs.core.protocol.alarms import AlarmLevel
from tui_gcs.core.protocol.common import Alarm, Freshness, VehicleRow
from tui_gcs.feed.notices import Severity

LEVELS = {
    AlarmLevel.WARNING: Severity.WARNING,
    AlarmLevel.CAUTION: Severity.CAUTION,
    AlarmLevel.ADVISORY: Severity.NORMAL,
}
ACTIVE = ("new", "acknowledged")
AlarmsByVehicle = Mapping[int, Sequence[Alarm]]
"""The alarms of each vehicle that has any, the gravest first."""


def by_vehicle(alarms: Sequence[Alarm]) -> dict[int, list[Alarm]]:
    """The active alarms of each vehicle, the gravest first, acknowledged or not."""
    found: dict[int, list[Alarm]] = {}
    for alarm in sorted(alarms, key=lambda alarm: -alarm.level):
        if alarm.state in ACTIVE:
            for vehicle in alarm.vehicles:
                found.setdefault(vehicle, []).append(alarm)
    return found


def level_now(row: VehicleRow, alarms: Sequence[Alarm]) -> Severity:
    """The severity of the gravest of a vehicle's alarms; GREY for one that is not heard and has none."""
    level = LEVELS[alarms[0].level] if alarms else Severity.NORMAL
    return Severity.GREY if level is Severity.NORMAL and row.freshness is Freshness.LOST else level


def tag_of(alarms: Sequence[Alarm]) -> str:
    """The tag of the gravest alarm, three letters; empty without alarms."""
    return alarms[0].tag if alarms else ""
