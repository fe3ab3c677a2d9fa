"""The part of the world that a map shows: conversion of ENU metres to cells and dots, and back."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

DOTS_X = 2
DOTS_Y = 4
"""Dots per cell. A cell is about half as wide as high, so a dot is about square: same metres per dot both ways."""

MIN_M_PER_DOT = 0.05
MAX_M_PER_DOT = 20_000.0
_STEPS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0, 8.0, 9.0, 10.0)


@dataclass(frozen=True)
class Viewport:
    """A view of `columns` x `rows` cells, north up, with `centre_m` in the middle."""

    centre_m: tuple[float, float] = (0.0, 0.0)
    m_per_dot: float = 5.0
    columns: int = 1
    rows: int = 1

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """West, south, east and north edge of the view, ENU metres."""
        half_x_m, half_y_m = self.columns * DOTS_X * self.m_per_dot / 2.0, self.rows * DOTS_Y * self.m_per_dot / 2.0
        x_m, y_m = self.centre_m
        return x_m - half_x_m, y_m - half_y_m, x_m + half_x_m, y_m + half_y_m

    def to_dots(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) ENU metres as (n, 2) dots: x right, y down, (0, 0) is the corner of the top left dot."""
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
        scale = np.array([1.0 / self.m_per_dot, -1.0 / self.m_per_dot])
        middle = np.array([self.columns * DOTS_X / 2.0, self.rows * DOTS_Y / 2.0])
        return np.asarray((points - np.asarray(self.centre_m)) * scale + middle, dtype=np.float64)

    def world_to_cell(self, x_m: float, y_m: float) -> tuple[int, int] | None:
        """Return (column, row) of a point, which may lie outside the view; None if the point is not finite."""
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            return None
        column = (x_m - self.centre_m[0]) / self.m_per_dot / DOTS_X + self.columns / 2.0
        row = (self.centre_m[1] - y_m) / self.m_per_dot / DOTS_Y + self.rows / 2.0
        return math.floor(column), math.floor(row)

    def cell_to_world(self, column: float, row: float) -> tuple[float, float]:
        """Return the ENU metres of the middle of a cell."""
        x_m = self.centre_m[0] + (column + 0.5 - self.columns / 2.0) * DOTS_X * self.m_per_dot
        y_m = self.centre_m[1] - (row + 0.5 - self.rows / 2.0) * DOTS_Y * self.m_per_dot
        return x_m, y_m

    def contains(self, cell: tuple[int, int] | None) -> bool:
        """Return whether a cell is in the view."""
        return cell is not None and 0 <= cell[0] < self.columns and 0 <= cell[1] < self.rows

    def panned(self, columns: float, rows: float) -> "Viewport":
        """Return the view moved by cells, right and down."""
        x_m = self.centre_m[0] + columns * DOTS_X * self.m_per_dot
        y_m = self.centre_m[1] - rows * DOTS_Y * self.m_per_dot
        return replace(self, centre_m=(x_m, y_m))

    def zoomed(self, factor: float) -> "Viewport":
        """Return the view about the same centre, closer for factors above 1."""
        m_per_dot = min(max(self.m_per_dot / factor, MIN_M_PER_DOT), MAX_M_PER_DOT)
        return replace(self, m_per_dot=m_per_dot)

    def holds(self, bounds_m: tuple[float, float, float, float]) -> bool:
        """Whether all of (min x, min y, max x, max y), ENU metres, is in view."""
        west, south, east, north = bounds_m
        (left, top), (right, bottom) = self.to_dots([(west, north), (east, south)])
        return bool(left >= 0 and top >= 0 and right < self.columns * DOTS_X and bottom < self.rows * DOTS_Y)

    def fitted(self, bounds_m: tuple[float, float, float, float]) -> "Viewport":
        """Return a view of all of (min x, min y, max x, max y), ENU metres, at the next round scale."""
        min_x, min_y, max_x, max_y = bounds_m
        # A margin of one cell, so that the border of the area is in view.
        width = max(self.columns * DOTS_X - 2 * DOTS_X, DOTS_X)
        height = max(self.rows * DOTS_Y - DOTS_Y, DOTS_Y)
        needed = max((max_x - min_x) / width, (max_y - min_y) / height, MIN_M_PER_DOT)
        return replace(
            self,
            centre_m=((min_x + max_x) / 2.0, (min_y + max_y) / 2.0),
            m_per_dot=min(_round_up(needed), MAX_M_PER_DOT),
        )


def _round_up(m_per_dot: float) -> float:
    """Return the next scale that reads well."""
    decade: float = 10.0 ** math.floor(math.log10(m_per_dot))
    return next(step * decade for step in (*_STEPS, 12.0) if step * decade >= m_per_dot * (1.0 - 1e-9))
