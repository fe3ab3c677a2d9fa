"""The plan screen: the edited round on the map, its zones, and forms for zone and team.

What is typed goes into a working copy (`EditModel`); only an explicit apply sends it to the station. Values that are
not allowed stay in their field with the reason, and reach neither the map nor the station.
"""

from dataclasses import replace
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.events import DescendantBlur, DescendantFocus
from textual.screen import Screen
from textual.widgets import Input

from tui_gcs.actions import APP_ACTIONS, Action, bindings
from tui_gcs.core.clock import Clock, MonotonicClock
from tui_gcs.core.messages import ApplyScenario
from tui_gcs.feed import Feed, FleetUpdated, ScenarioChanged, StationBack, StationLost, StatusUpdated
from tui_gcs.screens.fly import FlyScreen
from tui_gcs.screens.plan_actions import PLAN_ACTIONS
from tui_gcs.screens.plan_text import remarks, state_remark
from tui_gcs.screens.second_press import EXPIRES_S, SecondPress
from tui_gcs.widgets.edit_map import EditMap
from tui_gcs.widgets.edit_model import EditModel
from tui_gcs.widgets.footer import FooterLine
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.open_bar import OpenBar
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.plan_draft import PlanDraft, reshaped
from tui_gcs.widgets.round_chooser import RoundChooser
from tui_gcs.widgets.save_bar import SaveBar
from tui_gcs.widgets.save_flow import SaveNext
from tui_gcs.widgets.shape_edit import converted
from tui_gcs.widgets.team_form import TeamForm
from tui_gcs.widgets.team_text import TeamText, team_text
from tui_gcs.widgets.titles import set_title
from tui_gcs.widgets.top_lines import TopLines
from tui_gcs.widgets.vehicle_alarms import by_vehicle
from tui_gcs.widgets.verdict import EditLine, Remark, VerdictLines
from tui_gcs.widgets.zone_form import ZoneForm
from tui_gcs.widgets.zone_list import AREA_ROW, ZoneList
from tui_gcs.widgets.zone_text import zone_text

QUIET = Remark("")


class PlanScreen(Screen[None]):
    """Edits a scenario; knows widgets and the working copy, nothing of protocols."""

    ACTIONS: ClassVar[tuple[Action, ...]] = PLAN_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(PLAN_ACTIONS, "plan")
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]
    AUTO_FOCUS = "ZoneList"
    CSS = """
    PlanScreen { layout: vertical; }
    PlanScreen #middle { height: 1fr; }
    PlanScreen EditMap { width: 1fr; height: 1fr; }
    PlanScreen #side { width: 50; height: 1fr; }
    PlanScreen #rounds { border: solid #4a5560; border-title-color: #d8dee4; height: 9; }
    PlanScreen.-ascii #rounds { border: ascii #4a5560; }
    PlanScreen TeamForm { max-height: 15; }
    PlanScreen.-narrow #side { width: 40; }
    PlanScreen.-short #rounds { height: 7; }
    PlanScreen.-short ZoneForm, PlanScreen.-short TeamForm { height: 9; }
    PlanScreen.-short TeamForm, PlanScreen.-short.-team ZoneForm { display: none; }
    PlanScreen.-short.-team TeamForm { display: block; }
    """

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE, clock: Clock | None = None) -> None:
        """For this feed."""
        super().__init__()
        self.feed = feed
        self._second = SecondPress(clock or MonotonicClock())
        self.model = EditModel()
        self.draft = PlanDraft(self.model)
        self._glyphs = glyphs
        self._message = QUIET
        self._refusal = ""
        self._applying = False
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.edit_line = EditLine(glyphs=glyphs)
        self.map_view = EditMap(glyphs=glyphs)
        self.round_chooser = RoundChooser(glyphs=glyphs)
        self.zone_list = ZoneList(glyphs=glyphs)
        self.zone_form = ZoneForm(glyphs=glyphs)
        self.team_form = TeamForm(glyphs=glyphs)
        self.verdict = VerdictLines(glyphs=glyphs)
        self.save_bar = SaveBar(self.model)
        self.open_bar = OpenBar()
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed)
        self.set_class(not glyphs.unicode, "-ascii")

    def compose(self) -> ComposeResult:
        """Status, alarm, state of the copy; map and forms; keys."""
        yield self.top_lines
        yield self.edit_line
        with Horizontal(id="middle"):
            yield self.map_view
            with Vertical(id="side"):
                with Vertical(id="rounds") as rounds:
                    set_title(rounds, "rounds and zones")
                    yield self.round_chooser
                    yield self.zone_list
                yield self.zone_form
                yield self.team_form
                yield self.verdict
        yield self.save_bar
        yield self.open_bar
        yield self.footer

    def on_mount(self) -> None:
        """Listen to the feed."""
        self.feed.listen(self)
        self._take_scenario()
        self.show_fleet()

    def on_unmount(self) -> None:
        """No more messages."""
        self.feed.leave(self)

    def on_screen_resume(self) -> None:
        """What changed while another screen was shown."""
        self.show_plan()
        self.show_fleet()

    # ------------------------------------------------------------ messages of the feed

    def on_scenario_changed(self, _message: ScenarioChanged) -> None:
        """The station flies something else: followed, or told."""
        self._take_scenario()

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Vehicles moved."""
        if self.is_current:
            self.show_fleet()

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Perhaps another round is flown."""
        if self.is_current:
            self.show_plan()

    def on_station_lost(self, _message: StationLost) -> None:
        """Nothing is known of the vehicles."""
        self.show_fleet()

    def on_station_back(self, _message: StationBack) -> None:
        """Known again."""
        self.show_fleet()

    def _take_scenario(self) -> None:
        if self.feed.scenario is None:
            self.show_plan()
            return
        self.draft.files = self.feed.planner_files
        first, before = self.model.scenario is None, self.model.text
        self.model.station_changed(self.feed.scenario)
        if first:
            self.model.select_round(self._flown() or 0)
            self.draft.choose_first()
            self.show_forms()
        elif self.model.text != before:
            self._say("the station's scenario changed: this is the new one")
            self.show_forms()
        self.show_plan()

    def _flown(self) -> int | None:
        return self.feed.status.round_index if self.feed.status is not None else None

    # ------------------------------------------------------------ showing

    def show_fleet(self) -> None:
        """Vehicles on the map."""
        alarms = by_vehicle(self.feed.alarms)
        self.map_view.set_fleet(self.feed.frame, alarms, known=not self.feed.station_lost)

    def show_plan(self) -> None:
        """Everything but the forms, from the working copy."""
        model = self.model
        scenario, current = model.scenario, model.current_round
        self.edit_line.show(state_remark(model), self._message)
        if scenario is None or current is None:
            return
        self.map_view.set_scenario(current, scenario.places, scenario.origin)
        self.map_view.edited_zone = self.draft.zone_name
        self.round_chooser.show([r.name for r in scenario.rounds], model.round_index, self._flown())
        names = [zone.name for zone in current.zones]
        zone_name = self.draft.zone_name
        self.zone_list.show(current, names.index(zone_name) + 1 if zone_name in names else AREA_ROW)
        self.verdict.show(remarks(model, self.draft, self._refusal, self._glyphs))

    def show_forms(self) -> None:
        """Fill both forms from the working copy; what was typed and not allowed is gone."""
        self.draft.refilled()
        current, edited = self.model.current_round, self.draft.edited
        if current is not None and edited is not None:
            self.zone_form.show(edited, current.area)
            self._show_team()

    def _show_team(self, texts: TeamText | None = None) -> None:
        scenario, team = self.model.scenario, self.draft.team
        if scenario is None or team is None:
            return
        shown = texts or team_text(team)
        self.team_form.show(
            shown,
            teams=[each.name for each in scenario.teams],
            zones=self.model.common_zones(),
            planners=self.draft.planners(),
            params=self.draft.declared(shown.planner)[0],
        )

    def _say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Tell what became of a key; a question that waited for its second press is over."""
        self._second.forget()
        self.save_bar.forget()
        self._message = Remark(text, ink)
        self.show_plan()

    def _confirmed(self, what: str, question: str) -> bool:
        """Whether this is the second press of the same key in a row, and soon enough; the first one asks."""
        if self._second.answers(what):
            return True
        self._message = Remark(question, Ink.CAUTION)
        self.save_bar.forget()
        self.set_timer(EXPIRES_S, self._expire)
        self.show_plan()
        return False

    def _expire(self) -> None:
        """Nobody answered: the same key asks anew."""
        if self._second.is_over or self.save_bar.asks:
            self._say(f"nothing done: no second key within {EXPIRES_S:.0f} s")

    # ------------------------------------------------------------ choosing

    def _select(self, zone_name: str | None) -> None:
        """Put a zone, or the operating area, into the form."""
        dropped = bool(self.draft.problems)
        self.draft.choose_zone(zone_name)
        self.show_forms()
        self._say("values that were not allowed were put back" if dropped else "", Ink.CAUTION)

    def on_zone_list_selected(self, message: ZoneList.Selected) -> None:
        """Another zone."""
        current = self.model.current_round
        if current is not None:
            self._select(current.zones[message.row - 1].name if message.row != AREA_ROW else None)

    def on_round_chooser_chosen(self, message: RoundChooser.Chosen) -> None:
        """Another round."""
        self._choose_round(message.index)

    def action_digit(self, digit: str) -> None:
        """Edit round 1 to 9."""
        self._choose_round(int(digit) - 1)

    def _choose_round(self, index: int) -> None:
        if self.model.select_round(index):
            self._select(self.draft.zone_name)
        else:
            self._say(f"there is no round {index + 1}", Ink.CAUTION)

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
        self.set_class(not self.has_class("-team") or not self.has_class("-short"), "-team")
        form = self.team_form if self.has_class("-team") else self.zone_form
        self.call_after_refresh(form.focus_first)

    def action_leave(self) -> None:
        """Back to the list."""
        self.zone_list.focus()
        self._say("")

    async def action_detach_asking(self) -> None:
        """Leave; what was neither applied nor saved would be lost, so that takes a second press."""
        lost = self.model.changes and self.model.unsaved
        if not lost or self._confirmed("detach", "changes neither applied nor saved: q again leaves without them"):
            await self.run_action("app.detach")

    def action_resume(self) -> None:
        """Enter outside a field means the same as on the fly screen."""
        if self.focused is None or self.focused is self.zone_list:
            self.post_message(FlyScreen.Resumed())

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        """Say what a planner's parameter is about."""
        self.footer.show_typing(isinstance(event.widget, Input))
        text = self.team_form.help_of(getattr(event.widget, "field", ""))
        if text:
            self._say(text, Ink.MUTED)

    def on_descendant_blur(self, _event: DescendantBlur) -> None:
        """A field was left: what comes next is another change."""
        self.footer.show_typing(False)
        self.draft.end_field()

    # ------------------------------------------------------------ typing

    def on_zone_form_edited(self, message: ZoneForm.Edited) -> None:
        """Take over what was typed, or say why not."""
        edited, texts = self.draft.edited, message.texts
        if edited is None:
            return
        if message.field == "shape":
            shape = converted(edited.shape, texts.shape)
            self.zone_form.show_shape(zone_text(reshaped(edited, shape)))
            texts = self.zone_form.texts
        name = self.draft.zone_name
        self.draft.zone_typed(texts, message.field)
        if self.draft.zone_name != name:
            set_title(self.zone_form, f"zone {self.draft.zone_name}")
            self._show_team()
        self._say("")

    def on_team_form_chosen(self, message: TeamForm.Chosen) -> None:
        """Another team."""
        self.draft.team_name = message.name
        self._show_team()
        self._say("")

    def on_team_form_edited(self, message: TeamForm.Edited) -> None:
        """Take over what was typed, or say why not."""
        texts, old = message.texts, self.draft.team
        if message.field == "planner" and old is not None:
            texts = replace(texts, parameters=team_text(old).parameters if texts.planner == old.planner else {})
            self._show_team(texts)
        self.draft.team_typed(texts, message.field)
        self._say(self.model.moved, Ink.CAUTION)

    # ------------------------------------------------------------ changing

    def action_add_zone(self) -> None:
        """A new zone in the middle of the area, with the cursor in its form."""
        problems = self.draft.add_zone()
        if problems:
            self._say(f"not added: {problems[0]}", Ink.CAUTION)
            return
        self.show_forms()
        self.remove_class("-team")
        self.call_after_refresh(self.zone_form.focus_first)
        self._say(f"{self.draft.zone_name} added")

    def action_import_zones(self) -> None:
        """From which file?"""
        self.open_bar.ask()

    def on_open_bar_named(self, message: OpenBar.Named) -> None:
        """Its areas become zones; undo takes them back."""
        self.zone_list.focus()
        if message.path is None:
            self._say("nothing imported")
            return
        problems, done = self.model.import_zones(message.path)
        self.show_forms()
        self._say(f"not imported: {problems[0]}" if problems else f"{done}; u takes it back", Ink.CAUTION)

    def action_delete_zone(self) -> None:
        """Take the zone out; the second press does it."""
        name = self.draft.zone_name
        if name is not None and not self._confirmed(f"delete {name}", f"delete zone {name}? Del again deletes it"):
            return
        problems = self.draft.delete_zone()
        if problems:
            self._say(f"not deleted: {problems[0]}", Ink.CAUTION)
        else:
            self.show_forms()
            self._say(f"zone {name} deleted, u brings it back")

    def action_undo(self) -> None:
        """Values that were not allowed first, then changes."""
        if self.draft.problems:
            self.show_forms()
            self._say("values that were not allowed were put back")
            return
        label = self.model.undo()
        self.show_forms()
        self._say(f"undone: {label}" if label else "nothing to undo")

    def action_move_on_map(self) -> None:
        """Arrows and brackets change the shape until Esc."""
        self.map_view.begin()
        self._say("")

    def on_edit_map_reshaped(self, message: EditMap.Reshaped) -> None:
        """Moved, turned or sized on the map."""
        edited = self.draft.edited
        if edited is not None:
            problems = self.draft.replace(reshaped(edited, message.change(edited.shape)), "on map")
            self.show_forms()
            self._say(f"! {problems[0]}" if problems else "", Ink.CAUTION)

    # ------------------------------------------------------------ apply, keep, discard

    def action_apply(self) -> None:
        """Send the working copy to the station; in flight the second press does it."""
        if self._applying:
            return
        if self.draft.problems:
            self._say("not applied: a value is not allowed (u puts it back)", Ink.CAUTION)
        elif self.model.newer is not None:
            self._say("not applied: first k keep this copy, or d take the station's", Ink.CAUTION)
        elif not self.model.changes:
            self._say("nothing to apply: the station flies this")
        elif self._may_apply():
            self._applying = True
            base_revision, text = self.model.sending()
            self._refusal = ""
            self._say("applying: sent")
            self.run_worker(self._apply(base_revision, text), group="apply")

    def _may_apply(self) -> bool:
        armed = self.feed.status.armed if self.feed.status is not None else 0
        question = f"{armed} vehicles armed: a or ^G again changes their flight now"
        return not armed or self._confirmed(f"apply to {armed}", question)

    async def _apply(self, base_revision: int, text: str) -> None:
        reply = await self.feed.request(ApplyScenario(base_revision=base_revision, toml=text))
        self._applying = False
        if reply.ok:
            if reply.scenario is not None:
                self.model.applied(text, reply.scenario.revision)
            self._say("applied: the station flies this now")
        else:
            vehicles = "".join(f"\nvehicle {r.vehicle}: {r.text}" for r in reply.results if not r.ok)
            self._refusal = (reply.text or "no reason given") + vehicles
            self._say("NOT APPLIED, see right", Ink.WARNING)

    def action_keep(self) -> None:
        """Stay with this copy although the station has a newer scenario."""
        if self.model.newer is not None:
            self.model.keep()
            self._say("kept: the next apply replaces the station's newer scenario")

    def action_discard(self) -> None:
        """Drop this copy for the station's newer scenario; the second press does it."""
        if self.model.newer is not None and self._confirmed("discard", "drop your changes? d again drops them"):
            self.model.discard()
            self._refusal = ""
            self.show_forms()
            self._say("this is what the station flies")

    # ------------------------------------------------------------ save

    def action_save(self) -> None:
        """To the scenario's file, or ask where."""
        if self.draft.problems:
            self._say("not saved: a value is not allowed (u puts it back)", Ink.CAUTION)
        else:
            self.save_bar.save()

    def on_save_bar_said(self, message: SaveBar.Said) -> None:
        """Saved, asked or failed."""
        if message.closed:
            self.zone_list.focus()
        done = message.step.what is SaveNext.DONE
        self._second.forget()
        self._message = Remark(message.step.text, Ink.TEXT if done else Ink.CAUTION)
        if message.step.what is SaveNext.CONFIRM:
            self.set_timer(EXPIRES_S, self._expire)
        self.show_plan()
