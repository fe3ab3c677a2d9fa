"""Titles in borders, from plain text."""

from rich.text import Text
from textual.content import Content
from textual.dom import DOMNode
from textual.widget import Widget

from tui_gcs.widgets.basics.glyphs import as_ascii


def framed(selector: str, more: str = "") -> str:
    """Return the style rules of a panel with a frame, of ASCII in class `-ascii`; `more` are other declarations."""
    frame = f"{selector} {{ border: solid #4a5560; border-title-color: #d8dee4; {more} }}"
    return f"{frame} {selector}.-ascii {{ border: ascii #4a5560; }} "


def set_title(widget: Widget, text: str) -> None:
    """Title a widget's border; brackets in `text` are letters, not markup.

    A widget of class `-ascii` gets ASCII only.
    """
    if widget.has_class("-ascii"):
        text = as_ascii(text)
    if not _shows(widget.border_title, text):
        # A plain string would be parsed as markup, and Textual's own escaping does not survive an unclosed bracket.
        widget.border_title = Text(text)


def _shows(title: str | None, text: str) -> bool:
    """Return whether a border has this text already; Textual paints the whole widget when a title is set, equal or not.

    Textual returns a title as markup.
    """
    return (title or "") == (Content(text).markup if text else "")


def show_beyond(panel: DOMNode | None, above: int, below: int, how: str = "") -> None:
    """Write the numbers of hidden lines into a panel's lower border, with the keys that scroll to them (`how`).

    `panel` may be the parent of a list. Before the list is mounted that is not a widget, and nothing is written.
    """
    if not isinstance(panel, Widget):
        return
    words = [f"{count} more {where}" for count, where in ((above, "above"), (below, "below")) if count > 0]
    text = ", ".join(words) + (f": {how}" if words and how else "")
    if panel.has_class("-ascii"):
        text = as_ascii(text)
    if not _shows(panel.border_subtitle, text):
        panel.border_subtitle = Text(text)
