"""The newest hours of all published values, once a second, so that a plot begins in the past.

Bounded: when it is full every second row is left out, and rows are taken half as often. 250 vehicles take 22 MB, eight
less than 1 MB.
"""

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
MAX_ROWS = 1200
MAX_COLUMNS = 10_000
"""Values beyond these are not kept: 500 vehicles."""
FIRST_PERIOD_S = 1.0


class ValueHistory:
    """A table of rows over time with a column for each value; columns may be added at any time."""

    def __init__(self) -> None:
        """Begin without rows."""
        self._times_s = np.empty(MAX_ROWS)
        self._table = np.full((MAX_ROWS, 0), np.nan, dtype=np.float32)
        self._columns: dict[Hashable, int] = {}
        self._keys: Sequence[Hashable] = ()
        self._places: NDArray[np.intp] = np.empty(0, dtype=np.intp)
        self._count = 0
        self.period_s = FIRST_PERIOD_S

    def is_due(self, t_s: float) -> bool:
        """Whether a row is wanted now. A time before the newest one is that of another clock: all is forgotten."""
        if self._count and t_s < self._times_s[self._count - 1]:
            self._count, self.period_s = 0, FIRST_PERIOD_S
            self._table[:] = np.nan
        return not self._count or t_s - self._times_s[self._count - 1] >= self.period_s - 1e-6

    def add(self, t_s: float, keys: Sequence[Hashable], values: Floats) -> None:
        """Take a row; call it when `is_due`."""
        if keys != self._keys:
            self._keys, self._places = keys, self._places_of(keys)
        if self._count == MAX_ROWS:
            self._thin()
        self._times_s[self._count] = t_s
        self._table[self._count] = np.nan
        kept = self._places >= 0
        with np.errstate(over="ignore"):  # what does not fit into 32 bits becomes infinite, which is drawn as a gap
            self._table[self._count, self._places[kept]] = values[kept]
        self._count += 1

    def _places_of(self, keys: Sequence[Hashable]) -> NDArray[np.intp]:
        for key in keys:
            if key not in self._columns and len(self._columns) < MAX_COLUMNS:
                self._columns[key] = len(self._columns)
        missing = len(self._columns) - self._table.shape[1]
        if missing > 0:
            self._table = np.hstack([self._table, np.full((MAX_ROWS, missing), np.nan, dtype=np.float32)])
        return np.array([self._columns.get(key, -1) for key in keys], dtype=np.intp)

    def _thin(self) -> None:
        kept = slice(0, MAX_ROWS, 2)
        self._count = MAX_ROWS // 2
        self._times_s[: self._count] = self._times_s[kept].copy()
        self._table[: self._count] = self._table[kept].copy()
        self.period_s *= 2.0

    def points(self, key: Hashable) -> tuple[Floats, Floats]:
        """Return (times, values) of a value, oldest first."""
        column = self._columns.get(key)
        if column is None:
            return np.empty(0), np.empty(0)
        return self._times_s[: self._count].copy(), self._table[: self._count, column].astype(np.float64)
