"""Idleness of a zone: how long ago each cell was last inside a footprint, and the bounds to compare it with.

A cell is a square of `cell_m` with its centre in the zone; it is seen while its centre is within the footprint radius
of a vehicle. A cell that was never seen has infinite idleness.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tui_gcs.core.geometry.zones import Shape, bounds, contains

Floats = NDArray[np.floating[Any]]


def sweep_bound_s(area_m2: float, n: int, speed_m_s: float, footprint_radius_m: float) -> float:
    """Return A / (n v 2r), the least worst idleness of any repeating tour of `n` vehicles; infinite for none."""
    swept_m2_s = n * speed_m_s * 2.0 * footprint_radius_m
    return area_m2 / swept_m2_s if swept_m2_s > 0.0 else math.inf


def serving(n: int, waiting: int) -> int:
    """Return how many of `n` vehicles the bound counts: not those in reserve, but all if all are waiting."""
    return n - waiting if waiting < n else n


def cell_centres_m(shape: Shape, cell_m: float) -> Floats:
    """Return the (n, 2) centres of the cells of `shape`; at least one (the middle), however small the shape."""
    axis_x, axis_y, inside = _lattice(shape, cell_m)
    rows, columns = np.nonzero(inside)
    return np.stack([axis_x[columns], axis_y[rows]], axis=1)


MAX_CELLS = 250_000
"""Cells of a zone's bounding box: 1.25 km x 1.25 km at 2.5 m; larger zones get larger cells."""


class IdlenessGrid:
    """When each cell of a zone was last seen.

    Cells lie on a dense lattice over the zone's bounding box, so that an update touches only the few rows and columns
    under a footprint; cells outside the zone are carried along and never counted.
    """

    # An optimum on cells of 5 m leaves 1 to 3 % of the cells of 2.5 m unseen (docs/planning.md A1).
    def __init__(self, shape: Shape, footprint_radius_m: float, cell_m: float = 2.5) -> None:
        """Begin with nothing seen. Raises ValueError unless radius and cell size are positive."""
        if not (footprint_radius_m > 0.0 and cell_m > 0.0):
            raise ValueError(f"footprint radius {footprint_radius_m:g} m and cell {cell_m:g} m must be positive")
        self.footprint_radius_m = footprint_radius_m
        x0, y0, x1, y1 = bounds(shape)
        self.cell_m = max(cell_m, math.sqrt((x1 - x0) * (y1 - y0) / MAX_CELLS))
        """Cell size as requested, or larger where a huge zone would need too many cells."""
        self._x, self._y, self._inside = _lattice(shape, self.cell_m)
        self._x0, self._y0 = float(self._x[0]), float(self._y[0])
        self.cells = int(np.count_nonzero(self._inside))
        self._last_s = np.full(self._inside.shape, -np.inf)
        self._unseen = self.cells
        self.full_cover_t: float | None = None
        """Time when the last cell was first seen; None while some never were."""
        self._window: _Window | None = None

    @property
    def coverage(self) -> float:
        """Share of the cells seen at least once, 0…1."""
        return 1.0 - self._unseen / self.cells

    def update(self, t_s: float, xy_m: ArrayLike) -> None:
        """Take vehicles at `xy_m` (n, 2) now; rows that are not finite see nothing. Times must not go back."""
        if self._window is not None:
            self._window.advance(t_s)
        for x, y in np.asarray(xy_m, dtype=float).reshape(-1, 2).tolist():
            if math.isfinite(x) and math.isfinite(y):
                self._see(t_s, x, y)
        if self._unseen == 0 and self.full_cover_t is None:
            self.full_cover_t = t_s

    def idleness_s(self, t_s: float) -> Floats:
        """Return (cells,) seconds since each cell was last seen, infinite where never; order of `cell_centres_m`."""
        return np.asarray(t_s - self._last_s[self._inside])

    def worst_now_s(self, t_s: float) -> float:
        """Return the idleness of the cell that was longest unseen at `t_s`; infinite while one was never seen."""
        return float(t_s - self._last_s[self._inside].min())

    def average_now_s(self, t_s: float) -> float:
        """Return the mean idleness of all cells at `t_s`; infinite while one was never seen."""
        return float(t_s - self._last_s[self._inside].mean())

    def begin_window(self, t_s: float) -> None:
        """Start measuring worst and average idleness at `t_s`."""
        self._window = _Window(t_s, self._last_s, self._inside)

    @property
    def worst_idleness_s(self) -> float:
        """Largest idleness of any cell at any update since `begin_window`; NaN without a window."""
        if self._window is None:
            return math.nan
        return max(self._window.worst_s, float(np.max(self._window.now_s - self._last_s[self._inside])))

    @property
    def average_idleness_s(self) -> float:
        """Mean idleness over cells and time since `begin_window`; NaN without a window or before time passed."""
        if self._window is None or self._window.now_s <= self._window.begin_s:
            return math.nan
        return self._window.average(self._last_s, self._inside)

    def _see(self, t_s: float, x: float, y: float) -> None:
        r, cell = self.footprint_radius_m, self.cell_m
        x0, y0 = self._x0, self._y0
        left, right = max(0, math.ceil((x - r - x0) / cell)), math.floor((x + r - x0) / cell) + 1
        low, high = max(0, math.ceil((y - r - y0) / cell)), math.floor((y + r - y0) / cell) + 1
        if right <= left or high <= low or left >= len(self._x) or low >= len(self._y):
            return
        block = (slice(low, high), slice(left, right))
        dx, dy = self._x[left:right] - x, self._y[low:high] - y
        under = (dy * dy)[:, None] + (dx * dx)[None, :] <= r * r
        last = self._last_s[block]
        if self._unseen:
            under &= self._inside[block]
            self._unseen -= int(np.count_nonzero(under & (last == -np.inf)))
        if self._window is not None:
            self._window.closes(block, t_s, last, under)
        last[under] = t_s


@dataclass
class _Window:
    """Worst and average idleness since `begin_s`, kept up as sightings end gaps.

    A cell's idleness grows from gap to gap, so its integral over a gap from a to b (since last seen at s) is
    ((b - s)^2 - (a - s)^2) / 2 and its maximum b - s; only cells that are seen need work.
    """

    begin_s: float
    worst_s: float
    now_s: float

    def __init__(self, t_s: float, last_s: Floats, inside: NDArray[np.bool_]) -> None:
        self.begin_s = self.now_s = t_s
        self._inside = inside
        self.worst_s = float(np.max(t_s - last_s[inside]))
        self._integral = -float(np.sum((t_s - last_s[inside]) ** 2)) / 2.0
        """Of idleness over gaps ended so far, less what lies before the window."""

    def advance(self, t_s: float) -> None:
        self.now_s = t_s

    def closes(self, block: tuple[slice, slice], t_s: float, last: Floats, under: NDArray[np.bool_]) -> None:
        gaps = t_s - last[under & self._inside[block]]
        if gaps.size:
            self.worst_s = max(self.worst_s, float(gaps.max()))
            self._integral += float(gaps @ gaps) / 2.0

    def average(self, last_s: Floats, inside: NDArray[np.bool_]) -> float:
        open_s = self.now_s - last_s[inside]
        if not math.isfinite(self.worst_s) or not np.isfinite(open_s).all():
            return math.inf
        integral = self._integral + float(open_s @ open_s) / 2.0
        return integral / (self.now_s - self.begin_s) / len(open_s)


def _lattice(shape: Shape, cell_m: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return cell centres along x and along y, aligned to the bounding box, and which are inside (y, x)."""
    x0, y0, x1, y1 = bounds(shape)
    axis_x = x0 + cell_m * (np.arange(max(1, math.ceil((x1 - x0) / cell_m - 1e-9))) + 0.5)
    axis_y = y0 + cell_m * (np.arange(max(1, math.ceil((y1 - y0) / cell_m - 1e-9))) + 0.5)
    grid_x, grid_y = np.meshgrid(axis_x, axis_y)
    inside = contains(shape, np.stack([grid_x.ravel(), grid_y.ravel()], axis=1)).reshape(grid_x.shape)
    if not inside.any():
        axis_x, axis_y = np.array([(x0 + x1) / 2.0]), np.array([(y0 + y1) / 2.0])
        inside = np.ones((1, 1), dtype=bool)
    return axis_x, axis_y, inside
