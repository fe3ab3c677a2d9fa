"""How bad things are with a vehicle, and the mark and colour that say so."""

from enum import IntEnum

from tui_gcs.core.protocol.common import Phase, VehicleRow
from tui_gcs.widgets.basics.palette import Ink

LAND_MODE_PHASES = (Phase.GROUND, Phase.ARMING)


class Level(IntEnum):
    """Alarm level (facts/terminal.md D7)."""

    NORMAL = 0
    GREY = 1
    """Not heard, and no alarm: not flying when last heard."""
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
