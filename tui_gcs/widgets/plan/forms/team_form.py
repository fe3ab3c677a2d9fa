"""The form for a team: its vehicles, the zone they serve, the planner that flies them and its parameters."""

from collections.abc import Sequence

from textual import on
from textual.message import Message
from textual.widgets import Input

from tui_gcs.planner.api import Param
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form import Form, FormField, FormRow
from tui_gcs.widgets.plan.forms.param_form import ParamForm
from tui_gcs.widgets.plan.forms.team_text import TeamText


class TeamForm(Form):
    """Posts what is typed; what it means and whether it is allowed is decided elsewhere."""

    class Edited(Message):
        """The operator changed a field."""

        def __init__(self, texts: TeamText, field: str) -> None:
            super().__init__()
            self.texts = texts
            self.field = field

    class Chosen(Message):
        """The operator chose another team."""

        def __init__(self, name: str) -> None:
            super().__init__()
            self.name = name

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        self._team = ChoiceField("team", glyphs=glyphs)
        self._new_name = FormField("team_name")
        self._vehicles = FormField("vehicles", placeholder="ids")
        self._count = FormField("count")
        self._zone = ChoiceField("zone", glyphs=glyphs)
        self._planner = ChoiceField("planner", glyphs=glyphs)
        self._params = ParamForm(glyphs=glyphs)
        super().__init__(
            FormRow("Team", self._team),
            FormRow("Name", self._new_name),
            FormRow("Vehicles", self._vehicles, "or count", self._count),
            FormRow("Zone", self._zone),
            FormRow("Planner", self._planner),
            self._params,
            glyphs=glyphs,
        )
        set_title(self, "team")

    @property
    def texts(self) -> TeamText:
        """The texts in the fields."""
        return TeamText(
            self._team.value,
            self._vehicles.value,
            self._count.value,
            self._zone.value,
            self._planner.value,
            self._params.values,
            self._new_name.value,
        )

    def show(
        self,
        texts: TeamText,
        *,
        teams: Sequence[str],
        zones: Sequence[str],
        planners: Sequence[str],
        params: Sequence[Param],
    ) -> None:
        """Fill all fields without posting a change."""
        self._team.show(texts.name, teams)
        self._new_name.show(texts.new_name or texts.name)
        self._vehicles.show(texts.vehicles)
        self._count.show(texts.count)
        self._zone.show(texts.zone, zones)
        self._planner.show(texts.planner, planners)
        self._params.show(params, texts.parameters)

    def show_teams(self, name: str, teams: Sequence[str]) -> None:
        """Show the teams and choose one, without touching the other fields: they may be a key further by now."""
        self._team.show(name, teams)

    def help_of(self, field: str) -> str:
        """Return what a planner's parameter means."""
        return self._params.help_of(field)

    @on(Input.Changed)
    @on(ChoiceField.Changed)
    def _changed(self, event: Input.Changed | ChoiceField.Changed) -> None:
        event.stop()
        field = getattr(event.control, "field", "")
        if field == "team":
            self.post_message(self.Chosen(self._team.value))
        else:
            self.post_message(self.Edited(self.texts, field))

    @on(ParamForm.Edited)
    def _param_changed(self, event: ParamForm.Edited) -> None:
        event.stop()
        self.post_message(self.Edited(self.texts, event.field))
