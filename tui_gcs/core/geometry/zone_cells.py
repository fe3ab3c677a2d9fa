"""The cells of a zone that can be seen, the one reference of every figure: planner, preview, referee and screens.

A cell is a square with its centre in the zone. It can be seen if a footprint reaches its centre from where vehicles
are permitted to be: the operating area less its margin, less no-fly zones with theirs. What cannot be seen is listed
with its area and the reason, and never counted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from tui_gcs.core.geometry.idleness_bounds import ideal_idleness_s, idleness_bound_s, longest_m
from tui_gcs.core.geometry.zones import Shape, Zone, area_m2, bounds, contains, polygon_of

Floats = NDArray[np.floating[Any]]
Flags = NDArray[np.bool_]

CELL_M = 2.5
"""Largest cell of a zone of ordinary size: an optimum on cells of 5 m leaves 1 to 3 % of the cells of 2.5 m unseen
(docs/planning.md A1)."""
CELLS_PER_FOOTPRINT = 4.0
"""A footprint's radius is at least so many cells."""
MAX_CELLS = 250_000
"""Cells of a zone's bounding box: 1.25 km x 1.25 km at 2.5 m; larger zones get larger cells."""
RESERVE_M = 0.5
"""Distance that is planned beyond the guard's own margin, so that rounding never causes a veto."""
STRAY_M = 2.0
"""A cell counts as reachable if the footprint reaches it although the vehicle is so far off its course: both
autopilots stray by less (`Firmware.off_course_m` is 1.1 and 1.25 m), and tours are averaged by a little."""
MIN_REACH_SHARE = 0.4
"""Share of a small footprint that always counts as reaching."""
MIN_PART_M2 = 1.0
"""Smaller parts of the permitted region are no room for a vehicle."""


@dataclass(frozen=True)
class UnreachablePart:
    """A part of a zone that no vehicle can see."""

    area_m2: float
    why: str


def cell_size_m(shape: Shape, footprint_radius_m: float) -> float:
    """Return the size of the cells of `shape`: 2.5 m, less for small footprints, more for huge zones."""
    x0, y0, x1, y1 = bounds(shape)
    fine_m = min(CELL_M, footprint_radius_m / CELLS_PER_FOOTPRINT)
    return max(fine_m, math.sqrt((x1 - x0) * (y1 - y0) / MAX_CELLS))


def permitted_region(area: Shape, no_fly: Sequence[Zone], margin_m: float, zone: Shape) -> shapely.Polygon:
    """Return where vehicles may be planned to fly; empty if margin and no-fly zones leave nothing.

    This is the connected part that shares most with `zone`, or else is nearest to it: vehicles cannot change from one
    part to another.
    """
    parts = permitted_parts(area, no_fly, margin_m)
    return part_for(zone, parts) if parts else shapely.Polygon()


def part_for(zone: Shape, parts: Sequence[shapely.Polygon]) -> shapely.Polygon:
    """Return the part from which `zone` is flown: the one that shares most with it, or else is nearest to it."""
    target = polygon_of(zone)
    return max(parts, key=lambda part: (part.intersection(target).area, -part.distance(target)))


def permitted_parts(area: Shape, no_fly: Sequence[Zone], margin_m: float) -> list[shapely.Polygon]:
    """Return the connected parts into which margin and no-fly zones divide an operating area."""
    kept_m = margin_m + RESERVE_M
    free: BaseGeometry = polygon_of(area).buffer(-kept_m)
    for closed in no_fly:
        free = free.difference(polygon_of(closed.shape).buffer(kept_m))
    return [part for part in getattr(free, "geoms", [free]) if not part.is_empty and part.area > MIN_PART_M2]


@dataclass(frozen=True)
class ZoneCells:
    """The cells of a zone on a lattice over its bounding box, rows along y and columns along x."""

    cell_m: float
    axis_x_m: Floats
    axis_y_m: Floats
    counted: Flags
    """(rows, columns) whether the cell is in the zone and can be seen."""
    zone_m2: float
    reachable_m2: float
    """Area of the zone that can be seen: exact if all of it can be, else the share of its cells."""
    unreachable: tuple[UnreachablePart, ...] = ()

    @property
    def count(self) -> int:
        """Number of cells that count."""
        return int(np.count_nonzero(self.counted))

    def centres_m(self) -> Floats:
        """Return (count, 2) centres of the cells that count, row by row."""
        rows, columns = np.nonzero(self.counted)
        return np.stack([self.axis_x_m[columns], self.axis_y_m[rows]], axis=1)

    @cached_property
    def length_m(self) -> float:
        """The largest extent of the cells that count, from centre to centre."""
        rows = np.flatnonzero(self.counted.any(axis=1))
        first = np.argmax(self.counted[rows], axis=1)
        last = self.counted.shape[1] - 1 - np.argmax(self.counted[rows, ::-1], axis=1)
        ends = [np.stack([self.axis_x_m[columns], self.axis_y_m[rows]], axis=1) for columns in (first, last)]
        return longest_m(np.vstack(ends))

    def ideal_s(self, n: int, speed_m_s: float, footprint_radius_m: float, fastest_m_s: float | None = None) -> float:
        """Return the ideal worst idleness of `n` vehicles: no overlap, no turns (`ideal_idleness_s`).

        Both this and `bound_s` take a `Sweep`; the ideal does not depend on who is the fastest.
        """
        return ideal_idleness_s(self.reachable_m2, n, speed_m_s, footprint_radius_m)

    def bound_s(self, n: int, speed_m_s: float, footprint_radius_m: float, fastest_m_s: float | None = None) -> float:
        """Return the worst idleness that no plan of `n` vehicles beats (`idleness_bound_s`)."""
        return idleness_bound_s(self.reachable_m2, self.length_m, n, speed_m_s, footprint_radius_m, fastest_m_s)

    def unreachable_text(self) -> str:
        """Return what is left out, for people; "" if all can be seen."""
        parts = ", ".join(f"{part.area_m2:.0f} m2 {part.why}" for part in self.unreachable)
        return f"cannot be seen: {parts}" if parts else ""


def all_cells(shape: Shape, cell_m: float) -> ZoneCells:
    """Return all cells of `shape`, whether they can be seen or not; at least one (the middle), however small it is."""
    x0, y0, x1, y1 = bounds(shape)
    axis_x = x0 + cell_m * (np.arange(max(1, math.ceil((x1 - x0) / cell_m - 1e-9))) + 0.5)
    axis_y = y0 + cell_m * (np.arange(max(1, math.ceil((y1 - y0) / cell_m - 1e-9))) + 0.5)
    grid_x, grid_y = np.meshgrid(axis_x, axis_y)
    inside = contains(shape, np.stack([grid_x.ravel(), grid_y.ravel()], axis=1)).reshape(grid_x.shape)
    if not inside.any():
        axis_x, axis_y = np.array([(x0 + x1) / 2.0]), np.array([(y0 + y1) / 2.0])
        inside = np.ones((1, 1), dtype=bool)
    size_m2 = area_m2(shape)
    return ZoneCells(cell_m, axis_x, axis_y, inside, size_m2, size_m2)


@lru_cache(maxsize=32)
def reachable_cells(
    shape: Shape, area: Shape, no_fly: tuple[Zone, ...], margin_m: float, footprint_radius_m: float
) -> ZoneCells:
    """Return the cells of `shape` that a footprint can reach from permitted positions; there may be none."""
    cells = all_cells(shape, cell_size_m(shape, footprint_radius_m))
    region = permitted_region(area, no_fly, margin_m, shape)
    if region.covers(shapely.box(*bounds(shape))):
        return cells
    centres = cells.centres_m()
    reach_m = max(footprint_radius_m - STRAY_M, MIN_REACH_SHARE * footprint_radius_m)
    seen = _near(region, centres, reach_m)
    if seen.all():
        return cells
    counted = cells.counted.copy()
    counted[cells.counted] = seen
    each_m2 = cells.zone_m2 / len(centres)
    parts = _reasons(centres[~seen], each_m2, area, no_fly, margin_m + RESERVE_M)
    reachable_m2 = each_m2 * int(seen.sum())
    return ZoneCells(cells.cell_m, cells.axis_x_m, cells.axis_y_m, counted, cells.zone_m2, reachable_m2, parts)


def _near(region: shapely.Polygon, points_m: Floats, reach_m: float) -> Flags:
    """Return which points (n, 2) are in the region or at most `reach_m` from it."""
    if region.is_empty:
        return np.zeros(len(points_m), dtype=bool)
    shapely.prepare(region)
    near = np.asarray(shapely.intersects_xy(region, points_m[:, 0], points_m[:, 1]))
    far = np.flatnonzero(~near)
    near[far] = shapely.dwithin(region, shapely.points(points_m[far]), reach_m)
    return near


def _reasons(
    unseen_m: Floats, each_m2: float, area: Shape, no_fly: Sequence[Zone], kept_m: float
) -> tuple[UnreachablePart, ...]:
    """Return why cells are not seen: beyond the edge of the area, in or behind a no-fly zone, or cut off by them."""
    beyond = ~shapely.intersects_xy(polygon_of(area).buffer(-kept_m), unseen_m[:, 0], unseen_m[:, 1])
    causes = [("beyond the edge of the operating area and its margin", beyond)]
    for closed in no_fly:
        wall = polygon_of(closed.shape).buffer(kept_m)
        causes.append((f"in no-fly zone {closed.name}", shapely.intersects_xy(wall, unseen_m[:, 0], unseen_m[:, 1])))
    left, parts = np.ones(len(unseen_m), dtype=bool), []
    for why, holds in [*causes, ("cut off by margins and no-fly zones", left.copy())]:
        if count := int(np.count_nonzero(left & holds)):
            parts.append(UnreachablePart(round(count * each_m2, 1), why))
        left &= ~holds
    return tuple(parts)
