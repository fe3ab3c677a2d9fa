"""Designs the tour of a zone: a portfolio of first guesses, each bent by descent, the best by exact evaluation."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.idleness import cell_centres_m
from tui_gcs.core.zones import bounds, polygon_of
from tui_gcs.planner.api import Shape
from tui_gcs.planner.region import Region
from tui_gcs.planner.seeds import seeds
from tui_gcs.planner.smoothing import Motion, controls_of, smooth, spline_points
from tui_gcs.planner.tour import Evaluation, Tour, evaluate, timed

Floats = NDArray[np.floating[Any]]

CELL_M = 2.5
COARSE_M = 5.0
MOST_CELLS = 6000
"""Larger zones are judged on larger cells."""
PATH_PER_CONTROL = 14
LEAST_LOOP_M = 6.0
"""Radius of the loop over a zone that one footprint covers."""
FIRST_TRY, FIRST_PULL = 14, 0.02
FINALISTS = 5
POLISH = ((0.05, 30), (0.5, 30))
FINISH = (3.0, 30)
"""(pull s/m^2, iterations) of the finalists, on coarse cells; the finish is on all."""


@dataclass(frozen=True)
class Design:
    """The chosen tour and what it promises."""

    name: str
    tour: Tour
    margin: Evaluation
    """With the planning footprint (less than the real one)."""
    real: Evaluation
    """With the real footprint."""


@dataclass(frozen=True)
class _Draft:
    name: str
    controls: Floats
    cost: float


def design(shape: Shape, region: Region, motion: Motion, footprint_m: float, n: int) -> Design:
    """The best tour found for `n` vehicles over `shape`. The same arguments give the same tour."""
    x0, y0, x1, y1 = bounds(shape)
    scale = max(1.0, math.sqrt((x1 - x0) * (y1 - y0) / CELL_M**2 / MOST_CELLS))
    cells = cell_centres_m(shape, CELL_M * scale)
    centre = cells.mean(axis=0)
    if np.hypot(*(cells - centre).T).max() + LEAST_LOOP_M <= motion.radius_m:
        drafts = [_Draft("loop", _loop(centre), 0.0)]
    else:
        coarse = np.vstack([cell_centres_m(shape, COARSE_M * scale), _rim(cells, CELL_M * scale)])
        drafts = [_bent(draft, cells, motion, region, *FINISH) for draft in _drafts(shape, coarse, motion, region)]
    return _best(_judged(draft, cells, motion, region, footprint_m, max(1, n)) for draft in drafts)


def _drafts(shape: Shape, cells: Floats, motion: Motion, region: Region) -> list[_Draft]:
    tried = []
    for name, path in seeds(polygon_of(shape), motion.radius_m):
        controls = region.pulled_inside(controls_of(path))
        tried.append(_bent(_Draft(name, controls, 0.0), cells, motion, region, FIRST_PULL, FIRST_TRY))
    finalists = sorted(tried, key=lambda draft: draft.cost)[:FINALISTS]
    for pull, iterations in POLISH:
        finalists = [_bent(draft, cells, motion, region, pull, iterations) for draft in finalists]
    return finalists


def _bent(draft: _Draft, cells: Floats, motion: Motion, region: Region, pull: float, iterations: int) -> _Draft:
    controls, cost = smooth(draft.controls, cells, motion, region, pull, iterations)
    return _Draft(draft.name, controls, cost)


def _judged(draft: _Draft, cells: Floats, motion: Motion, region: Region, footprint_m: float, n: int) -> Design:
    path = region.pulled_inside(spline_points(draft.controls, PATH_PER_CONTROL))
    tour = timed(path, motion.speed_m_s, motion.accel_m_s2, _stopping_cap(path, motion, region))
    margin = evaluate(tour, cells, motion.radius_m, n)
    return Design(draft.name, tour, margin, evaluate(tour, cells, footprint_m, n))


def _best(designs: Iterable[Design]) -> Design:
    """Full cover first (with the real footprint), then worst idleness."""
    return min(designs, key=lambda d: (-d.real.coverage, d.real.worst_s, -d.margin.coverage, d.tour.period_s))


def _stopping_cap(path: Floats, motion: Motion, region: Region) -> Floats:
    """Speed at each point from which a vehicle that brakes straight on stops inside the region."""
    ahead = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    stop_m = motion.speed_m_s**2 / (2.0 * motion.accel_m_s2)
    room = region.room_ahead_m(path, ahead, stop_m)
    return np.asarray(np.sqrt(2.0 * motion.accel_m_s2 * np.maximum(room - 0.5, 0.2)))


def _rim(cells: Floats, cell_m: float) -> Floats:
    """Cells with fewer than four neighbours."""
    place = np.round((cells - cells.min(axis=0)) / cell_m).astype(int) + 1
    grid = np.zeros(place.max(axis=0) + 2, dtype=bool)
    x, y = place.T
    grid[x, y] = True
    return np.asarray(cells[~(grid[x - 1, y] & grid[x + 1, y] & grid[x, y - 1] & grid[x, y + 1])])


def _loop(centre: Floats) -> Floats:
    """Control points of a small circle; the spline of eight of them lies a tenth inside."""
    angles = np.arange(8) * (math.pi / 4.0)
    return centre + 1.1 * LEAST_LOOP_M * np.stack([np.cos(angles), np.sin(angles)], axis=1)
