"""Below the forms: what is wrong with what was typed, or what the plan is worth. Wrapped, never markup."""

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

from tui_gcs.core.text import clean
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink

MAX_CELLS = 600


class Remark(NamedTuple):
    """A sentence and its colour."""

    text: str
    ink: Ink = Ink.TEXT


class VerdictLines(LinesView):
    """Sentences one below the other, each wrapped to the width."""

    DEFAULT_CSS = "VerdictLines { height: 1fr; min-height: 2; padding: 0 1; }"

    _remarks: tuple[Remark, ...] = ()

    def show(self, remarks: Sequence[Remark]) -> None:
        """Show these, the most important first: what does not fit is cut off with a sign."""
        self._remarks = tuple(remarks)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        lines: list[Line] = []
        for remark in self._remarks:
            text = clean(remark.text, MAX_CELLS)
            lines += [[(part, remark.ink)] for part in textwrap.wrap(text, max(width, 10))]
        if len(lines) > height > 0:
            rest = lines[height - 1][0]
            lines = [*lines[: height - 1], [(rest[0][: max(width - 2, 0)] + " …", rest[1])]]
        return lines


class EditLine(LinesView):
    """One line: how far the copy is from station and file, and what became of the last key."""

    DEFAULT_CSS = "EditLine { height: 1; }"

    _state: Remark = Remark("")
    _message: Remark = Remark("")

    def show(self, state: Remark, message: Remark) -> None:
        """Show these."""
        self._state, self._message = state, message
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        state = clean(self._state.text, width)
        runs = [(f" {state}", self._state.ink)]
        if self._message.text:
            runs.append((f"  {clean(self._message.text, max(width - len(state) - 4, 10))}", self._message.ink))
        return [runs]
