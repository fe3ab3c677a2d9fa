"""What became of the newest orders, vehicle by vehicle: a table over the lower part of the screen that takes no keys.

It stays as long as something is under way or failed; it closes by itself when all succeeded, or on Esc.
"""

from collections import Counter
from collections.abc import Callable, Sequence

from tui_gcs.core.protocol.common import VehicleRow
from tui_gcs.feed.order_tracker import SUCCEEDED, OrderState, VehicleProgress
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

MAX_ROWS = 10
MIN_ID_CELLS, WORD_CELLS = 4, 10
NOW_CELLS = 46
"""Width reserved for the present state of a vehicle, so that the layout does not jump when a number grows."""
MAX_REASON_LINES = 3
BORDER_CELLS, BORDER_LINES = 4, 2
"""Size of the border with its padding."""
AS_ABOVE = "as above"
StateText = Callable[[VehicleRow | None], str]


_INKS = {
    OrderState.WAITING: Ink.ADVISORY,
    OrderState.BEGUN: Ink.TEXT,
    OrderState.DONE: Ink.NORMAL,
    OrderState.NO_ANSWER: Ink.WARNING,
}


def summary(title: str, results: Sequence[VehicleProgress]) -> tuple[str, Ink]:
    """Return one line about an order, and its ink; it reads as success only if every vehicle succeeded."""
    waiting = [r.vehicle for r in results if r.state is OrderState.WAITING]
    bad = [r for r in results if r.state not in SUCCEEDED and r.state is not OrderState.WAITING]
    if bad:
        words = "; ".join(
            f"{state.value} {ids(vehicles)}"
            for state in dict.fromkeys(r.state for r in bad)
            if (vehicles := [r.vehicle for r in bad if r.state is state])
        )
        good = len(results) - len(bad) - len(waiting)
        ink = Ink.WARNING if any(r.state is not OrderState.LEFT_OUT for r in bad) else Ink.CAUTION
        return f"{title}: {good} of {len(results)} good, {words}", ink
    if waiting:
        return f"{title}: waiting for {ids(waiting)}", Ink.ADVISORY
    word = "done" if all(r.state is OrderState.DONE for r in results) else "begun"
    return f"{title}: {word}{'' if len(results) == 1 else f' for all {len(results)}'}", Ink.NORMAL


def _hidden_runs(hidden: Sequence[VehicleProgress]) -> list[Run]:
    """Number and outcome of vehicles that there is no room for."""
    if not hidden:
        return []
    counts = Counter(result.state for result in hidden)  # the worst first, as they are sorted
    words = ", ".join(f"{count} {state.value}" for state, count in counts.items())
    worst = next(iter(counts))
    return [(f"  and {len(hidden)} more: {words}", _INKS.get(worst, Ink.CAUTION))]


class ResultPanel(LinesView):
    """The table of results; it takes no keys."""

    DEFAULT_CSS = """
    ResultPanel { layer: results; dock: bottom; margin-bottom: 1; background: #101418; display: none;
                  border: heavy #d8dee4; border-title-color: #d8dee4; border-title-style: bold; padding: 0 1; }
    ResultPanel.-ascii { border: ascii #d8dee4; }
    """

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        """Begin empty and closed; `show` opens it."""
        super().__init__(glyphs=glyphs)
        self._orders: Sequence[tuple[str, Sequence[VehicleProgress]]] = ()
        self._row_of: Callable[[int], VehicleRow | None] = lambda vehicle: None
        self._state_text: StateText = str
        self._short_state_text: StateText = str

    def show(
        self,
        newest: tuple[str, Sequence[VehicleProgress]],
        before: Sequence[tuple[str, Sequence[VehicleProgress]]],
        now: Callable[[int], VehicleRow | None],
        words: StateText,
        brief: StateText,
    ) -> None:
        """Show the title and results of the newest order, and of those `before` what waits or failed.

        `now` returns a vehicle as it is at this moment; `words` describes it, `brief` where there is little room.
        """
        self._row_of, self._state_text, self._short_state_text = now, words, brief
        open_ = [(title, [r for r in results if r.state not in SUCCEEDED]) for title, results in before]
        self._orders = [newest, *((title, results) for title, results in open_ if results)]
        self.display = True
        set_title(self, f"result: {newest[0]}")
        self.fit()

    def fit(self) -> None:
        """Make the panel as high as its text, as far as the terminal has room."""
        most = max(5, self.app.size.height - 6)
        text = self.lines(self.app.size.width - BORDER_CELLS, most - BORDER_LINES)
        self.styles.height = min(len(text) + BORDER_LINES, most)
        self.update_lines()

    def close(self) -> bool:
        """Close the table; return whether it was open."""
        was, self.display = bool(self.display), False
        return was

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`. Bad news first, older orders below; one line for each vehicle if reasons do not fit.

        The present state of a vehicle is never cut for the sake of a reason, because it is the newest truth.
        """
        room = max(1, height - len(self._orders) - 1)
        shown: list[tuple[str, Sequence[VehicleProgress], list[VehicleProgress]]] = []
        hidden: list[VehicleProgress] = []
        for title, results in self._orders:
            ordered = _in_order(results)
            fits = min(len(ordered), MAX_ROWS, room)
            shown.append((title, results, ordered[:fits]))
            room, hidden = room - fits, hidden + ordered[fits:]
        for rows_of in (self._whole, self._one_line_each):
            lines: list[Line] = []
            for title, results, ordered in shown:
                lines += [[summary(title, results)], *rows_of(ordered, width)]
            if len(lines) < height:
                break
        return [*lines, [(" Esc = close ", Ink.MUTED), *_hidden_runs(hidden)]]

    def _whole(self, results: Sequence[VehicleProgress], width: int) -> list[Line]:
        """Every reason whole, and how each vehicle is now beside it or, if that is too long, below."""
        id_cells = self._id_cells()
        room = width - id_cells - WORD_CELLS
        texts = _without_repeats(results)
        beside = max((len(text) + 2 for text in texts if text and len(text) + 2 + NOW_CELLS <= room), default=0)
        lines: list[Line] = []
        for result, text in zip(results, texts, strict=True):
            now = f"now: {self._state_text(self._row_of(result.vehicle))}"
            if len(text) + 2 <= max(beside, 2):
                lines.append([*_head(result, id_cells), (f"{text:<{beside}}", Ink.TEXT), (now, Ink.MUTED)])
                continue
            first, *rest = wrapped(text, room, MAX_REASON_LINES)
            indent: Run = (" " * (id_cells + WORD_CELLS), Ink.TEXT)
            lines.append([*_head(result, id_cells), (first, Ink.TEXT)])
            lines += [[indent, (more, Ink.TEXT)] for more in rest]
            lines.append([indent, (now, Ink.MUTED)])
        return lines

    def _one_line_each(self, results: Sequence[VehicleProgress], width: int) -> list[Line]:
        """One line for each vehicle: how it is now in brief, and as much of the reason as fits beside that."""
        id_cells = self._id_cells()
        now = [f"now: {self._short_state_text(self._row_of(result.vehicle))}" for result in results]
        texts = _without_repeats(results)
        room = width - id_cells - WORD_CELLS - 2 - max(map(len, now), default=0)
        reason = min(max(map(len, texts), default=0), max(0, room))
        return [
            [*_head(result, id_cells), (cut(text, reason) + "  ", Ink.TEXT), (words, Ink.MUTED)]
            for result, text, words in zip(results, texts, now, strict=True)
        ]

    def _id_cells(self) -> int:
        digits = max((len(str(result.vehicle)) for _, results in self._orders for result in results), default=0)
        return max(MIN_ID_CELLS, digits + 1)


def _is_bad(result: VehicleProgress) -> bool:
    return result.state not in SUCCEEDED and result.state is not OrderState.WAITING


def _in_order(results: Sequence[VehicleProgress]) -> list[VehicleProgress]:
    """Bad news first, vehicles with the same reason together; then those that wait; then success."""
    first: dict[tuple[OrderState, str], int] = {}
    for result in sorted(results, key=lambda r: r.vehicle):
        first.setdefault((result.state, result.text), result.vehicle)

    def rank(result: VehicleProgress) -> tuple[bool, bool, int, int]:
        together = first[result.state, result.text] if _is_bad(result) else 0
        return result.state in SUCCEEDED, result.state is OrderState.WAITING, together, result.vehicle

    return sorted(results, key=rank)


def _without_repeats(results: Sequence[VehicleProgress]) -> list[str]:
    """The reasons; a bad one that is the same as in the line above is replaced by `AS_ABOVE`."""
    texts: list[str] = []
    above: VehicleProgress | None = None
    for result in results:
        same = above is not None and (above.state, above.text) == (result.state, result.text)
        texts.append(AS_ABOVE if same and _is_bad(result) and len(result.text) > len(AS_ABOVE) else result.text)
        above = result
    return texts


def _head(result: VehicleProgress, id_cells: int) -> Line:
    return [
        (f"{result.vehicle:<{id_cells}}", Ink.BOLD),
        (f"{result.state.value:<{WORD_CELLS}}", _INKS.get(result.state, Ink.CAUTION)),
    ]
