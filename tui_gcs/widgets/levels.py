"""How bad things are with a vehicle, by what the console itself can see; colour and mark follow from it."""

from enum import IntEnum

from tui_gcs.core.messages import Freshness, Phase, VehicleRow
from tui_gcs.widgets.palette import Ink

BATTERY_CAUTION_PCT = 25.0
BATTERY_WARNING_PCT = 15.0

LAND_MODE_PHASES = (Phase.GROUND, Phase.ARMING)


class Level(IntEnum):
    """Alarm level (facts/terminal.md D7)."""

    NORMAL = 0
    GREY = 1
    """Not heard, and not flying when last heard."""
    CAUTION = 2
    WARNING = 3


MARKS = {Level.NORMAL: "", Level.GREY: "x", Level.CAUTION: "^", Level.WARNING: "!"}
INKS = {Level.NORMAL: Ink.TEXT, Level.GREY: Ink.MUTED, Level.CAUTION: Ink.CAUTION, Level.WARNING: Ink.WARNING}
SELECTED_INKS = {
    Level.NORMAL: Ink.SELECTED,
    Level.GREY: Ink.SELECTED,
    Level.CAUTION: Ink.SELECTED_CAUTION,
    Level.WARNING: Ink.SELECTED_WARNING,
}


def on_ground(row: VehicleRow) -> bool:
    """Whether the vehicle stands on the ground as far as is known."""
    return row.phase in LAND_MODE_PHASES or not row.armed


def level_of(row: VehicleRow) -> Level:
    """The worst of freshness, identity, hand-over and battery."""
    if row.freshness is Freshness.LOST:
        return Level.GREY if on_ground(row) else Level.WARNING
    battery = row.battery_pct  # NaN compares false: unknown is no alarm
    if row.problem or (battery < BATTERY_WARNING_PCT and row.armed):
        return Level.WARNING
    if row.freshness is Freshness.STALE or row.phase is Phase.TAKEN_OUT or battery < BATTERY_CAUTION_PCT:
        return Level.CAUTION
    return Level.NORMAL
