"""What screens that edit have in common: a working copy shown on a map, forms, second presses, files."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.events import DescendantBlur, DescendantFocus
from textual.reactive import Reactive
from textual.widget import Widget
from textual.widgets import Input

from tui_gcs.actions import APP_ACTIONS, ConsoleAction
from tui_gcs.core.base.clock import Clock
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated, StationBack, StationLost
from tui_gcs.screens.common.confirm_press import EXPIRES_S, SecondPress
from tui_gcs.screens.common.map_screen import MapScreen
from tui_gcs.screens.common.remarks_dialog import RemarksDialog
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.drafts.draft_map import DraftMap
from tui_gcs.widgets.drafts.save_bar import SaveBar
from tui_gcs.widgets.drafts.save_flow import SaveNext, WorkingCopy
from tui_gcs.widgets.fleet.vehicle_alarms import by_vehicle
from tui_gcs.widgets.forms.form_findings import EditLine, Remark, VerdictLines
from tui_gcs.widgets.forms.number_field import NumberField
from tui_gcs.widgets.missions.open_bar import OpenBar

NO_LETTER = "numbers only: a letter was NOT taken, look at the number"


class DraftScreen(MapScreen):
    """The parts and handlers; Textual calls a handler of this class beside the screen's own one of the same name.

    Classes in between derive from this one, one from the other: of several bases Textual takes the first's CSS only.
    """

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]]
    FILE_NAME: ClassVar[str]
    """Offered where the work has no file yet."""
    HERE: ClassVar[str] = ""
    """The screen, in the footer."""
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]
    DEFAULT_CSS = """
    DraftScreen { layout: vertical; }
    DraftScreen #middle { height: 1fr; }
    DraftScreen DraftMap { width: 1fr; height: 1fr; }
    DraftScreen #side { width: 50; height: 1fr; }
    """
    focused: Reactive[Widget | None] = Reactive(None, repaint=False)
    """Where the cursor goes Textual would paint the whole screen; the widgets it leaves and comes to are enough."""
    map_view: DraftMap
    work_list: Widget
    """Has the cursor while neither a form nor the map has it."""

    def __init__(self, feed: Feed, clock: Clock, glyphs: GlyphSet, work: WorkingCopy) -> None:
        """For this feed and this work."""
        super().__init__()
        self.feed = feed
        self.clock = clock
        self.glyphs = glyphs
        self.message = Remark("")
        self._took_no_letter = False
        self._second = SecondPress(clock)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.edit_line = EditLine(glyphs=glyphs)
        self.verdict = VerdictLines(glyphs=glyphs)
        self.save_bar = SaveBar(work, self.FILE_NAME)
        self.open_bar = OpenBar()
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here=self.HERE)
        self.set_class(not glyphs.unicode, "-ascii")

    def compose(self) -> ComposeResult:
        """Status, alarm, state of the work; what is edited; keys."""
        yield self.top_lines
        yield self.edit_line
        with Horizontal(id="middle"):
            yield from self.compose_middle()
        yield from self.compose_questions()
        yield self.footer

    def compose_questions(self) -> ComposeResult:
        """What is asked in one line."""
        yield self.save_bar
        yield self.open_bar

    def compose_middle(self) -> ComposeResult:
        """Map, lists, forms."""
        raise NotImplementedError

    def show_message(self) -> None:
        """The state of the work, and `message`."""
        raise NotImplementedError

    # ------------------------------------------------------------ the feed

    def on_mount(self) -> None:
        """Listen to the feed."""
        self.feed.listen(self)

    def on_unmount(self) -> None:
        """No more messages."""
        self.feed.leave(self)

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Vehicles moved."""
        if self.is_current:
            self.show_fleet()

    def on_station_lost(self, _message: StationLost) -> None:
        """Nothing is known of the vehicles."""
        self.show_fleet()

    def on_station_back(self, _message: StationBack) -> None:
        """Known again."""
        self.show_fleet()

    def show_fleet(self) -> None:
        """Vehicles on the map."""
        self.map_view.set_fleet(self.feed.frame, by_vehicle(self.feed.alarms), known=not self.feed.station_lost)

    # ------------------------------------------------------------ what became of a key

    def say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Tell it; a question that waited for its second press is over.

        Letters that were not taken into a number stay told while that is typed: 3o5 would be 35.
        """
        if not text and self._took_no_letter:
            text, ink = NO_LETTER, Ink.CAUTION
        self._second.forget()
        self.save_bar.forget()
        self.message = Remark(text, ink)
        self.show_message()

    def confirmed(self, what: str, question: str) -> bool:
        """Whether this is the second press of the same key in a row, and soon enough; the first one asks."""
        if self._second.answers(what):
            return True
        self.save_bar.forget()
        self._ask(question)
        return False

    def _ask(self, question: str) -> None:
        self.message = Remark(question, Ink.CAUTION)
        self.set_timer(EXPIRES_S, self._expire)
        self.show_message()

    def _expire(self) -> None:
        """Nobody answered: the same key asks anew."""
        if self._second.is_over or self.save_bar.asks:
            self.say(f"nothing done: no second key within {EXPIRES_S:.0f} s")

    # ------------------------------------------------------------ the cursor

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        """Other keys work while something is typed."""
        self.footer.show_typing(isinstance(event.widget, Input))

    def on_descendant_blur(self, _event: DescendantBlur) -> None:
        """A field was left."""
        self._took_no_letter = False
        self.footer.show_typing(False)

    def on_number_field_refused(self, _message: NumberField.Refused) -> None:
        """A letter would be no number."""
        self._took_no_letter = True
        self.say("")

    def action_resume(self) -> None:
        """Enter outside a field means the same as on the fly screen."""
        if self.focused is None or self.focused is self.work_list:
            self.post_message(self.ResumeRequested())

    # ------------------------------------------------------------ files

    def action_read_whole(self) -> None:
        """What stands below the forms, where it is cut."""
        self.app.push_screen(RemarksDialog(self.verdict))

    def action_save(self) -> None:
        """To the work's file, or ask where."""
        self.save_bar.save()

    def on_save_bar_said(self, message: SaveBar.Said) -> None:
        """Saved, asked or failed."""
        if message.closed:
            self.work_list.focus()
        step = message.step
        self._second.forget()
        if step.what is SaveNext.CONFIRM:
            self._ask(step.text)
            return
        self.message = Remark(step.text, Ink.TEXT if step.what is SaveNext.DONE else Ink.CAUTION)
        self.show_message()

    def action_open(self) -> None:
        """Which file?"""
        self.open_bar.ask()
