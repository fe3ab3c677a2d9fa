"""The traffic screen: layout, views and keys."""

import math
from collections.abc import Callable
from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.traffic_actions import TRAFFIC_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.common import AddPoints, CancelPoints
from tui_gcs.core.protocol.setup import HearTraffic
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StationBack, StationLost
from tui_gcs.feed.traffic.contact_watch import ContactWatch
from tui_gcs.screens.common.point_prompt import PointPrompt
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.traffic.traffic_lists import ContactList, PointList, TrafficPanel

Request = AddPoints | CancelPoints | HearTraffic

OF_CONTACTS = {"end_point": ""}
OF_POINTS = {"next_view": "traffic", "end_point": "cancel", "hear": "", "select": ""}
"""Labels of the footer in each view; no vehicle is selected for a task of planners."""


class TrafficScreen(PolledScreen):
    """What flies beside the fleet, and what planners are to visit."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = TRAFFIC_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(TRAFFIC_ACTIONS, "traffic")
    LOOK_S = 1.0
    CSS = """
    TrafficScreen { layout: vertical; }
    TrafficScreen.-points ContactList { display: none; }
    TrafficScreen.-points PointList { display: block; }
    """

    def __init__(
        self,
        feed: Feed,
        clock: Clock,
        *,
        cursor: Callable[[], tuple[float, float] | None] = lambda: None,
        glyphs: GlyphSet = UNICODE,
    ) -> None:
        """Show contacts of the station of `feed`; `cursor` is where the cursor of the fly screen's map is."""
        super().__init__(feed)
        self._clock = clock
        self._glyphs = glyphs
        self.watch_contacts = ContactWatch(feed, self.show_all)
        self.edits = ScreenEdits(self, feed, clock, glyphs, self.show_all)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.contact_list = ContactList(glyphs=glyphs)
        self.point_list = PointList(glyphs=glyphs)
        self.panel = TrafficPanel(glyphs=glyphs)
        self.point_bar = PointPrompt(feed, cursor)
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_traffic")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel, the question and the footer."""
        yield self.top_lines
        yield self.contact_list
        yield self.point_list
        yield self.panel
        yield self.point_bar
        yield self.footer

    @on(events.ScreenResume)
    @on(StationBack)
    def look_again(self) -> None:
        """Look at once."""
        self.look()

    async def ask_station(self) -> None:
        """Ask for ADS-B and Remote ID."""
        await self.watch_contacts.look()

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show what is known; the same row stays chosen while others come and go."""
        if not self.is_current:
            return
        status = self.feed.status
        points = sorted(status.points, key=lambda point: point.state != "open") if status is not None else []
        self.point_list.now_s = status.t_s if status is not None else math.nan
        self.contact_list.show_kept(self.watch_contacts.contacts(), lambda each: (each.seen.kind, each.seen.name))
        self.point_list.show_kept(points, lambda point: point.name)
        silent = "   STATION SILENT" if self.feed.station_lost else ""
        near = sum(contact.is_near for contact in self.contact_list.rows)
        set_title(self.contact_list, f"beside the fleet  {len(self.contact_list.rows)}   {near} near{silent}")
        set_title(self.point_list, f"tasks for planners  {sum(point.state == 'open' for point in points)} open{silent}")
        self.footer.relabel(OF_POINTS if self.has_class("-points") else OF_CONTACTS)
        self.panel.show(self.row_list.chosen_row, self.edits.report)

    def show_chosen(self) -> None:
        """Show the chosen row."""
        self.show_all()

    @property
    def row_list(self) -> RowsView[Any]:
        """The contacts, or the tasks."""
        return self.point_list if self.has_class("-points") else self.contact_list

    async def _send(self, request: Request) -> None:
        reply = await self.feed.requests.send(request)
        refused = "; ".join(f"vehicle {each.vehicle}: {each.text}" for each in reply.results if not each.ok)
        if reply.ok:
            self.edits.say(reply.text or "asked", Ink.NORMAL)
        else:
            self.edits.say(f"NOT DONE: {refused or reply.text}", Ink.WARNING)

    def _begin(self, request: Request) -> None:
        self.run_worker(self._send(request), group="send", exit_on_error=False)

    def _may_command(self) -> bool:
        if why := self.feed.requests.read_only:
            self.edits.say(why, Ink.CAUTION)
        return not why

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.edits.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def action_next_view(self) -> None:
        """Show the contacts, or the tasks for planners."""
        self.toggle_class("-points")
        self.show_all()

    def action_cancel(self) -> None:
        """Forget the report of the last key."""
        self.edits.report = ()
        self.show_all()

    def action_hear(self) -> None:
        """Have the selected vehicles report what their receivers hear."""
        if not self._may_command():
            return
        if self.feed.selection.ids:
            self._begin(HearTraffic(self.feed.selection.ids))
        else:
            self.edits.say("no vehicle is selected: a number or s selects those with a receiver", Ink.CAUTION)

    def action_add_point(self) -> None:
        """Ask where planners are to send a vehicle."""
        if self._may_command():
            self.point_bar.ask_point()

    @on(PointPrompt.Typed)
    def _add_point(self, message: PointPrompt.Typed) -> None:
        message.stop()
        self._begin(AddPoints((message.point,)))

    @on(PointPrompt.Remark)
    def _refuse_point(self, message: PointPrompt.Remark) -> None:
        message.stop()
        self.edits.say(message.text, Ink.CAUTION)

    def action_end_point(self) -> None:
        """Ask whether the chosen task is to be cancelled."""
        point = self.point_list.chosen_row if self.has_class("-points") else None
        if not self._may_command():
            return
        if point is None or point.state != "open":
            why = "choose a task first: Tab shows them" if point is None else f"{clean(point.name)} is {point.state}"
            self.edits.say(why, Ink.CAUTION)
            return

        def answered(yes: bool | None) -> None:
            if yes:
                self._begin(CancelPoints((point.name,)))
            else:
                self.edits.say("left as it is")

        title = f"cancel task {clean(point.name)}"
        reasons = ["a vehicle that is on its way there goes on with its planner's other work"]
        self.app.push_screen(SureDialog(title, reasons, "cancel it", self._glyphs, self._clock), answered)
