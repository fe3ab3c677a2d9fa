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
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.api import Shape, area_m2, cell_centres_m, polygon_of
from tui_gcs.planner.lazy_scipy import nearest
from tui_gcs.planner.region import Region
from tui_gcs.planner.round_trip import round_trips
from tui_gcs.planner.seeds import seeds
from tui_gcs.planner.smoothing import Draft, Effort, Motion, draft_of, smooth
from tui_gcs.planner.tour import PATH_STEP_M, Evaluation, Tour, evaluate, timed

Floats = NDArray[np.floating[Any]]

CELL_M = 2.5
COARSE_M = 5.0
MOST_CELLS = 6000
"""Larger zones are judged on larger cells."""
LOOP_M = 4.0
"""Radius of the loop over a zone that one footprint about covers."""
FULL_SEARCH_CELLS = 3500
"""Zones with more cells are searched less, so that configuring takes about a second all the same."""
ROUND_TRIPS = 30
FIRST_TRY = Effort(pull=0.05, limits=1.0, iterations=18)
FINALISTS = 7
BEND = (Effort(0.1, 2.0, 30), Effort(2.0, 5.0, 40))
WINNERS = 3
KICKS = 15
"""Random local changes tried on the best draft."""
KICK = Effort(2.0, 5.0, 12)
KICK_M = 8.0
KICK_REACH_M = 15.0
FINISH = (Effort(20.0, 10.0, 30), Effort(100.0, 20.0, 30), Effort(500.0, 50.0, 30))
"""On all cells, harder as long as one is missed."""
MISS_M = 0.3
"""A cell missed by less than this is not: the planning footprint is smaller than the real one by more."""
EVENED_M = 0.1
"""So much farther the tour may be, once it is evened."""


@dataclass(frozen=True)
class Design:
    """The chosen tour and what it promises."""

    name: str
    tour: Tour
    margin: Evaluation
    """With the planning footprint: what it covers stays covered while vehicles are that much off their slots."""
    real: Evaluation
    """With the real footprint."""


@dataclass(frozen=True)
class _Site:
    """What all drafts of one zone are shaped for."""

    zone: shapely.Polygon
    cells: Floats
    coarse: Floats
    motion: Motion
    region: Region
    share: float
    """Of the full search that is affordable: 1 up to `FULL_SEARCH_CELLS`."""

    def times(self, count: int) -> int:
        """How many of `count` tries are affordable."""
        return max(1, round(count * self.share))

    def bent(self, draft: Draft, *efforts: Effort) -> Draft:
        """The draft after descent on coarse cells."""
        for effort in efforts:
            draft = smooth(draft, self.coarse, self.motion, self.region, effort)
        return draft

    def finished(self, draft: Draft) -> Draft:
        """The draft after descent on all cells, until none is missed."""
        for effort in FINISH:
            draft = smooth(draft, self.cells, self.motion, self.region, effort)
            if nearest(draft.path_m(), self.cells)[0].max() <= self.motion.radius_m + MISS_M:
                break
        return draft


def design(
    shape: Shape, region: Region, motion: Motion, footprint_m: float, n: int, rng: np.random.Generator
) -> Design:
    """The best tour found for `n` vehicles over `shape`. The same arguments give the same tour.

    Raises:
        ValueError: no part of the zone can be seen from where vehicles may fly.
    """
    site = _site(shape, region, motion)
    centre = site.cells.mean(axis=0)
    if np.hypot(*(site.cells - centre).T).max() <= motion.radius_m + 0.75 * LOOP_M:
        drafts = [Draft("loop", region.pulled_inside(_loop(centre)), 1.0)]
    else:
        drafts = [site.finished(draft) for draft in _drafts(site, rng)]
    return _best(_judged(draft, site, footprint_m, max(1, n)) for draft in drafts)


def _site(shape: Shape, region: Region, motion: Motion) -> _Site:
    """Cells that cannot be seen from inside the region are left out: no tour could please them."""
    scale = max(1.0, math.sqrt(area_m2(shape) / CELL_M**2 / MOST_CELLS))

    def visible(cells: Floats) -> Floats:
        return np.asarray(cells[shapely.distance(region.polygon, shapely.points(cells)) <= motion.radius_m])

    cells = visible(cell_centres_m(shape, CELL_M * scale))
    if not len(cells):
        raise ValueError("the zone cannot be seen from where vehicles may fly (operating area, margin, no-fly zones)")
    coarse = np.vstack([visible(cell_centres_m(shape, COARSE_M * scale)), _rim(cells, CELL_M * scale)])
    share = min(1.0, (FULL_SEARCH_CELLS / len(cells)) ** 2)
    return _Site(polygon_of(shape), cells, coarse, motion, region, share)


def _drafts(site: _Site, rng: np.random.Generator) -> list[Draft]:
    """The most promising drafts, bent on coarse cells."""
    trips = round_trips(site.zone, site.motion.radius_m, site.times(ROUND_TRIPS), rng)
    guesses = chain(seeds(site.zone, site.motion.radius_m), ((f"round trip {i}", p) for i, p in enumerate(trips)))
    first = (draft_of(name, site.region.pulled_inside(path), site.motion) for name, path in guesses)
    tried = _cheapest((site.bent(draft, FIRST_TRY) for draft in first), site.times(FINALISTS))
    best, *others = _cheapest((site.bent(draft, *BEND) for draft in tried), site.times(WINNERS))
    return [_kicked(best, site, rng), *others]


def _kicked(best: Draft, site: _Site, rng: np.random.Generator) -> Draft:
    """Basin hopping: shove the tour near a random place, descend, keep what got cheaper."""
    for _ in range(site.times(KICKS)):
        place = best.controls[rng.integers(len(best.controls))] + rng.normal(0.0, KICK_M, 2)
        near = np.exp(-((best.controls - place) ** 2).sum(axis=1) / (2.0 * KICK_REACH_M**2))
        shoved = best.controls + near[:, None] * rng.normal(0.0, KICK_M, 2)
        tried = site.bent(replace(best, controls=shoved), KICK)
        best = min(best, tried, key=lambda draft: draft.cost)
    return best


def _cheapest(drafts: Iterable[Draft], count: int) -> list[Draft]:
    return sorted(drafts, key=lambda draft: draft.cost)[:count]


def _judged(draft: Draft, site: _Site, footprint_m: float, n: int) -> Design:
    cells, motion, region = site.cells, site.motion, site.region
    path = region.closed_inside(draft.path_m(), PATH_STEP_M / 4.0)
    tour = timed(path, motion.speed_m_s, motion.accel_m_s2, _stopping_cap(path, motion, region))
    margin = evaluate(tour, cells, motion.radius_m + MISS_M + EVENED_M, n)
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
    return centre + 1.1 * LOOP_M * np.stack([np.cos(angles), np.sin(angles)], axis=1)
