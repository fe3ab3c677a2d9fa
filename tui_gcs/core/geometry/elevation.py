"""The height of the ground above mean sea level, from grids of measured heights.

Heights between the points of a grid are bilinear. Where no grid reaches, or where a point beside the place was not
measured, the height is NaN: unknown, never 0.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ElevationGrid:
    """Heights at the crossings of evenly spaced parallels and meridians."""

    south_deg: float
    """The latitude of the first row."""
    west_deg: float
    """The longitude of the first column."""
    step_lat_deg: float
    step_lon_deg: float
    heights_m: Floats | NDArray[np.float32]
    """(rows, columns), from south to north and from west to east, metres above sea level; NaN where not measured."""

    def amsl_m(self, lat_deg: Floats, lon_deg: Floats) -> Floats:
        """Return the heights at places (n,), metres above sea level; NaN outside and where not measured."""
        rows, columns = self.heights_m.shape
        row = (lat_deg - self.south_deg) / self.step_lat_deg
        column = (lon_deg - self.west_deg) / self.step_lon_deg
        inside = (row >= 0) & (row <= rows - 1) & (column >= 0) & (column <= columns - 1)
        # The last row and column belong to the cell before them.
        south = np.clip(np.nan_to_num(row), 0, rows - 2).astype(np.int64)
        west = np.clip(np.nan_to_num(column), 0, columns - 2).astype(np.int64)
        up, right = row - south, column - west
        amsl_m = np.zeros(row.shape)
        for rows_on, columns_on, weight in (
            (0, 0, (1 - up) * (1 - right)),
            (0, 1, (1 - up) * right),
            (1, 0, up * (1 - right)),
            (1, 1, up * right),
        ):
            # A corner without weight does not count, measured or not.
            amsl_m += np.where(weight == 0, 0.0, self.heights_m[south + rows_on, west + columns_on] * weight)
        return np.where(inside, amsl_m, np.nan)


GridAt = Callable[[int, int], ElevationGrid | None]
"""Returns the grid that covers a whole degree, by its south-western corner in degrees, or None."""


class Elevation:
    """The ground as several grids describe it."""

    def __init__(self, name: str, grids: Sequence[ElevationGrid] = (), grid_at: GridAt | None = None) -> None:
        """Take `grids`; `grid_at` gives further ones, a degree each, when a place in them is first asked for."""
        self.name = name
        """What the operator called it: the name of its file or folder."""
        self._grids = list(grids)
        self._grid_at = grid_at

    def amsl_m(self, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return the ground's heights at places (n,), metres above sea level; NaN where unknown."""
        lat, lon = (np.atleast_1d(np.asarray(each, dtype=np.float64)) for each in (lat_deg, lon_deg))
        heights_m = np.full(lat.shape, np.nan)
        for grid in (*self._grids, *self._degrees(lat, lon)):
            missing = np.isnan(heights_m)
            if not missing.any():
                break
            heights_m[missing] = grid.amsl_m(lat[missing], lon[missing])
        return heights_m

    def place_amsl_m(self, lat_deg: float, lon_deg: float) -> float | None:
        """Return the ground's height at one place, metres above sea level; None where unknown."""
        height_m = float(self.amsl_m(lat_deg, lon_deg)[0])
        return None if np.isnan(height_m) else height_m

    def _degrees(self, lat_deg: Floats, lon_deg: Floats) -> list[ElevationGrid]:
        """Return the grids of the whole degrees in which the places lie."""
        if self._grid_at is None:
            return []
        known = np.isfinite(lat_deg) & np.isfinite(lon_deg)
        corners = np.unique(np.floor(np.stack([lat_deg[known], lon_deg[known]], axis=1)).astype(np.int64), axis=0)
        found = (self._grid_at(int(south), int(west)) for south, west in corners)
        return [grid for grid in found if grid is not None]
