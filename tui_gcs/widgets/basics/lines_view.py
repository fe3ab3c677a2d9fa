"""A panel of text lines that writes only the lines that changed."""

from collections.abc import Sequence

from rich.style import Style
from textual import events
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet, as_ascii
from tui_gcs.widgets.basics.strips import Run, runs_to_strip

Line = Sequence[Run]


class LinesView(Widget):
    """Base of the text panels: a subclass returns its text from `lines` and calls `update_lines` after a change.

    Text goes to the screen as it is, cut to the width, never as markup.
    """

    DEFAULT_CSS = """
    LinesView { height: auto; }
    LinesView.-ascii { border-title-color: #d8dee4; }
    """

    def __init__(self, *, glyphs: GlyphSet = UNICODE, classes: str | None = None) -> None:
        """Begin as an empty panel."""
        # Before `super`: Textual asks for styles while it sets up a widget.
        self._strips: dict[int, Strip] = {}
        self._base: Style | None = None
        self._lines: list[list[Run]] = []
        super().__init__(classes=classes)
        self.glyphs = glyphs
        self.set_class(not glyphs.unicode, "-ascii")

    def lines(self, width: int, height: int) -> Sequence[Line]:
        """Return the text of the panel from the top; at most `height` lines are shown."""
        raise NotImplementedError

    def update_lines(self) -> None:
        """Call `lines` again, and have the changed ones written."""
        if not self.is_attached or self.size.width == 0:
            return
        new = [list(line) for line in self.lines(self.size.width, self.size.height)]
        if not self.glyphs.unicode:
            new = [[(as_ascii(text), ink) for text, ink in line] for line in new]
        old, self._lines = self._lines, new
        # Textual writes a refreshed region again, equal or not (docs/terminal.md B1): only changed lines are refreshed.
        changed = [y for y in range(max(len(old), len(new))) if _at(old, y) != _at(new, y)]
        for y in changed:
            self._strips.pop(y, None)
        if changed:
            self.refresh(*(Region(0, y, self.size.width, 1) for y in changed if y < self.size.height))

    def text(self) -> str:
        """The panel as plain text."""
        return "\n".join("".join(text for text, _ in line) for line in self._lines)

    def on_resize(self, event: events.Resize) -> None:
        """Fit the text to the new size."""
        self._strips.clear()
        self.update_lines()

    def notify_style_update(self) -> None:
        """See `Widget`; all strips have old colours."""
        super().notify_style_update()
        self._strips.clear()
        self._base = None

    def render_line(self, y: int) -> Strip:
        """See `Widget`."""
        strip = self._strips.get(y)
        if strip is None or strip.cell_length != self.size.width:
            base = self._base = self._base or self.rich_style  # looking it up costs more than the line
            line = self._lines[y] if y < len(self._lines) else []
            strip = self._strips[y] = runs_to_strip(line, self.size.width, base)
        return strip


def _at(lines: list[list[Run]], y: int) -> list[Run] | None:
    return lines[y] if y < len(lines) else None
