"""Rows of a form: a label and one-line fields. Everything in them is plain text, never markup."""

from collections.abc import Iterator
from typing import ClassVar

from rich.text import Text
from textual import events
from textual.binding import Binding
from textual.containers import Horizontal, VerticalScroll
from textual.scrollbar import ScrollBarRender
from textual.widget import Widget
from textual.widgets import Input, Static

from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.key_order import own_binding


class FormField(Input):
    """A one-line text field; Enter and down go to the next field, up to the one before."""

    DEFAULT_CSS = """
    FormField { width: 1fr; min-width: 4; height: 1; border: none; padding: 0; background: $surface; }
    FormField:focus { border: none; background: $surface-lighten-1; }
    """
    BINDINGS = [
        Binding("up,shift+tab", "app.focus_previous", "previous field", show=False, priority=True),
        Binding("down,enter,tab", "app.focus_next", "next field", show=False, priority=True),
    ]

    def __init__(self, field: str, *, placeholder: str = "") -> None:
        """`field` is what the field is about (`FormField.field`)."""
        super().__init__(compact=True, placeholder=placeholder)
        self.field = field
        self.cursor_blink = False

    async def _on_key(self, event: events.Key) -> None:
        """Textual inserts characters after this."""
        await own_binding(self, event)

    def show(self, text: str) -> None:
        """Show this without telling anybody."""
        if text != self.value:
            with self.prevent(Input.Changed):
                self.value = text


class FormRow(Horizontal):
    """A label and what belongs to it."""

    DEFAULT_CSS = """
    FormRow { height: 1; }
    FormRow > .form-label { width: 9; color: #909090; }
    FormRow > .form-word { width: auto; padding: 0 1; color: #909090; }
    FormRow > .form-bracket { width: 1; color: #909090; }
    """

    def __init__(self, label: str, *widgets: Widget | str, classes: str | None = None, height: int = 1) -> None:
        """Strings among `widgets` are words between the fields, such as units."""
        cells = [cell for each in widgets for cell in _cells(each)]
        super().__init__(Static(Text(label), classes="form-label"), *cells, classes=classes)
        self.styles.height = height


class _PlainBars(ScrollBarRender):
    """Of colour alone: the ends of Textual's bars are drawn with parts of a cell."""

    VERTICAL_BARS: ClassVar[list[str]] = [" "] * 8


class Form(VerticalScroll, can_focus=False):
    """A bordered panel of rows; scrolls where it is too small."""

    DEFAULT_CSS = """
    Form { border: solid #4a5560; border-title-color: #d8dee4; height: auto; scrollbar-size-vertical: 1; }
    Form.-ascii { border: ascii #4a5560; }
    """

    def __init__(self, *rows: Widget, glyphs: GlyphSet = UNICODE, id: str | None = None) -> None:  # noqa: A002
        """A form of these rows."""
        super().__init__(*rows, id=id)
        self.glyphs = glyphs
        self.set_class(not glyphs.unicode, "-ascii")
        if not glyphs.unicode:
            self.vertical_scrollbar.renderer = _PlainBars  # type: ignore[misc]  # of this bar, not of all

    def focus_first(self) -> None:
        """Put the cursor into the first field that is shown."""
        first = next(_fields(self), None)
        if first is not None:
            first.focus()


def _fields(parent: Widget) -> Iterator[Widget]:
    return (w for w in parent.walk_children(Widget) if w.focusable and w.display)


def _cells(part: Widget | str) -> list[Widget]:
    """Text fields stand in brackets: without colour they would not be seen."""
    if isinstance(part, str):
        return [Static(Text(part), classes="form-word")]
    if isinstance(part, FormField):
        return [Static(Text("["), classes="form-bracket"), part, Static(Text("]"), classes="form-bracket")]
    return [part]
