"""What could be met at all in the waves of `guardian`, beside a planner's figure: where the rest is lost.

Two ceilings, neither of which any planner can pass:

* *all known*: every arrival is known from the start, turns take no time. Exact over all orders and partitions.
* *from sight on*: where the planner's vehicles are when an intruder is first in sight of one, somebody could still meet
  it if he had nothing else to do and turned at once. The rest is lost by where vehicles were, whoever is sent then.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.bench import guardian as model
from tui_gcs.planner.api import Planner
from tui_gcs.planner.guardian.intercept import first_contact_s

Floats = NDArray[np.floating[Any]]

SPEED_M_S = 8.0
NEVER_S = 1e6


@dataclass
class Ceilings:
    """In percent of all intruders."""

    met: float
    """By the planner."""
    doubt: float
    """Half the 95 % interval of that."""
    from_sight: float
    all_known: float


def ceilings(planner: Planner, n: int, k: int, episodes: int, seed: int = 0) -> Ceilings:
    """Of the same waves as `guardian.waves` flies."""
    rng, blank = np.random.default_rng((seed, n, k)), planner.snapshot()
    shares = []
    for _ in range(episodes):
        planner.restore(blank)
        one = _Sighted(planner, n, k, rng)
        known = one.most_met()
        one.fly()
        shares.append((one.met.mean(), one.could.mean(), known / k))
    each = 100.0 * np.array(shares)
    met, could, all_known = each.mean(axis=0).tolist()
    return Ceilings(met, 1.96 * float(each[:, 0].std()) / math.sqrt(episodes), could, all_known)


class _Sighted(model.Episode):
    """An episode that notes who could be met when he came in sight."""

    def __init__(self, planner: Planner, n: int, k: int, rng: np.random.Generator) -> None:
        super().__init__(planner, n, k, rng)
        self.could = np.zeros(k, dtype=bool)

    def judge(self, t_s: float) -> None:
        """As every episode, and note it."""
        before = self.seen.copy()
        super().judge(t_s)
        radius, places, velocities = self.targets(t_s)
        for j in np.flatnonzero(self.seen & ~before):
            after_s = first_contact_s(places[j] - self.xy, velocities[j], SPEED_M_S, model.MET_M)
            self.could[j] = self.met[j] or bool((after_s <= (radius[j] - model.ZONE_M) / model.INTRUDER_M_S).any())

    def most_met(self) -> int:
        """How many could be met if all were known from now on.

        `times[i, mask, last]`: the earliest at which vehicle i has met all of `mask`, `last` at the end. Who has met
        one may be anywhere within `MET_M` of it: so the next is met within twice that, from where the last one is.
        Intruders are slower, so whoever meets one later is never better off than who met it early and went along.
        """
        k = len(self.met)
        radius, places, velocities = self.targets(model.BEGIN_S)
        left_s = (radius - model.ZONE_M) / model.INTRUDER_M_S
        times = np.full((len(self.xy), 2**k, k), np.inf)
        masks, rows = np.arange(2**k), np.arange(k)
        first_s = first_contact_s(places - self.xy[:, None], velocities, SPEED_M_S, model.MET_M)
        times[:, 2**rows, rows] = np.where(first_s <= left_s, first_s, np.inf)
        sizes = (masks[:, None] >> rows & 1).sum(axis=1)
        for size in range(1, k):
            for mask in masks[sizes == size]:
                last = np.flatnonzero(mask >> rows & 1)
                after = np.flatnonzero(~(mask >> rows) & 1)
                at_s = times[:, mask, last]
                if not np.isfinite(at_s).any():
                    continue
                at_s = np.where(np.isfinite(at_s), at_s, NEVER_S)[..., None]
                here = places[last, None] + velocities[last, None] * at_s[..., None]
                there = places[after] + velocities[after] * at_s[..., None]
                then_s = at_s + first_contact_s(there - here, velocities[after], SPEED_M_S, 2.0 * model.MET_M)
                then_s = np.where(then_s <= left_s[after], then_s, np.inf).min(axis=1)
                times[:, mask | 2**after, after] = np.minimum(times[:, mask | 2**after, after], then_s)
        together = np.zeros(1, dtype=np.int64)
        for reached in np.isfinite(times).any(axis=2):
            alone = np.append(masks[reached], 0)
            together = np.unique(together[:, None] | alone)
        return int(sizes[together].max())
