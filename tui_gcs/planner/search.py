"""Searches for the tour of a zone: many first guesses, each bent by descent; the best are kept and changed at random.

Topology (which lanes in which order) matters more than descent (planning.md C1). So half of the search is new guesses,
and half changes of what is good already: shoves, lanes joined the other way round, more or fewer control points.

A search is a pure function of its seed and of how many units of work it did: work u draws its random numbers from
(seed, u), so that a search can be stored between any two of them.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.round_trip import round_trip
from tui_gcs.planner.seeds import seeds
from tui_gcs.planner.site import Design, Site
from tui_gcs.planner.smoothing import Draft, Effort

Floats = NDArray[np.floating[Any]]

LOOP_M = 4.0
"""Radius of the loop over a zone that one footprint about covers."""
FULL_SEARCH_CELLS = 3500
"""Zones with more cells are searched less, so that configuring takes about a second all the same."""
ROUND_TRIPS = 48
TRY = (Effort(0.05, 1.0, 12), Effort(1.0, 3.0, 10))
FIRST_BEND = (Effort(2.0, 5.0, 24), Effort(20.0, 10.0, 8))
BEND = (Effort(20.0, 10.0, 16), Effort(100.0, 20.0, 16))
CHANGE = (Effort(100.0, 20.0, 24),)
HALF_BENT, BENT = 12, 5
"""Tries that are bent a little, and to the end: what looks short at first often misses cells for good."""
WINNERS = 3
"""Bent drafts that are finished and judged at first."""
POOL = 5
"""Bent drafts that are kept and changed."""
NEW_SHARE = 0.4
"""Of the search: new guesses."""
SHOVE_SHARE, TURN_SHARE = 0.6, 0.25
"""Of changes: shoves, and stretches turned round; the others change the number of control points."""
KICK_M, KICK_REACH_M = 8.0, 15.0
NEIGHBOUR_M = 45.0
"""Lanes so close may be joined the other way round."""
PROMISING = 1.02
"""A try that costs up to so much more than the last one that was bent at first is bent, too."""
WORTH_JUDGING = 1.04
"""A bent draft that costs at most so much more than the best one is finished."""
WORTH_S = 0.05
"""A change must gain so much (of the tour's duration) to count."""


@dataclass
class Search:
    """The state of a search that `begun` began; it must `work` on the same site. `pool` is sorted by cost."""

    seed: int
    n: int
    """Vehicles that tours are judged for."""
    pool: list[Draft] = field(default_factory=list)
    bar: float = math.inf
    """What a try may cost to be bent a little …"""
    half_bar: float = math.inf
    """… and then to the end."""
    units: int = 0
    """Done so far."""
    waiting: list[Draft] = field(default_factory=list)
    """Good enough to be finished and judged: what looks a little longer may be shorter once it misses no cell."""
    best: Design | None = None

    def work(self, site: Site) -> None:
        """One unit: a new guess, or a change of a draft of the pool, or one of those that wait is judged."""
        self.units += 1
        if not self.pool:
            return
        rng = np.random.default_rng([self.seed, self.units])
        if self.waiting:
            self._judge(site, self.waiting.pop(0))
        elif rng.random() < NEW_SHARE:
            for tried in self.new(site, self.units, rng):
                if tried.cost > self.bar:
                    continue
                bent = site.bent(tried, *FIRST_BEND)
                if bent.cost <= self.half_bar:
                    self._admit(site.bent(bent, *BEND))
        else:
            place = int(len(self.pool) * rng.random() * rng.random())
            before = self.pool[place]
            changed = site.bent(_changed(before, rng), *CHANGE)
            if changed.cost < before.cost - WORTH_S:
                del self.pool[place]
                self.waiting = [draft for draft in self.waiting if draft.cost != before.cost]
                self._admit(changed)

    def new(self, site: Site, number: int, rng: np.random.Generator) -> list[Draft]:
        """A new guess, tried; none if chance gives nothing of use."""
        path = round_trip(site.zone, site.motion.radius_m, rng)
        return [] if path is None else [site.bent(site.draft(f"round trip {number}", path), *TRY)]

    def _admit(self, draft: Draft) -> None:
        if any(abs(draft.cost - other.cost) <= WORTH_S for other in self.pool):
            return
        self.pool = sorted([*self.pool, draft], key=_cost)[:POOL]
        if draft.cost <= WORTH_JUDGING * self.pool[0].cost:
            self.waiting = sorted([*self.waiting, draft], key=_cost)[:POOL]

    def _judge(self, site: Site, draft: Draft) -> None:
        design = site.judged(site.finished(draft), self.n)
        if self.best is None or design.rank < self.best.rank:
            self.best = design


def begun(site: Site, seed: int, n: int) -> Search:
    """The instant plan for `n` vehicles is `best` of what is returned. Takes about a second."""
    search = Search(seed, n)
    centre = site.cells.mean(axis=0)
    if np.hypot(*(site.cells - centre).T).max() <= site.motion.radius_m + 0.75 * LOOP_M:
        search.best = site.judged(Draft("loop", site.region.pulled_inside(_loop(centre)), 1.0), n)
        return search
    rng, share = np.random.default_rng([seed, 0]), min(1.0, (FULL_SEARCH_CELLS / len(site.cells)) ** 2)
    tries = [site.bent(site.draft(name, path), *TRY) for name, path in seeds(site.zone, site.motion.radius_m)]
    for i in range(max(4, round(ROUND_TRIPS * share))):
        tries.extend(search.new(site, i, rng))
    tries.sort(key=_cost)
    half, most = (max(WINNERS, round(count * share)) for count in (HALF_BENT, BENT))
    search.bar = tries[min(half, len(tries)) - 1].cost * PROMISING
    bent = sorted((site.bent(draft, *FIRST_BEND) for draft in tries[:half]), key=_cost)[:most]
    search.half_bar = bent[-1].cost * PROMISING
    search.pool = sorted((site.bent(draft, *BEND) for draft in bent), key=_cost)[:POOL]
    winners = max(1, round(WINNERS * share))
    for draft in search.pool[:winners]:
        search._judge(site, draft)
    search.waiting = search.pool[winners:]
    return search


def _cost(draft: Draft) -> float:
    return draft.cost


def _changed(draft: Draft, rng: np.random.Generator) -> Draft:
    kind = rng.random()
    if kind < SHOVE_SHARE:
        return _shoved(draft, rng)
    return _turned(draft, rng) if kind < SHOVE_SHARE + TURN_SHARE else draft.respaced(rng.uniform(0.85, 1.15))


def _shoved(draft: Draft, rng: np.random.Generator) -> Draft:
    """The draft pushed to a side near a random place."""
    controls = draft.controls
    place = controls[rng.integers(len(controls))] + rng.normal(0.0, KICK_M, 2)
    near = np.exp(-((controls - place) ** 2).sum(axis=1) / (2.0 * KICK_REACH_M**2))
    return replace(draft, controls=controls + near[:, None] * rng.normal(0.0, KICK_M, 2))


def _turned(draft: Draft, rng: np.random.Generator) -> Draft:
    """The stretch between two places that are close to each other flown the other way round (2-opt)."""
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


def _loop(centre: Floats) -> Floats:
    """Control points of a small circle; the spline of eight of them lies a tenth inside."""
    angles = np.arange(8) * (math.pi / 4.0)
    return np.asarray(centre + 1.1 * LOOP_M * np.stack([np.cos(angles), np.sin(angles)], axis=1))
