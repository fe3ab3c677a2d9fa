"""The selected vehicle in three lines, for small terminals."""

from collections.abc import Sequence

from tui_gcs.core.protocol.common import Alarm, FleetFrame, Freshness, Phase, VehicleRow
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.number_text import gps, hand_words, heading, number, phase_words, slot_words, speed_m_s
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.fleet.severity_levels import INKS
from tui_gcs.widgets.fleet.vehicle_alarms import level_now


def row_of(frame: FleetFrame | None, vehicle: int | None) -> VehicleRow | None:
    """The row of a vehicle; None if the frame does not have it."""
    return frame.row(vehicle) if frame is not None and vehicle is not None else None


def brief_lines(row: VehicleRow | None, alarms: Sequence[Alarm], glyphs: GlyphSet) -> list[list[Run]]:
    """Three lines for small terminals; `alarms` are its own."""
    if row is None:
        return [[("n or number+Enter selects", Ink.MUTED)], [], []]
    if row.freshness is Freshness.LOST:
        return _last_known(row, INKS[level_now(row, alarms)])
    motion = f"{number(row.position_m[2], 1)}m {number(speed_m_s(row.velocity_m_s), 1)}m/s {_heading(row, glyphs)}"
    power = f"bat {number(row.battery_pct)}% {number(row.battery_v, 1)}V gps {gps(row.gps_fix, row.satellites)}"
    return [
        [(f"{row.id} {row.team[:8]} ", Ink.BOLD), (motion, Ink.TEXT)],
        [(power, INKS[level_now(row, alarms)])],
        [(row.problem, Ink.WARNING)] if row.problem else [(_does(row), Ink.TEXT)],
    ]


def _does(row: VehicleRow) -> str:
    """What the vehicle flies for; by hand with its mode, for which the roster has no room."""
    if row.phase is Phase.BY_HAND:
        return f"{row.mode[:8]} {row.phase}, {hand_words(row)}"
    if row.phase is Phase.TAKEN_OUT:
        return f"{row.mode[:8]} {phase_words(row)}"
    return f"{row.phase} {slot_words(row.slot)} off {number(row.slot_error_m, 0, 'm')}"


def _last_known(row: VehicleRow, ink: Ink) -> list[list[Run]]:
    """A lost vehicle: since when, and where it was."""
    return [
        [(f"{row.id} {row.team[:8]} ", Ink.BOLD), (f"LOST {number(row.heard_age_s)} s", ink)],
        [(f"last {number(row.lat_deg, 6)} {number(row.lon_deg, 6)}", Ink.TEXT)],
        [(f"then {number(row.position_m[2])}m up, bat {number(row.battery_pct, 0, '%')}", Ink.TEXT)],
    ]


def _heading(row: VehicleRow, glyphs: GlyphSet) -> str:
    return heading(row.heading_deg, glyphs.degree)
