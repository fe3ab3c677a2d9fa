"""The plan screen: the edited round on the map, its zones, and forms for zone and team.

What is typed goes into a working copy (`ScenarioEditor`); only an apply sends it to the station. Values that are
not allowed stay in their field with the reason, and reach neither the map nor the station.
"""

import contextlib
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.timer import Timer

from tui_gcs.actions import ConsoleAction, bindings
from tui_gcs.actions.plan_actions import PLAN_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.safe_files import FileRefused
from tui_gcs.core.geometry.zones import area_m2, contains
from tui_gcs.core.scenario.model import Limits, Round, Team
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import ScenarioUpdated, StatusUpdated
from tui_gcs.screens.plan.plan_apply import PlanApply
from tui_gcs.screens.plan.plan_text import meeting_remarks, preview_remarks, remarks, state_remark
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.missions.open_bar import OpenBar
from tui_gcs.widgets.plan.edit_map import EditMap
from tui_gcs.widgets.plan.forms.settings_form import SettingsForm
from tui_gcs.widgets.plan.forms.team_form import TeamForm
from tui_gcs.widgets.plan.forms.zone_form import ZoneForm
from tui_gcs.widgets.plan.idleness_bar import IdlenessBar
from tui_gcs.widgets.plan.plan_autosave import PlanAutosave
from tui_gcs.widgets.plan.plan_draft import PlanDraft
from tui_gcs.widgets.plan.round_chooser import RoundChooser
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor
from tui_gcs.widgets.plan.shape_edit import border_of, corners_told
from tui_gcs.widgets.plan.zone_list import AREA_ROW, ZoneList

KEEP_S = 1.0
"""So long after an edit the work is kept against crashes."""


class PlanScreen(PlanApply):
    """Edits a scenario; knows widgets and the working copy, nothing of protocols."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = PLAN_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(PLAN_ACTIONS, "plan")
    FILE_NAME = "scenario.toml"
    map_view: EditMap
    AUTO_FOCUS = "ZoneList"
    CSS = """
    PlanScreen #rounds { border: solid #4a5560; border-title-color: #d8dee4; height: 9; }
    PlanScreen.-ascii #rounds { border: ascii #4a5560; }
    PlanScreen TeamForm { max-height: 15; }
    PlanScreen.-narrow #side { width: 40; }
    PlanScreen.-short #rounds { height: 7; }
    PlanScreen.-short ZoneForm, PlanScreen.-short TeamForm { height: 9; }
    PlanScreen.-short TeamForm, PlanScreen.-short.-team ZoneForm { display: none; }
    PlanScreen.-short.-team TeamForm { display: block; }
    PlanScreen SettingsForm { display: none; }
    PlanScreen.-settings SettingsForm { display: block; }
    PlanScreen.-settings #rounds, PlanScreen.-settings ZoneForm, PlanScreen.-settings TeamForm { display: none; }
    PlanScreen.-settings VerdictLines { height: 6; }
    PlanScreen.-short.-settings VerdictLines { height: 4; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, folder: Path | None = None, glyphs: GlyphSet = UNICODE) -> None:
        """For this feed; work in progress is kept in `folder`, nowhere if that is None."""
        self.model = ScenarioEditor()
        self.autosave = PlanAutosave(self.model, folder)
        super().__init__(feed, clock, glyphs, self.model)
        self.draft = PlanDraft(self.model)
        self.idleness_bar = IdlenessBar()
        self._keep: Timer | None = None
        self.map_view = EditMap(glyphs=glyphs)
        self.round_chooser = RoundChooser(glyphs=glyphs)
        self.work_list = self.zone_list = ZoneList(glyphs=glyphs)
        self.zone_form = ZoneForm(glyphs=glyphs)
        self.team_form = TeamForm(glyphs=glyphs)
        self.settings_form = SettingsForm(glyphs=glyphs)
        self.rounds = Vertical(id="rounds")
        set_title(self.rounds, "rounds and zones")

    def compose_middle(self) -> ComposeResult:
        """Map and forms."""
        yield self.map_view
        with Vertical(id="side"):
            with self.rounds:
                yield self.round_chooser
                yield self.zone_list
            yield self.zone_form
            yield self.team_form
            yield self.settings_form
            yield self.verdict

    def compose_questions(self) -> ComposeResult:
        """One more than files."""
        yield from super().compose_questions()
        yield self.idleness_bar

    def on_mount(self) -> None:
        """Show what there is."""
        self._take_scenario()
        self.show_fleet()

    def on_screen_suspend(self) -> None:
        """Nobody looks: no need to plan."""
        self.end_preview()

    def on_screen_resume(self) -> None:
        """What changed while another screen was shown."""
        self.show_plan()
        self.show_fleet()

    # ------------------------------------------------------------ messages of the feed

    def on_scenario_updated(self, _message: ScenarioUpdated) -> None:
        """The station flies something else: followed, or told."""
        self._take_scenario()

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Perhaps another round is flown."""
        if self.is_current:
            self.show_plan()

    @property
    def what_to_foresee(self) -> tuple[int, str, int] | None:
        """(base revision, text, round) of what is shown; None while nothing can be planned for it."""
        if self.model.scenario is None or self.draft.problems or self.model.newer is not None:
            return None
        return self.model.base_revision, self.model.text, self.model.round_index

    @property
    def limits_now(self) -> Limits:
        """Of the working copy."""
        return self.model.scenario.limits if self.model.scenario is not None else Limits()

    def show_foreseen(self) -> None:
        """Tours on the map, numbers below the forms."""
        self.map_view.set_annotations({team: found.annotations for team, found in self.previews.items()})
        self.show_plan()

    def _take_scenario(self) -> None:
        if self.feed.scenario is None:
            self.show_plan()
            return
        self.draft.files = self.feed.planner_files
        first, before = self.model.scenario is None, self.model.text
        self.model.station_changed(self.feed.scenario)
        if first:
            self.model.select_round(self._flown() or 0)
            recovered = self._recover()
            self.draft.choose_first()
            self.show_forms()
            if recovered:
                self.say(recovered, Ink.CAUTION)
        elif self.model.text != before:
            self.say("the station's scenario changed: this is the new one")
            self.show_forms()
        self.show_plan()

    def _recover(self) -> str:
        """What a crash left, in words."""
        try:
            return self.autosave.recover(self.feed.scenario) if self.feed.scenario is not None else ""
        except FileRefused as error:
            return f"work in progress is not kept: {error}"

    def _keep_later(self) -> None:
        """Once the operator pauses."""
        if self._keep is None and self.autosave.is_behind:
            self._keep = self.set_timer(KEEP_S, self._keep_work)

    def _keep_work(self) -> None:
        self._keep = None
        try:
            self.autosave.keep()
        except FileRefused as error:
            self.say(f"work in progress is not kept: {error}", Ink.CAUTION)

    def on_unmount(self) -> None:
        """What is in progress is kept."""
        with contextlib.suppress(FileRefused):
            self.autosave.keep()
        self.autosave.close()

    def _flown(self) -> int | None:
        return self.feed.status.round_index if self.feed.status is not None else None

    # ------------------------------------------------------------ showing

    def show_plan(self) -> None:
        """Everything but the forms, from the working copy."""
        model = self.model
        scenario, current = model.scenario, model.current_round
        self.edit_line.show(state_remark(model), self.message)
        if scenario is None or current is None:
            return
        self.map_view.set_scenario(current, scenario.places, scenario.origin)
        self.map_view.edited_zone = self.draft.zone_name
        self._show_edited(current)
        self.round_chooser.show([r.name for r in scenario.rounds], model.round_index, self._flown())
        names = [zone.name for zone in current.zones]
        zone_name = self.draft.zone_name
        self.zone_list.show(current, names.index(zone_name) + 1 if zone_name in names else AREA_ROW)
        team = self.draft.team
        previewed = self._previewed(team) if team is not None else []
        met = [each.finding for each in self.meetings if team is not None and team.name in each.teams]
        refusal = self.refusal if model.text == self.refused_text else ""
        self.verdict.show(remarks(model, self.draft, refusal, self.glyphs, [*previewed, *meeting_remarks(met)]))
        self.foresee_later()
        self._keep_later()

    def _previewed(self, team: Team) -> list[Remark]:
        return preview_remarks(team, self.previews.get(team.name), self.asked_s, self.waited_s)

    def _show_edited(self, current: Round) -> None:
        edited, pending = self.draft.edited, self.draft.pending
        others = [zone.shape for zone in current.zones if zone.name != self.draft.zone_name]
        if edited is not None:
            if self.draft.zone_name is not None:
                others.append(current.area.shape)
            self.map_view.show_edited(
                (pending or edited).shape, tuple(others), allowed=pending is None, border=border_of(edited)
            )

    def show_message(self) -> None:
        """It stands among everything else."""
        self.show_plan()

    # ------------------------------------------------------------ choosing

    def _select(self, zone_name: str | None) -> None:
        """Put a zone, or the operating area, into the form."""
        dropped = bool(self.draft.problems)
        self.draft.choose_zone(zone_name)
        self.show_forms()
        self.say("values that were not allowed were put back" if dropped else "", Ink.CAUTION)

    def on_zone_list_selected(self, message: ZoneList.Selected) -> None:
        """Another zone."""
        current = self.model.current_round
        if current is not None:
            self._select(current.zones[message.row - 1].name if message.row != AREA_ROW else None)

    def on_round_chooser_chosen(self, message: RoundChooser.Chosen) -> None:
        """Another round."""
        self.choose_round(message.index)

    def action_digit(self, digit: str) -> None:
        """Edit round 1 to 9; or copy the zone there, if that was asked."""
        index = int(digit) - 1
        if self.copies:
            self.copy_zone([index])
        else:
            self.choose_round(index)

    def choose_round(self, index: int) -> None:
        """Edit another round."""
        if self.model.select_round(index):
            self._select(self.draft.zone_name)
        else:
            self.say(f"there is no round {index + 1}", Ink.CAUTION)

    def action_how_many(self) -> None:
        """How many vehicles does it take?"""
        if self.draft.team is not None:
            self.idleness_bar.ask(self.draft.team.name)

    def on_idleness_bar_wanted(self, message: IdlenessBar.Wanted) -> None:
        """The planner finds out."""
        self.zone_list.focus()
        if message.idleness_s is None or self.draft.team is None:
            self.say(message.why or "nothing asked", Ink.CAUTION if message.why else Ink.TEXT)
        else:
            self.foresee_now(self.draft.team.name, message.idleness_s)
            self.say("")

    def action_missions(self) -> None:
        """What single vehicles fly by themselves."""
        self.app.switch_mode("missions")

    def action_zone_up(self) -> None:
        """The zone above."""
        self.zone_list.action_move(-1)

    def action_zone_down(self) -> None:
        """The zone below."""
        self.zone_list.action_move(1)

    def action_team_page(self) -> None:
        """Zone form or team form."""
        self._show_class("-team", on=not self.has_class("-team") or not self.has_class("-short"))
        self.close_settings()
        form = self.team_form if self.has_class("-team") else self.zone_form
        form.focus_first()

    def action_leave(self) -> None:
        """Back to the list; out of the settings."""
        self.close_settings()
        self.zone_list.focus()
        self.say("")

    async def action_detach_asking(self) -> None:
        """Leave; what was neither applied nor saved would be lost, so that takes a second press."""
        lost = self.model.changes and self.model.unsaved
        if not lost or self.confirmed("detach", "changes neither applied nor saved: q again leaves without them"):
            await self.run_action("app.detach")

    # ------------------------------------------------------------ changing

    def action_add_zone(self) -> None:
        """A new zone in the middle of the area, with the cursor in its form; in the line of teams a new team."""
        if self.is_on_teams:
            self.add_team()
            return
        problems = self.draft.add_zone()
        if problems:
            self.say(f"not added: {problems[0]}", Ink.CAUTION)
            return
        self.show_forms()
        self._show_class("-team", on=False)
        self.close_settings()
        self.zone_form.focus_first()
        self.say(f"{self.draft.zone_name} added")

    def on_open_bar_named(self, message: OpenBar.Named) -> None:
        """Its areas become zones; undo takes them back."""
        self.zone_list.focus()
        if message.path is None:
            self.say("nothing imported")
            return
        problems, done = self.model.import_zones(message.path)
        self.show_forms()
        self.say(f"not imported: {problems[0]}" if problems else f"{done}; u takes it back", Ink.CAUTION)

    def action_delete_zone(self) -> None:
        """Take the zone out, in the line of teams the team; the second press does it."""
        if self.is_on_teams:
            self.delete_team()
            return
        name = self.draft.zone_name
        if name is not None and not self.confirmed(f"delete {name}", f"delete zone {name}? Del again deletes it"):
            return
        problems = self.draft.delete_zone()
        if problems:
            self.say(f"not deleted: {problems[0]}", Ink.CAUTION)
        else:
            self.show_forms()
            self.say(f"zone {name} deleted, u brings it back")

    def action_undo(self) -> None:
        """Values that were not allowed first, then changes."""
        if self.draft.problems:
            self.show_forms()
            self.say("values that were not allowed were put back")
            return
        label = self.model.undo()
        self.show_forms()
        self.say(f"undone: {label}" if label else "nothing to undo")

    def action_redo(self) -> None:
        """What was taken back last."""
        label = self.model.redo()
        self.show_forms()
        self.say(f"done again: {label}" if label else "nothing to do again")

    def action_move_on_map(self) -> None:
        """Arrows and brackets change the shape until Esc."""
        self.map_view.begin()
        self.say("")

    def on_edit_map_reshaped(self, message: EditMap.Reshaped) -> None:
        """Changed on the map; what is not allowed is shown there until it is changed further, or taken back."""
        before = self.draft.pending or self.draft.edited
        self.draft.reshape(message.shape, message.step)
        self.map_view.heard()
        self.fill_forms()
        self.say(corners_told(before.shape, message.shape) if before is not None else "", Ink.CAUTION)

    def on_draft_map_clicked(self, message: EditMap.Clicked) -> None:
        """The smallest zone there is edited."""
        current = self.model.current_round
        zones = current.zones if current is not None else ()
        there = [zone for zone in zones if contains(zone.shape, [message.place_m])[0]]
        if there:
            self._select(min(there, key=lambda zone: area_m2(zone.shape)).name)

    # ------------------------------------------------------------ save

    def action_save(self) -> None:
        """Only what is allowed."""
        if self.draft.problems:
            self.say("not saved: a value is not allowed (u puts it back)", Ink.CAUTION)
        else:
            super().action_save()
