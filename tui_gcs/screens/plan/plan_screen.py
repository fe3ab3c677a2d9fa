"""The plan screen: the edited round on the map, its zones, and forms for zone, team and settings.

What is typed goes into a working copy (`ScenarioEditor`); only an apply sends it to the station. Values that are not
allowed stay in their field with the reason, and reach neither the map nor the station.
"""

import contextlib
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.timer import Timer

from tui_gcs.actions import ConsoleAction, bindings
from tui_gcs.actions.plan_actions import PLAN_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.safe_files import FileRefused
from tui_gcs.core.geometry.zones import area_m2, contains
from tui_gcs.core.scenario.model import Limits, Round
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import ScenarioUpdated, StatusUpdated
from tui_gcs.screens.common.draft_screen import DraftScreen, typed_path
from tui_gcs.screens.plan.part_edits import PartEdits
from tui_gcs.screens.plan.plan_forms import PlanForms
from tui_gcs.screens.plan.plan_preview import PlanPreview, Target, to_idleness
from tui_gcs.screens.plan.plan_text import meeting_remarks, preview_remarks, remarks, state_remark
from tui_gcs.screens.plan.scenario_apply import ScenarioApply
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.forms.form_text import FieldError
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.plan.edit_map import EditMap
from tui_gcs.widgets.plan.forms.settings_form import SettingsForm
from tui_gcs.widgets.plan.forms.team_form import TeamForm
from tui_gcs.widgets.plan.forms.zone_form import ZoneForm
from tui_gcs.widgets.plan.plan_autosave import PlanAutosave
from tui_gcs.widgets.plan.plan_draft import PlanDraft
from tui_gcs.widgets.plan.round_chooser import RoundChooser
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor
from tui_gcs.widgets.plan.shape_edit import border_of, describe_corners
from tui_gcs.widgets.plan.zone_list import AREA_ROW, ZoneList

AUTOSAVE_S = 1.0
"""Edits are kept against a crash this long after the last one."""


class PlanScreen(DraftScreen):
    """Layout and handlers of the plan screen; its subjects are in `forms`, `parts`, `preview` and `apply`."""

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
        """Edit the scenario of `feed`; work in progress is kept in `folder`, or nowhere if that is None."""
        self.model = ScenarioEditor()
        self.autosave = PlanAutosave(self.model, folder)
        super().__init__(feed, clock, glyphs, self.model)
        self.draft = PlanDraft(self.model)
        self.fleet_size_bar = PromptBar("fleet-size")
        self.map_view = EditMap(glyphs=glyphs)
        self.round_chooser = RoundChooser(glyphs=glyphs)
        self.work_list = self.zone_list = ZoneList(glyphs=glyphs)
        self.zone_form = ZoneForm(glyphs=glyphs)
        self.team_form = TeamForm(glyphs=glyphs)
        self.settings_form = SettingsForm(glyphs=glyphs)
        self.rounds = Vertical(id="rounds")
        set_title(self.rounds, "rounds and zones")
        forms = (self.zone_form, self.team_form, self.settings_form)
        self.forms = PlanForms(self, forms, (self.rounds, self.verdict), self.draft, self.feedback)
        self.parts = PartEdits(self.draft, self.feedback, self.forms.refill)
        run = partial(self.run_worker, group="apply")
        self.apply = ScenarioApply(feed, self.draft, self.feedback, run, self.forms.refill)
        self.preview = PlanPreview(
            self, feed, clock, target=self._preview_target, limits=self._limits, show=self._show_preview
        )
        self._autosave_timer: Timer | None = None

    def _compose_middle(self) -> ComposeResult:
        """Compose the map, and the lists and forms beside it."""
        yield self.map_view
        with Vertical(id="side"):
            with self.rounds:
                yield self.round_chooser
                yield self.zone_list
            yield self.zone_form
            yield self.team_form
            yield self.settings_form
            yield self.verdict

    def _compose_prompts(self) -> ComposeResult:
        """Compose the prompts for files, and the one for a worst idleness."""
        yield from super()._compose_prompts()
        yield self.fleet_size_bar

    def on_mount(self) -> None:
        """Show the station's scenario, or what a crash left of its edits."""
        self._take_scenario()
        self.show_fleet()

    @on(events.ScreenSuspend)
    def _suspended(self) -> None:
        self.preview.end()

    @on(events.ScreenResume)
    def _resumed(self) -> None:
        self.show_message()
        self.show_fleet()

    def on_unmount(self) -> None:
        """Keep the edits against a crash of the next console."""
        # The screen is going away: there is no line left to report a failure in.
        with contextlib.suppress(FileRefused):
            self.autosave.keep()
        self.autosave.close()

    @on(ScenarioUpdated)
    def _scenario_changed(self) -> None:
        self._take_scenario()

    @on(StatusUpdated)
    def _status_updated(self) -> None:
        if self.is_current:  # another round may be flown now
            self.show_message()

    def _preview_target(self) -> Target | None:
        # With an invalid value the text does not say what is shown, and with a newer scenario the station refuses it.
        if self.model.scenario is None or self.draft.problems or self.model.newer is not None:
            return None
        return self.model.base_revision, self.model.text, self.model.round_index

    def _limits(self) -> Limits:
        return self.model.scenario.limits if self.model.scenario is not None else Limits()

    def _show_preview(self) -> None:
        self.map_view.set_annotations({team: found.annotations for team, found in self.preview.results.items()})
        self.show_message()

    def _take_scenario(self) -> None:
        """Follow the station's scenario, or note that it differs from what is edited."""
        if self.feed.scenario is None:
            self.show_message()
            return
        self.draft.files = self.feed.planner_files
        first, before = self.model.scenario is None, self.model.text
        self.model.station_changed(self.feed.scenario)
        if first:
            # The round that is flown is what the operator wants to see first.
            self.model.select_round(self._flown_round() or 0)
            recovered = self._recover()
            self.draft.choose_first()
            self.forms.refill()
            if recovered:
                self.feedback.report(recovered, Ink.CAUTION)
        elif self.model.text != before:
            self.feedback.report("the station's scenario changed: this is the new one")
            self.forms.refill()
        self.show_message()

    def _recover(self) -> str:
        try:
            return self.autosave.recover(self.feed.scenario) if self.feed.scenario is not None else ""
        except FileRefused as error:
            return f"work in progress is not kept: {error}"

    def _autosave_later(self) -> None:
        if self._autosave_timer is None and self.autosave.is_behind:
            self._autosave_timer = self.set_timer(AUTOSAVE_S, self._autosave_now)

    def _autosave_now(self) -> None:
        self._autosave_timer = None
        try:
            self.autosave.keep()
        except FileRefused as error:
            self.feedback.report(f"work in progress is not kept: {error}", Ink.CAUTION)

    def _flown_round(self) -> int | None:
        return self.feed.status.round_index if self.feed.status is not None else None

    def show_message(self) -> None:
        """Show everything but the forms from the working copy: the message stands among the rest."""
        model = self.model
        scenario, current = model.scenario, model.current_round
        self.edit_line.show(state_remark(model), self.feedback.message)
        if scenario is None or current is None:
            return
        self.map_view.set_scenario(current, scenario.places, scenario.origin)
        self.map_view.edited_zone = self.draft.zone_name
        self._show_edited_shape(current)
        self.round_chooser.show([r.name for r in scenario.rounds], model.round_index, self._flown_round())
        names = [zone.name for zone in current.zones]
        zone_name = self.draft.zone_name
        self.zone_list.show(current, names.index(zone_name) + 1 if zone_name in names else AREA_ROW)
        self._show_verdict()
        self.preview.request_later()
        self._autosave_later()

    def _show_verdict(self) -> None:
        preview, team = self.preview, self.draft.team
        found: list[Remark] = []
        if team is not None:
            found += preview_remarks(team, preview.results.get(team.name), preview.idleness_s, preview.waited_s)
            found += meeting_remarks([each.finding for each in preview.meetings if team.name in each.teams])
        self.verdict.show(remarks(self.model, self.draft, self.apply.refusal, self.glyphs, found))

    def _show_edited_shape(self, current: Round) -> None:
        edited, pending = self.draft.edited, self.draft.pending
        others = [zone.shape for zone in current.zones if zone.name != self.draft.zone_name]
        if edited is not None:
            if self.draft.zone_name is not None:
                others.append(current.area.shape)
            self.map_view.show_edited(
                (pending or edited).shape, tuple(others), allowed=pending is None, border=border_of(edited)
            )

    def _select_zone(self, name: str | None) -> None:
        self.forms.replacing_typed(lambda: self.draft.choose_zone(name))

    @on(ZoneList.Selected)
    def _zone_selected(self, message: ZoneList.Selected) -> None:
        current = self.model.current_round
        if current is not None:
            self._select_zone(current.zones[message.row - 1].name if message.row != AREA_ROW else None)

    @on(RoundChooser.Chosen)
    @on(SettingsForm.RoundChosen)
    def _round_chosen(self, message: RoundChooser.Chosen | SettingsForm.RoundChosen) -> None:
        self._choose_round(message.index)

    def _choose_round(self, index: int) -> None:
        if self.model.select_round(index):
            self._select_zone(self.draft.zone_name)
        else:
            self.feedback.report(f"there is no round {index + 1}", Ink.CAUTION)

    @on(ZoneForm.Edited)
    def _zone_typed(self, message: ZoneForm.Edited) -> None:
        self.forms.take_zone(message.texts, message.field)

    @on(TeamForm.Chosen)
    def _team_chosen(self, message: TeamForm.Chosen) -> None:
        self.forms.choose_team(message.name)

    @on(TeamForm.Edited)
    def _team_typed(self, message: TeamForm.Edited) -> None:
        self.forms.take_team(message.texts, message.field)

    @on(SettingsForm.PlaceChosen)
    def _place_chosen(self, message: SettingsForm.PlaceChosen) -> None:
        self.forms.choose_place(message.index)

    @on(SettingsForm.Edited)
    def _setting_typed(self, message: SettingsForm.Edited) -> None:
        self.forms.take_settings(message.texts, message.field)

    @on(events.DescendantFocus)
    def _field_entered(self, event: events.DescendantFocus) -> None:
        self.forms.explain(getattr(event.widget, "field", ""))

    @on(events.DescendantBlur)
    def _field_left(self) -> None:
        self.draft.end_field()

    @on(EditMap.Reshaped)
    def _reshaped(self, message: EditMap.Reshaped) -> None:
        # A shape that is not allowed stays on the map until it is changed further or undone.
        before = self.draft.pending or self.draft.edited
        self.draft.reshape(message.shape, message.step)
        self.map_view.acknowledge()
        self.forms.fill()
        self.feedback.report(describe_corners(before.shape, message.shape) if before is not None else "", Ink.CAUTION)

    @on(EditMap.Clicked)
    def _map_clicked(self, message: EditMap.Clicked) -> None:
        current = self.model.current_round
        zones = current.zones if current is not None else ()
        there = [zone for zone in zones if contains(zone.shape, [message.place_m])[0]]
        # Zones may overlap: the smallest one could not be hit otherwise.
        if there:
            self._select_zone(min(there, key=lambda zone: area_m2(zone.shape)).name)

    @on(PromptBar.Answered, "#fleet-size")
    def _idleness_typed(self, message: PromptBar.Answered) -> None:
        self.zone_list.focus()
        try:
            idleness_s = to_idleness(message.text) if message.text is not None else None
        except FieldError as error:
            self.feedback.report(str(error), Ink.CAUTION)
            return
        if idleness_s is None or self.draft.team is None:
            self.feedback.report("nothing asked")
        else:
            self.preview.request_fleet_size(self.draft.team.name, idleness_s)
            self.feedback.report("")

    @on(PromptBar.Answered, "#open")
    def _file_named(self, message: PromptBar.Answered) -> None:
        self.zone_list.focus()
        path = typed_path(message.text or "")
        if path is None:
            self.feedback.report("nothing imported")
            return
        problems, done = self.draft.zones.import_zones(path)
        self.forms.refill()
        self.feedback.report(f"not imported: {problems[0]}" if problems else f"{done}; u takes it back", Ink.CAUTION)

    def action_save(self) -> None:
        """Save the scenario, unless a value in the forms is not allowed."""
        if self.draft.problems:
            self.feedback.report("not saved: a value is not allowed (u puts it back)", Ink.CAUTION)
        else:
            super().action_save()

    def action_digit(self, digit: str) -> None:
        """Edit round 1 to 9, or copy the zone into it if that was asked."""
        index = int(digit) - 1
        if self.parts.awaits_round:
            self.parts.copy_zone([index])
        else:
            self._choose_round(index)

    def action_add_zone(self) -> None:
        """Add a zone and put the cursor into its form; in the line of teams add a team."""
        if self._is_on_teams:
            self.parts.add_team()
        elif self.parts.add_zone():
            self.forms.open_zone()
            self.feedback.report(f"{self.draft.zone_name} added")

    def action_delete_zone(self) -> None:
        """Delete the zone; in the line of teams delete the team."""
        if self._is_on_teams:
            self.parts.delete_team()
        else:
            self.parts.delete_zone()

    @property
    def _is_on_teams(self) -> bool:
        return getattr(self.focused, "field", "") == "team"

    def action_undo(self) -> None:
        """Put back values that are not allowed; if there are none, undo the last change."""
        if self.draft.problems:
            self.forms.refill()
            self.feedback.report("values that were not allowed were put back")
            return
        label = self.model.undo()
        self.forms.refill()
        self.feedback.report(f"undone: {label}" if label else "nothing to undo")

    def action_redo(self) -> None:
        """Redo the change that was undone last."""
        label = self.model.redo()
        self.forms.refill()
        self.feedback.report(f"done again: {label}" if label else "nothing to do again")

    def action_how_many(self) -> None:
        """Ask for the worst idleness that the team shall reach."""
        if self.draft.team is not None:
            self.fleet_size_bar.ask(f"Vehicles of {self.draft.team.name} for a worst idleness of how many seconds?")

    def action_move_on_map(self) -> None:
        """Let keys change the shape on the map, until Esc."""
        self.map_view.begin()
        self.feedback.report("")

    def action_settings(self) -> None:
        """Open the settings form, or close it."""
        if self.forms.shows_settings:
            self.action_leave()
        else:
            self.forms.open_settings()

    def action_leave(self) -> None:
        """Leave the settings and put the cursor into the list of zones."""
        self.forms.close_settings()
        self.zone_list.focus()
        self.feedback.report("")

    def action_missions(self) -> None:
        """Show the missions screen instead of this one."""
        self.app.switch_mode("missions")

    def action_rehearse(self) -> None:
        """Show the rehearsals screen instead of this one."""
        self.app.switch_mode("rehearsals")

    async def action_detach_asking(self) -> None:
        """Detach; if changes were neither applied nor saved, at the second press."""
        lost = self.model.changes and self.model.unsaved
        question = "changes neither applied nor saved: q again leaves without them"
        if not lost or self.feedback.confirmed("detach", question):
            await self.run_action("app.detach")
