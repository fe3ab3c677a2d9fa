"""Remarks below the forms: what is wrong with a typed value, or what the plan is worth. Wrapped, never markup."""

from collections.abc import Sequence
from typing import NamedTuple

from textual import events

from tui_gcs.core.base.text import clean
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.shown_keys import cut_mark
from tui_gcs.widgets.basics.strips import cut_before, wrapped

MAX_CELLS = 600
MARGIN_CELLS = 3


class Remark(NamedTuple):
    """A sentence with its ink."""

    text: str
    ink: Ink = Ink.TEXT


class VerdictLines(LinesView):
    """Remarks below each other, each wrapped to the width."""

    DEFAULT_CSS = "VerdictLines { height: 1fr; min-height: 2; padding: 0 1; }"

    _remarks: tuple[Remark, ...] = ()

    def show(self, remarks: Sequence[Remark]) -> None:
        """Show these remarks, the most important first; where they are cut, the key that shows all is named."""
        self._remarks = tuple(remarks)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """Return the remarks, cut where there is no room for more."""
        lines: list[Line] = []
        for remark in self._remarks:
            text = clean(remark.text, MAX_CELLS)
            lines += [[(part, remark.ink)] for part in wrapped(text, width)]
        if len(lines) > height > 0:
            (last, ink), more = lines[height - 1][0], cut_mark(self, "read_whole", "^R", self.app.current_mode)
            lines = [*lines[: height - 1], [(cut_before(last, width, more), ink), (more, Ink.MUTED)]]
        return lines

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """All remarks, as they were given to `show`."""
        return self._remarks


class EditLine(LinesView):
    """How far the copy is from station and file, and what became of the last key, in one line.

    Where both do not fit, the message has the line alone, with `*` for unsaved work, and a second line if it is longer:
    why a file was refused cannot be guessed from the beginning of the reason.
    """

    DEFAULT_CSS = "EditLine { height: 1; }"

    _state: Remark = Remark("")
    _message: Remark = Remark("")

    def show(self, state: Remark, message: Remark) -> None:
        """Show the state of the work and the message."""
        self._state, self._message = state, message
        self._fit()
        self.update_lines()

    def on_resize(self, event: events.Resize) -> None:
        """Fit the number of lines to the new width. The base class repaints."""
        self._fit()

    def lines(self, width: int, height: int) -> list[Line]:
        """Return state and message in one line, or the message alone."""
        state, message = clean(self._state.text, width), clean(self._message.text, MAX_CELLS)
        if not message:
            return [[(f" {state}", self._state.ink)]]
        if self._fits_beside(width):
            return [[(f" {state}", self._state.ink), (f"  {message}", self._message.ink)]]
        parts = wrapped(message, width - MARGIN_CELLS, max(height, 1), placeholder=" …")
        signs = ["*" if self._state.ink is Ink.CAUTION else " ", *" " * len(parts)]
        return [
            [(f" {sign}", self._state.ink), (part, self._message.ink)] for sign, part in zip(signs, parts, strict=False)
        ]

    def _fits_beside(self, width: int) -> bool:
        return len(clean(self._state.text, MAX_CELLS)) + len(clean(self._message.text, MAX_CELLS)) + 4 <= width

    def _fit(self) -> None:
        width = self.size.width
        is_long = len(clean(self._message.text, MAX_CELLS)) + MARGIN_CELLS > width > 0
        self.styles.height = 2 if is_long else 1
