"""The form of the generator: a survey, a corridor or a fence, over a zone or along way-points, for several vehicles."""

from collections.abc import Sequence

from textual import on
from textual.message import Message
from textual.widgets import Input

from tui_gcs.core.missions.generate import WHAT, GenerationRequest
from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form import Form, FormRow
from tui_gcs.widgets.forms.form_text import FieldError, ids_text, number_text, to_ids, to_number
from tui_gcs.widgets.forms.number_field import NumberField

SIDES = ("inside", "outside")
CORNERS = ("1", "2", "3", "4")
NUMBERS = {"spacing_m": "lanes", "angle_deg": "angle", "turn_m": "turn", "width_m": "width", "photos_m": "photos"}
"""Number fields by name, and the words that the form and its problems use for them."""


class GenerateForm(Form):
    """What is to be generated; every change is shown on the map at once, and taken or dropped as a whole."""

    DEFAULT_CSS = """
    GenerateForm { display: none; }
    GenerateForm.-survey .corridor, GenerateForm.-survey .fence { display: none; }
    GenerateForm.-corridor .survey, GenerateForm.-corridor .fence { display: none; }
    GenerateForm.-fence .survey, GenerateForm.-fence .corridor, GenerateForm.-fence .way { display: none; }
    """

    class Changed(Message):
        """The operator changed a field."""

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        first = GenerationRequest()
        self._what = ChoiceField("what", WHAT, glyphs=glyphs)
        self._over = ChoiceField("over", glyphs=glyphs)
        self._side = ChoiceField("side", SIDES, glyphs=glyphs)
        self._entry = ChoiceField("entry", CORNERS, glyphs=glyphs)
        self._vehicles = NumberField("vehicles")
        self._height = NumberField("height_m", placeholder="own layers")
        self._numbers = {name: NumberField(name) for name in NUMBERS}
        fields = self._numbers
        super().__init__(
            FormRow("Make", self._what),
            FormRow("Over", self._over),
            FormRow("Vehicles", self._vehicles),
            FormRow("Height", self._height, "m", classes="way"),
            FormRow("Lanes", fields["spacing_m"], "m apart", classes="way"),
            FormRow("Angle", fields["angle_deg"], "deg  turn", fields["turn_m"], "m", classes="survey"),
            FormRow("Photos", fields["photos_m"], "m apart", classes="survey"),
            FormRow("Width", fields["width_m"], "m", classes="corridor"),
            FormRow("Begin", self._entry, classes="way"),
            FormRow("Stay", self._side, classes="fence"),
            glyphs=glyphs,
        )
        set_title(self, "generate: ^G takes it, Esc drops it")
        for name, field in fields.items():
            field.value = number_text(getattr(first, name))

    def begin(self, vehicles: Sequence[int], shapes: Sequence[str]) -> None:
        """Open the form for these vehicles, over one of these shapes."""
        self._vehicles.show(ids_text(vehicles))
        self._over.show(self._over.value if self._over.value in shapes else shapes[0] if shapes else "", shapes)
        self.display = True
        self._show_rows()
        self.focus_first()

    def request(self) -> GenerationRequest:
        """Return the request in the fields. Raises FieldError or GeneratorError."""
        numbers = {name: to_number(field.value, NUMBERS[name]) for name, field in self._numbers.items()}
        height = self._height.value.strip()
        if not self._over.value:
            raise GeneratorError("there is neither a zone nor a way to generate over")
        ids = to_ids(self._vehicles.value, "vehicles")
        # A vehicle that is named twice would get two parts of the survey.
        if len(set(ids)) != len(ids):
            raise FieldError("vehicles: one of them twice")
        return GenerationRequest(
            what=self._what.value,
            over=self._over.value,
            vehicles=ids,
            height_m=to_number(height, "height") if height else None,
            entry=int(self._entry.value),
            inside=self._side.value == SIDES[0],
            **numbers,
        )

    @on(Input.Changed)
    @on(ChoiceField.Changed)
    def _changed(self, event: Input.Changed | ChoiceField.Changed) -> None:
        event.stop()
        self._show_rows()
        if self.display:
            self.post_message(self.Changed())

    def _show_rows(self) -> None:
        show_classes(self, {f"-{what}": self._what.value == what for what in WHAT}, self.children)
