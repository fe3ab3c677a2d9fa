"""A dialog that chooses one of several named numbers: arrows and Enter, or the number itself is typed."""

from collections.abc import Sequence

from textual import events

from tui_gcs.core.base.float32 import shown
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import cut

MAX_DIGITS = 9
KEYS_AND_GAP = 2


class ChoiceDialog(TextDialog[str]):
    """Lists the choices; the result is the chosen or typed number as text, "" if the operator left it as it is."""

    def __init__(
        self, title: str, choices: Sequence[tuple[int, str]], present: int | float | None, glyphs: GlyphSet
    ) -> None:
        """Ask `title`; `present` is the number that is set now, None if it is not known."""
        super().__init__(glyphs)
        self.title_text = title
        self._choices = choices
        self._present = present
        self._typed = ""
        self._chosen = next((at for at, (number, _) in enumerate(choices) if number == present), 0)

    def on_key(self, event: events.Key) -> None:
        """Move by arrows, take a typed number, Enter takes it, Esc leaves."""
        event.stop()
        character = event.character or ""
        if event.key == "escape":
            self.finish("")
        elif event.key == "enter":
            self.finish(self._typed or (str(self._choices[self._chosen][0]) if self._choices else ""))
        elif event.key in ("down", "j", "up", "k", "pagedown", "pageup", "home", "end"):
            self._move(event.key)
        elif event.key == "backspace":
            self._typed = self._typed[:-1]
        elif len(character) == 1 and (character in "0123456789" or (character == "-" and not self._typed)):
            self._typed = (self._typed + character)[:MAX_DIGITS]
        self.redraw()

    def _move(self, key: str) -> None:
        page = max(1, self._room() - 1)
        steps = {"down": 1, "j": 1, "up": -1, "k": -1, "pagedown": page, "pageup": -page}
        last = len(self._choices) - 1
        self._chosen = 0 if key == "home" else last if key == "end" else self._chosen + steps[key]
        self._chosen = max(0, min(self._chosen, last))
        self._typed = ""

    def _room(self) -> int:
        return max(1, self.room - KEYS_AND_GAP)

    def body(self) -> list[Line]:
        """Return the choices in view, what is typed, and the keys."""
        room = self._room()
        first = max(0, min(self._chosen - room // 2, len(self._choices) - room))
        rows: list[Line] = []
        for at in range(first, min(first + room, len(self._choices))):
            number, name = self._choices[at]
            now = "   (now)" if number == self._present else ""
            ink = Ink.SELECTED if at == self._chosen and not self._typed else Ink.TEXT
            rows.append([(cut(f" {number:>6}  {name}{now}", LINE_CELLS), ink)])
        return [*rows, [], [(" Esc = leave it ", Ink.SELECTED), (self._keys(), Ink.BOLD)]]

    def _keys(self) -> str:
        keys = "   Enter = take; arrows choose, or type a number"
        if self._typed:
            return f"{keys}: {self._typed}_"
        is_other = self._present is not None and all(number != self._present for number, _ in self._choices)
        return f"{keys}; now {shown(self._present)}" if self._present is not None and is_other else keys
