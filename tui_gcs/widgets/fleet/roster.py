"""The roster: the fleet on the fly screen, one line for each vehicle. Narrow terminals drop columns, never rows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from textual import events
from textual.message import Message

from tui_gcs.core.protocol.common import FleetFrame, Freshness, Phase, VehicleRow
from tui_gcs.feed.notices import Severity
from tui_gcs.feed.visible_changes import whole_age_s
from tui_gcs.widgets.basics.border_titles import framed, set_title, show_beyond
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import (
    UNKNOWN,
    autopilot_short,
    fitted,
    gps,
    mode_or_hand,
    number,
    speed_m_s,
)
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, wrapped
from tui_gcs.widgets.fleet.severity_levels import INKS, MARKS
from tui_gcs.widgets.fleet.vehicle_alarms import AlarmsByVehicle, level_now


class VehiclePicked(Message):
    """A vehicle was clicked in a list of the fleet."""

    def __init__(self, vehicle: int) -> None:
        super().__init__()
        self.vehicle = vehicle


@dataclass(frozen=True)
class Column:
    """A column of a table; those with the lowest `keep` are dropped first when there is no room."""

    title: str
    width: int
    keep: int
    cell: Callable[[VehicleRow, int], str]
    left: bool = False
    narrow: int = 0
    """Width in narrow terminals, if it differs."""


def _mode(row: VehicleRow, width: int) -> str:
    """The mode, or how long ago the vehicle was last heard; the mode also if it never reported a position (indoors)."""
    lost = row.freshness is Freshness.LOST
    age_s = whole_age_s(row.heard_age_s if lost else row.age_s)
    if row.freshness is Freshness.OK or (age_s is None and not lost):
        return mode_or_hand(row)
    word = "LOST" if lost else "old"
    return f"{word} {UNKNOWN if age_s is None else min(age_s, 999)}s"


def unless_lost(text: Callable[[VehicleRow, int], str]) -> Callable[[VehicleRow, int], str]:
    """Return `text` without the values of lost vehicles, which are not shown as if they were still true."""
    return lambda row, width: UNKNOWN if row.freshness is Freshness.LOST else text(row, width)


def _age(row: VehicleRow, _width: int) -> str:
    age_s = whole_age_s(row.age_s)
    return UNKNOWN if age_s is None else "" if age_s == 0 else f"{min(age_s, 999)}"


# To show another value of `VehicleRow`, add a line here: see the list for a telemetry value in CONTRIBUTING.md.
COLUMNS = (
    Column("ID", 3, 100, lambda row, _: str(row.id)),
    Column("TEAM", 7, 30, lambda row, _: row.team, left=True),
    Column("AP", 4, 10, lambda row, _: autopilot_short(row.autopilot), left=True),
    Column("MODE", 8, 90, _mode, left=True),
    Column("A", 1, 80, lambda row, _: "A" if row.armed else "-", left=True),
    Column("ALT", 4, 70, unless_lost(lambda row, width: fitted(row.position_m[2], width)), narrow=3),
    Column("SPD", 4, 50, unless_lost(lambda row, width: fitted(speed_m_s(row.velocity_m_s), width)), narrow=3),
    Column("BAT", 4, 60, unless_lost(lambda row, _: number(row.battery_pct, 0, "%")), narrow=3),
    Column("GPS", 5, 20, unless_lost(lambda row, _: gps(row.gps_fix, row.satellites)), left=True),
    Column("AGE", 3, 15, _age),
)
NARROW = 40
MARK_CELLS = 2


class Roster(LinesView):
    """One line for each vehicle, those in trouble first if not all fit; the selected one stays in view."""

    DEFAULT_CSS = framed("Roster")

    _frame: FleetFrame | None = None
    _selected: tuple[int, ...] = ()
    _lead: int | None = None
    _alarms: AlarmsByVehicle = {}
    _first = 0
    _waiting = ""
    _order: Sequence[int] = ()
    """Ids of the vehicles in the order shown last."""

    def show(
        self,
        frame: FleetFrame | None,
        selected: tuple[int, ...],
        lead: int | None,
        alarms: AlarmsByVehicle,
        *,
        waiting: str = "",
    ) -> None:
        """Show these vehicles, `lead` in view; `None` when nothing is known.

        `waiting` is what an empty fleet waits for, in words.
        """
        self._frame, self._selected, self._lead = frame, selected, lead
        self._alarms, self._waiting = alarms, waiting
        set_title(self, self._title())
        self.update_lines()

    def _title(self) -> str:
        """The title with counts: vehicles flown by hand may be below the last line."""
        frame, selected = self._frame, len(self._selected)
        count, by_hand = (len(frame.ids), frame.phase.count(Phase.BY_HAND)) if frame is not None else (0, 0)
        if by_hand and selected > 1 and self.size.width < NARROW:
            return f"{by_hand} by hand, {selected} sel of {count}"
        hand = f"   {by_hand} by hand" if by_hand else ""
        return f"fleet  {count}{hand}" + (f"   {selected} selected" if selected > 1 else "")

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if self._frame is None or not self._frame.ids:
            return [[(text, Ink.MUTED)] for text in ("no vehicle yet", *wrapped(self._waiting, width))]
        rows = self._frame.rows()
        columns = fitting_columns(width, max(row.id for row in rows))
        room = max(1, height - 1)
        if len(rows) > room:
            # Stable, also with `reverse`: vehicles of one level stay in the order of their ids.
            rows.sort(key=self._trouble, reverse=True)
        self._order = [row.id for row in rows]
        self._first = _first_shown(self._first, room, rows, self._lead)
        shown = rows[self._first : self._first + room]
        show_beyond(self, self._first, len(rows) - self._first - len(shown), "n N")
        return [header(columns), *(self._line(row, columns) for row in shown)]

    def _trouble(self, row: VehicleRow) -> Severity:
        """How urgently a vehicle must be seen: one that is merely silent stands on the ground."""
        level = self._level(row)
        return level if level >= Severity.CAUTION else Severity.NORMAL

    def _level(self, row: VehicleRow) -> Severity:
        return level_now(row, self._alarms.get(row.id, ()))

    def _line(self, row: VehicleRow, columns: list[Column]) -> list[Run]:
        level = self._level(row)
        return roster_line(row, columns, row.id in self._selected, level, self.glyphs)

    def on_click(self, event: events.Click) -> None:
        """Post `VehiclePicked` for the clicked vehicle."""
        offset = event.get_content_offset(self)
        if offset is None or offset.y < 1:
            return
        index = self._first + offset.y - 1
        if index < len(self._order):
            self.post_message(VehiclePicked(self._order[index]))


def fitting_columns(width: int, highest_id: int = 0) -> list[Column]:
    """The columns that fit, in their order; the id is never cut, and has four digits on a second network."""
    narrow = [replace(column, width=column.narrow or column.width) for column in COLUMNS]
    return dropped_to_fit(narrow if width < NARROW else COLUMNS, width, highest_id)


def dropped_to_fit(columns: Sequence[Column], width: int, highest_id: int) -> list[Column]:
    """Return the columns without those for which `width` cells have no room; the id is never cut."""
    kept = [replace(columns[0], width=max(columns[0].width, len(str(highest_id)))), *columns[1:]]
    while len(kept) > 1 and MARK_CELLS + sum(column.width + 1 for column in kept) - 1 > width:
        kept.remove(min(kept, key=lambda column: column.keep))
    return kept


def header(columns: list[Column]) -> list[Run]:
    """The line of column titles."""
    return [(" " * MARK_CELLS + " ".join(column_text(column, column.title) for column in columns), Ink.MUTED)]


def roster_line(row: VehicleRow, columns: list[Column], selected: bool, level: Severity, glyphs: GlyphSet) -> list[Run]:
    """The line of a vehicle: alarm mark, selection mark, values."""
    ink = INKS[level]
    if selected and level is Severity.NORMAL:
        ink = Ink.BOLD
    # Colour never stands alone: 8 % of men cannot tell red from green (docs/terminal.md D7).
    mark = MARKS[level] or " "
    text = " ".join(column_text(column, column.cell(row, column.width)) for column in columns)
    return [(f"{mark}{glyphs.selected if selected else ' '}{text}", ink)]


def column_text(column: Column, text: str) -> str:
    """Return a value or a title in exactly as many cells as the column has."""
    cut = text[: column.width]
    return cut.ljust(column.width) if column.left else cut.rjust(column.width)


def _first_shown(first: int, room: int, rows: list[VehicleRow], selected: int | None) -> int:
    """The first row to show: as little scrolling as keeps the selected vehicle in view."""
    first = max(0, min(first, len(rows) - room))
    index = next((i for i, row in enumerate(rows) if row.id == selected), None)
    if index is None:
        return first
    return max(index - room + 1, min(first, index))
