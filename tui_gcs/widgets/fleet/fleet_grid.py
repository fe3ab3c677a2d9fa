"""The whole fleet at a glance: one cell for each vehicle; 250 are readable in 80x24."""

from collections.abc import Collection, Sequence

from textual import events

from tui_gcs.core.protocol.common import Alarm, Freshness, Phase, VehicleRow
from tui_gcs.feed.notices import Severity
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import ids, mode_or_hand, number
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.fleet.roster import VehiclePicked
from tui_gcs.widgets.fleet.severity_levels import INKS, LAND_MODE_PHASES, MARKS, SELECTED_INKS
from tui_gcs.widgets.fleet.vehicle_alarms import LEVELS, by_vehicle, level_now, tag_of

MODE_CELLS, BATTERY_CELLS = 7, 4
FULL_CELLS, SHORT_CELLS = MODE_CELLS + BATTERY_CELLS + 3, 5
"""Cells beyond mark, shape and id: with mode and battery, or only with the cause of trouble (else the mode, cut)."""


class FleetGrid(LinesView):
    """One cell for each vehicle in order of id, as wide as fits for all."""

    DEFAULT_CSS = "FleetGrid { height: 1fr; }"

    _rows: Sequence[VehicleRow] = ()
    _alarms: dict[int, list[Alarm]] = {}
    _selected: Collection[int] = ()
    _columns = 1
    _cell = 1
    _first = 0

    def show(
        self, rows: Sequence[VehicleRow], alarms: Sequence[Alarm], selected: Collection[int], lead: int | None
    ) -> None:
        """Show these vehicles; `lead`, which is looked at, stays in view."""
        self._rows, self._alarms, self._selected, self._lead = rows, by_vehicle(alarms), selected, lead
        self.update_lines()

    _lead: int | None = None

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if not self._rows:
            return [[("no vehicle here", Ink.MUTED)]]
        digits = _digits(self._rows)
        extra = _extra_cells(len(self._rows), digits, width, height)
        self._cell = 2 + digits + extra
        self._columns = max(1, width // self._cell)
        count = -(-len(self._rows) // self._columns)
        self._first = self._first_line(count, height)
        shown = range(self._first, min(count, self._first + height))
        return [[self._run(row, digits, extra) for row in self._line(y)] for y in shown]

    @staticmethod
    def has_room(rows: Sequence[VehicleRow], width: int, height: int) -> bool:
        """Whether all vehicles fit into a grid of this size."""
        columns = max(1, width // (2 + _digits(rows)))
        return -(-len(rows) // columns) <= height

    def _line(self, y: int) -> Sequence[VehicleRow]:
        return self._rows[y * self._columns : (y + 1) * self._columns]

    def _first_line(self, count: int, height: int) -> int:
        index = next((i for i, row in enumerate(self._rows) if row.id == self._lead), 0)
        line = index // self._columns
        return max(0, min(max(self._first, line - height + 1), line, count - height))

    def _run(self, row: VehicleRow, digits: int, extra: int) -> Run:
        alarms = self._alarms.get(row.id, [])
        level = level_now(row, alarms)
        selected = row.id in self._selected
        mark = MARKS[level] or (self.glyphs.selected if row.id == self._lead else " ")
        text = f"{mark}{shape(row, self.glyphs)}{row.id:>{digits}}"
        # Values of a lost vehicle are old: shown like the others they would pass for the truth (docs/threats.md D.8).
        known = row.freshness is not Freshness.LOST
        why = tag_of(alarms) or (mode_or_hand(row) if known else "LOST")
        if extra == FULL_CELLS:
            battery = number(row.battery_pct, 0, "%") if known else ""
            text += f" {why[:MODE_CELLS]:<{MODE_CELLS}}{battery:>{BATTERY_CELLS + 1}}"
        elif extra:
            text += f" {why[: SHORT_CELLS - 1]}"
        ink = SELECTED_INKS[level] if selected else INKS[level]
        return text.ljust(self._cell)[: self._cell], ink

    def on_click(self, event: events.Click) -> None:
        """Post `VehiclePicked` for the clicked vehicle."""
        offset = event.get_content_offset(self)
        if offset is None or offset.x // self._cell >= self._columns:
            return
        index = (self._first + offset.y) * self._columns + offset.x // self._cell
        if index < len(self._rows):
            self.post_message(VehiclePicked(self._rows[index].id))


def _digits(rows: Sequence[VehicleRow]) -> int:
    return max(3, *(len(str(row.id)) for row in rows), 0)


def _extra_cells(count: int, digits: int, width: int, height: int) -> int:
    """Width of cells beyond mark, shape and id with which all vehicles fit."""
    for extra in (FULL_CELLS, SHORT_CELLS):
        columns = width // (2 + digits + extra)
        if columns and -(-count // columns) <= height:
            return extra
    return 0


def shape(row: VehicleRow, glyphs: GlyphSet) -> str:
    """The shape of a vehicle: flying, by hand, armed on the ground, disarmed, lost."""
    if row.freshness is Freshness.LOST:
        return glyphs.lost
    if not row.armed:
        return glyphs.disarmed
    if row.phase is Phase.BY_HAND:
        return glyphs.by_hand
    # Headings are for maps: here all that fly have one shape, so that another one stands out.
    return glyphs.armed_on_ground if row.phase in LAND_MODE_PHASES else glyphs.headings[0]


class CauseLine(LinesView):
    """One line of alarms: three letters and the vehicles of each, the gravest first."""

    DEFAULT_CSS = "CauseLine { height: 1; }"

    _alarms: Sequence[Alarm] = ()
    _legend = ""

    def show(self, alarms: Sequence[Alarm], legend: str) -> None:
        """Show the alarms that hold; `legend` where there are none."""
        self._alarms, self._legend = alarms, legend
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        active = sorted((a for a in self._alarms if a.state in ("new", "acknowledged")), key=lambda a: -a.level)
        return [cause_runs(active, width)] if active else [[(f" {self._legend}", Ink.MUTED)]]


def cause_runs(alarms: Sequence[Alarm], width: int) -> list[Run]:
    """As many alarms as fit, and the number of those that do not."""
    runs: list[Run] = []
    used = 0
    for index, alarm in enumerate(alarms):
        level = LEVELS[alarm.level]
        vehicles = ids(alarm.vehicles) or " ".join(alarm.names)
        text = f" {MARKS[level] or ' '}{alarm.tag} {vehicles} "
        if used + len(text) > width - 8 and index < len(alarms) - 1:
            return [*runs, (f" +{len(alarms) - index} more", Ink.TEXT)]
        runs.append((text, INKS[level] if level is not Severity.NORMAL else Ink.ADVISORY))
        used += len(text)
    return runs
