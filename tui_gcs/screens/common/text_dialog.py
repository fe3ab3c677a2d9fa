"""The base of the dialogs: lines of text in a box. The subclass handles keys; Esc always leaves.

A box never covers the first two lines and the last one: alarms, what waits for a key, and the selection stay in view.
Over a replay it leaves the third line free, too: what flies meanwhile.
"""

from collections.abc import Sequence
from typing import TypeVar

from textual import events
from textual.app import App, ComposeResult
from textual.screen import ModalScreen

from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink

T = TypeVar("T")
DIALOG_WIDTH = 76
REACTION_S = 0.7
"""A key pressed within this time after a change was meant for what was shown before."""
LINE_CELLS = 72
"""The longest line of text that fits into a dialog at 80 columns."""
TOP_LINES, BOTTOM_LINES, BORDER_LINES = 2, 1, 2
KEY_LINES = 3
"""Lines at the end of a text that are never left out: they name the keys."""


BESIDE = "-beside"
"""Class of the app while it shows a replay: a third line is of the stations that fly."""


def top_lines(app: App[object]) -> int:
    """Return how many lines of the top no box covers."""
    return TOP_LINES + app.has_class(BESIDE)


class DialogBox(LinesView):
    """The box that shows the text."""

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
        self.styles.height = min(len(text) + BORDER_LINES, screen.height - top_lines(self.app) - BOTTOM_LINES)
        self.update_lines()

    def lines(self, width: int, height: int) -> Sequence[Line]:
        """Return the text that was given to `show`."""
        return self._text


def fitted(text: list[Line], room: int) -> list[Line]:
    """Return `text` in at most `room` lines.

    Empty lines are dropped first, the last ones before others. If that is not enough, lines in the middle are replaced
    by one that counts them.
    """
    empty = [at for at, line in enumerate(text) if not any(words.strip() for words, _ in line)]
    too_many = max(len(text) - room, 0)
    # Empty lines are only for the eye: they go first.
    left_out = frozenset(empty[-too_many:] if too_many else ())
    text = [line for at, line in enumerate(text) if at not in left_out]
    if len(text) <= room:
        return text
    missing = len(text) - room + 1
    first = room - KEY_LINES - 1
    return [
        *text[:first],
        [(f"  {missing} more lines: a taller terminal shows them", Ink.CAUTION)],
        *text[-KEY_LINES:],
    ]


class TextDialog(ModalScreen[T]):
    """A modal dialog of text lines, which ends with a result once."""

    DEFAULT_CSS = "TextDialog { align: center middle; }"

    title_text = ""
    closed_by_itself = ""
    """Why no key closed it; "" if one did. The app then drops keys that were still meant for the dialog."""

    def __init__(self, glyphs: GlyphSet) -> None:
        super().__init__()
        self.glyphs = glyphs
        self.box = DialogBox(glyphs=glyphs)
        self._finished = False
        self._left_with: list[T] = []

    def finish(self, result: T) -> None:
        """Close with this result. Later calls do nothing: a timer may come as late as a key, and a key after another.

        Below another screen (the tiny one) the dialog closes when it is on top again: Textual can only close the top
        one.
        """
        if self._finished:
            return
        self._finished = True
        # Textual dismisses the top screen only: below another one the result waits for `on_screen_resume`.
        if self.is_active:
            self.dismiss(result)
        else:
            self._left_with = [result]

    def lapse(self, result: T, why: str) -> None:
        """Close without a key. The operator is shown `why`: an answer may be half typed."""
        if not self._finished:
            self.closed_by_itself = why
        self.finish(result)

    def on_screen_resume(self) -> None:
        """Close, if that was decided while the dialog was covered."""
        left_with, self._left_with = self._left_with, []
        for result in left_with:
            self.dismiss(result)

    def compose(self) -> ComposeResult:
        """Compose the box, which is all there is."""
        self.box.styles.margin = (top_lines(self.app), 0, BOTTOM_LINES, 0)
        yield self.box

    def on_mount(self) -> None:
        """Show the text for the first time."""
        self.redraw()

    def on_resize(self) -> None:
        """Fit the box to the terminal."""
        self.redraw()

    def body(self) -> list[Line]:
        """Return the text as it is now."""
        raise NotImplementedError

    @property
    def room(self) -> int:
        """The number of lines that the box has for text."""
        return max(KEY_LINES + 1, self.size.height - top_lines(self.app) - BOTTOM_LINES - BORDER_LINES)

    def redraw(self) -> None:
        """Show `body` again; what is too long for the terminal loses lines before the keys, never the keys."""
        self.box.show(self.title_text, fitted(self.body(), self.room))

    def text(self) -> str:
        """Return the text without colours."""
        return "\n".join("".join(text for text, _ in line) for line in self.body())


class ScrolledDialog(TextDialog[None]):
    """A dialog of more lines than the box has room for: arrows scroll, Esc closes."""

    LEAVE_KEYS: tuple[str, ...] = ("escape", "q", "enter")

    def __init__(self, glyphs: GlyphSet) -> None:
        super().__init__(glyphs)
        self._first = 0

    def on_key(self, event: events.Key) -> None:
        """Scroll by arrows and pages, close by Esc."""
        event.stop()
        if event.key in self.LEAVE_KEYS:
            self.finish(None)
        elif event.key in ("down", "j", "pagedown", "space"):
            self._scroll(+1 if event.key in ("down", "j") else +10)
        elif event.key in ("up", "k", "pageup"):
            self._scroll(-1 if event.key in ("up", "k") else -10)

    def _scroll(self, by: int) -> None:
        self._first = max(0, min(self._first + by, len(self.all_lines()) - self._lines_shown()))
        self.redraw()

    def _lines_shown(self) -> int:
        return self.room - 1

    def all_lines(self) -> list[Line]:
        """Return the whole text, of which a part is in view."""
        raise NotImplementedError

    def body(self) -> list[Line]:
        """Return the lines in view, and the keys."""
        room, lines = self._lines_shown(), self.all_lines()
        shown = lines[self._first : self._first + room]
        more = f"   arrows: more, {self._first + len(shown)} of {len(lines)} lines" if len(lines) > room else ""
        return [*shown, [(" Esc = close ", Ink.SELECTED), (more, Ink.MUTED)]]
