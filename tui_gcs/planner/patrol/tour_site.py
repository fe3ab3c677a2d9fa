"""A zone as tours are designed for it: its cells, the flyable region, the limits; and what finished tours achieve."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from tui_gcs.planner.api import Shape, ZoneCells, area_m2, cell_centres_m, polygon_of
from tui_gcs.planner.lazy_scipy import nearest
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.tour import PATH_STEP_M, Tour, TourEvaluation, evaluate, evaluate_large, timed
from tui_gcs.planner.patrol.tour_smoothing import DescentEffort, TourDraft, TourLimits, draft_of, flown_as, smooth

Floats = NDArray[np.floating[Any]]

COARSER = 2.0
"""The first descent looks at cells that are so many times as large, and at the rim."""
LARGE_CELLS = 6400
"""A zone of more cells (4 ha) is large: its tour is built of lanes, and only these are bent."""
MAX_FOOTPRINTS = 5000
"""Footprints that fill a zone. The worker's memory grows with them: 6100 needed 410 MB, 24,000 820 MB."""
FINISH, FINISH_ROUNDS = DescentEffort(10.0, 5.0, 24), 6
"""Descent and number of finishing rounds."""
WORTH_A_ROUND = 0.003
"""Share by which a round must shorten the tour to be followed by another one."""
FINER = 2.0
"""Factor of control points in a finished draft: corners get tighter, lanes straighter."""
MISS_M = 0.1
"""A cell missed by less counts as seen: the planning footprint is smaller than the real one by more."""
MISSED_S_PER_M = 50.0
"""Penalty for a draft that still misses a cell: another draft will do."""
LOOP_M = 4.0
"""Radius of the loop over what is seen from one place."""
DETOUR_STEP_M = 5.0
"""Spacing of points of a way round an obstacle."""
SLOWER_ROUNDS, SLOWER = 8, 0.95
"""Times that a tour is timed again, slower where the guard would not let it pass; and slower than needed by the second:
without that the last three in a hundred places took more than twelve rounds."""
SLOWER_AROUND_M = 1.0
"""A place that is flown slower is slower this far around it."""
FAR_LONGER = 3.0
"""A tour that takes so many times as long as the best is given up: squeezed between walls it may take days."""
STANDING_M = 1.0
"""A shorter way round is none: its vehicles stand."""
CRAWLING_M_S = 0.5
"""A tour with a lower mean speed crawls."""
MIN_SHARE = 0.2
"""Smallest factor by which a place is flown slower at once."""
EVENED_M = 0.1
"""Distance by which averaging may move a tour away from a cell."""


class TourDesign:
    """A tour and what it achieves for `n` vehicles. Its draft is enough to compute it again."""

    def __init__(self, draft: TourDraft, tour: Tour, margin: float, real: TourEvaluation, n: int) -> None:
        """`margin` is the share of cells that stay covered while vehicles are off by the planning reserve.

        `real` is the evaluation with the real footprint.
        """
        self.draft, self.tour, self.margin, self.real, self.n = draft, tour, margin, real, n

    @property
    def name(self) -> str:
        """Name of the first tour that it was developed from."""
        return self.draft.name

    @property
    def crawls(self) -> bool:
        """Whether the tour stands, or is squeezed between walls so that hardly a vehicle finds a way onto it."""
        return self.tour.length_m < CRAWLING_M_S * self.tour.period_s

    @property
    def rank(self) -> tuple[float, bool, float, float, float]:
        """Sort key, smallest is best: coverage with the real footprint, then with margin, then worst idleness.

        A tour that crawls comes after all others that see as much.
        """
        return -self.real.coverage, self.crawls, -self.margin, self.real.worst_s, self.tour.period_s


@dataclass(frozen=True)
class TourFinishing:
    """A draft that is being changed until it misses no cell and is as short as possible. Field names are stored."""

    going: TourDraft
    """What the next round begins with."""
    less_m: Floats
    """Distance by which the footprint is reduced for each cell."""
    best: TourDraft
    """The best of all rounds. Its cost is its exact duration, infinite before the first round."""
    left: int = FINISH_ROUNDS
    """Rounds that may follow."""
    instead_of: float = math.inf
    """Cost of the draft that it is a mutation of."""
    enough: float = math.inf
    """Highest cost for which more rounds are worth it."""

    @property
    def done(self) -> bool:
        """Whether no further round helps: no cell is missed and the tour hardly gets shorter."""
        return self.left == 0


@dataclass(frozen=True)
class TourSite:
    """What all drafts of one zone are designed for."""

    zone: shapely.Polygon
    """The outline of `ground`."""
    ground: BaseGeometry
    """Where vehicles fly to see the zone: the zone itself where they may fly over it; with holes, in several parts."""
    seen: ZoneCells
    """The cells that count, on their lattice."""
    cells: Floats
    """(k, 2) their centres."""
    coarse: Floats
    motion: TourLimits
    region: FlyableRegion
    footprint_m: float
    """The real footprint radius; `motion.radius_m` is the one to plan with."""

    @property
    def is_large(self) -> bool:
        """Whether the zone has too many cells for a search."""
        return len(self.cells) > LARGE_CELLS

    def draft(self, name: str, path_m: Floats) -> TourDraft:
        """Return a draft from a rough closed polyline; where it crosses an obstacle, it goes round it."""
        path_m = self.region.closed_inside(self.region.pulled_inside(path_m), DETOUR_STEP_M)
        if len(path_m) < 3:  # one short lane: all of it is seen from one place
            around = np.arange(8) * (math.pi / 4.0)
            path_m = self.cells.mean(axis=0) + LOOP_M * np.stack([np.cos(around), np.sin(around)], axis=1)
            path_m = self.region.pulled_inside(path_m)
        return draft_of(name, path_m, self.motion)

    def bent(self, draft: TourDraft, *efforts: DescentEffort) -> TourDraft:
        """Return the draft after descent on coarse cells."""
        for effort in efforts:
            draft = smooth(draft, self.coarse, self.motion, self.region, effort)
        return draft

    def begun(self, draft: TourDraft, instead_of: float = math.inf, enough: float = math.inf) -> TourFinishing:
        """Return the state before the first finishing round."""
        nothing = replace(draft, cost=math.inf)
        return TourFinishing(draft, np.zeros(len(self.cells)), nothing, instead_of=instead_of, enough=enough)

    def tightened(self, before: TourFinishing) -> TourFinishing:
        """Return the state after one finishing round: the footprint of each missed cell is reduced by what was missed.

        This augmented Lagrangian finds shorter tours than ever harder penalties do.
        """
        draft = smooth(before.going, self.cells, self.motion, self.region, FINISH, before.less_m)
        over_m = nearest(draft.path_m(), self.cells)[0] - self.motion.radius_m
        missed_m = float(over_m.max()) - MISS_M
        at_most_s = FAR_LONGER * min(before.enough, before.best.cost)
        tour = self.timed(draft, at_most_s)
        of_use = tour.period_s <= at_most_s and tour.length_m > STANDING_M
        cost = tour.period_s + MISSED_S_PER_M * max(missed_m, 0.0) if of_use else math.inf
        worth_more = missed_m > 0.0 or (cost < (1.0 - WORTH_A_ROUND) * before.best.cost and cost <= before.enough)
        return replace(
            before,
            going=flown_as(draft, tour),
            less_m=np.maximum(before.less_m + over_m, 0.0),
            best=replace(draft, cost=cost) if cost < before.best.cost else before.best,
            left=before.left - 1 if worth_more else 0,
        )

    def timed(self, draft: TourDraft, at_most_s: float = math.inf) -> Tour:
        """Return the draft as a tour with its exact time law.

        One that takes longer than `at_most_s` is not made to pass the guard: it takes longer still, and is of no use.
        """
        motion = self.motion
        path = self.region.closed_inside(draft.path_m(), PATH_STEP_M / 4.0)
        cap_m_s = _stopping_cap(path, motion, self.region)
        tour = timed(path, motion.speed_m_s, motion.accel_m_s2, cap_m_s)
        for _ in range(SLOWER_ROUNDS):
            if tour.period_s > at_most_s:
                break
            sent_m_s2 = tour.sent_accels_m_s2(motion.sent_step_s)
            share = self.region.sendable_share(tour.xy_m, tour.velocity_m_s, sent_m_s2, motion.accel_m_s2)
            if (share == 1.0).all():
                break
            cap_m_s = np.minimum(cap_m_s, _slower_cap(path, tour, share))
            tour = timed(path, motion.speed_m_s, motion.accel_m_s2, cap_m_s)
        return tour

    def judged(self, draft: TourDraft, n: int) -> TourDesign:
        """Return the draft as a tour with what `n` vehicles achieve on it."""
        return self.evaluated(draft, self.timed(draft), n)

    def evaluated(self, draft: TourDraft, tour: Tour, n: int) -> TourDesign:
        """Return the draft, which was timed as this tour, with what `n` vehicles achieve on it."""
        # `MISS_M` and `EVENED_M` are what finishing and averaging may leave.
        margin = nearest(tour.xy_m, self.cells)[0] <= self.motion.radius_m + MISS_M + EVENED_M
        if self.is_large:
            real = evaluate_large(tour, self.seen, self.footprint_m, n)
        else:
            real = evaluate(tour, self.cells, self.footprint_m, n)
        return TourDesign(draft, tour, float(margin.mean()), real, n)


def site_of(shape: Shape, region: FlyableRegion, motion: TourLimits, footprint_m: float) -> TourSite:
    """Return the site of a zone. Cells that cannot be seen from inside the region are left out.

    Raises:
        ValueError: no part of the zone can be seen from where vehicles may fly, or its lanes would be too many.
    """
    if area_m2(shape) > MAX_FOOTPRINTS * math.pi * footprint_m**2:
        zone = f"a zone of {area_m2(shape):.0f} m2"
        raise ValueError(f"a footprint of {footprint_m:g} m radius is too fine to plan {zone}")
    seen = region.cells_of(shape, footprint_m)
    cells = seen.centres_m()
    if not len(cells):
        raise ValueError("the zone cannot be seen from where vehicles may fly (operating area, margin, no-fly zones)")
    coarse = cell_centres_m(shape, COARSER * seen.cell_m)
    coarse = coarse[shapely.dwithin(region.polygon, shapely.points(coarse), motion.radius_m)]
    coarse = np.vstack([coarse, _rim(cells, seen.cell_m)])
    zone = polygon_of(shape)
    if region.polygon.covers(zone):
        return TourSite(zone, zone, seen, cells, coarse, motion, region, footprint_m)
    ground = _ground(zone, cells, region, motion.radius_m)
    return TourSite(_outline(ground), ground, seen, cells, coarse, motion, region, footprint_m)


def _ground(zone: shapely.Polygon, cells: Floats, region: FlyableRegion, radius_m: float) -> BaseGeometry:
    """Return where vehicles fly to see these cells of a zone that they cannot fly over everywhere."""
    over = zone.intersection(region.polygon)
    near = shapely.dwithin(over, shapely.points(cells), radius_m)
    beside = cells[~near] if not over.is_empty else cells
    if len(beside):
        around = shapely.union_all(shapely.buffer(shapely.points(beside), radius_m / 2.0, quad_segs=2))
        over = over.union(region.polygon.intersection(around))
    if over.is_empty:
        over = region.polygon.intersection(zone.buffer(radius_m))
    return over


def _outline(ground: BaseGeometry) -> shapely.Polygon:
    """Return the ground without holes, in one piece, for patterns that know of neither."""
    parts = [part for part in getattr(ground, "geoms", [ground]) if isinstance(part, shapely.Polygon)]
    if len(parts) > 1:
        return shapely.Polygon(shapely.MultiPolygon(parts).convex_hull)
    return shapely.Polygon(parts[0].exterior)


def _stopping_cap(path: Floats, motion: TourLimits, region: FlyableRegion) -> Floats:
    """Return the speed at each point from which a vehicle that brakes straight on stops inside the region."""
    ahead = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    stop_m = float(region.stopping_m(np.array(motion.speed_m_s), motion.accel_m_s2)) + 1.0
    room = region.room_ahead_m(path, ahead, stop_m)
    return region.stopping_speed_m_s(np.maximum(room - 0.5, 0.2), motion.accel_m_s2)


def _slower_cap(path: Floats, tour: Tour, share: Floats) -> Floats:
    """Return speed limits (m,) along the path (m, 2): `share` (k,) of the tour's own where that is less than 1."""
    slower = share < 1.0
    wanted_m_s = SLOWER * np.maximum(share, MIN_SHARE)[slower] * np.hypot(*tour.velocity_m_s[slower].T)
    away_m, which = nearest(tour.xy_m[slower], path)
    return np.where(away_m <= SLOWER_AROUND_M, wanted_m_s[which], np.inf)


def _rim(cells: Floats, cell_m: float) -> Floats:
    """Return cells with fewer than four neighbours."""
    place = np.round((cells - cells.min(axis=0)) / cell_m).astype(int) + 1
    grid = np.zeros(place.max(axis=0) + 2, dtype=bool)
    x, y = place.T
    grid[x, y] = True
    return np.asarray(cells[~(grid[x - 1, y] & grid[x + 1, y] & grid[x, y - 1] & grid[x, y + 1])])
