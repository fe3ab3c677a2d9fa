"""Marks and colours of a severity, the same in every panel."""

from tui_gcs.core.protocol.common import Phase, VehicleRow
from tui_gcs.feed.notices import Severity
from tui_gcs.widgets.basics.palette import Ink

LAND_MODE_PHASES = (Phase.GROUND, Phase.ARMING)


MARKS = {Severity.NORMAL: "", Severity.GREY: "x", Severity.CAUTION: "^", Severity.WARNING: "!"}
INKS = {
    Severity.NORMAL: Ink.TEXT,
    Severity.GREY: Ink.MUTED,
    Severity.CAUTION: Ink.CAUTION,
    Severity.WARNING: Ink.WARNING,
}
SELECTED_INKS = {
    Severity.NORMAL: Ink.SELECTED,
    Severity.GREY: Ink.SELECTED,
    Severity.CAUTION: Ink.SELECTED_CAUTION,
    Severity.WARNING: Ink.SELECTED_WARNING,
}


def on_ground(row: VehicleRow) -> bool:
    """Whether the vehicle stands on the ground, as far as is known."""
    return row.phase in LAND_MODE_PHASES or not row.armed
