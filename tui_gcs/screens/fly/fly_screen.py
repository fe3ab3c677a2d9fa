"""The fly screen: map, fleet, selected vehicle, planners, events.

A screen is layout and message handlers: messages of the feed go to the panels, keys move the view and the selection.
Commands to the fleet belong to the app, so that they work on every screen.
"""

from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical

from tui_gcs.actions import APP_ACTIONS, FLY_ACTIONS, ConsoleAction, bindings
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.protocol.common import FleetFrame, StationStatus
from tui_gcs.core.protocol.services import OnBoardRow
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import (
    EventRaised,
    FleetUpdated,
    PlannerUpdated,
    ScenarioUpdated,
    SelectionChanged,
    StationBack,
    StationLost,
    StatusUpdated,
    VehicleInfoUpdated,
)
from tui_gcs.screens.common.map_screen import MapScreen, present_round
from tui_gcs.widgets.basics.event_lines import EventLines
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.fleet.planner_panel import BriefPanel, PlannerPanel
from tui_gcs.widgets.fleet.roster import Roster, VehiclePicked
from tui_gcs.widgets.fleet.selected_panel import row_of
from tui_gcs.widgets.fleet.vehicle_alarms import by_vehicle
from tui_gcs.widgets.fleet.vehicle_detail import VehicleDetail
from tui_gcs.widgets.map.map_layers import Layer
from tui_gcs.widgets.map.map_view import MapView
from tui_gcs.widgets.map.task_markers import TASKS, task_markers

DETAIL_PERIOD_S, ON_BOARD_PERIOD_S = 1.0, 3.0
HIGH_LINES, MIN_HIGH_ROSTER = 48, 13
"""From this height of the terminal on panels are higher; the roster then has at least ten vehicles."""
MAX_ON_BOARD = 16
"""Stored plans are drawn for at most this many of the selected vehicles."""
EMPTY_LINES = 6
CURSOR_KEYS = {"add_task": "task", "measure": "measure", "cancel": "hide"}
"""What the footer calls the keys of the map's cursor while it is shown."""
# Half a second, less the jitter of frames: figures that change more often cannot be read, and cost bytes.
FIGURES_PERIOD_S = 0.45


class FlyScreen(MapScreen):
    """The screen that an operator watches while vehicles fly."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = FLY_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(FLY_ACTIONS, "fly")
    DIGITS_SELECT = True
    """A digit begins the number of a vehicle to select, see `ConsoleApp`."""
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall"), (HIGH_LINES, "-high")]
    AUTO_FOCUS = None
    CSS = """
    FlyScreen { layout: vertical; }
    FlyScreen #middle { height: 1fr; }
    FlyScreen MapView { width: 1fr; height: 1fr; }
    FlyScreen #side { width: 56; height: 1fr; }
    FlyScreen EventLines { height: 5; }
    FlyScreen.-high EventLines { height: 8; }
    FlyScreen BriefPanel { display: none; }
    FlyScreen.-narrow #side { width: 30; }
    FlyScreen.-narrow BriefPanel, FlyScreen.-short BriefPanel { display: block; }
    FlyScreen VehicleDetail { height: 13; }
    FlyScreen.-high VehicleDetail { height: 16; }
    FlyScreen.-narrow VehicleDetail, FlyScreen.-short VehicleDetail { display: none; }
    FlyScreen.-narrow PlannerPanel, FlyScreen.-short PlannerPanel { display: none; }
    FlyScreen.-short EventLines { height: 2; border: none; }
    """

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        super().__init__()
        self.feed = feed
        self._figures_s = float("-inf")
        self._states: tuple[object, ...] = ()
        self._on_board: tuple[tuple[OnBoardRow, ...], Origin | None] = ((), None)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.map_view = MapView(glyphs=glyphs)
        self.roster = Roster(glyphs=glyphs)
        self.selected_panel = VehicleDetail(glyphs=glyphs)
        self.planner_panel = PlannerPanel(glyphs=glyphs)
        self.brief_panel = BriefPanel(glyphs=glyphs)
        self.event_lines = EventLines(glyphs=glyphs)
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed)

    def compose(self) -> ComposeResult:
        """Compose top lines, map, panels, events and footer."""
        yield self.top_lines
        with Horizontal(id="middle"):
            yield self.map_view
            with Vertical(id="side"):
                yield self.roster
                yield self.selected_panel
                yield self.planner_panel
                yield self.brief_panel
        yield self.event_lines
        yield self.footer

    def on_mount(self) -> None:
        """Subscribe to the feed and show what it knows."""
        self.feed.listen(self)
        self.set_interval(DETAIL_PERIOD_S, self.request_details)
        self.set_interval(ON_BOARD_PERIOD_S, self._look_on_board)
        self.show_all()

    @property
    def cursor_m(self) -> tuple[float, float] | None:
        """ENU metres of the map's cursor; None while it is not shown."""
        return self.map_view.cursor_m

    @property
    def selected(self) -> int | None:
        """The vehicle that the panels describe."""
        return self.feed.selection.lead

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Move the vehicles on the map at every frame, and refresh the figures at most twice a second."""
        frame = self._known_frame()
        if not self.is_current or frame is None:
            return
        # In a replay and after a restart of the station the time of a frame may be before that of the last one.
        if self._at_once(frame) != self._states or not 0.0 <= frame.t_s - self._figures_s < FIGURES_PERIOD_S:
            self.show_fleet()
        else:
            self.map_view.set_fleet(frame, by_vehicle(self.feed.alarms))

    def on_status_updated(self, message: StatusUpdated) -> None:
        """Show the state of station, teams and links."""
        if self.is_current:
            self._show_scenario()
            self._show_status()
            self._show_events()

    def on_vehicle_info_updated(self, _message: VehicleInfoUpdated) -> None:
        """Show the new details of the selected vehicle."""
        if self.is_current:
            self._show_detail()

    def on_event_raised(self, _message: EventRaised) -> None:
        """Show the newest events below the map."""
        if self.is_current:
            self._show_events()

    def on_selection_changed(self, _message: SelectionChanged) -> None:
        """Show the vehicle that is selected now and ask for its details."""
        self.map_view.selected = self.selected
        if self.is_current:
            self.show_fleet()
        self.request_details()
        self._look_on_board()

    def on_scenario_updated(self, _message: ScenarioUpdated) -> None:
        """Show the zones, rounds and teams of the new scenario."""
        if self.is_current:
            self._show_scenario()

    def on_planner_updated(self, _message: PlannerUpdated) -> None:
        """Draw the new tours of the planners."""
        self._show_drawings()

    @on(StationLost)
    @on(StationBack)
    @on(events.ScreenResume)
    def show_all(self) -> None:
        """Show in every panel what the feed knows."""
        self._show_scenario()
        self._show_status()
        self.show_fleet()
        self._show_events()

    def _show_scenario(self) -> None:
        """Show the present round on the map."""
        change, status = self.feed.scenario, self.feed.status
        if change is None:
            return
        self.map_view.set_scenario(present_round(self.feed), change.scenario.places, change.scenario.origin)
        self.planner_panel.show(self._known_status(status))

    def _show_drawings(self) -> None:
        """Draw what planners draw, and the tasks that are open."""
        status = self._known_status(self.feed.status)
        tasks = task_markers(status.points if status is not None else ())
        self.map_view.set_annotations({**self.feed.annotations, TASKS: tasks} if tasks else self.feed.annotations)

    def _show_status(self) -> None:
        status = self._known_status(self.feed.status)
        self._show_drawings()
        self.planner_panel.show(status)
        row = row_of(self._known_frame(), self.selected)
        self.brief_panel.show(status, row, by_vehicle(self.feed.alarms))

    def show_fleet(self) -> None:
        """Show the fleet in the roster, the panels and on the map."""
        frame = self._known_frame()
        if frame is not None:
            self._figures_s = frame.t_s
            self._states = self._at_once(frame)
        count = len(frame.ids) if frame is not None else 0
        self.roster.styles.height = max(4, min(count + 3 if count else EMPTY_LINES, self._roster_room()))
        alarms = by_vehicle(self.feed.alarms)
        self.roster.show(frame, self.feed.selection.ids, self.selected, alarms, waiting=self._waiting())
        row = row_of(frame, self.selected)
        self._show_detail()
        self.brief_panel.show(self._known_status(self.feed.status), row, alarms)
        self.map_view.set_fleet(self.feed.frame, alarms, known=frame is not None, silent_s=self.feed.silent_s)

    def _show_detail(self) -> None:
        row = row_of(self._known_frame(), self.selected)
        alarms = by_vehicle(self.feed.alarms).get(row.id, []) if row is not None else []
        wind_m_s = self.feed.frame.wind_m_s if self.feed.frame is not None else None
        self.selected_panel.show(row, self.feed.inspection.info, alarms, wind_m_s)

    def request_details(self) -> None:
        """Ask the station for the details of the selected vehicle."""
        if self.is_current and self.selected_panel.display:
            self.feed.inspection.look_at(self.selected)

    def _look_on_board(self) -> None:
        """Draw the plans that the selected vehicles are known to hold."""
        known = self.feed.scenario is not None and not self.feed.station_lost
        if self.is_current and known and Layer.ON_BOARD not in self.map_view.content.hidden:
            self.run_worker(self._show_on_board(), group="on board", exclusive=True, exit_on_error=False)

    async def _show_on_board(self) -> None:
        selected = self.feed.selection.ids[:MAX_ON_BOARD]
        rows = await self.feed.on_board(selected) if selected else ()
        scenario = self.feed.scenario
        # Most polls bring what is drawn already.
        if scenario is None or (rows, scenario.scenario.origin) == self._on_board or not (rows or self._on_board[0]):
            return
        from tui_gcs.widgets.map.stored_plans_layer import drawings  # when there is something to draw

        self._on_board = rows, scenario.scenario.origin
        self.map_view.set_drawings(*drawings(rows, LocalFrame(scenario.scenario.origin)))

    def _show_events(self) -> None:
        status = self.feed.status
        # Before the start the mission time is 0: events are shown with the time of day.
        started = status is not None and status.mission_time_s > 0.0
        offset_s = round(status.mission_time_s - status.t_s) if status is not None and started else float("nan")
        self.event_lines.show(self.feed.events.kept, offset_s, self.feed.requests.principal)

    def _at_once(self, frame: FleetFrame) -> tuple[object, ...]:
        """Return the values that are shown at once when they change."""
        alarms = tuple((alarm.cause, alarm.state, alarm.vehicles) for alarm in self.feed.alarms)
        return (frame.ids, frame.mode, frame.armed, frame.phase, frame.freshness, frame.problem, alarms)

    def _roster_room(self) -> int:
        """Return the number of lines that the roster may take, so that the panels below have room."""
        height = self.size.height
        if height < HIGH_LINES:
            return max(4, height - (13 if height < 36 else 29))
        # Events and details are three lines higher here, and there is room for more teams than two.
        teams = len(self.feed.status.teams) if self.feed.status is not None else 0
        return max(MIN_HIGH_ROSTER, height - 35 - 2 * max(0, teams - 2))

    def _known_frame(self) -> FleetFrame | None:
        return None if self.feed.station_lost else self.feed.frame

    def _known_status(self, status: StationStatus | None) -> StationStatus | None:
        return None if self.feed.station_lost else status

    def _waiting(self) -> str:
        """Return what an empty fleet waits for."""
        status = self.feed.status
        if self.feed.station_lost or status is None:
            return "--"
        names = ", ".join(f"{link.name}: {link.datagrams} datagrams" for link in status.links)
        return f"waiting on {names or 'no link'}"

    def on_vehicle_picked(self, message: VehiclePicked) -> None:
        """Select the vehicle that was clicked."""
        self.feed.selection.set((message.vehicle,))

    def action_step(self, by: int) -> None:
        """Go to the next vehicle in the roster (1) or the previous one (-1), or among several selected ones."""
        self.feed.selection.step(by, self.feed.frame.ids if self.feed.frame is not None else ())

    def action_enter(self) -> None:
        """Ask to resume the planner: in hold it goes on."""
        self.post_message(self.ResumeRequested())

    def action_add_task(self) -> None:
        """Ask for a task of planners at the cursor; the first press only shows the cursor."""
        from tui_gcs.screens.common.point_prompt import PointPrompt  # when first asked for

        if self.feed.requests.read_only:
            self.post_message(PointPrompt.Remark(self.feed.requests.read_only))
        elif self.map_view.cursor_m is None:
            self.map_view.show_cursor()
            self.post_message(PointPrompt.Remark("arrows move the cursor; t again: a task for planners there"))
        else:
            self.run_worker(self._ask_task(), group="task", exclusive=True, exit_on_error=False)

    async def _ask_task(self) -> None:
        from tui_gcs.screens.common.point_prompt import PointPrompt

        for prompt in self.query(PointPrompt):
            prompt.ask_point()
            return
        prompt = PointPrompt(self.feed, lambda: self.map_view.cursor_m)
        await self.mount(prompt)
        prompt.ask_point()

    def on_map_view_cursor_shown(self, message: MapView.CursorShown) -> None:
        """Name the keys of the cursor in the footer while it is shown."""
        self.footer.relabel(CURSOR_KEYS if message.shown else {})

    def action_cancel(self) -> None:
        """Hide the cursor; without one stop following a vehicle."""
        if self.map_view.cursor_m is not None:
            self.map_view.show_cursor(False)
        else:
            self.map_view.follow(False)
