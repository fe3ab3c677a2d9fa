"""Searches for the tour of a zone: tries many first tours, finishes promising ones, then mutates the best.

Topology (which lanes in which order) matters more than descent (docs/planning.md C1). So a part of the search is new
tours; the rest are mutations of good ones: shoves, lanes joined the other way round, more or fewer control points.
Finished tours are compared by their exact duration, because their descent cost is a poor measure of it (tours of equal
costs differed by 15 %).

A search is a pure function of its seed and of the units of work done: unit u draws its random numbers from (seed, u).
So it can be stored between any two units. A unit takes about 8 ms.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.api import Shape
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.lane_tours import DIRECTIONS, best_lane_tours
from tui_gcs.planner.patrol.tour import resampled
from tui_gcs.planner.patrol.tour_construction import lattice_tour
from tui_gcs.planner.patrol.tour_detours import with_detours
from tui_gcs.planner.patrol.tour_seeds import seeds
from tui_gcs.planner.patrol.tour_site import (
    CRAWLING_M_S,
    FAR_LONGER,
    FINER,
    LOOP_M,
    TourDesign,
    TourFinishing,
    TourSite,
    site_of,
)
from tui_gcs.planner.patrol.tour_smoothing import DescentEffort, TourDraft, TourLimits, draft_of

Floats = NDArray[np.floating[Any]]

FULL_SEARCH_CELLS = 2600
"""Zones with more cells get fewer tries, so that configuring still takes about a second."""
OBSTACLE_SHARE = 0.5
"""The same where obstacles make every try more expensive."""
ROUND_TRIPS = 40
"""Lattice tours among the first tries."""
TRY = (DescentEffort(0.05, 1.0, 12), DescentEffort(1.0, 3.0, 10))
"""Descents of a try and of a mutation."""
CHANGE = DescentEffort(1.0, 3.0, 10)
FINISHED, MIN_FINISHED = 8, 2
"""Tries that are finished at once, at most and at least."""
MAX_FINISHING = 80_000
"""Finishing rounds times cells after which no further try is begun. A round of 3000 cells takes about 20 ms."""
LANE_TRIES = 2
"""Lane tours among the first tries."""
WATCHED_SHARE = 0.95
"""Footprints are large if the worst idleness is less than this share of the time between two vehicles at one place."""
SHARP_STEP_M = 3.0
"""Spacing of control points of lanes that are not bent."""
MIN_CORNERS = 3
"""With fewer control points they are no closed way."""
ROUNDED = 2.0
"""Their control points are so much denser where their corners are rounded as a vehicle flies them."""
LARGE_LANE_TRIES, MAX_BENT_CELLS = 3, 40_000
"""Lane tours of a large zone; up to so many cells (25 ha) patterns are tried, too, and all are bent."""
LOOP_STEP_M, LOOP_STEPS = 2.0, 50
"""Spacing of the places that are tried for a loop over a small zone whose middle is closed; wider where there would be
more than so many on each side of it."""
LOOP_AT_MOST_S = 2.0 * math.pi * 1.5 * LOOP_M / CRAWLING_M_S
"""A loop that takes longer is squeezed between walls and given up: to slow it down for the guard took 2.3 s of CPU."""
ROOM_M = 1.5 * LOOP_M
"""What must be open around the middle of a loop: it is flown at 3 m/s, and a vehicle must be able to brake."""
DETOURS_M = (0.5, 1.0, 2.0)
"""Detours of a tour that leaves something out look so much farther than they must, until all is seen."""
MIN_LARGE_ROUNDS, MAX_LARGE_FINISHING = 2, 200_000
"""Finishing rounds of a large zone: at least, and times cells at most."""
POOL = 5
"""Finished drafts that are kept and mutated."""
NEW_SHARE = 0.4
"""Share of new tours in the search."""
SHOVE_SHARE, TURN_SHARE = 0.6, 0.25
"""Shares of shoves and reversed stretches among mutations; the others change the number of control points."""
RESPACED = (0.85, 1.15)
"""Range of the factor for the number of control points."""
KICK_M, KICK_REACH_M = 8.0, 15.0
"""Standard deviation and reach of a shove."""
NEIGHBOUR_M = 45.0
"""Lanes this close may be joined the other way round."""
PROMISING = 1.02
"""A try is finished, too, if it costs at most this factor of the last one finished at once."""
WORTH_JUDGING = 1.01
"""A tour longer than the best by more than this factor is not evaluated."""
HOPEFUL = 1.01
"""Work on a draft without missed cells stops if it is longer than the best by more than this factor."""
WORTH_S = 0.05
"""Smallest gain of a tour's duration that counts."""


@dataclass
class TourSearch:
    """The state of a search that `begin_search` began, always on the same site. Field names are stored in snapshots."""

    seed: int
    n: int
    """Vehicles that tours are evaluated for."""
    pool: list[TourDraft] = field(default_factory=list)
    """Finished drafts, sorted by cost, which is their duration."""
    bar: float = math.inf
    """Highest cost of a try that is finished."""
    units: int = 0
    """How many units of work the search has done."""
    finishing: TourFinishing | None = None
    """The draft that is being finished."""
    best: TourDesign | None = None

    @property
    def sees_all(self) -> bool:
        """Whether the best tour leaves nothing out."""
        return self.best is not None and self.best.real.coverage == 1.0

    def work(self, site: TourSite) -> None:
        """Do one unit: a new tour, or a mutation of a draft in the pool, or a round of finishing one of these."""
        self.units += 1
        if not self.pool:
            return
        if self.finishing is not None:
            self.finishing = site.tightened(self.finishing)
            if self.finishing.done:
                self._admit(site, self.finishing.best, self.finishing.instead_of)
                self.finishing = None
            return
        rng = np.random.default_rng([self.seed, self.units])
        if rng.random() < NEW_SHARE:
            for tried in self.new(site, self.units, rng):
                if tried.cost <= self.bar:
                    self.finishing = site.begun(tried.respaced(FINER), enough=self._hopeful())
        else:
            # The product of two random numbers prefers the front of the pool, the best drafts.
            before = self.pool[int(len(self.pool) * rng.random() * rng.random())]
            changed = site.bent(_mutated(before, rng), CHANGE)
            self.finishing = site.begun(changed, before.cost, self._hopeful())

    def new(self, site: TourSite, number: int, rng: np.random.Generator) -> list[TourDraft]:
        """Return a new tour after descent; none if the random lattice is of no use."""
        path = lattice_tour(site.ground, site.motion.radius_m, rng)
        return [] if path is None else [site.bent(site.draft(f"round trip {number}", path), *TRY)]

    def _hopeful(self) -> float:
        """Return the cost up to which a draft without missed cells is worked on."""
        return HOPEFUL * self.pool[0].cost if self.pool else math.inf

    def _admit(self, site: TourSite, draft: TourDraft, instead_of: float = math.inf) -> None:
        """Put a draft into the pool if it is good enough and no other is as long; a mutation replaces its parent."""
        if draft.cost >= instead_of - WORTH_S:
            return
        others = [other for other in self.pool if other.cost != instead_of]
        if any(abs(draft.cost - other.cost) <= WORTH_S for other in others):
            return
        self.pool = sorted([*others, draft], key=_cost)[:POOL]
        if draft.cost <= WORTH_JUDGING * self.pool[0].cost:
            self.offer(site.judged(draft, self.n))

    def try_out(self, site: TourSite, draft: TourDraft) -> None:
        """Keep the draft's tour as `best` if it is better than that; one that takes far longer is not looked at."""
        at_most_s = FAR_LONGER * self.best.tour.period_s if self.best is not None and self.sees_all else math.inf
        tour = site.timed(draft, at_most_s)
        if tour.period_s <= at_most_s:
            self.offer(site.evaluated(draft, tour, self.n))

    def offer(self, design: TourDesign) -> None:
        """Keep the design as `best` if it is better than that."""
        if self.best is None or design.rank < self.best.rank:
            self.best = design


def begin_search(site: TourSite, seed: int, n: int) -> TourSearch:
    """Return a search whose `best` is a tour for `n` vehicles at once. This takes about a second."""
    search = TourSearch(seed, n)
    centre = site.cells.mean(axis=0)
    # A zone that one footprint nearly covers needs no lanes: vehicles circle over its middle.
    if np.hypot(*(site.cells - centre).T).max() <= site.motion.radius_m + 0.75 * LOOP_M:
        loop = _loop(site, _middle_of_loop(site, centre))
        tour = site.timed(loop, LOOP_AT_MOST_S)
        if tour.period_s <= LOOP_AT_MOST_S:
            search.best = site.evaluated(loop, tour, n)
            if search.sees_all and not search.best.crawls:
                return search
            # Where the middle is closed the loop lies beside it, and may miss a corner. A detour completes it, but what
            # is seen on a detour only waits for the next vehicle: lanes may have all in sight all the time.
            _add_detours(search, site, [])
    return _searched(search, site)


def _searched(search: TourSearch, site: TourSite) -> TourSearch:
    """Complete a search: tours of many kinds are tried, and the best are finished."""
    if site.is_large:
        return _begin_large(search, site)
    rng, share = np.random.default_rng([search.seed, 0]), min(1.0, (FULL_SEARCH_CELLS / len(site.cells)) ** 2)
    share *= 1.0 if site.ground is site.zone else OBSTACLE_SHARE
    tries = [site.bent(site.draft(name, path), *TRY) for name, path in seeds(site.zone, site.motion.radius_m)]
    for i in range(max(4, round(ROUND_TRIPS * share))):
        tries.extend(search.new(site, i, rng))
    tries.sort(key=_cost)
    most = min(len(tries), max(MIN_FINISHED, round(FINISHED * share)))
    search.bar = tries[most - 1].cost * PROMISING
    left = MAX_FINISHING // len(site.cells)
    lanes = best_lane_tours(site.cells, site.motion.radius_m, LANE_TRIES)
    last = [site.bent(site.draft(f"lanes {i}", path), *TRY) for i, path in enumerate(lanes)]
    for draft in [*tries[:most], *last]:
        if left <= 0:
            break
        finishing = site.begun(draft.respaced(FINER), enough=search._hopeful())
        while not finishing.done:
            finishing, left = site.tightened(finishing), left - 1
        search._admit(site, finishing.best)
    if search.best is None or not search.sees_all:
        _add_unbent(search, site, lanes)
        _add_detours(search, site, lanes)
    elif search.best.real.worst_s < WATCHED_SHARE * search.best.tour.period_s / search.n:
        _add_straight_lanes(search, site)
    return search


def _add_straight_lanes(search: TourSearch, site: TourSite) -> None:
    """Try lanes that are not bent in all directions, with rounded and with sharp corners.

    Where footprints are large a place is in sight for a good part of the time between two vehicles, and for longer on
    some longer tours: then the shortest tour is not best, and all that was bent before was bent to be short.
    """
    for i, path in enumerate(best_lane_tours(site.cells, site.motion.radius_m, DIRECTIONS)):
        path = _unbent(site, path)
        if len(path) < MIN_CORNERS:
            continue
        rounded = draft_of(f"rounded lanes {i}", path, site.motion).respaced(ROUNDED)
        for draft in (rounded, TourDraft(f"sharp lanes {i}", path, 1.0)):
            search.try_out(site, draft)


def _unbent(site: TourSite, path: Floats) -> Floats:
    """Return control points of the path with its sharp corners, led round what is closed."""
    return site.region.closed_inside(site.region.pulled_inside(resampled(path, SHARP_STEP_M)), SHARP_STEP_M)


def _add_unbent(search: TourSearch, site: TourSite, lanes: list[Floats]) -> None:
    """Try lanes that were not bent, finished and as they are: bending can leave a pocket behind walls out for good."""
    for i, path in enumerate(lanes):
        draft = site.draft(f"lanes {i}", path).respaced(FINER)
        finishing = site.begun(draft)
        while not finishing.done:
            finishing = site.tightened(finishing)
        search._admit(site, finishing.best)
        for each in (finishing.best, draft):
            search.try_out(site, each)


def _add_detours(search: TourSearch, site: TourSite, lanes: list[Floats]) -> None:
    """Complete the tour, and simple lanes, if something is left out."""
    if search.sees_all:
        return
    incomplete = [search.best.draft] if search.best is not None else []
    incomplete += [site.draft(f"lanes {i}", path) for i, path in enumerate(lanes)]
    incomplete += [TourDraft(f"sharp lanes {i}", _unbent(site, path), 1.0) for i, path in enumerate(lanes)]
    for farther_m in DETOURS_M:
        for draft in incomplete:
            search.try_out(site, with_detours(site, draft, farther_m))
        if search.sees_all:
            return


def _begin_large(search: TourSearch, site: TourSite) -> TourSearch:
    """Complete a search of a large zone: the shortest of a few tours, finished. There is no pool to search on with."""
    paths = best_lane_tours(site.cells, site.motion.radius_m, LARGE_LANE_TRIES)
    tries = [site.draft(f"lanes {i}", path) for i, path in enumerate(paths)]
    if len(site.cells) <= MAX_BENT_CELLS:
        tries += [site.draft(name, path) for name, path in seeds(site.zone, site.motion.radius_m)]
        tries = sorted((site.bent(draft, *TRY) for draft in tries), key=_cost)
    left = max(MIN_LARGE_ROUNDS, MAX_LARGE_FINISHING // len(site.cells))
    found: list[TourDraft] = []
    for draft in tries:
        finishing = site.begun(draft.respaced(FINER), enough=HOPEFUL * min((f.cost for f in found), default=math.inf))
        while not finishing.done and left > 0:
            finishing, left = site.tightened(finishing), left - 1
        found.append(finishing.best)
        if left <= 0:
            break
    search.best = site.judged(min(found, key=_cost), search.n)
    _add_detours(search, site, paths[:1])
    return search


def design_tour(
    shape: Shape, region: FlyableRegion, motion: TourLimits, footprint_m: float, n: int, rng: np.random.Generator
) -> TourDesign:
    """Return the best tour found in about a second for `n` vehicles over `shape`. It depends on the arguments only.

    Raises:
        ValueError: no part of the zone can be seen from where vehicles may fly.
    """
    found = begin_search(site_of(shape, region, motion, footprint_m), int(rng.integers(2**32)), max(1, n)).best
    if found is None:
        raise ValueError("the zone has no tour")
    return found


def _cost(draft: TourDraft) -> float:
    return draft.cost


def _mutated(draft: TourDraft, rng: np.random.Generator) -> TourDraft:
    kind = rng.random()
    if kind < SHOVE_SHARE:
        return _shoved(draft, rng)
    return _turned(draft, rng) if kind < SHOVE_SHARE + TURN_SHARE else draft.respaced(rng.uniform(*RESPACED))


def _shoved(draft: TourDraft, rng: np.random.Generator) -> TourDraft:
    """Return the draft pushed to a side near a random place."""
    controls = draft.controls
    place = controls[rng.integers(len(controls))] + rng.normal(0.0, KICK_M, 2)
    near = np.exp(-((controls - place) ** 2).sum(axis=1) / (2.0 * KICK_REACH_M**2))
    return replace(draft, controls=controls + near[:, None] * rng.normal(0.0, KICK_M, 2))


def _turned(draft: TourDraft, rng: np.random.Generator) -> TourDraft:
    """Return the draft with a stretch between two close places flown the other way round (2-opt)."""
    controls, count = draft.controls, len(draft.controls)
    i = int(rng.integers(count))
    apart = np.abs(np.arange(count) - i)
    close = np.hypot(*(controls - controls[i]).T) < NEIGHBOUR_M
    others = np.flatnonzero(close & (np.minimum(apart, count - apart) >= 3))
    if not len(others):
        return _shoved(draft, rng)
    first, last = sorted((i, int(others[rng.integers(len(others))])))
    turned = controls.copy()
    turned[first + 1 : last + 1] = controls[first + 1 : last + 1][::-1]
    return replace(draft, controls=turned)


def _middle_of_loop(site: TourSite, centre: Floats) -> Floats:
    """Return the place that vehicles circle to see all of a small zone.

    This is its centre. Where no-fly zones leave no room for a loop there, it is the nearest place with room from which
    all is in sight all the time: squeezed between them a loop is crawled along, and hardly a vehicle finds a way onto
    it.
    """
    spare_m = site.motion.radius_m - LOOP_M
    if spare_m <= 0.0 or site.region.have_room(centre[None], ROOM_M)[0]:
        return centre
    step_m = max(LOOP_STEP_M, spare_m / LOOP_STEPS)
    steps = step_m * np.arange(-math.ceil(spare_m / step_m), math.ceil(spare_m / step_m) + 1)
    places = centre + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    rim = _extremes(site.cells)
    farthest_m = np.hypot(*(places[:, None] - rim).transpose(2, 0, 1)).max(axis=1)
    places = places[farthest_m <= spare_m]
    places = places[site.region.have_room(places, ROOM_M)]
    if not len(places):
        return centre
    return np.asarray(places[int(np.argmin(np.hypot(*(places - centre).T)))])


def _extremes(cells: Floats) -> Floats:
    """Return the cells of which one is the farthest from any place: the corners of their hull."""
    hull = shapely.MultiPoint(cells).convex_hull
    return np.asarray(shapely.get_coordinates(hull))


def _loop(site: TourSite, middle: Floats) -> TourDraft:
    """Return a small circle, as far as it may be flown; a spline of eight points lies a tenth inside."""
    angles = np.arange(8) * (math.pi / 4.0)
    circle = middle + 1.1 * LOOP_M * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return TourDraft("loop", site.region.pulled_inside(circle), 1.0)
