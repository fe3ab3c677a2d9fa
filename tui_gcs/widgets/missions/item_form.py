"""The form for one item of a plan: command, place, height and the parameters by their names."""

from textual import on
from textual.message import Message
from textual.widgets import Input

from tui_gcs.core.missions.command_reference import MISSION_WORDS, ParamLabel
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form import Form, FormRow
from tui_gcs.widgets.forms.number_field import NumberField
from tui_gcs.widgets.missions.mission_text import FRAME_WORDS, ItemText, has_height, labels


class ItemParamRow(FormRow):
    """The row of one parameter of an item; its name changes with the command."""

    def __init__(self, index: int) -> None:
        self.field = NumberField(f"param{index + 1}")
        super().__init__("", self.field, "")

    def show(self, label: ParamLabel, text: str) -> None:
        """Show name and value of the parameter."""
        self.set_label(label.label[:8], label.unit)
        self.field.placeholder = label.empty
        self.field.show(text)


class ItemForm(Form):
    """Posts what is typed; what it means and whether it is allowed is decided elsewhere."""

    DEFAULT_CSS = """
    ItemForm.-empty { display: none; }
    ItemForm.-fixed .command, ItemForm.-nowhere .where, ItemForm.-level .height { display: none; }
    """

    class Edited(Message):
        """The operator changed a field."""

        def __init__(self, texts: ItemText, field: str) -> None:
            super().__init__()
            self.texts = texts
            self.field = field

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        self._command = ChoiceField("command", MISSION_WORDS, glyphs=glyphs)
        self._east, self._north, self._height = (NumberField(name) for name in ("east_m", "north_m", "height_m"))
        self._frame = ChoiceField("frame", FRAME_WORDS, glyphs=glyphs)
        self._params = [ItemParamRow(index) for index in range(4)]
        super().__init__(
            FormRow("Does", self._command, classes="command"),
            FormRow("Place", "E", self._east, "N", self._north, "m", classes="where"),
            FormRow("Height", self._height, "m above", self._frame, classes="height"),
            *self._params,
            glyphs=glyphs,
        )
        set_title(self, "item")

    @property
    def texts(self) -> ItemText:
        """The texts in the fields."""
        one, two, three, four = (row.field.value for row in self._params)
        return ItemText(
            self._command.value,
            self._east.value,
            self._north.value,
            self._height.value,
            self._frame.value,
            (one, two, three, four),
        )

    def show(self, item: PlanItem | None, texts: ItemText, kind: PlanKind, title: str) -> None:
        """Fill the fields with this item; without one the form is hidden."""
        show_classes(self, {"-empty": item is None}, [self])
        if item is None:
            return
        self._command.show(texts.command)
        self._east.show(texts.east_m)
        self._north.show(texts.north_m)
        self._height.show(texts.height_m)
        self._frame.show(texts.frame)
        for row, label, text in zip(self._params, labels(item), texts.params, strict=True):
            row.display = label is not None
            if label is not None:
                row.show(label, text)
        is_fixed = kind is not PlanKind.MISSION
        show_classes(
            self, {"-fixed": is_fixed, "-nowhere": not item.is_place, "-level": not has_height(item)}, self.children
        )
        set_title(self, title)

    @on(Input.Changed)
    @on(ChoiceField.Changed)
    def _changed(self, event: Input.Changed | ChoiceField.Changed) -> None:
        event.stop()
        self.post_message(self.Edited(self.texts, getattr(event.control, "field", "")))
