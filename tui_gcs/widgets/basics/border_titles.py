"""Titles in borders, from plain text."""

from rich.text import Text
from textual.dom import DOMNode
from textual.widget import Widget

from tui_gcs.widgets.basics.glyphs import as_ascii


def set_title(widget: Widget, text: str) -> None:
    """Title a widget's border; brackets in `text` are letters, not markup.

    A widget of class `-ascii` gets ASCII only.
    """
    if widget.has_class("-ascii"):
        text = as_ascii(text)
    # A plain string would be parsed as markup, and Textual's own escaping does not survive an unclosed bracket.
    widget.border_title = Text(text)


def show_beyond(panel: DOMNode | None, above: int, below: int, how: str = "") -> None:
    """Show in the border below a panel how many lines are out of view, and `how` to see them.

    A list inside a panel gives its parent, which is no widget before it is mounted.
    """
    if not isinstance(panel, Widget):
        return
    words = [f"{count} more {where}" for count, where in ((above, "above"), (below, "below")) if count > 0]
    text = ", ".join(words) + (f": {how}" if words and how else "")
    if panel.has_class("-ascii"):
        text = as_ascii(text)
    if str(panel.border_subtitle or "") != text:
        panel.border_subtitle = Text(text)
