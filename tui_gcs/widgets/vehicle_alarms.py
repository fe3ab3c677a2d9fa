"""Which alarm each vehicle has: the level of its cell, and three letters why."""

from collections.abc import Sequence

from tui_gcs.core.messages import Alarm, VehicleRow
from tui_gcs.core.messages_alarms import AlarmLevel
from tui_gcs.widgets.levels import Level, level_of

LEVELS = {AlarmLevel.WARNING: Level.WARNING, AlarmLevel.CAUTION: Level.CAUTION, AlarmLevel.ADVISORY: Level.NORMAL}
ACTIVE = ("new", "acknowledged")


def by_vehicle(alarms: Sequence[Alarm]) -> dict[int, list[Alarm]]:
    """The alarms that hold, of each vehicle, the gravest first: seen or not makes no difference here."""
    found: dict[int, list[Alarm]] = {}
    for alarm in sorted(alarms, key=lambda alarm: -alarm.level):
        if alarm.state in ACTIVE:
            for vehicle in alarm.vehicles:
                found.setdefault(vehicle, []).append(alarm)
    return found


def level_now(row: VehicleRow, alarms: Sequence[Alarm]) -> Level:
    """By its alarms, and by what can be seen of it."""
    return max([level_of(row), *(LEVELS[alarm.level] for alarm in alarms)])


def tag_of(alarms: Sequence[Alarm]) -> str:
    """Why, in three letters; empty if nothing is wrong."""
    return alarms[0].tag if alarms else ""
