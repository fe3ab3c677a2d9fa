"""Everything about the selected vehicle."""

from tui_gcs.core.messages import FleetFrame, Freshness, VehicleRow
from tui_gcs.widgets.glyphs import GlyphSet
from tui_gcs.widgets.levels import INKS, level_of
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.strips import Run
from tui_gcs.widgets.titles import set_title
from tui_gcs.widgets.words import UNKNOWN, gps, heading, number, speed_m_s


class SelectedPanel(LinesView):
    """Eight lines of label and value."""

    DEFAULT_CSS = """
    SelectedPanel { border: solid #4a5560; border-title-color: #d8dee4; height: 10; }
    SelectedPanel.-ascii { border: ascii #4a5560; }
    """

    _row: VehicleRow | None = None

    def show(self, row: VehicleRow | None) -> None:
        """Show this vehicle."""
        self._row = row
        set_title(self, "selected")
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if self._row is None:
            return [[("n or number + Enter selects a vehicle", Ink.MUTED)]]
        return list(selected_lines(self._row, self.glyphs))


def row_of(frame: FleetFrame | None, vehicle: int | None) -> VehicleRow | None:
    """The row of a vehicle, if the frame has it."""
    return frame.row(vehicle) if frame is not None and vehicle is not None else None


def selected_lines(row: VehicleRow, glyphs: GlyphSet) -> list[list[Run]]:
    """The wide form."""
    known = row.freshness is not Freshness.LOST
    alt, climb = row.position_m[2], row.velocity_m_s[2]
    team = f"   team {row.team}" if row.team else ""
    return [
        [(f"vehicle {row.id}   {row.autopilot} {row.vehicle_type}{team}", Ink.BOLD)],
        _pair("state", f"{row.mode}  {'ARMED' if row.armed else 'disarmed'}  {row.phase}", INKS[level_of(row)]),
        _pair("alt", _if(known, f"{number(alt, 1)} m rel  {number(row.alt_amsl_m, 1)} amsl  climb {_signed(climb)}")),
        _pair("spd", _if(known, f"{number(speed_m_s(row.velocity_m_s), 1)} m/s   hdg {_heading(row, glyphs)}")),
        _pair("bat", _if(known, f"{number(row.battery_v, 1)} V  {number(row.battery_pct)} %")),
        _pair("gps", _if(known, f"{gps(row.gps_fix, row.satellites)} sat   {_place(row)}")),
        _pair("WHO?", row.problem, Ink.WARNING)
        if row.problem
        else _pair("slot", f"{row.slot or UNKNOWN}   off {number(row.slot_error_m, 1)} m   {row.signing}"),
        _pair("link", f"{row.link}  loss {number(row.loss_pct, 1)} %  heard {number(row.heard_age_s, 0)} s"),
    ]


def brief_lines(row: VehicleRow | None, glyphs: GlyphSet) -> list[list[Run]]:
    """Three lines for small terminals."""
    if row is None:
        return [[("n or number+Enter selects", Ink.MUTED)], [], []]
    known = row.freshness is not Freshness.LOST
    motion = f"{number(row.position_m[2], 1)}m {number(speed_m_s(row.velocity_m_s), 1)}m/s {_heading(row, glyphs)}"
    power = f"bat {number(row.battery_pct)}% {number(row.battery_v, 1)}V gps {gps(row.gps_fix, row.satellites)}"
    return [
        [(f"{row.id} {row.team[:8]} ", Ink.BOLD), (_if(known, motion), Ink.TEXT)],
        [(_if(known, power), INKS[level_of(row)])],
        [(row.problem, Ink.WARNING)]
        if row.problem
        else [(f"{row.phase} slot {row.slot or UNKNOWN} off {number(row.slot_error_m, 0)}m", Ink.TEXT)],
    ]


def _pair(label: str, text: str, ink: Ink = Ink.TEXT) -> list[Run]:
    return [(f"{label:<6}", Ink.MUTED), (text, ink)]


def _if(known: bool, text: str) -> str:
    return text if known else UNKNOWN


def _signed(value: float) -> str:
    text = number(value, 1)
    return text if text == UNKNOWN or text.startswith("-") else f"+{text}"


def _heading(row: VehicleRow, glyphs: GlyphSet) -> str:
    return heading(row.heading_deg, glyphs.degree)


def _place(row: VehicleRow) -> str:
    return f"{number(row.lat_deg, 5)} {number(row.lon_deg, 5)}"
