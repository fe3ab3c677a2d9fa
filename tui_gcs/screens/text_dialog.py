"""Base of the dialogs: plain text lines in a box; keys are handled by the subclass, and Esc always leaves."""

from collections.abc import Sequence
from typing import TypeVar

from textual.app import ComposeResult
from textual.screen import ModalScreen

from tui_gcs.widgets.glyphs import GlyphSet
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.titles import set_title

T = TypeVar("T")
DIALOG_WIDTH = 76
MOST_CELLS = 72
"""What a line may be long at 80 columns."""


class DialogBox(LinesView):
    """The box with the text."""

    DEFAULT_CSS = """
    DialogBox { border: heavy #d8dee4; border-title-color: #d8dee4; border-title-style: bold; padding: 0 1; }
    DialogBox.-ascii { border: ascii #d8dee4; }
    """

    _text: Sequence[Line] = ()

    def show(self, title: str, text: Sequence[Line]) -> None:
        """Show these lines, in a box as high as they need."""
        self._text = text
        set_title(self, title)
        screen = self.screen.size
        self.styles.width = min(DIALOG_WIDTH, screen.width - 2)
        self.styles.height = min(len(text) + 2, screen.height - 2)
        self.update_lines()

    def lines(self, width: int, height: int) -> Sequence[Line]:
        """See `LinesView.lines`."""
        return self._text


class TextDialog(ModalScreen[T]):
    """Lines in a box, keys handled by the subclass."""

    DEFAULT_CSS = "TextDialog { align: center middle; }"

    title_text = ""

    def __init__(self, glyphs: GlyphSet) -> None:
        """With these characters."""
        super().__init__()
        self.glyphs = glyphs
        self.box = DialogBox(glyphs=glyphs)
        self._finished = False

    def finish(self, result: T) -> None:
        """Leave with this, once: a timer may come as late as a key."""
        if not self._finished:
            self._finished = True
            self.dismiss(result)

    def compose(self) -> ComposeResult:
        """One box."""
        yield self.box

    def on_mount(self) -> None:
        """First text."""
        self.redraw()

    def on_resize(self) -> None:
        """The box follows the terminal."""
        self.redraw()

    def body(self) -> list[Line]:
        """The text now."""
        raise NotImplementedError

    def redraw(self) -> None:
        """Show `body` again."""
        self.box.show(self.title_text, self.body())

    def text(self) -> str:
        """The text without colours."""
        return "\n".join("".join(text for text, _ in line) for line in self.body())
