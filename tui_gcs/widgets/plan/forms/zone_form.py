"""The form for a zone, or for a round's operating area: name, role, shape, place, size, altitude band."""

from textual import on
from textual.binding import Binding
from textual.message import Message
from textual.widgets import Input, TextArea

from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form import Form, FormField, FormRow
from tui_gcs.widgets.plan.forms.zone_text import ROLES, ZoneText, zone_text
from tui_gcs.widgets.plan.shape_edit import KINDS

INPUTS = (
    *("name", "east_m", "north_m", "radius_m", "width_m", "height_m", "heading_deg"),
    *("alt_min_m", "alt_max_m"),
)


class CornersField(TextArea):
    """The corners of a polygon: `E,N` pairs with blanks between them, over several lines."""

    DEFAULT_CSS = """
    CornersField { width: 1fr; height: 3; border: none; padding: 0; background: $surface; scrollbar-size-vertical: 1; }
    CornersField:focus { border: none; background: $surface-lighten-1; }
    """

    BINDINGS = [
        Binding("ctrl+z", "screen.undo", "undo", show=False),
        Binding("ctrl+u", "empty", "empty it", show=False),
    ]

    def __init__(self) -> None:
        super().__init__(compact=True, soft_wrap=True, tab_behavior="focus", highlight_cursor_line=False)
        self.field = "vertices_m"
        self.cursor_blink = False

    def action_empty(self) -> None:
        """Empty all lines, as the key does in other fields."""
        self.clear()

    def show(self, text: str) -> None:
        """Show a text without posting a change."""
        if text != self.text:
            with self.prevent(TextArea.Changed):
                self.load_text(text)
            self.move_cursor(self.document.end)


class ZoneForm(Form):
    """Posts what is typed; `zone_text` decides what it means and whether it is allowed."""

    DEFAULT_CSS = """
    ZoneForm.-area .for-zone { display: none; }
    ZoneForm.-circle .rectangle, ZoneForm.-circle .polygon { display: none; }
    ZoneForm.-rectangle .circle, ZoneForm.-rectangle .polygon { display: none; }
    ZoneForm.-polygon .circle, ZoneForm.-polygon .rectangle, ZoneForm.-polygon .centre { display: none; }
    """

    class Edited(Message):
        """The operator changed a field."""

        def __init__(self, texts: ZoneText, field: str) -> None:
            super().__init__()
            self.texts = texts
            self.field = field

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        self._inputs = {name: FormField(name) for name in INPUTS}
        self._role = ChoiceField("role", ROLES, glyphs=glyphs)
        self._shape = ChoiceField("shape", KINDS, glyphs=glyphs)
        self._corners = CornersField()
        fields = self._inputs
        super().__init__(
            FormRow("Name", fields["name"], classes="for-zone"),
            FormRow("Role", self._role, classes="for-zone"),
            FormRow("Shape", self._shape),
            FormRow("Centre", "E", fields["east_m"], "N", fields["north_m"], "m", classes="centre"),
            FormRow("Radius", fields["radius_m"], "m", classes="circle"),
            FormRow("Width", fields["width_m"], "Height", fields["height_m"], "m", classes="rectangle"),
            FormRow("Heading", fields["heading_deg"], "deg", classes="rectangle"),
            FormRow("Corners", self._corners, classes="polygon", height=3),
            FormRow("Altitude", fields["alt_min_m"], glyphs.dash, fields["alt_max_m"], "m"),
            glyphs=glyphs,
        )
        set_title(self, "zone")

    @property
    def texts(self) -> ZoneText:
        """The texts in the fields."""
        inputs = {name: field.value for name, field in self._inputs.items()}
        return ZoneText(role=self._role.value, shape=self._shape.value, vertices_m=self._corners.text, **inputs)

    def show(self, zone: Zone | OperatingArea, area: OperatingArea) -> None:
        """Fill all fields; an empty altitude field shows the operating area's limit, which then holds."""
        texts = zone_text(zone)
        for name, field in self._inputs.items():
            field.show(getattr(texts, name))
        self._role.show(texts.role)
        self._shape.show(texts.shape)
        self._corners.show(texts.vertices_m)
        own_band = zone_text(area)
        for name in ("alt_min_m", "alt_max_m"):
            self._inputs[name].placeholder = f"({getattr(own_band, name)})"
        set_title(self, "operating area" if isinstance(zone, OperatingArea) else f"zone {zone.name}")
        self._show_rows(is_area=isinstance(zone, OperatingArea))

    def show_shape(self, texts: ZoneText) -> None:
        """Fill the fields of the shape alone: it was converted into another kind."""
        for name in ("east_m", "north_m", "radius_m", "width_m", "height_m", "heading_deg"):
            self._inputs[name].show(getattr(texts, name))
        self._shape.show(texts.shape)
        self._corners.show(texts.vertices_m)
        self._show_rows()

    @on(Input.Changed)
    @on(TextArea.Changed)
    @on(ChoiceField.Changed)
    def _changed(self, event: Input.Changed | TextArea.Changed | ChoiceField.Changed) -> None:
        event.stop()
        self._show_rows()
        field = getattr(event.control, "field", "")
        self.post_message(self.Edited(self.texts, field))

    def _show_rows(self, *, is_area: bool | None = None) -> None:
        """Show the rows of the shape; `is_area` None leaves the rows that depend on it."""
        classes = {f"-{kind}": self._shape.value == kind for kind in KINDS}
        if is_area is not None:
            classes["-area"] = is_area
        show_classes(self, classes, self.children)
