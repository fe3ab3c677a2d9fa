"""The base of the screens that edit: a working copy on a map, forms, questions in one line, files."""

from pathlib import Path
from textwrap import wrap
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.events import DescendantBlur, DescendantFocus
from textual.reactive import Reactive
from textual.widget import Widget
from textual.widgets import Input

from tui_gcs.actions import APP_ACTIONS, ConsoleAction
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated, StationBack, StationLost
from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.screens.common.map_screen import MapScreen
from tui_gcs.screens.common.text_dialog import LINE_CELLS, ScrolledDialog
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.drafts.draft_map import DraftMap
from tui_gcs.widgets.drafts.save_bar import SaveBar
from tui_gcs.widgets.drafts.save_flow import WorkingCopy
from tui_gcs.widgets.fleet.vehicle_alarms import by_vehicle
from tui_gcs.widgets.forms.form_findings import MAX_CELLS, EditLine, VerdictLines
from tui_gcs.widgets.forms.number_field import NumberField
from tui_gcs.widgets.forms.prompt_bar import PromptBar


class DraftScreen(MapScreen):
    """Layout and handlers that the plan screen and the missions screen share.

    Textual calls a message handler of this class in addition to the subclass's handler of the same name.
    """

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]]
    FILE_NAME: ClassVar[str]
    """The file name that is suggested while the work has no file."""
    HERE: ClassVar[str] = ""
    """The id of the action that shows this screen: the footer leaves it out."""
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]
    DEFAULT_CSS = """
    DraftScreen { layout: vertical; }
    DraftScreen #middle { height: 1fr; }
    DraftScreen DraftMap { width: 1fr; height: 1fr; }
    DraftScreen #side { width: 50; height: 1fr; }
    """
    # Textual would paint the whole screen when the cursor moves; the widgets that lose and get it are enough.
    focused: Reactive[Widget | None] = Reactive(None, repaint=False)
    map_view: DraftMap
    work_list: Widget
    """The list that has the cursor while neither a form nor the map has it."""

    def __init__(self, feed: Feed, clock: Clock, glyphs: GlyphSet, work: WorkingCopy) -> None:
        super().__init__()
        self.feed = feed
        self.clock = clock
        self.glyphs = glyphs
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.edit_line = EditLine(glyphs=glyphs)
        self.verdict = VerdictLines(glyphs=glyphs)
        self.save_bar = SaveBar(work, self.FILE_NAME)
        self.open_bar = PromptBar("open")
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here=self.HERE)
        self.feedback = KeyFeedback(clock, self.save_bar, self.set_timer, self.show_message)
        self.set_class(not glyphs.unicode, "-ascii")

    def compose(self) -> ComposeResult:
        """Compose the top lines, what is edited, the prompts and the footer."""
        yield self.top_lines
        yield self.edit_line
        with Horizontal(id="middle"):
            yield from self._compose_middle()
        yield from self._compose_prompts()
        yield self.footer

    def _compose_prompts(self) -> ComposeResult:
        """Compose the questions in one line."""
        yield self.save_bar
        yield self.open_bar

    def _compose_middle(self) -> ComposeResult:
        """Compose map, lists and forms."""
        raise NotImplementedError

    def show_message(self) -> None:
        """Show the state of the work and `feedback.message` in the edit line."""
        raise NotImplementedError

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        self.feed.listen(self)

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Move the vehicles on the map while the screen is shown."""
        if self.is_current:
            self.show_fleet()

    @on(StationLost)
    @on(StationBack)
    def show_fleet(self) -> None:
        """Draw the vehicles on the map."""
        self.map_view.set_fleet(self.feed.frame, by_vehicle(self.feed.alarms), known=not self.feed.station_lost)

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        """Show in the footer which keys work while a field has the cursor."""
        self.footer.show_typing(isinstance(event.widget, Input))

    def on_descendant_blur(self, _event: DescendantBlur) -> None:
        """Show in the footer the keys that work outside of fields."""
        self.feedback.refused_letter = False
        self.footer.show_typing(False)

    def on_number_field_refused(self, _message: NumberField.Refused) -> None:
        """Report that a letter was not taken into a number."""
        self.feedback.refused_letter = True
        self.feedback.report("")

    def action_resume(self) -> None:
        """Ask to resume the planner, as Enter does on the fly screen; not while a field has the cursor."""
        # In a field Enter goes to the next field.
        if self.focused is None or self.focused is self.work_list:
            self.post_message(self.ResumeRequested())

    def action_read_whole(self) -> None:
        """Show all remarks below the forms in a dialog: on a low terminal they are cut."""
        self.app.push_screen(RemarksDialog(self.verdict))

    def action_save(self) -> None:
        """Save the work to its file, or ask where."""
        self.save_bar.save()

    def on_save_bar_step_done(self, message: SaveBar.StepDone) -> None:
        """Report that the work was saved, or why not, or ask for a second press."""
        if message.closed:
            self.work_list.focus()
        self.feedback.show_save(message.step)

    def action_open(self) -> None:
        """Ask for the file to open."""
        self.open_bar.ask("Open")


class RemarksDialog(ScrolledDialog):
    """All remarks below the forms of an editing screen, as they were when the dialog was opened."""

    LEAVE_KEYS = (*ScrolledDialog.LEAVE_KEYS, "ctrl+r")
    title_text = "remarks about this plan"

    def __init__(self, verdict: VerdictLines) -> None:
        super().__init__(verdict.glyphs)
        self._remarks = verdict.remarks

    def all_lines(self) -> list[Line]:
        """Return every remark, wrapped to the width of the dialog."""
        return [[(part, each.ink)] for each in self._remarks for part in wrap(clean(each.text, MAX_CELLS), LINE_CELLS)]


def typed_path(text: str) -> Path | None:
    """Return the path that was typed into a prompt, `~` expanded; None if there is none."""
    text = text.strip()
    if not text or "\0" in text:
        return None
    try:
        return Path(text).expanduser()
    except RuntimeError:  # the home of a user who does not exist
        return Path(text)
