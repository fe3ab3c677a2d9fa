"""The form of the performance that vehicles are assumed to have, for forecasts of time and battery."""

from dataclasses import replace

from textual import on
from textual.message import Message
from textual.widgets import Input

from tui_gcs.core.missions.performance import Performance
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.forms.form import Form, FormRow
from tui_gcs.widgets.forms.form_text import FieldError, number_text, to_number
from tui_gcs.widgets.forms.number_field import NumberField

FIELDS = ("speed_m_s", "climb_m_s", "descent_m_s", "endurance_min", "reserve_pct")


class PerformanceForm(Form):
    """Speed, climb, battery and reserve of all vehicles; every change counts at once."""

    DEFAULT_CSS = "PerformanceForm { display: none; }"

    class Changed(Message):
        """The operator changed a field."""

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        self._fields = {name: NumberField(name) for name in FIELDS}
        fields = self._fields
        super().__init__(
            FormRow("Speed", fields["speed_m_s"], "m/s"),
            FormRow("Climb", fields["climb_m_s"], "m/s"),
            FormRow("Descent", fields["descent_m_s"], "m/s"),
            FormRow("Battery", fields["endurance_min"], "min when full"),
            FormRow("Reserve", fields["reserve_pct"], "% left at the end"),
            glyphs=glyphs,
        )
        set_title(self, "assumed of all vehicles: Esc leaves")

    def begin(self, performance: Performance) -> None:
        """Open the form with this performance."""
        for name in FIELDS:
            value = performance.endurance_s / 60 if name == "endurance_min" else getattr(performance, name)
            self._fields[name].show(number_text(value))
        self.display = True
        self.focus_first()

    def performance(self, old: Performance) -> Performance:
        """Return the performance in the fields. Raises FieldError."""
        values = {name: to_number(field.value, name.partition("_")[0]) for name, field in self._fields.items()}
        values["endurance_s"] = values.pop("endurance_min") * 60
        new = replace(old, **values)
        if why := new.problem():
            raise FieldError(why)
        return new

    @on(Input.Changed)
    def _changed(self, event: Input.Changed) -> None:
        event.stop()
        if self.display:
            self.post_message(self.Changed())
