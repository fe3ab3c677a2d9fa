"""The rounds in one line, with the edited one and the flown one marked."""

from collections.abc import Sequence

from textual import events
from textual.message import Message

from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run

MAX_NAME = 12


class RoundChooser(LinesView):
    """`▸1 round 1   2 round 2 (flown)`. Digits choose, so it needs no focus."""

    DEFAULT_CSS = "RoundChooser { height: 1; }"

    class Chosen(Message):
        """The operator clicked a round."""

        def __init__(self, index: int) -> None:
            super().__init__()
            self.index = index

    _rounds: tuple[str, ...] = ()
    _edited = 0
    _flown: int | None = None

    def show(self, rounds: Sequence[str], edited: int, flown: int | None) -> None:
        """Show these rounds; `flown` is the index of the station's present round, or None."""
        self._rounds, self._edited, self._flown = tuple(rounds), edited, flown
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """Return the rounds with names if they fit, else with numbers around the edited one."""
        named = [run for index in range(len(self._rounds)) for run in self._round(index, named=True)]
        if sum(len(text) for text, _ in named) <= width:
            return [named]
        short = [self._round(index, named=index == self._edited) for index in range(len(self._rounds))]
        first = 0
        while first < self._edited and _cells(short[first : self._edited + 1]) > width:
            first += 1
        return [[run for each in short[first:] for run in each]]

    def _round(self, index: int, *, named: bool) -> list[Run]:
        edited, flown = index == self._edited, index == self._flown
        mark = self.glyphs.selected if edited else " "
        name = self._rounds[index]
        words = (
            f"{index + 1} {name if len(name) <= MAX_NAME else name[: MAX_NAME - 1] + '.'}" if named else f"{index + 1}"
        )
        runs: list[Run] = [(mark + words, Ink.SELECTED if edited else Ink.TEXT)]
        if flown:
            runs.append((f" {self.glyphs.running}now" if named else self.glyphs.running, Ink.NORMAL))
        return [*runs, (" ", Ink.TEXT)]

    def on_click(self, event: events.Click) -> None:
        """Choose the round under the pointer."""
        x = 0
        for text, _ in self._lines[0] if self._lines else []:
            word = text[1:].split(" ")[0]
            if x <= event.x < x + len(text) and word.isdecimal():
                self.post_message(self.Chosen(int(word) - 1))
            x += len(text)


def _cells(rounds: list[list[Run]]) -> int:
    return sum(len(text) for each in rounds for text, _ in each)
