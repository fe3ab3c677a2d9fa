"""A raster of dots on a grid of cells: lines, dashes and hatching, shown as braille, quarter blocks or letters.

Vectorised with numpy: a full redraw of ten zones takes a millisecond or two, a frame with cached zones well below one
(docs/terminal.md C4).
"""

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.widgets.basics.glyphs import BRAILLE_BASE, QUADRANTS, Dots
from tui_gcs.widgets.basics.strips import SPACE
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y

Points = NDArray[np.float64]

_DOT_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint8)
"""The bit of a Unicode braille pattern that each of the 4 x 2 dots of a cell sets."""

_QUADRANT_BITS = np.array([[1, 2], [4, 8]], dtype=np.uint8)
_QUADRANT_CODES = np.array([ord(sign) for sign in QUADRANTS], dtype=np.uint32)

SOLID = (1.0, 0.0)


def unit_circle(count: int) -> Points:
    """Return (count, 2) points on the circle of radius 1 about the origin."""
    angles = np.linspace(0.0, math.tau, count, endpoint=False)
    return np.column_stack([np.cos(angles), np.sin(angles)])


class DotRaster:
    """Dots drawn by ink; the highest ink that touches a cell colours it."""

    def __init__(self, columns: int, rows: int) -> None:
        self.columns = columns
        self.rows = rows
        self.dots: NDArray[np.bool_] = np.zeros((rows * DOTS_Y, columns * DOTS_X), dtype=np.bool_)
        self.inks: NDArray[np.uint8] = np.zeros((rows, columns), dtype=np.uint8)

    def copy(self) -> "DotRaster":
        """Return a copy, to draw more upon."""
        other = DotRaster(self.columns, self.rows)
        other.dots[:] = self.dots
        other.inks[:] = self.inks
        return other

    def under(self, other: "DotRaster") -> None:
        """Put the dots of `other`, of the same size, into the cells in which nothing is drawn here."""
        free = self.inks == 0
        self.inks[free] = other.inks[free]
        cells = (self.rows, DOTS_Y, self.columns, DOTS_X)
        mine = self.dots.reshape(cells)  # a view of the same dots
        mine |= other.dots.reshape(cells) & free[:, None, :, None]

    def plot(self, points: Points, ink: int) -> None:
        """Draw single dots at (n, 2) dot coordinates; what is outside or not finite is left out."""
        points = points[np.isfinite(points).all(axis=1)]
        inside = (
            (points[:, 0] >= 0)
            & (points[:, 0] < self.columns * DOTS_X)
            & (points[:, 1] >= 0)
            & (points[:, 1] < self.rows * DOTS_Y)
        )
        x = points[inside, 0].astype(np.intp)
        y = points[inside, 1].astype(np.intp)
        self.dots[y, x] = True
        cells = (y // DOTS_Y, x // DOTS_X)
        self.inks[cells] = np.maximum(self.inks[cells], ink)

    def polyline(self, points: Points, ink: int, *, closed: bool = False, dash: tuple[float, float] = SOLID) -> None:
        """Draw a line through (n, 2) dot coordinates; `dash` is dots on, dots off.

        It is clipped before it is sampled.
        """
        if closed:
            points = np.vstack([points, points[:1]])
        if len(points) < 2 or not np.isfinite(points).all():
            return
        self._segments(points[:-1], np.diff(points, axis=0), ink, dash)

    def segments(self, begins: Points, ends: Points, ink: int, *, dash: tuple[float, float] = SOLID) -> None:
        """Draw straight pieces, each from one of (n, 2) dot coordinates to another; dashes go on from one to the next.

        Pieces that are not finite or not in view are left out.
        """
        low, high = np.minimum(begins, ends), np.maximum(begins, ends)
        size = (self.columns * DOTS_X, self.rows * DOTS_Y)
        shown = np.isfinite(begins + ends).all(axis=1) & (high >= 0.0).all(axis=1) & (low < size).all(axis=1)
        if shown.any():
            self._segments(begins[shown], ends[shown] - begins[shown], ink, dash)

    def _segments(self, start: Points, step: Points, ink: int, dash: tuple[float, float]) -> None:
        length = np.hypot(step[:, 0], step[:, 1])
        travelled = np.concatenate([[0.0], np.cumsum(length)[:-1]])
        # A line that reaches far out of the view would have millions of samples.
        first, last = self._clip(start, step)
        samples = np.ceil(np.abs(step).max(axis=1) * np.maximum(last - first, 0.0)).astype(np.intp) + 1
        samples[last < first] = 0
        of = np.repeat(np.arange(len(start)), samples)
        if not len(of):
            return
        within = np.arange(len(of)) - np.repeat(np.cumsum(samples) - samples, samples)
        along = first[of] + (last - first)[of] * within / np.maximum(samples[of] - 1, 1)
        if dash[1] > 0.0:
            phase = (travelled[of] + along * length[of]) % (dash[0] + dash[1])
            of, along = of[phase < dash[0]], along[phase < dash[0]]
        self.plot(start[of] + step[of] * along[:, None], ink)

    def _clip(self, start: Points, step: Points) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the part [first, last] of each segment inside the raster, by Liang-Barsky; last < first if none is."""
        first, last = np.zeros(len(start)), np.ones(len(start))
        for axis, limit in ((0, self.columns * DOTS_X), (1, self.rows * DOTS_Y)):
            position, slope = start[:, axis], step[:, axis]
            still = np.abs(slope) < 1e-12
            safe = np.where(still, 1.0, slope)
            at_low, at_high = -position / safe, (limit - position) / safe
            enter, leave = np.minimum(at_low, at_high), np.maximum(at_low, at_high)
            outside = still & ((position < 0) | (position >= limit))
            first = np.where(still, np.where(outside, 2.0, first), np.maximum(first, enter))
            last = np.where(still, last, np.minimum(last, leave))
        return first, last

    def hatch(self, outline: Points, ink: int, spacing: int = 6) -> None:
        """Draw crossed diagonals inside a polygon in dot coordinates."""
        low = np.maximum(np.floor(outline.min(axis=0)), 0)
        high = np.minimum(np.ceil(outline.max(axis=0)), (self.columns * DOTS_X - 1, self.rows * DOTS_Y - 1))
        if not np.isfinite(outline).all() or (low > high).any():
            return
        x, y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
        lined = ((x + y) % spacing == 0) | ((x - y) % spacing == 0)
        # The middle of each dot, so that a border through dots belongs to one side only.
        x, y = x[lined] + 0.5, y[lined] + 0.5
        shape = shapely.Polygon(outline)
        # A polygon that crosses itself has no inside; it is being edited.
        if shape.is_valid:
            inside = shapely.contains_xy(shape, x, y)
            self.plot(np.column_stack([x[inside], y[inside]]), ink)

    def codes(self, dots: Dots, letters: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Return (rows, columns) code points: braille, quarter blocks, or `letters[ink]` where anything is drawn."""
        cells = self.dots.reshape(self.rows, DOTS_Y, self.columns, DOTS_X)
        if dots == "blocks":
            quarters = cells.reshape(self.rows, 2, DOTS_Y // 2, self.columns, DOTS_X).any(axis=2)
            which = (quarters * _QUADRANT_BITS[None, :, None, :]).sum(axis=(1, 3), dtype=np.intp)
            return np.asarray(_QUADRANT_CODES[which], dtype=np.uint32)
        bits = (cells * _DOT_BITS[None, :, None, :]).sum(axis=(1, 3), dtype=np.uint32)
        drawn = bits > 0
        if dots == "braille":
            return np.where(drawn, bits + BRAILLE_BASE, SPACE).astype(np.uint32)
        return np.where(drawn, letters[self.inks], SPACE).astype(np.uint32)
