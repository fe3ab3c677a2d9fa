"""The fleet table of the vehicles screen, sorted and filtered; narrow terminals drop columns, never rows."""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from textual import events

from tui_gcs.core.protocol.common import Alarm, VehicleRow
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import mode_or_hand, number, phase_words, speed_m_s
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.fleet.roster import COLUMNS as ROSTER_COLUMNS
from tui_gcs.widgets.fleet.roster import MARK_CELLS, Column, VehiclePicked, column_text, dropped_to_fit, unless_lost
from tui_gcs.widgets.fleet.severity_levels import INKS, MARKS, SELECTED_INKS
from tui_gcs.widgets.fleet.vehicle_alarms import by_vehicle, level_now, tag_of

Value = float | str
"""A value to sort by; those of one column are either all numbers or all words."""


@dataclass(frozen=True)
class Sorting:
    """A column to sort by, and the value of a row in it."""

    title: str
    key: Callable[[VehicleRow], Value]


SORTINGS = (
    Sorting("ID", lambda row: float(row.id)),
    Sorting("CAUSE", lambda row: float(row.id)),
    Sorting("TEAM", lambda row: row.team),
    Sorting("MODE", mode_or_hand),
    Sorting("ALT", lambda row: row.position_m[2]),
    Sorting("SPD", lambda row: speed_m_s(row.velocity_m_s)),
    Sorting("BAT", lambda row: row.battery_pct),
    Sorting("GPS", lambda row: float(row.satellites)),
    Sorting("AGE", lambda row: row.age_s),
    Sorting("LOSS", lambda row: row.loss_pct),
    Sorting("OFF", lambda row: row.slot_error_m),
)
"""Columns to sort by; CAUSE sorts by severity, the gravest first, then by id."""
COLUMNS = (
    ROSTER_COLUMNS[0],
    Column("CAUSE", 5, 95, lambda row, _: "", left=True),
    *ROSTER_COLUMNS[1:],
    Column("V", 4, 35, unless_lost(lambda row, _: number(row.battery_v, 1))),
    Column("LOSS", 4, 25, lambda row, _: number(row.loss_pct, 0, "%")),
    Column("SLOT", 5, 22, lambda row, _: row.slot, left=True),
    Column("OFF", 4, 21, unless_lost(lambda row, _: number(row.slot_error_m, 0, "m"))),
    Column("PHASE", 9, 12, lambda row, _: phase_words(row), left=True),
    Column("LINK", 22, 5, lambda row, _: row.link, left=True),
)


class FleetTable(LinesView):
    """A line for each vehicle; the one that is looked at stays in view."""

    DEFAULT_CSS = "FleetTable { height: 1fr; }"

    _rows: Sequence[VehicleRow] = ()
    _alarms: dict[int, list[Alarm]] = {}
    _selected: Collection[int] = ()
    _lead: int | None = None
    _sorting = SORTINGS[0]
    _falling = False
    _first = _shown = 0

    def show(
        self, rows: Sequence[VehicleRow], alarms: Sequence[Alarm], selected: Collection[int], lead: int | None
    ) -> None:
        """Show these vehicles; `lead`, which is looked at, stays in view."""
        self._alarms, self._selected, self._lead = by_vehicle(alarms), selected, lead
        self._rows = self._sorted(rows)
        self.update_lines()

    def sort_by(self, by: int = 0, *, turn: bool = False) -> str:
        """Sort by another column, or `turn` the order round; return what is sorted by, in words."""
        self._sorting = SORTINGS[(SORTINGS.index(self._sorting) + by) % len(SORTINGS)]
        self._falling = not self._falling if turn else False
        self._rows = self._sorted(self._rows)
        self.update_lines()
        return f"{self._sorting.title}{' falling' if self._falling else ''}"

    def ids(self) -> tuple[int, ...]:
        """All vehicles in the order shown."""
        return tuple(row.id for row in self._rows)

    def _sorted(self, rows: Sequence[VehicleRow]) -> list[VehicleRow]:
        """Sort rows; unknown values come last in both orders, equal ones by id."""
        by_id = sorted(rows, key=lambda row: row.id)
        if self._sorting.title == "CAUSE":
            # The sort is stable: vehicles of one level stay in the order of their ids, and do not jump while one looks.
            by_id.sort(key=lambda row: -level_now(row, self._alarms.get(row.id, [])), reverse=self._falling)
            return by_id
        known = [row for row in by_id if _is_known(self._sorting.key(row))]
        unknown = [row for row in by_id if not _is_known(self._sorting.key(row))]
        # NaN compares with nothing: among the others it would spoil the order.
        known.sort(key=self._sorting.key, reverse=self._falling)
        return [*known, *unknown]

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if not self._rows:
            return [[("no vehicle here", Ink.MUTED)]]
        columns = dropped_to_fit(COLUMNS, width, max(row.id for row in self._rows))
        is_long = len(self._rows) > max(1, height - 1)
        room = max(1, height - 1 - is_long)
        index = next((i for i, row in enumerate(self._rows) if row.id == self._lead), 0)
        self._first = max(0, min(max(self._first, index - room + 1), index, len(self._rows) - room))
        shown = self._rows[self._first : self._first + room]
        self._shown = len(shown)
        below = len(self._rows) - self._first - len(shown)
        more: list[Line] = [[(f"  {self._first} more above, {below} more below: arrows", Ink.MUTED)]] if is_long else []
        return [self._header(columns), *([self._line(row, columns)] for row in shown), *more]

    def _header(self, columns: Sequence[Column]) -> list[Run]:
        runs: list[Run] = [(" " * MARK_CELLS, Ink.MUTED)]
        for column in columns:
            sorted_by = column.title == self._sorting.title
            runs.append((f"{column_text(column, column.title)} ", Ink.BOLD if sorted_by else Ink.MUTED))
        return runs

    def _line(self, row: VehicleRow, columns: Sequence[Column]) -> Run:
        alarms = self._alarms.get(row.id, [])
        level = level_now(row, alarms)
        looked_at = row.id == self._lead
        ink = SELECTED_INKS[level] if row.id in self._selected else INKS[level]
        mark = MARKS[level] or " "
        cells = (tag_of(alarms) if column.title == "CAUSE" else column.cell(row, column.width) for column in columns)
        text = " ".join(column_text(column, cell) for column, cell in zip(columns, cells, strict=True))
        return f"{mark}{self.glyphs.selected if looked_at else ' '}{text}", ink

    def on_click(self, event: events.Click) -> None:
        """Post `VehiclePicked` for the clicked vehicle."""
        offset = event.get_content_offset(self)
        if offset is not None and 0 < offset.y <= self._shown:
            self.post_message(VehiclePicked(self._rows[self._first + offset.y - 1].id))


def _is_known(value: Value) -> bool:
    return not isinstance(value, float) or math.isfinite(value)


def matching(rows: Sequence[VehicleRow], alarms: Sequence[Alarm], words: str) -> list[VehicleRow]:
    """The vehicles for which every word matches an id, team, mode, phase, autopilot, link, freshness or cause."""
    tags = by_vehicle(alarms)
    wanted = words.casefold().split()
    return [row for row in rows if all(_fits(word, row, tags.get(row.id, [])) for word in wanted)]


def _fits(word: str, row: VehicleRow, alarms: Sequence[Alarm]) -> bool:
    if word.isdigit():
        return str(row.id) == word
    armed = "armed" if row.armed else "disarmed"
    texts = (row.team, row.mode, phase_words(row), row.autopilot, row.vehicle_type, row.link, row.freshness)
    return word == armed or any(
        word in text.casefold() for text in (*texts, *(alarm.tag for alarm in alarms), *(a.title for a in alarms))
    )
