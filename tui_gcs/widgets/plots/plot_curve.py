"""Curves as dots: one style of line, colour and letter for each, so that they differ without colour, too."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import SOLID, DotRaster
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y

Floats = NDArray[np.float64]

LETTERS = "abcdefgh"
MAX_CURVES = len(LETTERS)
"""Curves of one pane: more would look alike."""
CURVE_INKS = (Ink.TEAM_1, Ink.TEAM_2, Ink.TEAM_3, Ink.TEAM_4, Ink.TEAM_5, Ink.TEAM_6, Ink.EDITED, Ink.TARGET)
DASHES = (SOLID, (3.0, 2.0), (1.0, 2.0), (8.0, 3.0), (5.0, 5.0), (2.0, 6.0), (12.0, 4.0), (1.0, 5.0))
"""Dots on and dots off, by curve."""
LETTER_CODES = np.full(len(Ink), ord("*"), dtype=np.uint32)
"""The sign of each ink where no dots can be drawn: the letter of its curve."""
LETTER_CODES[list(CURVE_INKS)] = [ord(letter) for letter in LETTERS]


@dataclass(frozen=True)
class Curve:
    """One value over time."""

    label: str
    times_s: Floats
    values: Floats
    """NaN where nothing is known: the line is interrupted there."""


@dataclass(frozen=True)
class PlotSpan:
    """The span of time and of values that a plot shows."""

    from_s: float
    to_s: float
    low: float
    high: float


def draw_curve(raster: DotRaster, curve: Curve, at: int, span: PlotSpan, *, dashed: bool) -> None:
    """Draw the curve of a number below `MAX_CURVES`."""
    dots = curve_dots(curve, span, raster.columns * DOTS_X, raster.rows * DOTS_Y)
    known: NDArray[np.bool_] = np.isfinite(dots.sum(axis=1))
    for run in np.split(np.arange(len(dots)), np.flatnonzero(np.diff(known)) + 1):
        if not len(run) or not known[run[0]]:
            continue
        if len(run) == 1:
            raster.plot(dots[run], CURVE_INKS[at])
        else:
            raster.polyline(dots[run], CURVE_INKS[at], dash=DASHES[at] if dashed else SOLID)


def curve_dots(curve: Curve, span: PlotSpan, columns: int, rows: int) -> Floats:
    """Return (n, 2) dot coordinates; where several points share a column, the lowest and the highest of them."""
    x = (curve.times_s - span.from_s) / (span.to_s - span.from_s) * columns
    # In units of the span: subtracting first would overflow for the largest numbers.
    y = (span.high - curve.values) / (span.high - span.low) * (rows - 1) + 0.5
    if len(x) <= 2 * columns:
        return np.column_stack([x, y])
    column = np.floor(x)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(column) != 0.0]))
    lowest, highest = np.fmin.reduceat(y, starts), np.fmax.reduceat(y, starts)
    middle = column[starts] + 0.5
    return np.column_stack([np.repeat(middle, 2), np.column_stack([lowest, highest]).ravel()])


def letter_cells(curve: Curve, at: int, count: int, span: PlotSpan, columns: int, rows: int) -> list[tuple[int, int]]:
    """Return the cells (column, row) where a curve's letter stands: at its end, and at a place of its own."""
    places = []
    known = np.isfinite(curve.values) & (curve.times_s <= span.to_s) & (curve.times_s >= span.from_s)
    times_s, values = curve.times_s[known], curve.values[known]
    if not len(times_s):
        return []
    own_s = times_s[0] + (times_s[-1] - times_s[0]) * (at + 0.5) / count
    for index in (len(times_s) - 1, int(np.searchsorted(times_s, own_s))):
        column = int((times_s[index] - span.from_s) / (span.to_s - span.from_s) * columns)
        row = int((span.high - values[index]) / (span.high - span.low) * rows)
        places.append((min(column, columns - 1), min(max(row, 0), rows - 1)))
    return places
