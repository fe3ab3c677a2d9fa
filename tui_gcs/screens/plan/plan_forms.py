"""The forms beside the map of the plan screen: filled from the draft, and what is typed into them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from textual.dom import DOMNode
from textual.widget import Widget

from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form import Form
from tui_gcs.widgets.plan.forms.settings_form import SettingsForm
from tui_gcs.widgets.plan.forms.team_form import TeamForm
from tui_gcs.widgets.plan.forms.team_text import TeamText, team_text
from tui_gcs.widgets.plan.forms.zone_form import ZoneForm
from tui_gcs.widgets.plan.forms.zone_text import ZoneText, zone_text
from tui_gcs.widgets.plan.plan_draft import PlanDraft, reshaped
from tui_gcs.widgets.plan.shape_edit import border_of, converted, describe_corners

PUT_BACK = "values that were not allowed were put back"


class PlanForms:
    """Passes texts from the zone, team and settings forms to the draft, and shows the draft in them."""

    def __init__(
        self,
        node: DOMNode,
        forms: tuple[ZoneForm, TeamForm, SettingsForm],
        others: Sequence[Widget],
        draft: PlanDraft,
        feedback: KeyFeedback,
    ) -> None:
        """`node` has the CSS classes that decide which forms are shown; `others` are styled by them, too."""
        self._node = node
        self.zone_form, self.team_form, self.settings_form = forms
        self._others = others
        self._draft = draft
        self._model = draft.model
        self._feedback = feedback

    def refill(self) -> None:
        """Fill the forms from the working copy; what was typed and not allowed is dropped."""
        self._draft.refilled()
        self.fill()

    def fill(self) -> None:
        """Fill the forms with what is edited, including a shape that is not allowed."""
        current, edited = self._model.current_round, self._draft.pending or self._draft.edited
        if current is not None and edited is not None:
            self.zone_form.show(edited, current.area)
            self._fill_team()
            self._fill_settings()

    def _fill_settings(self) -> None:
        settings = self._draft.settings
        texts = settings.texts
        if texts:
            where = {"round_index": self._model.round_index, "place_index": settings.place_index}
            self.settings_form.show(texts, rounds=settings.rounds, places=settings.places, **where)

    def _fill_team(self, texts: TeamText | None = None) -> None:
        scenario, team = self._model.scenario, self._draft.team
        if scenario is None or team is None:
            return
        shown = texts or team_text(team)
        self.team_form.show(
            shown,
            teams=[each.name for each in scenario.teams],
            zones=self._model.common_zones(),
            planners=self._draft.planners(),
            params=self._draft.declared(shown.planner)[0],
        )

    def take_zone(self, texts: ZoneText, field: str) -> None:
        """Take what was typed into the zone form."""
        edited = self._draft.edited
        if edited is None:
            return
        remark = ""
        if field == "shape":
            shape = converted(edited.shape, texts.shape, border_of(edited))
            remark = describe_corners(edited.shape, shape)
            # The fields of the new kind of shape are empty until they are filled from the converted shape.
            self.zone_form.show_shape(zone_text(reshaped(edited, shape)))
            texts = self.zone_form.texts
        name = self._draft.zone_name
        self._draft.zone_typed(texts, field)
        # Teams refer to a zone by its name.
        if self._draft.zone_name != name:
            set_title(self.zone_form, f"zone {self._draft.zone_name}")
            self._fill_team()
        self._feedback.report(remark, Ink.CAUTION)

    def choose_team(self, name: str) -> None:
        """Show another team in the team form."""
        self._draft.team_name = name
        self._fill_team()
        self._feedback.report("")

    def take_team(self, texts: TeamText, field: str) -> None:
        """Take what was typed into the team form."""
        old = self._draft.team
        if field == "planner" and old is not None:
            # Another planner has other parameters: it would refuse those of the old one.
            texts = replace(texts, parameters=team_text(old).parameters if texts.planner == old.planner else {})
            self._fill_team(texts)
        self._draft.team_typed(texts, field)
        scenario, team = self._model.scenario, self._draft.team
        if field == "team_name" and scenario is not None and team is not None:
            self.team_form.show_teams(team.name, [each.name for each in scenario.teams])
        self._feedback.report(self._draft.teams.moved, Ink.CAUTION)

    def open_settings(self) -> None:
        """Show the settings form instead of rounds, zone and team."""
        self.replacing_typed(lambda: self._show_class("-settings"), focus=self.settings_form)

    def replacing_typed(self, change: Callable[[], None], focus: Form | None = None) -> None:
        """Change what the forms show and refill them; report it if a typed value is lost by that."""
        dropped = bool(self._draft.problems)
        change()
        self.refill()
        if focus is not None:
            focus.focus_first()
        self._feedback.report(PUT_BACK if dropped else "", Ink.CAUTION)

    @property
    def shows_settings(self) -> bool:
        """Whether the settings form is shown."""
        return self._node.has_class("-settings")

    def close_settings(self) -> None:
        """Show rounds, zone and team again; what was not allowed in the settings is put back."""
        if self.shows_settings:
            self._show_class("-settings", on=False)
            if self._draft.settings.problems:
                self.refill()

    def turn_page(self) -> None:
        """Put the cursor into the team form or the zone form; a low screen shows one of them at a time."""
        self._show_class("-team", on=not self._node.has_class("-team") or not self._node.has_class("-short"))
        self.close_settings()
        form: Form = self.team_form if self._node.has_class("-team") else self.zone_form
        form.focus_first()

    def open_zone(self) -> None:
        """Put the cursor into the zone form."""
        self._show_class("-team", on=False)
        self.close_settings()
        self.zone_form.focus_first()

    def _show_class(self, name: str, *, on: bool = True) -> None:
        affected = [*self._others, self.zone_form, self.team_form, self.settings_form]
        show_classes(self._node, {name: on}, affected)

    def choose_place(self, index: int) -> None:
        """Show another take-off place in the settings form."""
        dropped = bool(self._draft.settings.problems)
        self._draft.settings.place_index = index
        self._draft.end_field()
        self.refill()
        self._feedback.report(PUT_BACK if dropped else "", Ink.CAUTION)

    def take_settings(self, texts: Mapping[str, str], field: str) -> None:
        """Take what was typed into the settings form."""
        settings = self._draft.settings
        settings.typed(texts, field)
        self.settings_form.show_places(settings.places, settings.place_index)
        self._feedback.report(settings.swapped, Ink.CAUTION)

    def explain(self, field: str) -> None:
        """Show what a planner's parameter or a setting means while its field has the cursor."""
        form = self.settings_form if self.shows_settings else self.team_form
        if text := form.help_of(field):
            self._feedback.report(text, Ink.MUTED)
