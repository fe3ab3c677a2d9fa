"""Designs the tour of a zone: a portfolio of first guesses, each bent by descent, the best by exact evaluation.

Topology (which lanes in which order) matters more than descent (planning.md C1), hence many guesses of different kinds,
most of which are dropped after a short try.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tui_gcs.core.idleness import cell_centres_m
from tui_gcs.core.zones import bounds, polygon_of
from tui_gcs.planner.api import Shape
from tui_gcs.planner.region import Region
from tui_gcs.planner.round_trip import round_trips
from tui_gcs.planner.seeds import seeds
from tui_gcs.planner.smoothing import Draft, Effort, Motion, draft_of, smooth
from tui_gcs.planner.tour import Evaluation, Tour, evaluate, timed

Floats = NDArray[np.floating[Any]]

CELL_M = 2.5
COARSE_M = 5.0
MOST_CELLS = 12000
"""Larger zones are judged on larger cells."""
LEAST_LOOP_M = 6.0
"""Radius of the loop over a zone that one footprint covers."""
ROUND_TRIPS = 30
FIRST_TRY = Effort(pull=0.05, limits=1.0, iterations=18)
FINALISTS = 7
BEND = (Effort(0.1, 2.0, 30), Effort(0.5, 5.0, 40))
WINNERS = 3
KICKS = 15
"""Random local changes tried on the best draft."""
KICK = Effort(0.5, 5.0, 12)
KICK_M = 8.0
KICK_REACH_M = 15.0
FINISH = (Effort(20.0, 10.0, 30), Effort(100.0, 20.0, 30), Effort(500.0, 50.0, 30))
"""On all cells, harder as long as one is missed."""
MISS_M = 0.3
"""A cell missed by less than this is not: the planning footprint is smaller than the real one by more."""


@dataclass(frozen=True)
class Design:
    """The chosen tour and what it promises."""

    name: str
    tour: Tour
    margin: Evaluation
    """With the planning footprint: what it covers stays covered while vehicles are that much off their slots."""
    real: Evaluation
    """With the real footprint."""


def design(
    shape: Shape, region: Region, motion: Motion, footprint_m: float, n: int, rng: np.random.Generator
) -> Design:
    """The best tour found for `n` vehicles over `shape`. The same arguments give the same tour."""
    x0, y0, x1, y1 = bounds(shape)
    scale = max(1.0, math.sqrt((x1 - x0) * (y1 - y0) / CELL_M**2 / MOST_CELLS))
    cells = cell_centres_m(shape, CELL_M * scale)
    centre = cells.mean(axis=0)
    if np.hypot(*(cells - centre).T).max() + LEAST_LOOP_M <= motion.radius_m:
        drafts = [Draft("loop", region.pulled_inside(_loop(centre)), 1.0)]
    else:
        coarse = np.vstack([cell_centres_m(shape, COARSE_M * scale), _rim(cells, CELL_M * scale)])
        drafts = [_finished(draft, cells, motion, region) for draft in _drafts(shape, coarse, motion, region, rng)]
    return _best(_judged(draft, cells, motion, region, footprint_m, max(1, n)) for draft in drafts)


def _drafts(shape: Shape, cells: Floats, motion: Motion, region: Region, rng: np.random.Generator) -> list[Draft]:
    """The most promising drafts, bent on coarse cells."""
    zone = polygon_of(shape)
    trips = round_trips(zone, motion.radius_m, ROUND_TRIPS, rng)
    guesses = chain(seeds(zone, motion.radius_m), ((f"round trip {i}", path) for i, path in enumerate(trips)))
    first = (draft_of(name, region.pulled_inside(path), motion) for name, path in guesses)
    drafts = _cheapest((smooth(draft, cells, motion, region, FIRST_TRY) for draft in first), FINALISTS)
    for effort in BEND:
        drafts = [smooth(draft, cells, motion, region, effort) for draft in drafts]
    winners = _cheapest(drafts, WINNERS)
    return [_kicked(winners[0], cells, motion, region, rng), *winners[1:]]


def _kicked(best: Draft, cells: Floats, motion: Motion, region: Region, rng: np.random.Generator) -> Draft:
    """Basin hopping: shove the tour near a random place, descend, keep what got cheaper."""
    for _ in range(KICKS):
        place = best.controls[rng.integers(len(best.controls))] + rng.normal(0.0, KICK_M, 2)
        near = np.exp(-((best.controls - place) ** 2).sum(axis=1) / (2.0 * KICK_REACH_M**2))
        shoved = best.controls + near[:, None] * rng.normal(0.0, KICK_M, 2)
        tried = smooth(replace(best, controls=shoved), cells, motion, region, KICK)
        best = min(best, tried, key=lambda draft: draft.cost)
    return best


def _finished(draft: Draft, cells: Floats, motion: Motion, region: Region) -> Draft:
    for effort in FINISH:
        draft = smooth(draft, cells, motion, region, effort)
        if cKDTree(draft.path_m()).query(cells)[0].max() <= motion.radius_m + MISS_M:
            break
    return draft


def _cheapest(drafts: Iterable[Draft], count: int) -> list[Draft]:
    return sorted(drafts, key=lambda draft: draft.cost)[:count]


def _judged(draft: Draft, cells: Floats, motion: Motion, region: Region, footprint_m: float, n: int) -> Design:
    path = region.pulled_inside(draft.path_m())
    tour = timed(path, motion.speed_m_s, motion.accel_m_s2, _stopping_cap(path, motion, region))
    margin = evaluate(tour, cells, motion.radius_m + MISS_M, n)
    return Design(draft.name, tour, margin, evaluate(tour, cells, footprint_m, n))


def _best(designs: Iterable[Design]) -> Design:
    """Full cover first, with the real footprint and with margin, then worst idleness."""
    return min(designs, key=lambda d: (-d.real.coverage, -d.margin.coverage, d.real.worst_s, d.tour.period_s))


def _stopping_cap(path: Floats, motion: Motion, region: Region) -> Floats:
    """Speed at each point from which a vehicle that brakes straight on stops inside the region."""
    ahead = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    stop_m = motion.speed_m_s**2 / (2.0 * motion.accel_m_s2) + 1.0
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
