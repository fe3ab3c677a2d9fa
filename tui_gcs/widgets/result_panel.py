"""What became of the newest order, vehicle by vehicle: over the lower part of the screen, and never in the way of keys.

Stays as long as something is under way or failed; goes by itself when all succeeded, or on Esc.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from tui_gcs.core.messages import VehicleRow
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.strips import cut
from tui_gcs.widgets.titles import set_title
from tui_gcs.widgets.words import ids

MOST_ROWS = 10
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
        self._title = ""
        self._results: Sequence[Result] = ()
        self._now: Callable[[int], VehicleRow | None] = lambda vehicle: None
        self._words: Callable[[VehicleRow | None], str] = str

    def show(
        self,
        title: str,
        results: Sequence[Result],
        now: Callable[[int], VehicleRow | None],
        words: Callable[[VehicleRow | None], str],
    ) -> None:
        """Show `results`; `now` gives a vehicle as it is at this moment, `words` says it."""
        self._title, self._results, self._now, self._words = title, results, now, words
        self.display = True
        shown = min(len(results), MOST_ROWS) + (len(results) > MOST_ROWS)
        self.styles.height = min(shown + 4, max(5, self.app.size.height - 6))
        set_title(self, f"result: {title}")
        self.update_lines()

    def close(self) -> bool:
        """Away with it; whether it was there."""
        was, self.display = bool(self.display), False
        return was

    def lines(self, width: int, height: int) -> list[Line]:
        """Bad news first."""
        text, ink = summary(self._title, self._results)
        lines: list[Line] = [[(text, ink)]]
        ordered = sorted(self._results, key=lambda r: (r.came in GOOD, r.came is Came.WAITING, r.vehicle))
        room = max(1, height - 2)
        reason = min(max(len(result.text) for result in ordered), max(0, width - BESIDE_REASON)) if ordered else 0
        for result in ordered[:room]:
            color = _INKS.get(result.came, Ink.CAUTION)
            now = self._words(self._now(result.vehicle))
            lines.append(
                [
                    (f"{result.vehicle:<4}", Ink.BOLD),
                    (f"{result.came.value:<10}", color),
                    (cut(result.text, reason) + "  ", Ink.TEXT),
                    (f"now: {now}", Ink.MUTED),
                ]
            )
        more = len(ordered) - room
        keys = " Esc = close " + (f"  and {more} more, all of them better" if more > 0 else "")
        return [*lines, [(keys, Ink.MUTED)]]
