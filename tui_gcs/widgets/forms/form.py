"""Forms: rows of a label and one-line fields. All text in them is plain, never markup."""

from collections.abc import Sequence
from typing import ClassVar

from rich.cells import cell_len, set_cell_size
from textual import events
from textual.containers import Horizontal, VerticalScroll
from textual.scrollbar import ScrollBarRender
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Input

from tui_gcs.core.base.text import clean
from tui_gcs.terminal.variant import run_own_binding
from tui_gcs.widgets.basics.border_titles import framed, show_beyond
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import runs_to_strip
from tui_gcs.widgets.forms.field_order import FIELD_BINDINGS, OrderedFields, shown_fields, step_field

LABEL_CELLS = 9


class FormField(Input):
    """A one-line text field; Enter and down go to the next field, up to the one before."""

    DEFAULT_CSS = """
    FormField { width: 1fr; min-width: 4; height: 1; border: none; padding: 0; background: $surface; }
    FormField:focus { border: none; background: $surface-lighten-1; }
    """
    BINDINGS = FIELD_BINDINGS

    def __init__(self, field: str, *, placeholder: str = "") -> None:
        """`field` names what the field is about."""
        super().__init__(compact=True, placeholder=placeholder)
        self.field = field
        # A blinking cursor writes twice a second to the terminal, also over a slow link.
        self.cursor_blink = False

    def action_step_field(self, by: int) -> None:
        """Go to the next field (1), or to the one before (-1)."""
        step_field(self, by)

    async def _on_key(self, event: events.Key) -> None:
        await run_own_binding(self, event)

    def validate(self, value: str) -> None:
        """Do nothing: the form checks what is typed. Textual would style every field again to mark it as valid."""

    def show(self, text: str) -> None:
        """Show a text without posting a change."""
        if text != self.value:
            with self.prevent(Input.Changed):
                self.value = text


class FormRow(Horizontal):
    """A label and its fields, with words such as units between them and brackets around text fields.

    The row draws its words itself: a widget for each would cost as much as a field whenever the form changes.
    """

    DEFAULT_CSS = "FormRow { height: 1; }"

    def __init__(
        self,
        label: str,
        *parts: Widget | str,
        classes: str | None = None,
        height: int = 1,
        label_cells: int = LABEL_CELLS,
        ink: Ink = Ink.MUTED,
    ) -> None:
        """Strings among `parts` are words between the fields."""
        self._label_cells, self._ink = label_cells, ink
        self._fields = [part for part in parts if isinstance(part, Widget)]
        self._words = _words(parts)
        self._label = _cells(label, label_cells)
        super().__init__(*self._fields, classes=classes)
        self.styles.height = height
        self._make_room()

    def set_label(self, label: str, unit: str) -> None:
        """Show another label and another unit, in a row of one field."""
        words, text = _words([*self._fields, unit]), _cells(label, self._label_cells)
        if (text, words) != (self._label, self._words):
            self._label, self._words = text, words
            self._make_room()
            self.refresh()

    def render_line(self, y: int) -> Strip:
        """Draw the words where the fields leave room for them."""
        width, base = self.size.width, self.rich_style
        if y:
            return Strip.blank(width, base)
        text, tail = self._label, self._words[-1]
        # There is one text more than fields: the last one stands behind them.
        for field, words in zip(self._fields, self._words, strict=False):
            left = field.virtual_region.x - cell_len(words)
            text = set_cell_size(text, left) + words
        if self._fields:
            text = set_cell_size(text, width - cell_len(tail))
        return runs_to_strip([(text + tail, self._ink)], width, base)

    def _make_room(self) -> None:
        """Give the fields margins where the words stand."""
        room = [cell_len(words) for words in self._words]
        if self._fields:
            room[0] += cell_len(self._label)
        for index, field in enumerate(self._fields):
            field.styles.margin = (0, room[-1] if field is self._fields[-1] else 0, 0, room[index])


def _words(parts: Sequence[Widget | str]) -> list[str]:
    """Return the words before each field, and those after the last one. Text fields stand in brackets."""
    # Without colour, a text field is only visible by its brackets.
    words = [""]
    for part in parts:
        if isinstance(part, str):
            words[-1] += f" {clean(part)} "
        else:
            has_brackets = isinstance(part, FormField)
            words[-1] += "[" if has_brackets else ""
            words.append("]" if has_brackets else "")
    return words


def _cells(text: str, cells: int) -> str:
    return set_cell_size(clean(text), cells)


class _PlainBars(ScrollBarRender):
    """A scroll bar of colour alone: the ends of Textual's bars are drawn with parts of a cell, which ASCII lacks."""

    VERTICAL_BARS: ClassVar[list[str]] = [" "] * 8


class Form(VerticalScroll, OrderedFields, can_focus=False):
    """A bordered panel of rows, which scrolls where it is too small."""

    DEFAULT_CSS = framed("Form", "height: auto; scrollbar-size-vertical: 1;")

    def __init__(self, *rows: Widget, glyphs: GlyphSet = UNICODE, id: str | None = None) -> None:  # noqa: A002
        super().__init__(*rows, id=id)
        self.glyphs = glyphs
        self.set_class(not glyphs.unicode, "-ascii")
        self.watch(self, "virtual_size", self._show_beyond, init=False)
        if not glyphs.unicode:
            self.vertical_scrollbar.renderer = _PlainBars  # type: ignore[misc]  # of this bar, not of all

    def watch_scroll_y(self, old_value: float, new_value: float) -> None:
        """Update the number of rows beyond those in view."""
        super().watch_scroll_y(old_value, new_value)
        self._show_beyond()

    def on_resize(self) -> None:
        """Update the number of rows beyond those in view."""
        self._show_beyond()

    def _show_beyond(self) -> None:
        # The number of rows above and below stands in the border: a bar one cell wide is easily missed.
        above, height = round(self.scroll_y), self.scrollable_content_region.height
        show_beyond(self, above, max(self.virtual_size.height - height - above, 0) if height else 0, "Tab")

    def focus_first(self) -> None:
        """Put the cursor into the first field that is shown."""
        first = next(shown_fields(self), None)
        if first is not None:
            first.focus()
