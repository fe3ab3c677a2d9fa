"""The missions screen: plans of every vehicle, all their paths on one map, and what they come to.

What is edited here is a draft of this console; vehicles get it only by an upload that the operator confirms. Every edit
can be undone, and unsaved work is recovered after a crash.
"""

from collections.abc import Iterator
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.timer import Timer
from textual.widgets import Input

from tui_gcs.actions import ConsoleAction, bindings
from tui_gcs.actions.mission_actions import MISSION_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.missions.draft_file import DraftFileError
from tui_gcs.core.missions.mission_conflicts import Conflict
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import PlannerUpdated, ScenarioUpdated, StatusUpdated
from tui_gcs.screens.common.draft_screen import DraftScreen, typed_path
from tui_gcs.screens.common.map_screen import present_round
from tui_gcs.screens.common.row_copies import copy_rows
from tui_gcs.screens.missions.mission_forms import MissionForms
from tui_gcs.screens.missions.mission_transfers import MissionTransfers
from tui_gcs.screens.missions.plan_copies import PlanCopies
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.drafts.draft_map import DraftMap
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.missions.altitude_profile import AltitudeProfile
from tui_gcs.widgets.missions.generate_form import GenerateForm
from tui_gcs.widgets.missions.item_form import ItemForm
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_edits import MissionEdits
from tui_gcs.widgets.missions.mission_files import FILE_NAME, MissionFile
from tui_gcs.widgets.missions.mission_map import drawings
from tui_gcs.widgets.missions.mission_remarks import mission_remarks, state_remark
from tui_gcs.widgets.missions.mission_table import COLUMNS_TITLE, ItemTable, PlanList
from tui_gcs.widgets.missions.performance_form import PerformanceForm

COMPARE_S = 0.2
"""Paths are compared with each other this long after the last edit: keys do not wait for it."""
SLICE_S, BREATH_S = 0.02, 0.01
"""The comparison then runs for SLICE_S at a time, with pauses of BREATH_S for keys."""
AUTOSAVE_S = 1.0
"""The draft is kept against a crash this long after the last edit."""
ITEM_HEADING, WHOLE_HEADING = "moving the item: arrows, Esc", "moving ALL items: arrows, Esc"
CURSOR_HEADING = "cursor: arrows, + adds, Esc"


class MissionsScreen(DraftScreen):
    """Layout and handlers of the missions screen; its subjects are in `forms`, `transfers`, `copies` and `edits`."""

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
        """Plan for the vehicles of `feed`; work in progress is kept in `folder`, or nowhere if that is None."""
        self.editor = MissionEditor()
        self.edits = MissionEdits(self.editor)
        self.file = MissionFile(self.editor, folder)
        super().__init__(feed, clock, glyphs, self.file)
        self._moves_whole = False
        self._writes = False
        """The file prompt asks for a file to write, not for one to open."""
        self._first_site = True
        self._compare_timer: Timer | None = None
        self._autosave_timer: Timer | None = None
        self.map_view = DraftMap(glyphs=glyphs)
        self.profile = AltitudeProfile(self.editor, glyphs=glyphs)
        self.plan_list = PlanList(self.editor, glyphs=glyphs)
        self.work_list = self.item_table = ItemTable(self.editor, glyphs=glyphs)
        self._vehicles_panel, self._items_panel = Vertical(id="vehicles"), Vertical(id="items")
        self._forms = (ItemForm(glyphs=glyphs), GenerateForm(glyphs=glyphs), PerformanceForm(glyphs=glyphs))
        self.forms = MissionForms(
            self,
            self._forms,
            (self._items_panel, self.verdict),
            self.item_table,
            self.edits,
            self.feedback,
            did=self.did,
            show=partial(self.show_all, form=False),
        )
        self.transfers = MissionTransfers(
            self,
            self.editor,
            feed,
            clock,
            glyphs,
            self.feedback,
            did=self.did,
            show=self.show_all,
            show_progress=self._show_transfers,
        )
        self.copy_bar = PromptBar("copy")
        self.copies = PlanCopies(self.editor, self.copy_bar, self.feedback, self.did)

    def set_elevation(self, elevation: Elevation | None) -> None:
        """Take the heights of the ground: the map's cursor, the profile and the findings show them."""
        self.map_view.content.elevation = self.editor.forecast.elevation = elevation

    def _compose_middle(self) -> ComposeResult:
        """Compose map and profile, and the lists and forms beside them."""
        with Vertical(id="left"):
            yield self.map_view
            yield self.profile
        with Vertical(id="side"):
            with self._vehicles_panel:
                yield self.plan_list
            with self._items_panel:
                yield self.item_table
            yield from self._forms
            yield self.verdict

    def _compose_prompts(self) -> ComposeResult:
        """Compose the prompts for files, and the one for copies."""
        yield from super()._compose_prompts()
        yield self.copy_bar

    def on_mount(self) -> None:
        """Show the draft that a crash left, if there is one."""
        self._take_site()
        try:
            recovered = self.file.recover()
        except DraftFileError as error:
            recovered = f"work in progress is not kept: {error}"
        if recovered:
            self.feedback.report(recovered, Ink.CAUTION)
        # What other consoles left after a crash is named, not taken: they may run on another terminal.
        self.transfers.report = [
            Remark(f"of another console, not saved: {path}", Ink.CAUTION) for path in self.file.waiting
        ]
        self.show_all()

    def on_unmount(self) -> None:
        """Keep the draft for the next console."""
        self._autosave()
        self.file.close()

    @on(events.ScreenResume)
    @on(ScenarioUpdated)
    def _site_changed(self) -> None:
        self._take_site()
        self.show_all()

    @on(StatusUpdated)
    @on(PlannerUpdated)
    def _flight_changed(self) -> None:
        # Another round may be flown, with another area; or a planner may have drawn another tour.
        if self.is_current and self._take_site():
            self.show_all()

    def _take_site(self) -> bool:
        """Plan where the station flies; return whether that has changed."""
        current = present_round(self.feed)
        if self.feed.scenario is None or current is None:
            return False
        scenario = self.feed.scenario.scenario
        rows = self.feed.frame.rows() if self.feed.frame is not None else []
        self.map_view.set_scenario(current, scenario.places, scenario.origin)
        changed = self.editor.set_site(scenario, current, rows, self.feed.annotations)
        # The operator comes here for the vehicle that is selected; from then on the choice on this screen counts.
        if self._first_site and self.feed.selection.lead is not None:
            self.editor.choose_vehicle(self.feed.selection.lead)
        self._first_site = False
        return changed

    def did(self, text: str, ink: Ink = Ink.TEXT, *, form: bool = True) -> None:
        """Report that the draft or the selection in it has changed, and show it."""
        self.transfers.report = []
        self.feedback.report(text, ink)
        self.show_all(form=form)

    def show_all(self, *, form: bool | None = None) -> None:
        """Show the draft; the item form, too, unless the operator types (None) or the caller leaves it out (False)."""
        # A form that is filled while it is typed into would take letters away.
        form = not isinstance(self.focused, Input | ChoiceField) if form is None else form
        self.show_fleet()
        self.forms.problem = "" if form else self.forms.problem
        self.map_view.set_drawings(*drawings(self.editor))
        self.profile.update_lines()
        self._show_lists()
        if form:
            self.forms.show_item()
        self._work_later()

    def _show_lists(self) -> None:
        editor = self.editor
        self._show_transfers()
        set_title(self._items_panel, f"vehicle {editor.vehicle}  {editor.kind.word} of {len(editor.items)}")
        set_title(self.profile, f"height of vehicle {editor.vehicle}")
        self.item_table.update_lines()
        self.show_message()
        self.verdict.show(mission_remarks(editor, self.forms.problem, self.transfers.report))

    def show_message(self) -> None:
        """Show whether the draft is saved, and what became of the last key."""
        self.edit_line.show(state_remark(self.editor.history), self.feedback.message)

    def _show_transfers(self) -> None:
        """Show the progress of each transfer, and above the list that of all together."""
        jobs = self.transfers.jobs
        self.plan_list.show(jobs.states(), frozenset(each.vehicle for each in jobs.failed if each.to_vehicle))
        overall = jobs.overall()
        title = COLUMNS_TITLE if self.has_class("-short") else "missions"
        hidden = self.plan_list.hidden if self.has_class("-short") else 0  # without a border below, the title counts
        more = f" +{hidden}:n" if hidden else ""
        set_title(self._vehicles_panel, (f"sending {overall}" if overall else title) + more)

    @on(PlanList.OthersHidden)
    def _others_hidden(self) -> None:
        self._show_transfers()

    def on_resize(self) -> None:
        """Show the title of the list again: on a low screen it names the columns."""
        self.call_after_refresh(self._show_transfers)  # Textual sets the class `-short` after this handler

    def _work_later(self) -> None:
        """Compare paths, and keep the draft, once the operator pauses."""
        for timer in (self._compare_timer, self._autosave_timer):
            if timer is not None:
                timer.stop()
        self._compare_timer = self.set_timer(COMPARE_S, self.compare_ways)
        self._autosave_timer = self.set_timer(AUTOSAVE_S, self._autosave)

    def compare_ways(self) -> None:
        """Find where paths meet; with many long paths that takes several slices of time."""
        self._compare_on(self.editor.forecast.comparing(), self.editor.forecast.conflicts)

    def _compare_on(self, comparing: Iterator[None], before: list[Conflict]) -> None:
        # Comparing many long missions takes longer than a key may wait.
        until_s = self.clock.now() + SLICE_S
        for _ in comparing:
            if self.clock.now() >= until_s:
                self._compare_timer = self.set_timer(BREATH_S, partial(self._compare_on, comparing, before))
                return
        if self.editor.forecast.conflicts != before:
            self.map_view.set_drawings(*drawings(self.editor))
            self._show_lists()

    def _autosave(self) -> None:
        try:
            self.file.keep()
        except DraftFileError as error:
            self.feedback.report(f"work in progress is not kept: {error}", Ink.CAUTION)

    @on(events.DescendantBlur)
    def _field_left(self) -> None:
        self.editor.history.end_subject()

    @on(ItemForm.Edited)
    def _item_typed(self, message: ItemForm.Edited) -> None:
        self.forms.take_item(message.texts, message.field)

    @on(PerformanceForm.Changed)
    def _performance_typed(self) -> None:
        self.forms.take_performance()

    @on(GenerateForm.Changed)
    def _generator_typed(self) -> None:
        self.forms.preview()

    @on(ItemTable.Chosen)
    def _item_clicked(self, message: ItemTable.Chosen) -> None:
        self.item_table.focus()
        self._choose(message.index)

    @on(PlanList.Picked)
    def _vehicle_clicked(self, message: PlanList.Picked) -> None:
        self._choose_vehicle(message.vehicle)

    @on(DraftMap.Moved)
    def _moved(self, message: DraftMap.Moved) -> None:
        self.did(self.edits.shift(message.east_m, message.north_m, whole=self._moves_whole))

    @on(DraftMap.Clicked)
    def _map_clicked(self, message: DraftMap.Clicked) -> None:
        # A click moves the item while it is being moved; otherwise it selects what is there.
        if self.map_view.has_focus and self.map_view.cursor_m is None and not self._moves_whole:
            self.edits.place(message.place_m)
            self.did("")
            return
        found = self.editor.nearest(message.place_m, message.reach_m)
        if found is not None:
            self._choose(found)

    @on(PromptBar.Answered, "#copy")
    def _copy_answered(self, message: PromptBar.Answered) -> None:
        self.item_table.focus()
        self.copies.copy(message.text)

    def _choose(self, index: int) -> None:
        self.editor.choose(index)
        self.did("")

    def _choose_vehicle(self, vehicle: int) -> None:
        known = self.editor.choose_vehicle(vehicle)
        self.did("" if known else f"vehicle {vehicle} is neither in the scenario nor heard", Ink.CAUTION)

    def action_edit(self, path: str, *arguments: object) -> None:
        """Have a part change the draft or the selection in it, and report the line that it returns, if any."""
        self.did(attrgetter(path)(self)(*arguments) or "")

    def action_step_item(self, by: int) -> None:
        """Select the item `by` places further down."""
        self._choose(self.editor.index + by)

    def action_step_page(self, by: int) -> None:
        """Select the item `by` pages further down."""
        self._choose(self.editor.index + by * self.item_table.page)

    def action_choose_item(self, index: int) -> None:
        """Select an item by its index, from the end if negative."""
        self._choose(index if index >= 0 else len(self.editor.items) + index)

    def action_step_vehicle(self, by: int) -> None:
        """Edit the plans of the next vehicle (1) or the previous one (-1)."""
        self.editor.step_vehicle(by)
        self.did("")

    def action_reorder(self, by: int) -> None:
        """Move the edited item earlier (-1) or later (1) in the list."""
        self.did(self.edits.reorder(by))

    def action_digit(self, digit: str) -> None:
        """Edit the plans of vehicle 1 to 9."""
        self._choose_vehicle(int(digit))

    def action_add(self) -> None:
        """Add an item after the edited one, at the cursor if it is shown."""
        self.did(self.edits.add(self.map_view.cursor_m))

    def action_new_fence(self, shape: str) -> None:
        """Add a fence "polygon" or "circle", and edit the fence."""
        self.editor.choose_kind(PlanKind.FENCE)
        add = self.edits.add_fence if shape == "polygon" else self.edits.add_circle
        self.did(add(self.map_view.cursor_m))

    def action_clear(self) -> None:
        """Delete all items of this kind, at the second press."""
        what = f"clear {self.editor.vehicle} {self.editor.kind.word}"
        question = f"{what}? C again clears it here; what is on board stays"
        if not self.editor.items or self.feedback.confirmed(what, question):
            self.did(self.edits.clear())

    def action_copy_row(self) -> None:
        """Copy the edited item to the terminal's clipboard."""
        self.did(*copy_rows(self.app, self.item_table.records()[self.editor.index :][:1]))

    def action_copy_rows(self) -> None:
        """Copy all items of the edited plan to the terminal's clipboard."""
        self.did(*copy_rows(self.app, self.item_table.records()))

    def action_undo(self) -> None:
        """Put back a value that is not allowed; if there is none, undo the last edit."""
        if self.forms.problem:
            self.did("a value that was not allowed was put back")
        else:
            self.did(self.editor.undo())

    def action_move_on_map(self, whole: bool) -> None:
        """Let arrows move the item, or all items of this kind, until Esc."""
        self._moves_whole = whole
        self.map_view.begin(WHOLE_HEADING if whole else ITEM_HEADING)

    def action_cursor(self) -> None:
        """Show the cursor and let arrows move it, or hide it."""
        if self.map_view.cursor_m is not None:
            self.item_table.focus()
            return
        self.map_view.begin(CURSOR_HEADING)
        self.map_view.show_cursor()

    def action_generate(self) -> None:
        """Open the generator; what it would make is shown at once."""
        self.forms.open_generator(self.feed.selection.ids)

    def action_write(self) -> None:
        """Ask for the file that this vehicle's plans are written into."""
        if self.editor.history.draft.of(self.editor.vehicle).is_empty:
            self.feedback.report("nothing is planned for this vehicle")
        else:
            self._writes = True
            self.open_bar.ask("Write", f"vehicle-{self.editor.vehicle}.plan")

    def action_open(self) -> None:
        """Ask for the file to open."""
        self._writes = False
        super().action_open()

    @on(PromptBar.Answered, "#open")
    def _file_named(self, message: PromptBar.Answered) -> None:
        self.item_table.focus()
        path, done = typed_path(message.text or ""), "written" if self._writes else "opened"
        if path is None:
            self.feedback.report(f"nothing {done}")
            return
        try:
            text = self.file.write(path) if self._writes else self.file.open(path)
        except DraftFileError as error:
            self.feedback.report(f"not {done}: {error}", Ink.CAUTION)
        else:
            self.did(text if self._writes else f"{text}; u takes it back")
