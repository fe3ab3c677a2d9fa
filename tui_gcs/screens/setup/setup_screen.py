"""The setup screen: layout, sections and keys."""

from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.setup_actions import SETUP_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.float32 import shown
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.setup import SectionWord
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import SelectionChanged, StationBack, StationLost
from tui_gcs.feed.setup_watch import FleetSetupField, SetupWatch
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.setup.setup_edits import SetupEdits
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowPicked, RowsView
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.setup.setup_lists import FieldList, SectionList
from tui_gcs.widgets.setup.setup_panel import SetupPanel

FIRST: SectionWord = "airframe"

ENTER_WORDS = {"calibrate": "calibrate", "motor": "test motor", "none": ""}
"""What Enter does with a line that is no parameter."""


class SetupScreen(PolledScreen):
    """The setup of the selected vehicles, or of all while none is selected."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = SETUP_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(SETUP_ACTIONS, "setup")
    LOOK_S = 0.7
    CSS = """
    SetupScreen { layout: vertical; }
    SetupScreen #middle { height: 1fr; }
    SetupScreen.-narrow SectionList { width: 20; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show the setup of vehicles of the station of `feed`."""
        super().__init__(feed)
        self._glyphs = glyphs
        self._listed: SectionWord = FIRST
        """The section whose lines were asked for last."""
        self._asked: FleetSetupField | None = None
        """The line that a value is being typed for."""
        self.watch_setup = SetupWatch(feed.requests, self.show_all)
        self.edits = SetupEdits(self, feed, clock, glyphs, self.show_all)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.section_list = SectionList(glyphs=glyphs)
        self.field_list = FieldList(glyphs=glyphs)
        self.panel = SetupPanel(glyphs=glyphs)
        self.value_bar = PromptBar("value")
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_setup")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel, the question and the footer."""
        yield self.top_lines
        with Horizontal(id="middle"):
            yield self.section_list
            yield self.field_list
        yield self.panel
        yield self.value_bar
        yield self.footer

    @on(events.ScreenResume)
    @on(SelectionChanged)
    @on(StationBack)
    def look_again(self) -> None:
        """Look at once."""
        self.show_all()
        self.look()

    async def ask_station(self) -> None:
        """Ask how the setup of the shown vehicles stands, with the lines of the chosen section."""
        await self.watch_setup.look(self.feed.shown_vehicles(), self.section)

    @property
    def section(self) -> SectionWord:
        """The chosen section."""
        row = self.section_list.chosen_row
        return row.section if row is not None else FIRST

    @property
    def row_list(self) -> RowsView[Any]:
        """The list that keys are for: the sections, or the lines of one."""
        return self.section_list if self.section_list.is_active else self.field_list

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show what is known; the same section and line stay chosen."""
        if not self.is_current:
            return
        vehicles = self.feed.shown_vehicles()
        silent = "   STATION SILENT" if self.feed.station_lost else ""
        self.section_list.empty_text = "no vehicle heard" if not vehicles else "asking the station"
        self.field_list.empty_text = "R reads it from the vehicles"
        self.section_list.show_kept(self.watch_setup.sections, lambda row: row.section)
        self.field_list.vehicles = vehicles
        self.field_list.show_kept(self.watch_setup.fields, lambda row: row.key)
        set_title(self.section_list, vehicles_words(vehicles) if vehicles else "setup")
        all_ = "" if self.feed.selection.ids else "   looking only: s selects vehicles"
        set_title(self.field_list, f"{self.section}{all_}{silent}")
        self.footer.relabel(self._labels())
        self.panel.show(
            self.watch_setup.tasks,
            self.feed.selection.lead,
            self.section_list.chosen_row,
            self.field_list.chosen_row,
            self.edits.report,
        )

    def _labels(self) -> dict[str, str]:
        """Return what keys are called now: Enter is for the chosen line, d and Del for what is under way."""
        tasks, field = self.watch_setup.tasks, self.field_list.chosen_row
        act = ENTER_WORDS.get(field.row.act, "set") if field is not None else "set"
        labels = {"edit": "open" if self.section_list.is_active else act}
        if not any(task.waits for task in tasks):
            labels["confirm"] = ""
        labels["end_led"] = "cancel" if tasks else ""
        return labels

    def show_chosen(self) -> None:
        """Show the lines of a section that was chosen, or the chosen line."""
        if self.section_list.is_active and self.section != self._listed:
            # The lines of the section before would stand below the new title until the station has answered.
            self._listed = self.section
            self.watch_setup.fields = ()
            self.field_list.chosen = 0
            lines = self.watch_setup.look_at(self.feed.shown_vehicles(), self.section)
            self.run_worker(lines, group="section", exclusive=True, exit_on_error=False)
        self.show_all()

    def on_row_picked(self, message: RowPicked) -> None:
        """Choose the row that was clicked, and its list."""
        self._go_to(sections=message.view is self.section_list)
        super().on_row_picked(message)

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.edits.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def _go_to(self, *, sections: bool) -> None:
        self.section_list.is_active, self.field_list.is_active = sections, not sections
        self.show_all()

    def action_next_view(self) -> None:
        """Go from the sections to the lines of one, or back."""
        self._go_to(sections=not self.section_list.is_active)

    def action_to_sections(self) -> None:
        """Go to the list of sections."""
        self._go_to(sections=True)

    def action_to_fields(self) -> None:
        """Go to the lines of the chosen section."""
        self._go_to(sections=False)

    def action_edit(self) -> None:
        """Do what the chosen line is for; from the list of sections, go to the lines."""
        if self.section_list.is_active:
            self.action_to_fields()
            return
        field = self.field_list.chosen_row
        if field is None or not self._may_change():
            return
        if not self.edits.vehicles_of(field):
            self.edits.say("no selected vehicle has this line", Ink.CAUTION)
        elif field.row.act == "calibrate":
            self.edits.calibrate(field)
        elif field.row.act == "motor":
            self.edits.test_motor(field)
        elif field.row.act == "none":
            self.edits.say("no parameter chooses this", Ink.CAUTION)
        elif field.row.choices:
            self.edits.choose(field)
        else:
            self._ask_value(field)

    def _ask_value(self, field: FleetSetupField) -> None:
        number = field.number_of(self.feed.selection.lead)
        unit = f" ({field.row.unit})" if field.row.unit else ""
        self._asked = field
        self.value_bar.ask(f"{field.row.param}{unit} =", shown(number) if number is not None else "")

    @on(PromptBar.Answered, "#value")
    def _set_value(self, message: PromptBar.Answered) -> None:
        field, self._asked = self._asked, None
        self.set_focus(None)
        if message.text is not None and field is not None:
            self.edits.set(field, message.text)

    def action_confirm(self) -> None:
        """Report that the prompt was followed."""
        if self._may_change():
            self.edits.confirm(self.watch_setup.tasks)

    def action_end_led(self) -> None:
        """Stop motor tests, or ask whether calibrations are to be cancelled."""
        if self._may_change():
            self.edits.end_led(self.watch_setup.tasks)

    def action_undo(self) -> None:
        """Take the last change of the section back."""
        if self._may_change():
            self.edits.undo(self.section, self.field_list.chosen_row)

    def action_undo_all(self) -> None:
        """Ask whether all changes of gains are to be taken back."""
        if self._may_change():
            self.edits.undo_all()

    def action_fetch(self) -> None:
        """Read the section from the shown vehicles; all sections while the list of them is used."""
        self.edits.fetch(self.feed.shown_vehicles(), None if self.section_list.is_active else self.section)

    def action_cancel(self) -> None:
        """Forget the report of the last key."""
        self.edits.report = ()
        self.show_all()

    def _may_change(self) -> bool:
        why = self.edits.why_not()
        if why:
            self.edits.say(why, Ink.CAUTION)
        return not why
