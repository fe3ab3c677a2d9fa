"""One pane of plots: scale, curves, times, the cursor, and a line for each curve with its numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from tui_gcs.core.records.time_series import value_at
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.glyphs import Dots, next_dots
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, cut
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.plots.plot_curve import (
    CURVE_INKS,
    LETTER_CODES,
    LETTERS,
    Curve,
    PlotSpan,
    draw_curve,
    letter_cells,
)
from tui_gcs.widgets.plots.plot_scale import PlotScale, nice_scale, short_number, tick_words

SCALE_CELLS = 9
"""Numbers beside the curves, with a blank."""
NUMBER_CELLS = 7
MIN_LABEL_CELLS, MAX_LABEL_CELLS = 4, 26
MIN_CURVE_CELLS = 12
LEGEND_SHARE = 0.42
"""The part of a narrow pane that the legend may take."""
TIME_CELLS = 22
"""One time is written below so many columns."""


@dataclass(frozen=True)
class PaneContent:
    """What a pane shows."""

    curves: tuple[Curve, ...]
    unit: str
    from_s: float
    to_s: float
    time_words: Callable[[float], str]
    """A time of the curves for people."""
    cursor_s: float | None = None
    """The legend shows the values at this time; None: the newest."""
    empty_text: str = ""


class PlotPane(LinesView):
    """Curves of values with one unit."""

    DEFAULT_CSS = framed("PlotPane", "height: 1fr;")

    def __init__(self, **options: object) -> None:
        """Begin without curves."""
        super().__init__(**options)  # type: ignore[arg-type]
        self.dots: Dots = self.glyphs.dots
        """How curves are drawn."""
        self.content: PaneContent | None = None
        """What is shown; see `show`."""
        self._scale: PlotScale | None = None
        self._scaled: tuple[object, ...] = ()
        """For which curves and size the scale was made."""

    def show(self, content: PaneContent, title: str) -> None:
        """Show this, with a title in the border."""
        self.content = content
        if str(self.border_title or "") != title:
            set_title(self, title)
        self.update_lines()

    def next_dots(self) -> None:
        """Draw in another way: the terminal's font may not have the signs."""
        self.dots = next_dots(self.dots) if self.glyphs.unicode else self.glyphs.dots
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        content = self.content
        if content is None or not content.curves:
            text = content.empty_text if content is not None else ""
            return [[(text, Ink.MUTED)]]
        legend_cells = self._legend_cells(content, width)
        columns, rows = width - SCALE_CELLS - legend_cells, height - 1
        if columns < MIN_CURVE_CELLS or rows < 2:
            return [[("too small to plot", Ink.MUTED)]]
        scale = self._fitting_scale(content, rows)
        span = PlotSpan(content.from_s, content.to_s, scale.low, scale.high)
        graph = self._graph(content, span, columns, rows)
        marks = tick_rows(scale, rows)
        legend = self._legend(content, span, legend_cells, rows + 1)
        wall = "│" if self.glyphs.unicode else "|"
        lines: list[Line] = []
        for y in range(rows):
            mark = f"{marks[y]:>{SCALE_CELLS - 1}}{wall}" if y in marks else " " * (SCALE_CELLS - 1) + wall
            lines.append([(mark, Ink.MUTED), *graph[y], *legend[y]])
        times = time_axis(content, columns)
        unit = f"{content.unit:>{SCALE_CELLS - 1}} "
        lines.append([(cut(unit, SCALE_CELLS), Ink.TEXT), (times, Ink.MUTED), *legend[rows]])
        return lines

    def _legend_cells(self, content: PaneContent, width: int) -> int:
        longest = max(len(curve.label) for curve in content.curves)
        label = min(max(longest, MIN_LABEL_CELLS), MAX_LABEL_CELLS)
        wanted = 3 + label + 3 * NUMBER_CELLS
        return max(3 + MIN_LABEL_CELLS + 3 * NUMBER_CELLS, min(wanted, int(width * LEGEND_SHARE)))

    def _fitting_scale(self, content: PaneContent, rows: int) -> PlotScale:
        """Return the scale as it was while it fits, so that the picture does not jump with every point."""
        low, high = extent(content)
        key = (rows, content.unit, tuple(curve.label for curve in content.curves))
        if self._scale is None or key != self._scaled or not self._scale.covers(low, high):
            self._scale, self._scaled = nice_scale(low, high, rows), key
        return self._scale

    def _graph(self, content: PaneContent, span: PlotSpan, columns: int, rows: int) -> list[list[Run]]:
        """Return the runs of each row of the curves."""
        raster = DotRaster(columns, rows)
        dots = self.dots
        for at, curve in enumerate(content.curves):
            draw_curve(raster, curve, at, span, dashed=dots != "letters")
        codes, inks = raster.codes(dots, LETTER_CODES), raster.inks.copy()
        taken: set[tuple[int, int]] = set()
        for at, curve in enumerate(content.curves):
            for cell in letter_cells(curve, at, len(content.curves), span, columns, rows):
                if cell not in taken:
                    taken.add(cell)
                    codes[cell[1], cell[0]], inks[cell[1], cell[0]] = ord(LETTERS[at]), CURVE_INKS[at]
        if content.cursor_s is not None:
            at = cursor_column(content, columns)
            free = codes[:, at] == ord(" ")
            codes[free, at] = ord("│" if self.glyphs.unicode else "|")
            inks[:, at] = np.where(free, Ink.MUTED, Ink.SELECTED)
        return [_runs(codes[y], inks[y]) for y in range(rows)]

    def _legend(self, content: PaneContent, span: PlotSpan, cells: int, rows: int) -> list[list[Run]]:
        """Return a line for each curve: letter, label, the value now or at the cursor, lowest and highest."""
        label_cells = cells - 3 - 3 * NUMBER_CELLS
        head = "AT" if content.cursor_s is not None else "NOW"
        titles = "".join(f"{word:>{NUMBER_CELLS}}" for word in (head, "MIN", "MAX"))
        lines: list[list[Run]] = [[(f"   {'':<{label_cells}}{titles}", Ink.MUTED)]]
        shown = content.curves if len(content.curves) < rows else content.curves[: rows - 2]
        for at, curve in enumerate(shown):
            now = value_at(curve.times_s, curve.values, np.inf if content.cursor_s is None else content.cursor_s)
            low, high = curve_extent(curve, span.from_s, span.to_s)
            numbers = "".join(f"{short_number(value, NUMBER_CELLS - 1):>{NUMBER_CELLS}}" for value in (now, low, high))
            lines.append([(f" {LETTERS[at]} ", CURVE_INKS[at]), (cut(curve.label, label_cells) + numbers, Ink.TEXT)])
        if len(shown) < len(content.curves):
            lines.append([(f"   {len(content.curves) - len(shown)} more: a higher pane shows them", Ink.MUTED)])
        return lines + [[] for _ in range(rows - len(lines))]


def curve_extent(curve: Curve, from_s: float, to_s: float) -> tuple[float, float]:
    """Return the lowest and highest value within a span; NaN where there is none."""
    values = curve.values[(curve.times_s >= from_s) & (curve.times_s <= to_s)]
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (float("nan"), float("nan"))


def extent(content: PaneContent) -> tuple[float, float]:
    """Return the lowest and highest value of all curves; 0 and 1 where nothing is known."""
    found = np.array([curve_extent(curve, content.from_s, content.to_s) for curve in content.curves])
    if not np.isfinite(found).any():
        return 0.0, 1.0
    return float(np.nanmin(found[:, 0])), float(np.nanmax(found[:, 1]))


def tick_rows(scale: PlotScale, rows: int) -> dict[int, str]:
    """Return the words of the marks by row."""
    return {
        round((scale.high - tick) / (scale.high - scale.low) * (rows - 1)): tick_words(
            tick, scale.step, SCALE_CELLS - 2
        )
        for tick in scale.ticks
    }


def cursor_column(content: PaneContent, columns: int) -> int:
    """Return the column of the cursor."""
    cursor_s = content.cursor_s if content.cursor_s is not None else content.to_s
    share = (cursor_s - content.from_s) / (content.to_s - content.from_s)
    return min(max(int(share * columns), 0), columns - 1)


def time_axis(content: PaneContent, columns: int) -> str:
    """Return the line of times below the curves; where the cursor's time stands, others give way."""
    parts = max(1, columns // TIME_CELLS)
    times = [
        (part / parts * (columns - 1), content.from_s + part / parts * (content.to_s - content.from_s))
        for part in range(parts + 1)
    ]
    words = [(round(column), content.time_words(t_s)) for column, t_s in times]
    if content.cursor_s is not None:
        words.insert(0, (cursor_column(content, columns), f"[{content.time_words(content.cursor_s)}]"))
    line = " " * columns
    for column, text in words:
        begin = min(max(column - len(text) // 2, 0), columns - len(text))
        around = line[max(begin - 1, 0) : begin + len(text) + 1]
        if begin >= 0 and not around.strip():
            line = line[:begin] + text + line[begin + len(text) :]
    return line


def _runs(codes: np.ndarray, inks: np.ndarray) -> list[Run]:
    """Return the runs of one row; blanks take the ink to their left, so that runs stay few."""
    text = codes.astype("<u4").tobytes().decode("utf-32-le")
    seen: list[Ink] = []
    ink = Ink.BLANK
    for sign, value in zip(text, inks.tolist(), strict=True):
        ink = ink if sign == " " and ink is not Ink.SELECTED else Ink(value) if sign != " " else Ink.BLANK
        seen.append(ink)
    runs: list[Run] = []
    for same, group in groupby(zip(text, seen, strict=True), key=lambda each: each[1]):
        runs.append(("".join(sign for sign, _ in group), same))
    return runs


def plain_text(lines: Sequence[Line]) -> str:
    """Return lines as text without trailing blanks."""
    return "\n".join("".join(text for text, _ in line).rstrip() for line in lines)
