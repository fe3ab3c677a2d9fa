"""The vehicles screen: the whole fleet as a grid of cells or as a table, and the one vehicle that is looked at."""

import math
from typing import ClassVar

from textual import events
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
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.fleet.fleet_grid import CauseLine, FleetGrid
from tui_gcs.widgets.fleet.fleet_table import FleetTable, matching
from tui_gcs.widgets.fleet.vehicle_alarms import by_vehicle
from tui_gcs.widgets.fleet.vehicle_detail import VehicleDetail

LOOK_S = 1.0
FIGURES_PERIOD_S = 0.45
MOST_FILTER = 40
CHROME_LINES = 9
"""All but the fleet, at 80x24; a fleet that fits below as a table begins as one."""


class VehiclesScreen(Screen[None]):
    """Who is how, all at once."""

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
        """For this feed."""
        super().__init__()
        self.feed = feed
        self._glyphs = glyphs
        self._filter = ""
        self._figures_s = -math.inf
        self.is_typing = False
        """Keys are letters of the filter."""
        self._sorted_by = "ID"
        self._has_chosen = False
        """Grid or table: the operator has said so; before, what suits the fleet."""
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.grid = FleetGrid(glyphs=glyphs)
        self.table = FleetTable(glyphs=glyphs)
        self.cause_line = CauseLine(glyphs=glyphs)
        self.beside = VehicleDetail(glyphs=glyphs)
        self.beside.id = "beside"
        self.below = VehicleDetail(glyphs=glyphs, classes="-dense")
        self.below.id = "below"

    def compose(self) -> ComposeResult:
        """Status, alarm; grid or table; the vehicle looked at; keys."""
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
        """Listen to the feed, and have the station tell more of the vehicle looked at."""
        self.feed.listen(self)
        self.set_interval(LOOK_S, self.look)
        self.show_all()

    def on_unmount(self) -> None:
        """No more messages."""
        self.feed.leave(self)

    def on_screen_resume(self) -> None:
        """What changed while another screen was shown."""
        self.show_all()
        self.look()

    def look(self) -> None:
        """Ask for the details of who is looked at."""
        if self.is_current:
            self.feed.inspection.look_at(self.feed.selection.lead)

    # ------------------------------------------------------------ messages of the feed

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Vehicles moved: figures that flicker are written twice a second at most."""
        frame = self.feed.frame
        if frame is None or not 0.0 <= frame.t_s - self._figures_s < FIGURES_PERIOD_S:
            self.show_all()

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Alarms."""
        self.show_all()

    def on_selection_changed(self, _message: SelectionChanged) -> None:
        """Others are selected."""
        self.show_all()
        self.look()

    def on_vehicle_info_updated(self, _message: VehicleInfoUpdated) -> None:
        """More of who is looked at."""
        self.show_detail()

    def on_station_lost(self, _message: StationLost) -> None:
        """Nothing is known any more."""
        self.show_all()

    def on_station_back(self, _message: StationBack) -> None:
        """Known again."""
        self.show_all()

    # ------------------------------------------------------------ showing

    def _rows(self) -> list[VehicleRow]:
        frame = self.feed.frame
        return frame.rows() if frame is not None and not self.feed.station_lost else []

    def show_all(self) -> None:
        """Everything from what the feed knows."""
        if not self.is_current:
            return
        alarms = self.feed.alarms
        rows, selection = self._rows(), self.feed.selection
        self._figures_s = self.feed.frame.t_s if self.feed.frame is not None else -math.inf
        if not self._has_chosen:
            self.set_class(len(rows) <= self.size.height - CHROME_LINES, "-table")
        shown = matching(rows, alarms, self._filter)
        is_grid = not self.has_class("-table")
        self.set_class(is_grid and not self.grid.has_room(shown, self.size.width, self._grid_lines()), "-crowded")
        view = self.table if self.has_class("-table") else self.grid
        view.show(shown, alarms, selection.ids, selection.lead)
        self.cause_line.show(
            alarms if not self._filter and not self.is_typing else (), self._legend(len(shown), len(rows))
        )
        self.show_detail(rows)

    def _grid_lines(self) -> int:
        """Lines for cells above a panel that tells firmware and hardware, which are the first to go without room."""
        return self.size.height - CHROME_LINES

    def show_detail(self, rows: list[VehicleRow] | None = None) -> None:
        """The vehicle looked at."""
        lead = self.feed.selection.lead
        row = next((row for row in (self._rows() if rows is None else rows) if row.id == lead), None)
        frame = self.feed.frame
        alarms = by_vehicle(self.feed.alarms).get(row.id, []) if row is not None else []
        for panel in (self.beside, self.below):
            panel.show(row, self.feed.inspection.info, alarms, frame.wind_m_s if frame is not None else None)

    def _legend(self, shown: int, all_of_them: int) -> str:
        if self._filter or self.is_typing:
            cursor = "_   Enter keeps, Esc ends" if self.is_typing else "   / changes, Esc ends"
            return f"filter: {self._filter}{cursor}   {shown} of {all_of_them}"
        if self.has_class("-table"):
            return f"{all_of_them} vehicles by {self._sorted_by}"
        g = self._glyphs
        shapes = f"{g.headings[0]} flying  {g.by_hand} by hand  {g.armed_on_ground} armed on ground"
        shapes += f"  {g.disarmed} disarmed  {g.lost} lost"
        return f"{all_of_them} vehicles   {shapes}"

    # ------------------------------------------------------------ keys

    def on_key(self, event: events.Key) -> None:
        """While a filter is typed, keys are letters of it."""
        if not self.is_typing:
            return
        event.stop()
        event.prevent_default()
        if event.key in ("enter", "escape"):
            self.is_typing = False
            self._filter = "" if event.key == "escape" else self._filter
        elif event.key == "backspace":
            self._filter = self._filter[:-1]
        elif event.character is not None and event.is_printable:
            self._filter = (self._filter + event.character)[:MOST_FILTER]
        self.show_all()

    def action_filter(self) -> None:
        """Begin to type."""
        self.is_typing = True
        self.show_all()

    def action_cancel(self) -> None:
        """No filter."""
        self._filter = ""
        self.show_all()

    def action_turn_view(self) -> None:
        """Cells or lines."""
        self._has_chosen = True
        self.toggle_class("-table")
        self.show_all()

    def action_sort_next(self) -> None:
        """By the next column."""
        self._sort(1)

    def action_sort_previous(self) -> None:
        """By the one before."""
        self._sort(-1)

    def action_sort_turn(self) -> None:
        """The other way round."""
        self._sort(0, turn=True)

    def _sort(self, by: int, *, turn: bool = False) -> None:
        self._has_chosen = True
        self.add_class("-table")
        self._sorted_by = self.table.sort_by(by, turn=turn)
        self.show_all()

    def action_select_next(self) -> None:
        """The next one in the order shown."""
        self.feed.selection.step(1, self._order())

    def action_select_previous(self) -> None:
        """The one before."""
        self.feed.selection.step(-1, self._order())

    def _order(self) -> tuple[int, ...]:
        if self.has_class("-table"):
            return self.table.ids()
        return tuple(row.id for row in matching(self._rows(), self.feed.alarms, self._filter))

    def on_fleet_grid_picked(self, message: FleetGrid.Picked) -> None:
        """Clicked."""
        self.feed.selection.set((message.vehicle,))

    def on_fleet_table_picked(self, message: FleetTable.Picked) -> None:
        """Clicked."""
        self.feed.selection.set((message.vehicle,))
