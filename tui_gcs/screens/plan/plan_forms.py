"""The plan screen's forms: filled from the working copy, and what is typed into them."""

from dataclasses import replace

from textual.containers import Vertical
from textual.events import DescendantBlur, DescendantFocus

from tui_gcs.screens.plan.plan_parts import PlanParts
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.plan.forms.settings_form import SettingsForm
from tui_gcs.widgets.plan.forms.team_form import TeamForm
from tui_gcs.widgets.plan.forms.team_text import TeamText, team_text
from tui_gcs.widgets.plan.forms.zone_form import ZoneForm
from tui_gcs.widgets.plan.forms.zone_text import zone_text
from tui_gcs.widgets.plan.plan_draft import reshaped
from tui_gcs.widgets.plan.shape_edit import border_of, converted, corners_told


class PlanForms(PlanParts):
    """Zone, team, settings: forms say texts, the draft says what becomes of them."""

    zone_form: ZoneForm
    team_form: TeamForm
    settings_form: SettingsForm
    rounds: Vertical
    """The panel of rounds and zones."""

    def choose_round(self, index: int) -> None:
        """Edit another round."""
        raise NotImplementedError

    def show_forms(self) -> None:
        """Fill the forms from the working copy; what was typed and not allowed is gone."""
        self.draft.refilled()
        self.fill_forms()

    def fill_forms(self) -> None:
        """Show in them what is edited, also what is not allowed yet."""
        current, edited = self.model.current_round, self.draft.pending or self.draft.edited
        if current is not None and edited is not None:
            self.zone_form.show(edited, current.area)
            self._show_team()
            self._show_settings()

    def _show_settings(self) -> None:
        settings = self.draft.settings
        texts = settings.texts
        if texts:
            where = {"round_index": self.model.round_index, "place_index": settings.place_index}
            self.settings_form.show(texts, rounds=settings.rounds, places=settings.places, **where)

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

    # ------------------------------------------------------------ typing

    def on_zone_form_edited(self, message: ZoneForm.Edited) -> None:
        """Take over what was typed, or say why not."""
        edited, texts = self.draft.edited, message.texts
        if edited is None:
            return
        told = ""
        if message.field == "shape":
            shape = converted(edited.shape, texts.shape, border_of(edited))
            told = corners_told(edited.shape, shape)
            self.zone_form.show_shape(zone_text(reshaped(edited, shape)))
            texts = self.zone_form.texts
        name = self.draft.zone_name
        self.draft.zone_typed(texts, message.field)
        if self.draft.zone_name != name:
            set_title(self.zone_form, f"zone {self.draft.zone_name}")
            self._show_team()
        self.say(told, Ink.CAUTION)

    def on_team_form_chosen(self, message: TeamForm.Chosen) -> None:
        """Another team."""
        self.draft.team_name = message.name
        self._show_team()
        self.say("")

    def on_team_form_edited(self, message: TeamForm.Edited) -> None:
        """Take over what was typed, or say why not."""
        texts, old = message.texts, self.draft.team
        if message.field == "planner" and old is not None:
            texts = replace(texts, parameters=team_text(old).parameters if texts.planner == old.planner else {})
            self._show_team(texts)
        self.draft.team_typed(texts, message.field)
        scenario, team = self.model.scenario, self.draft.team
        if message.field == "team_name" and scenario is not None and team is not None:
            self.team_form.show_teams(team.name, [each.name for each in scenario.teams])
        self.say(self.model.moved, Ink.CAUTION)

    # ------------------------------------------------------------ settings

    def action_settings(self) -> None:
        """Open the form for what is neither a zone nor a team, or close it."""
        if self.has_class("-settings"):
            self.action_leave()
            return
        dropped = bool(self.draft.problems)
        self._show_class("-settings")
        self.show_forms()
        self.settings_form.focus_first()
        self.say("values that were not allowed were put back" if dropped else "", Ink.CAUTION)

    def close_settings(self) -> None:
        """Zones and teams again; what was not allowed is put back."""
        if self.has_class("-settings"):
            self._show_class("-settings", on=False)
            if self.draft.settings.problems:
                self.show_forms()

    def _show_class(self, name: str, *, on: bool = True) -> None:
        """One of the classes that say which forms are shown: nothing else looks different then."""
        show_classes(self, {name: on}, [self.rounds, self.zone_form, self.team_form, self.settings_form, self.verdict])

    def action_leave(self) -> None:
        """Back to the list of zones."""
        raise NotImplementedError

    def on_settings_form_round_chosen(self, message: SettingsForm.RoundChosen) -> None:
        """Another round, here and on the map."""
        self.choose_round(message.index)

    def on_settings_form_place_chosen(self, message: SettingsForm.PlaceChosen) -> None:
        """Another take-off place."""
        dropped = bool(self.draft.settings.problems)
        self.draft.settings.place_index = message.index
        self.draft.end_field()
        self.show_forms()
        self.say("values that were not allowed were put back" if dropped else "", Ink.CAUTION)

    def on_settings_form_edited(self, message: SettingsForm.Edited) -> None:
        """Take over what was typed, or say why not."""
        settings = self.draft.settings
        settings.typed(message.texts, message.field)
        self.settings_form.show_places(settings.places, settings.place_index)
        self.say(settings.swapped, Ink.CAUTION)

    # ------------------------------------------------------------ the cursor

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        """Say what a planner's parameter, or a setting, is about."""
        field = getattr(event.widget, "field", "")
        form = self.settings_form if self.has_class("-settings") else self.team_form
        if text := form.help_of(field):
            self.say(text, Ink.MUTED)

    def on_descendant_blur(self, _event: DescendantBlur) -> None:
        """A field was left: what comes next is another change."""
        self.draft.end_field()
