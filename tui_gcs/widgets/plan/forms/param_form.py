"""The rows for a planner's parameters, made from the planner's declaration."""

from collections.abc import Mapping, Sequence

from textual import on
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.message import Message
from textual.widgets import Input

from tui_gcs.planner.api import Param
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form import FormField, FormRow
from tui_gcs.widgets.plan.forms.team_text import NO, YES, value_text

LABEL_CELLS = 21


class ParamForm(Vertical):
    """One row for each parameter; an empty field stands for the declared default, which it shows."""

    DEFAULT_CSS = "ParamForm { height: auto; }"

    class Edited(Message):
        """The operator changed a parameter; `values` are the texts of all parameters by name."""

        def __init__(self, values: dict[str, str], field: str) -> None:
            super().__init__()
            self.values = values
            self.field = field

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        super().__init__()
        self._glyphs = glyphs
        self._params: tuple[Param, ...] = ()
        self._fields: dict[str, FormField | ChoiceField] = {}

    @property
    def values(self) -> dict[str, str]:
        """The texts in the fields, by parameter."""
        return {name: field.value for name, field in self._fields.items()}

    def show(self, params: Sequence[Param], values: Mapping[str, str]) -> None:
        """Show these parameters; those not among `values` have their default."""
        # Composing the rows anew takes the cursor away: only when another planner declares other parameters.
        if tuple(params) != self._params:
            self._params = tuple(params)
            self._fields = {param.name: self._field(param) for param in params}
            self.refresh(recompose=True)
        for param in params:
            field, declared = self._fields[param.name], value_text(param.default)
            if isinstance(field, ChoiceField):
                field.show(values.get(param.name, declared))
            else:
                field.show(values.get(param.name, ""))

    def compose(self) -> ComposeResult:
        """Compose one row for each parameter."""
        for param in self._params:
            yield FormRow(_label(param), self._fields[param.name], param.unit, label_cells=LABEL_CELLS)

    def help_of(self, name: str) -> str:
        """Return the planner's own help text for a parameter."""
        return next((param.help for param in self._params if param.name == name), "")

    @on(Input.Changed)
    @on(ChoiceField.Changed)
    def _changed(self, event: Input.Changed | ChoiceField.Changed) -> None:
        event.stop()
        self.post_message(self.Edited(self.values, getattr(event.control, "field", "")))

    def _field(self, param: Param) -> FormField | ChoiceField:
        if param.type is bool:
            return ChoiceField(param.name, (NO, YES), glyphs=self._glyphs)
        if param.choices:
            return ChoiceField(param.name, param.choices, glyphs=self._glyphs)
        return FormField(param.name, placeholder=f"({value_text(param.default)})")


def _label(param: Param) -> str:
    return f" {param.name}"[: LABEL_CELLS - 1]
