"""Idleness of a zone: how long ago each of its cells was last inside a footprint.

A cell is seen while its centre is within the footprint radius of a vehicle. A cell that was never seen has infinite
idleness; in a measurement it counts from a time that the measurement names.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tui_gcs.core.geometry.zone_cells import ZoneCells, all_cells, cell_size_m
from tui_gcs.core.geometry.zones import Shape

Floats = NDArray[np.floating[Any]]
Cells = NDArray[np.intp]
"""Places of cells in a flattened lattice."""

PICTURE_S = 0.1
"""Positions farther apart in time than this are interpolated: 0.8 m at 8 m/s, which skips no cell."""
MAX_INTERPOLATED_S = 5.0
"""In a longer gap it is not known where a vehicle was: nothing counts as seen."""
MAX_SPEED_M_S = 60.0
"""A vehicle that seems to be faster than this jumped."""


def serving(n: int, waiting: int) -> int:
    """Return how many of `n` vehicles the ideal counts: not those in reserve, but all if all are waiting."""
    return n - waiting if waiting < n else n


def cell_centres_m(shape: Shape, cell_m: float) -> Floats:
    """Return the (n, 2) centres of all cells of `shape`; at least one (the middle), however small the shape."""
    return all_cells(shape, cell_m).centres_m()


class PositionInterpolator:
    """Fills gaps between two pictures of the fleet: vehicles fly straight from place to place.

    On a busy computer pictures come 0.5 s apart; without this a cell at the edge of a swath, in sight for 0.4 s, counts
    as not seen (1.3 x was flown and 2.1 to 2.7 x measured).
    """

    def __init__(self) -> None:
        self._t_s = math.nan
        self._places: dict[int, tuple[float, float]] = {}

    def take(self, t_s: float, places_m: Mapping[int, tuple[float, float]]) -> Iterator[tuple[float, Floats]]:
        """Yield (time, (n, 2) places) from the picture before, exclusive, up to this one, by vehicle."""
        gap_s, before = t_s - self._t_s, self._places
        self._t_s, self._places = t_s, dict(places_m)
        if PICTURE_S * 1.01 < gap_s <= MAX_INTERPOLATED_S:
            both = [v for v in places_m if v in before and math.dist(places_m[v], before[v]) <= MAX_SPEED_M_S * gap_s]
            if both:
                old, new = (np.array([places[v] for v in both], dtype=float) for places in (before, places_m))
                steps = math.ceil(gap_s / PICTURE_S - 1e-9)
                for k in range(1, steps):
                    yield t_s - gap_s * (1.0 - k / steps), old + (new - old) * (k / steps)
        yield t_s, np.array(list(places_m.values()), dtype=float).reshape(-1, 2)


class IdlenessGrid:
    """When each cell of a zone was last seen.

    Cells lie on a dense lattice over the zone's bounding box, so that an update touches only the few rows and columns
    under each footprint; cells that do not count are carried along. In it a cell is a place in the flattened lattice.
    """

    def __init__(self, zone: Shape | ZoneCells, footprint_radius_m: float, cell_m: float | None = None) -> None:
        """Begin with nothing seen. All cells of a shape count, by default of the size of `cell_size_m`.

        Raises:
            ValueError: radius or cell size is not positive.
        """
        if not footprint_radius_m > 0.0 or not (cell_m is None or cell_m > 0.0):
            raise ValueError(f"footprint radius {footprint_radius_m:g} m and cell {cell_m} m must be positive")
        self.footprint_radius_m = footprint_radius_m
        if not isinstance(zone, ZoneCells):
            zone = all_cells(zone, max(cell_m or 0.0, cell_size_m(zone, footprint_radius_m)))
        self.cell_m = zone.cell_m
        self._inside = zone.counted
        axes_m = zone.axis_x_m, zone.axis_y_m
        self._first_m, self._last_m = (np.array([axis[end] for axis in axes_m]) for end in (0, -1))
        """(2,) x and y of the first and last column and row."""
        self._size = np.array([len(axis) for axis in axes_m])
        self._span = np.arange(math.floor(2.0 * footprint_radius_m / self.cell_m) + 1)
        """0, 1, … up to the most columns, and rows, that a footprint can lie on."""
        self.cells = zone.count
        self._last_s = np.full(self._inside.shape, -np.inf)
        self._number = np.zeros(self._inside.size, dtype=np.intp)
        self.unseen = self.cells
        """How many cells were never seen."""
        self.full_cover_t: float | None = None
        """Time when the last cell was first seen; None while some never were."""
        self.new_cell_t = -math.inf
        """Time when a cell was last seen for the first time."""
        self._window: _Window | None = None

    @property
    def coverage(self) -> float:
        """Share of the cells seen at least once, 0…1; 0 of a zone without cells."""
        return 1.0 - self.unseen / self.cells if self.cells else 0.0

    def update(self, t_s: float, xy_m: ArrayLike) -> None:
        """Take vehicles at `xy_m` (n, 2) now; rows that are not finite see nothing. Times must not go back."""
        if self._window is not None:
            self._window.now_s = t_s
        self._see(t_s, self._under(np.asarray(xy_m, dtype=float).reshape(-1, 2)))
        if self.unseen == 0 and self.full_cover_t is None:
            self.full_cover_t = t_s

    def idleness_s(self, t_s: float) -> Floats:
        """Return (cells,) seconds since each cell was last seen, infinite where never; order of `centres_m`."""
        return np.asarray(t_s - self._last_s[self._inside])

    def worst_now_s(self, t_s: float, never_s: float = math.inf) -> float:
        """Return the idleness of the cell that was longest unseen at `t_s`; cells never seen count as `never_s`."""
        return float(self._idle_s(t_s, never_s).max(initial=0.0))

    def average_now_s(self, t_s: float, never_s: float = math.inf) -> float:
        """Return the mean idleness of all cells at `t_s`; cells never seen count as `never_s`."""
        return float(self._idle_s(t_s, never_s).mean()) if self.cells else math.nan

    def _idle_s(self, t_s: float, never_s: float) -> Floats:
        idle_s = self.idleness_s(t_s)
        return np.where(np.isfinite(idle_s), idle_s, never_s)

    def begin_window(self, t_s: float, since_s: float = -math.inf) -> None:
        """Start measuring idleness at `t_s`; cells that were never seen count as seen at `since_s`."""
        self._window = _Window(t_s, since_s, self._last_s, self._inside)

    @property
    def worst_idleness_s(self) -> float:
        """Largest idleness of any cell at any update since `begin_window`; NaN without a window."""
        if self._window is None:
            return math.nan
        return float(self._window.worst_of_cells(self._last_s).max(initial=0.0))

    @property
    def p99_idleness_s(self) -> float:
        """Worst idleness that 99 % of the zone's area keeps since `begin_window`; NaN without a window.

        Cells are equally large, so this is the 99th percentile over cells of each one's own largest idleness.
        """
        if self._window is None or not self.cells:
            return math.nan
        worst = self._window.worst_of_cells(self._last_s)
        return float(np.percentile(worst, 99.0, method="higher"))

    @property
    def average_idleness_s(self) -> float:
        """Mean idleness over cells and time since `begin_window`; NaN without a window or before time passed."""
        if self._window is None or self._window.now_s <= self._window.begin_s or not self.cells:
            return math.nan
        return self._window.average(self._last_s)

    def _under(self, xy_m: Floats) -> Cells:
        """Return the cells whose centres are inside a footprint of `xy_m` (n, 2), each of them once."""
        r = self.footprint_radius_m
        # Not true of what is not finite.
        near = ((xy_m >= self._first_m - r) & (xy_m <= self._last_m + r)).all(axis=1)
        if not near.all():
            xy_m = xy_m[near]
        # (n, 2, k) columns and rows that a footprint can lie on, and how far along their axis those are.
        lines = np.ceil((xy_m - r - self._first_m) / self.cell_m).astype(np.intp)[:, :, None] + self._span
        away2_m2 = (self._first_m[:, None] + lines * self.cell_m - xy_m[:, :, None]) ** 2
        away2_m2[(lines < 0) | (lines >= self._size[:, None])] = np.inf
        under = away2_m2[:, 1, :, None] + away2_m2[:, 0, None, :] <= r * r
        found: Cells = (lines[:, 1, :, None] * self._size[0] + lines[:, 0, None, :])[under]
        if len(xy_m) < 2:
            return found
        # Of a cell that several see, the number that stays there is that of one of them.
        order = np.arange(len(found))
        self._number[found] = order
        found = found[self._number[found] == order]
        return found

    def _see(self, t_s: float, cells: Cells) -> None:
        last_s = self._last_s.reshape(-1)
        before_s, counted = last_s[cells], self._inside.reshape(-1)[cells]
        if self.unseen and (new := int(np.count_nonzero(counted & (before_s == -np.inf)))):
            self.unseen, self.new_cell_t = self.unseen - new, t_s
        if self._window is not None:
            self._window.closes(cells, t_s, before_s, counted)
        last_s[cells] = t_s


class _Window:
    """Idleness since `begin_s`, kept up as sightings end gaps.

    A cell's idleness grows from gap to gap, so its integral over a gap from a to b (since last seen at s) is
    ((b - s)^2 - (a - s)^2) / 2 and its maximum b - s; only cells that are seen need work.
    """

    def __init__(self, t_s: float, since_s: float, last_s: Floats, inside: NDArray[np.bool_]) -> None:
        self.begin_s = self.now_s = t_s
        self._since_s, self._inside = since_s, inside
        self._worst_s = t_s - np.maximum(last_s, since_s)
        """Of each cell of the lattice, over the gaps that ended."""
        idle_s = self._worst_s[inside]
        self._integral = -float(idle_s @ idle_s) / 2.0
        """Of idleness over gaps ended so far, less what lies before the window."""

    def closes(self, cells: Cells, t_s: float, before_s: Floats, counted: NDArray[np.bool_]) -> None:
        """Take that these cells, seen last at `before_s`, are seen at `t_s`; only those `counted` are in the mean."""
        gaps_s = t_s - np.maximum(before_s, self._since_s)
        worst_s = self._worst_s.reshape(-1)
        worst_s[cells] = np.maximum(worst_s[cells], gaps_s)
        counted_s = gaps_s[counted]
        self._integral += float(counted_s @ counted_s) / 2.0

    def worst_of_cells(self, last_s: Floats) -> Floats:
        open_s = self.now_s - np.maximum(last_s[self._inside], self._since_s)
        return np.asarray(np.maximum(self._worst_s[self._inside], open_s))

    def average(self, last_s: Floats) -> float:
        open_s = self.now_s - np.maximum(last_s[self._inside], self._since_s)
        if not np.isfinite(self.worst_of_cells(last_s)).all():
            return math.inf
        integral = self._integral + float(open_s @ open_s) / 2.0
        return integral / (self.now_s - self.begin_s) / len(open_s)
