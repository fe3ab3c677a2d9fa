"""The missions screen: what is planned for each vehicle, all ways on one map, and what they come to.

What is edited here is a draft of this console; vehicles get it only by an upload that is asked about. Every edit can be
taken back, and unsaved work is there again after a crash.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.events import DescendantBlur
from textual.timer import Timer
from textual.widgets import Input

from tui_gcs.actions import ConsoleAction, bindings
from tui_gcs.actions.mission_actions import MISSION_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.missions.draft_file import DraftFileError
from tui_gcs.core.missions.mission_conflicts import Conflict
from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import PlannerUpdated, ScenarioUpdated, StatusUpdated
from tui_gcs.screens.common.map_screen import present_round
from tui_gcs.screens.missions.mission_copies import MissionCopies
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.drafts.draft_map import DraftMap
from tui_gcs.widgets.forms.choice import Choice
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.forms.form_text import FieldError
from tui_gcs.widgets.missions.altitude_profile import AltitudeProfile
from tui_gcs.widgets.missions.generate_form import GenerateForm
from tui_gcs.widgets.missions.item_form import ItemForm
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_files import FILE_NAME, MissionFile
from tui_gcs.widgets.missions.mission_map import drawings
from tui_gcs.widgets.missions.mission_remarks import mission_remarks, state_remark
from tui_gcs.widgets.missions.mission_table import COLUMNS_TITLE, ItemTable, PlanList
from tui_gcs.widgets.missions.mission_text import ItemText, item_text, item_title, to_item
from tui_gcs.widgets.missions.open_bar import OpenBar
from tui_gcs.widgets.missions.performance_form import PerformanceForm

COMPARE_S = 0.2
"""Ways are compared with each other so long after the last edit: keys do not wait for it."""
SLICE_S, BREATH_S = 0.02, 0.01
"""And then for so long at a time, with a pause for keys."""
KEEP_S = 1.0
"""And so long after it the work is kept against crashes."""
ITEM_HEADING, WHOLE_HEADING = "moving the item: arrows, Esc", "moving ALL items: arrows, Esc"
CURSOR_HEADING = "cursor: arrows, + adds, Esc"


class MissionsScreen(MissionCopies):
    """Edits missions, fences and rally points; knows widgets and the draft, nothing of protocols."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = MISSION_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(MISSION_ACTIONS, "missions")
    FILE_NAME = FILE_NAME
    HERE = "missions"
    AUTO_FOCUS = "ItemTable"
    CSS = """
    MissionsScreen #left { width: 1fr; height: 1fr; }
    MissionsScreen #vehicles, MissionsScreen #items { border: solid #4a5560; border-title-color: #d8dee4; }
    MissionsScreen.-ascii #vehicles, MissionsScreen.-ascii #items { border: ascii #4a5560; }
    MissionsScreen #vehicles { height: 12; }
    MissionsScreen #items { height: 1fr; }
    MissionsScreen VerdictLines { height: 5; }
    MissionsScreen.-narrow #side { width: 42; }
    MissionsScreen.-short #vehicles { height: 5; border-bottom: none; }
    MissionsScreen.-short VerdictLines { height: 2; }
    MissionsScreen.-short AltitudeProfile { height: 5; }
    MissionsScreen.-generating #items, MissionsScreen.-generating ItemForm { display: none; }
    MissionsScreen.-assuming ItemForm { display: none; }
    MissionsScreen.-generating VerdictLines { height: 1fr; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, folder: Path | None = None, glyphs: GlyphSet = UNICODE) -> None:
        """For this feed; work in progress is kept in `folder`, nowhere if that is None."""
        self.editor = MissionEditor()
        self.file = MissionFile(self.editor, folder)
        super().__init__(feed, clock, glyphs, self.file)
        self._clock = clock
        self._problem = ""
        self._moves_whole = False
        self._first_site = True
        self._compare: Timer | None = None
        self._keep: Timer | None = None
        self.map_view = DraftMap(glyphs=glyphs)
        self.profile = AltitudeProfile(self.editor, glyphs=glyphs)
        self.plan_list = PlanList(self.editor, glyphs=glyphs)
        self.work_list = self.item_table = ItemTable(self.editor, glyphs=glyphs)
        self._vehicles_panel, self._items_panel = Vertical(id="vehicles"), Vertical(id="items")
        self.item_form = ItemForm(glyphs=glyphs)
        self.generate_form = GenerateForm(glyphs=glyphs)
        self.performance_form = PerformanceForm(glyphs=glyphs)

    def compose_middle(self) -> ComposeResult:
        """Map, profile, lists, form."""
        with Vertical(id="left"):
            yield self.map_view
            yield self.profile
        with Vertical(id="side"):
            with self._vehicles_panel:
                yield self.plan_list
            with self._items_panel:
                yield self.item_table
            yield self.item_form
            yield self.generate_form
            yield self.performance_form
            yield self.verdict

    def on_mount(self) -> None:
        """What a crash left is there again."""
        self._take_site()
        try:
            recovered = self.file.recover()
        except DraftFileError as error:
            recovered = f"work in progress is not kept: {error}"
        if recovered:
            self.say(recovered, Ink.CAUTION)
        self.told = [Remark(f"of another console, not saved: {path}", Ink.CAUTION) for path in self.file.waiting]
        self.show_all()

    def on_unmount(self) -> None:
        """What is in progress is kept."""
        self._keep_work()
        self.file.close()

    def on_screen_resume(self) -> None:
        """What changed while another screen was shown."""
        self._take_site()
        self.show_all()

    # ------------------------------------------------------------ messages of the feed

    def on_scenario_updated(self, _message: ScenarioUpdated) -> None:
        """Another place, perhaps."""
        self._take_site()
        self.show_all()

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Perhaps another round is flown, with another area."""
        if self.is_current and self._take_site():
            self.show_all()

    def on_planner_updated(self, _message: PlannerUpdated) -> None:
        """Another tour, perhaps."""
        if self.is_current and self._take_site():
            self.show_all()

    def _take_site(self) -> bool:
        """Plan where the station flies; whether that changed anything."""
        current = present_round(self.feed)
        if self.feed.scenario is None or current is None:
            return False
        scenario = self.feed.scenario.scenario
        rows = self.feed.frame.rows() if self.feed.frame is not None else []
        self.map_view.set_scenario(current, scenario.places, scenario.origin)
        changed = self.editor.set_site(scenario, current, rows, self.feed.annotations)
        if self._first_site and self.feed.selection.lead is not None:
            self.editor.choose_vehicle(self.feed.selection.lead)
        self._first_site = False
        return changed

    # ------------------------------------------------------------ showing

    def show_all(self, *, form: bool | None = None) -> None:
        """Everything from the draft; the form (None) only where the operator does not type."""
        form = not isinstance(self.focused, Input | Choice) if form is None else form
        self.show_fleet()
        self._problem = "" if form else self._problem
        self.map_view.set_drawings(*drawings(self.editor))
        self.profile.update_lines()
        self._show_lists()
        if form:
            self.show_form()
        self._later()

    def _show_lists(self) -> None:
        editor = self.editor
        self.show_transfers()
        set_title(self._items_panel, f"vehicle {editor.vehicle}  {editor.kind.word} of {len(editor.items)}")
        set_title(self.profile, f"height of vehicle {editor.vehicle}")
        self.item_table.update_lines()
        self.show_message()
        self.verdict.show(mission_remarks(editor, self._problem, self.told))

    def show_transfers(self) -> None:
        """How far plans on their way are: each, and above all together."""
        self.plan_list.show(self.transfers.states())
        overall = self.transfers.overall()
        title = COLUMNS_TITLE if self.has_class("-short") else "missions"
        hidden = self.plan_list.hidden if self.has_class("-short") else 0  # there is no border below it
        more = f" +{hidden}:n" if hidden else ""
        set_title(self._vehicles_panel, (f"sending {overall}" if overall else title) + more)

    def on_plan_list_others_hidden(self, _message: PlanList.OthersHidden) -> None:
        """How many more there are, where no border below tells it."""
        self.show_transfers()

    def on_resize(self) -> None:
        """Perhaps the columns are named elsewhere now; whether it is low, Textual says after this."""
        self.call_after_refresh(self.show_transfers)

    def show_form(self) -> None:
        """The edited item; what was typed and not allowed is gone."""
        editor, item = self.editor, self.editor.item
        texts = item_text(editor, item) if item is not None else ItemText()
        self.item_form.show(item, texts, editor.kind, item_title(editor, item) if item is not None else "")

    def _later(self) -> None:
        """Compare ways, and keep the work, once the operator pauses."""
        for timer in (self._compare, self._keep):
            if timer is not None:
                timer.stop()
        self._compare = self.set_timer(COMPARE_S, self.compare_ways)
        self._keep = self.set_timer(KEEP_S, self._keep_work)

    def compare_ways(self) -> None:
        """Where do they meet? Many long ways take a while: keys come between."""
        self._compare_on(self.editor.forecast.comparing(), self.editor.forecast.conflicts)

    def _compare_on(self, comparing: Iterator[None], before: list[Conflict]) -> None:
        until_s = self._clock.now() + SLICE_S
        for _ in comparing:
            if self._clock.now() >= until_s:
                self._compare = self.set_timer(BREATH_S, partial(self._compare_on, comparing, before))
                return
        if self.editor.forecast.conflicts != before:
            self.map_view.set_drawings(*drawings(self.editor))
            self._show_lists()

    def _keep_work(self) -> None:
        try:
            self.file.keep()
        except DraftFileError as error:
            self.say(f"work in progress is not kept: {error}", Ink.CAUTION)

    def show_message(self) -> None:
        """How far the draft is from the file, and what became of a key."""
        self.edit_line.show(state_remark(self.editor.history), self.message)

    def did(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """The draft, or what is edited of it, changed."""
        self.told = []
        self.say(text, ink)
        self.show_all(form=True)

    # ------------------------------------------------------------ leaving

    def action_leave(self) -> None:
        """Back to the list; a preview is dropped."""
        if self.has_class("-assuming"):
            self._show_class("-assuming", on=False)
            self.performance_form.display = False
        if self.has_class("-generating"):
            self._end_generating()
            self.editor.drop_preview()
            self.did("nothing generated")
            return
        self.item_table.focus()
        self.did("a value that was not allowed was put back" if self._problem else "")

    def on_descendant_blur(self, _event: DescendantBlur) -> None:
        """A field was left: what comes next is another edit."""
        self.editor.history.end_subject()

    # ------------------------------------------------------------ editing

    def on_item_form_edited(self, message: ItemForm.Edited) -> None:
        """Take over what was typed, or say why not."""
        item = self.editor.item
        if item is None:
            return
        try:
            new = to_item(self.editor, message.texts, item)
        except FieldError as error:
            self._problem = str(error)
            self.editor.retract()
            self.show_all(form=False)
            return
        self._problem = ""
        self.editor.replace_item(new, message.field)
        self.told = []
        self.say("")
        self.show_all(form=message.field == "command")

    def action_add(self) -> None:
        """After this one; at the cursor if it is shown."""
        self.did(self.editor.add(self.map_view.cursor_m))

    def action_new_polygon(self) -> None:
        """Of the fence, which comes in view."""
        self.editor.choose_kind(PlanKind.FENCE)
        self.did(self.editor.add_fence(self.map_view.cursor_m))

    def action_new_circle(self) -> None:
        """Of the fence, which comes in view."""
        self.editor.choose_kind(PlanKind.FENCE)
        self.did(self.editor.add_circle(self.map_view.cursor_m))

    def action_delete(self) -> None:
        """The edited one."""
        self.did(self.editor.delete())

    def action_earlier(self) -> None:
        """Before the one before."""
        self.did(self.editor.reorder(-1))

    def action_later(self) -> None:
        """After the next."""
        self.did(self.editor.reorder(1))

    def action_other_side(self) -> None:
        """Inside or outside."""
        self.did(self.editor.other_side())

    def action_clear(self) -> None:
        """All of this kind; the second press does it."""
        what = f"clear {self.editor.vehicle} {self.editor.kind.word}"
        if not self.editor.items or self.confirmed(what, f"{what}? C again clears it here; what is on board stays"):
            self.did(self.editor.clear())

    def action_undo(self) -> None:
        """Values that were not allowed first, then edits."""
        if self._problem:
            self.did("a value that was not allowed was put back")
        else:
            self.did(self.editor.undo())

    def action_redo(self) -> None:
        """Do again."""
        self.did(self.editor.redo())

    # ------------------------------------------------------------ the map

    def action_move_on_map(self) -> None:
        """Arrows move the item until Esc."""
        self._moves_whole = False
        self.map_view.begin(ITEM_HEADING)

    def action_move_whole(self) -> None:
        """Arrows move all of them."""
        self._moves_whole = True
        self.map_view.begin(WHOLE_HEADING)

    def action_cursor(self) -> None:
        """Show the cursor and move it, or hide it."""
        if self.map_view.cursor_m is not None:
            self.item_table.focus()
            return
        self.map_view.begin(CURSOR_HEADING)
        self.map_view.show_cursor()

    def on_draft_map_moved(self, message: DraftMap.Moved) -> None:
        """By arrows."""
        self.did(self.editor.shift(message.east_m, message.north_m, whole=self._moves_whole))

    def on_draft_map_clicked(self, message: DraftMap.Clicked) -> None:
        """Move the item there while it is being moved; else choose what is there."""
        if self.map_view.has_focus and self.map_view.cursor_m is None and not self._moves_whole:
            self.editor.place(message.place_m)
            self.did("")
            return
        found = self.editor.nearest(message.place_m, message.reach_m)
        if found is not None:
            self._choose(found)

    def _show_class(self, name: str, *, on: bool = True) -> None:
        """One of the classes that say which forms are shown: nothing else looks different then."""
        show_classes(self, {name: on}, [self._items_panel, self.item_form, self.verdict])

    # ------------------------------------------------------------ what vehicles can

    def action_assume(self) -> None:
        """Open the form; what it says counts at once."""
        if self.has_class("-generating"):
            self.action_leave()
        self._show_class("-assuming")
        self.performance_form.begin(self.editor.forecast.performance)

    def on_performance_form_changed(self, _message: PerformanceForm.Changed) -> None:
        """Foretell with it."""
        try:
            self.editor.assume(self.performance_form.performance(self.editor.forecast.performance))
            self._problem = ""
        except FieldError as error:
            self._problem = str(error)
        self.show_all(form=False)

    # ------------------------------------------------------------ generating

    def action_generate(self) -> None:
        """Open the form; what it says is shown at once."""
        editor = self.editor
        chosen = [vehicle for vehicle in self.feed.selection.ids if vehicle in editor.vehicles]
        if self.has_class("-assuming"):
            self.action_leave()
        self._show_class("-generating")
        self.generate_form.begin(chosen if editor.vehicle in chosen else [editor.vehicle], list(editor.shapes()))
        self._foresee()

    def on_generate_form_changed(self, _message: GenerateForm.Changed) -> None:
        """Something else is wanted."""
        self._foresee()

    def _foresee(self) -> None:
        try:
            self.editor.foresee(self.generate_form.wanted())
            self._problem = ""
        except (FieldError, GeneratorError) as error:
            self.editor.drop_preview()
            self._problem = str(error)
        self.show_all(form=False)

    def action_take(self) -> None:
        """What is shown becomes the draft."""
        if not self.has_class("-generating"):
            return
        preview = self.editor.preview
        if preview is None:
            self.say(f"nothing taken: {self._problem}", Ink.CAUTION)
            return
        wanted = self.generate_form.wanted()
        self._end_generating()
        self.editor.take(f"{wanted.what} over {wanted.over}", preview)
        self.editor.choose_vehicle(wanted.vehicles[0])
        self.did(f"{wanted.what} over {wanted.over} for {ids(wanted.vehicles)}; u takes it back")

    def _end_generating(self) -> None:
        self._show_class("-generating", on=False)
        self.generate_form.display = False
        self._problem = ""
        self.item_table.focus()

    # ------------------------------------------------------------ files

    def action_write(self) -> None:
        """Into which file?"""
        if self.editor.history.draft.of(self.editor.vehicle).is_empty:
            self.say("nothing is planned for this vehicle")
        else:
            self.open_bar.ask(write=True, suggestion=f"vehicle-{self.editor.vehicle}.plan")

    def on_open_bar_named(self, message: OpenBar.Named) -> None:
        """Take what is in it, or write it."""
        self.item_table.focus()
        done = "written" if message.write else "opened"
        if message.path is None:
            self.say(f"nothing {done}")
            return
        try:
            text = self.file.write(message.path) if message.write else self.file.open(message.path)
        except DraftFileError as error:
            self.say(f"not {done}: {error}", Ink.CAUTION)
        else:
            self.did(text if message.write else f"{text}; u takes it back")
