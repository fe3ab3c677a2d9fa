"""The vehicles screen: the whole fleet as a grid of cells or as a table, and the details of the selected vehicle."""

import math
from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.viewer_actions import VEHICLES_ACTIONS
from tui_gcs.core.protocol.common import VehicleRow
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import (
    FleetUpdated,
    SelectionChanged,
    StationBack,
    StationLost,
    StatusUpdated,
    VehicleInfoUpdated,
)
from tui_gcs.screens.common.row_copies import copy_rows
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.widgets.basics.copied_rows import record_of
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.fleet.fleet_grid import CauseLine, FleetGrid
from tui_gcs.widgets.fleet.fleet_table import FleetTable, matching
from tui_gcs.widgets.fleet.roster import VehiclePicked
from tui_gcs.widgets.fleet.vehicle_alarms import by_vehicle
from tui_gcs.widgets.fleet.vehicle_detail import VehicleDetail

DETAIL_PERIOD_S = 1.0
FIGURES_PERIOD_S = 0.45
CHROME_LINES = 9
"""Lines of everything but the fleet at 80x24: a fleet that fits into the rest begins as a table."""


class VehiclesScreen(Screen[None]):
    """The state of every vehicle at once."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = VEHICLES_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(VEHICLES_ACTIONS, "vehicles")
    DIGITS_SELECT = True
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    AUTO_FOCUS = None
    CSS = """
    VehiclesScreen { layout: vertical; }
    VehiclesScreen #fleet { width: 1fr; height: 1fr; }
    VehiclesScreen #middle { height: 1fr; }
    VehiclesScreen FleetTable { display: none; }
    VehiclesScreen.-table FleetTable { display: block; }
    VehiclesScreen.-table FleetGrid { display: none; }
    VehiclesScreen #beside { width: 50; height: 1fr; }
    VehiclesScreen #below { display: none; height: 5; }
    VehiclesScreen.-crowded #below { height: 4; }
    VehiclesScreen.-narrow #beside { display: none; }
    VehiclesScreen.-narrow #below { display: block; }
    """

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        super().__init__()
        self.feed = feed
        self._glyphs = glyphs
        self.typed = TypedWords()
        self._figures_s = -math.inf
        self._sorted_by = "ID"
        self._copied = ""
        """What the last key copied; instead of the legend until the next key."""
        self._has_chosen = False
        """The operator has chosen grid or table; until then the size of the fleet decides."""
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.grid = FleetGrid(glyphs=glyphs)
        self.table = FleetTable(glyphs=glyphs)
        self.cause_line = CauseLine(glyphs=glyphs)
        self.beside = VehicleDetail(glyphs=glyphs)
        self.beside.id = "beside"
        self.below = VehicleDetail(glyphs=glyphs, classes="-dense")
        self.below.id = "below"

    def compose(self) -> ComposeResult:
        """Compose the top lines, grid and table, the panels of the selected vehicle, and the footer."""
        yield self.top_lines
        with Horizontal(id="middle"):
            with Vertical(id="fleet"):
                yield self.grid
                yield self.table
                yield self.cause_line
            yield self.beside
        yield self.below
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_vehicles")

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, and request the details of the selected vehicle regularly."""
        self.feed.listen(self)
        self.set_interval(DETAIL_PERIOD_S, self.request_details)
        self.show_all()

    def request_details(self) -> None:
        """Request the details of the selected vehicle."""
        if self.is_current:
            self.feed.inspection.look_at(self.feed.selection.lead)

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Show the new fleet frame; figures that flicker are written at most twice a second."""
        frame = self.feed.frame
        # In a replay and after a restart of the station the time of a frame may be before that of the last one.
        if frame is None or not 0.0 <= frame.t_s - self._figures_s < FIGURES_PERIOD_S:
            self.show_all()

    @on(events.ScreenResume)
    @on(SelectionChanged)
    def _show_selection(self) -> None:
        self.show_all()
        self.request_details()

    def on_vehicle_info_updated(self, _message: VehicleInfoUpdated) -> None:
        """Show the new details of the selected vehicle."""
        self.show_detail()

    def _rows(self) -> list[VehicleRow]:
        frame = self.feed.frame
        return frame.rows() if frame is not None and not self.feed.station_lost else []

    @on(StatusUpdated)
    @on(StationLost)
    @on(StationBack)
    def show_all(self) -> None:
        """Show everything that the feed knows."""
        if not self.is_current:
            return
        alarms = self.feed.alarms
        rows, selection = self._rows(), self.feed.selection
        self._figures_s = self.feed.frame.t_s if self.feed.frame is not None else -math.inf
        # A small fleet is read better as a table, a large one fits only as a grid.
        if not self._has_chosen:
            self.set_class(len(rows) <= self.size.height - CHROME_LINES, "-table")
        shown = matching(rows, alarms, self.typed.words)
        is_grid = not self.has_class("-table")
        self.set_class(is_grid and not self.grid.has_room(shown, self.size.width, self._grid_lines()), "-crowded")
        view = self.table if self.has_class("-table") else self.grid
        view.show(shown, alarms, selection.ids, selection.lead)
        has_words = bool(self.typed.words or self.typed.is_typing or self._copied)
        self.cause_line.show(() if has_words else alarms, self._legend(len(shown), len(rows)))
        self.show_detail(rows)

    def _grid_lines(self) -> int:
        # For cells above a panel with firmware and hardware, which are dropped first without room.
        return self.size.height - CHROME_LINES

    def show_detail(self, rows: list[VehicleRow] | None = None) -> None:
        """Show the details of the selected vehicle."""
        lead = self.feed.selection.lead
        row = next((row for row in (self._rows() if rows is None else rows) if row.id == lead), None)
        frame = self.feed.frame
        alarms = by_vehicle(self.feed.alarms).get(row.id, []) if row is not None else []
        for panel in (self.beside, self.below):
            panel.show(row, self.feed.inspection.info, alarms, frame.wind_m_s if frame is not None else None)

    def _legend(self, shown: int, all_of_them: int) -> str:
        if self._copied:
            return self._copied
        if self.typed.words or self.typed.is_typing:
            cursor = "_   Enter keeps, Esc ends" if self.typed.is_typing else "   / changes, Esc ends"
            return f"filter: {self.typed.words}{cursor}   {shown} of {all_of_them}"
        if self.has_class("-table"):
            return f"{all_of_them} vehicles by {self._sorted_by}"
        g = self._glyphs
        shapes = f"{g.headings[0]} flying  {g.by_hand} by hand  {g.armed_on_ground} armed on ground"
        shapes += f"  {g.disarmed} disarmed  {g.lost} lost"
        return f"{all_of_them} vehicles   {shapes}"

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the filter while it is typed."""
        if self.typed.take(event):
            self.show_all()

    def action_filter(self) -> None:
        """Begin to type the filter."""
        self.typed.is_typing, self._copied = True, ""
        self.show_all()

    def action_cancel(self) -> None:
        """End the filter: all vehicles are shown."""
        self.typed.words = self._copied = ""
        self.show_all()

    def action_copy_row(self) -> None:
        """Copy what is known of the vehicle looked at to the terminal's clipboard."""
        self._copy([row for row in self._rows() if row.id == self.feed.selection.lead])

    def action_copy_rows(self) -> None:
        """Copy what is known of the vehicles shown to the terminal's clipboard, in their order."""
        rows = {row.id: row for row in self._rows()}
        self._copy([rows[vehicle] for vehicle in self._order() if vehicle in rows])

    def _copy(self, rows: list[VehicleRow]) -> None:
        self._copied, _ = copy_rows(self.app, [record_of(row) for row in rows])
        self.show_all()

    def action_turn_view(self) -> None:
        """Switch between grid and table."""
        self._copied = ""
        self._has_chosen = True
        self.toggle_class("-table")
        self.show_all()

    def action_sort(self, by: int, turn: bool = False) -> None:
        """Sort the table by the next column (1) or the previous one (-1), or reverse its order."""
        self._has_chosen = True
        self._copied = ""
        self.add_class("-table")
        self._sorted_by = self.table.sort_by(by, turn=turn)
        self.show_all()

    def action_step(self, by: int) -> None:
        """Select the next vehicle in the order shown (1), or the previous one (-1)."""
        self._copied = ""
        self.feed.selection.step(by, self._order())

    def _order(self) -> tuple[int, ...]:
        if self.has_class("-table"):
            return self.table.ids()
        return tuple(row.id for row in matching(self._rows(), self.feed.alarms, self.typed.words))

    def on_vehicle_picked(self, message: VehiclePicked) -> None:
        """Select the vehicle that was clicked."""
        self.feed.selection.set((message.vehicle,))
