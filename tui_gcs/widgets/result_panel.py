"""What became of the newest orders, vehicle by vehicle: over the lower part of the screen, never in the way of keys.

Stays as long as something is under way or failed; goes by itself when all succeeded, or on Esc.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from tui_gcs.core.messages import VehicleRow
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.strips import Run, cut
from tui_gcs.widgets.titles import set_title
from tui_gcs.widgets.words import ids

MOST_ROWS = 10
LEAST_ID_CELLS, WORD_CELLS = 4, 10
BESIDE_REASON = 38
"""Cells for id, word and the first words of how the vehicle is now; the reason gets what it needs of the others."""


class Came(Enum):
    """What came of it for one vehicle: the word for it."""

    WAITING = "waiting"
    BEGUN = "begun"
    DONE = "done"
    REFUSED = "REFUSED"
    FAILED = "FAILED"
    NO_ANSWER = "NO ANSWER"
    NOT_SEEN = "NOT SEEN"
    LEFT_OUT = "left out"


GOOD = frozenset({Came.DONE, Came.BEGUN})
_INKS = {Came.WAITING: Ink.ADVISORY, Came.BEGUN: Ink.TEXT, Came.DONE: Ink.NORMAL, Came.NO_ANSWER: Ink.WARNING}


@dataclass
class Result:
    """One vehicle's line."""

    vehicle: int
    came: Came = Came.WAITING
    text: str = ""


def summary(title: str, results: Sequence[Result]) -> tuple[str, Ink]:
    """One line that never shows partial success as success."""
    waiting = [r.vehicle for r in results if r.came is Came.WAITING]
    bad = [r for r in results if r.came not in GOOD and r.came is not Came.WAITING]
    if bad:
        words = "; ".join(
            f"{came.value} {ids(who)}"
            for came in dict.fromkeys(r.came for r in bad)
            if (who := [r.vehicle for r in bad if r.came is came])
        )
        good = len(results) - len(bad) - len(waiting)
        ink = Ink.WARNING if any(r.came is not Came.LEFT_OUT for r in bad) else Ink.CAUTION
        return f"{title}: {good} of {len(results)} good, {words}", ink
    if waiting:
        return f"{title}: waiting for {ids(waiting)}", Ink.ADVISORY
    word = "done" if all(r.came is Came.DONE for r in results) else "begun"
    return f"{title}: {word} for all {len(results)}", Ink.NORMAL


def _hidden_runs(hidden: Sequence[Result]) -> list[Run]:
    """What came of those there was no room for: who was refused does not count as one of many more."""
    if not hidden:
        return []
    counts = Counter(result.came for result in hidden)  # the worst first, as they are sorted
    words = ", ".join(f"{count} {came.value}" for came, count in counts.items())
    worst = next(iter(counts))
    return [(f"  and {len(hidden)} more: {words}", _INKS.get(worst, Ink.CAUTION))]


class ResultPanel(LinesView):
    """A table over the screen; takes no keys."""

    DEFAULT_CSS = """
    ResultPanel { layer: results; dock: bottom; margin-bottom: 1; background: #101418; display: none;
                  border: heavy #d8dee4; border-title-color: #d8dee4; border-title-style: bold; padding: 0 1; }
    ResultPanel.-ascii { border: ascii #d8dee4; }
    """

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        """Nothing to tell."""
        super().__init__(glyphs=glyphs)
        self._orders: Sequence[tuple[str, Sequence[Result]]] = ()
        self._now: Callable[[int], VehicleRow | None] = lambda vehicle: None
        self._words: Callable[[VehicleRow | None], str] = str

    def show(
        self,
        newest: tuple[str, Sequence[Result]],
        before: Sequence[tuple[str, Sequence[Result]]],
        now: Callable[[int], VehicleRow | None],
        words: Callable[[VehicleRow | None], str],
    ) -> None:
        """Show the title and results of the newest order, and of those `before` what waits or failed.

        `now` gives a vehicle as it is at this moment, `words` says it.
        """
        self._now, self._words = now, words
        open_ = [(title, [r for r in results if r.came not in GOOD]) for title, results in before]
        self._orders = [newest, *((title, results) for title, results in open_ if results)]
        self.display = True
        shown = sum(min(len(results), MOST_ROWS) + (len(results) > MOST_ROWS) + 1 for _, results in self._orders)
        self.styles.height = min(shown + 3, max(5, self.app.size.height - 6))
        set_title(self, f"result: {newest[0]}")
        self.update_lines()

    def close(self) -> bool:
        """Away with it; whether it was there."""
        was, self.display = bool(self.display), False
        return was

    def lines(self, width: int, height: int) -> list[Line]:
        """Bad news first; those of older orders below."""
        lines: list[Line] = []
        room = max(1, height - len(self._orders) - 1)
        hidden: list[Result] = []
        reasons = [len(result.text) for _, results in self._orders for result in results]
        reason = min(max(reasons, default=0), max(0, width - BESIDE_REASON))
        digits = max((len(str(result.vehicle)) for _, results in self._orders for result in results), default=0)
        id_cells = max(LEAST_ID_CELLS, digits + 1)
        for title, results in self._orders:
            lines.append([summary(title, results)])
            ordered = sorted(results, key=lambda r: (r.came in GOOD, r.came is Came.WAITING, r.vehicle))
            shown = ordered[: max(0, room)]
            lines += [self._line(result, id_cells, reason, width) for result in shown]
            room, hidden = room - len(shown), hidden + ordered[len(shown) :]
        return [*lines, [(" Esc = close ", Ink.MUTED), *_hidden_runs(hidden)]]

    def _line(self, result: Result, id_cells: int, reason: int, width: int) -> Line:
        """One vehicle: what came of it, why in `reason` cells, how it is now. A long reason for bad news goes first."""
        head: Line = [
            (f"{result.vehicle:<{id_cells}}", Ink.BOLD),
            (f"{result.came.value:<{WORD_CELLS}}", _INKS.get(result.came, Ink.CAUTION)),
        ]
        is_bad = result.came not in GOOD and result.came is not Came.WAITING
        if is_bad and len(result.text) > reason:
            return [*head, (cut(result.text, max(reason, width - id_cells - WORD_CELLS)), Ink.TEXT)]
        now = f"now: {self._words(self._now(result.vehicle))}"
        return [*head, (cut(result.text, reason) + "  ", Ink.TEXT), (now, Ink.MUTED)]
