"""Whether vehicles that are foreseen keep apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.course import Samples
from tui_gcs.core.guard_courses import STEP_S
from tui_gcs.core.guard_motion import Flock
from tui_gcs.core.scenario import Limits

GROUND_M = 2.0
"""Below this height above home neither the band nor separation applies."""
SPARE_M, SPARE_UP_M = 0.5, 0.3
"""Kept beyond the limits, for what happens between two samples and for what is foreseen a little wrong."""
SAME = 1e-6
BETTER = 0.3
"""Shares of the limits: less is luck, of when samples are taken."""
FUTURES = 3
"""That are looked at: both go on, both brake a moment later, the other one brakes now."""
AS_KNOWN, GOES, BRAKES = range(3)
"""What the other one does: as is known of it, or as was decided just before."""

Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Meeting:
    """Who comes too close, and when."""

    vehicle: int
    in_s: float


@dataclass(frozen=True)
class _Pairs:
    """p pairs of a vehicle that is judged and another one, sorted by the first."""

    mine: Rows
    """Rows of those who are judged."""
    theirs: Rows
    """Rows of the others."""
    judged: Rows
    """The other's row among those who are judged, if it was judged before; else -1."""
    wide_m: Samples
    """(p, 1) distance to be kept sideways."""

    def some(self, pairs: Rows) -> "_Pairs":
        """These of them."""
        return _Pairs(self.mine[pairs], self.theirs[pairs], self.judged[pairs], self.wide_m[pairs])


def meetings(judged: Flock, others: Flock, passed: Sequence[bool], limits: Limits) -> dict[int, Meeting]:
    """The first vehicle that each of `judged` gets too close to if it goes on, or brakes a moment later, by row.

    They are judged in their order: who is `passed` and meets nobody goes on, all others brake, and those who are judged
    later see that. Whom one gets too close to by braking now, too, does not count if it goes on no nearer: what leads
    apart passes. Who climbs or descends in its own column gives way to nobody, but others keep clear of it.
    """
    pairs = _pairs(judged, others, passed, limits)
    known = np.flatnonzero(pairs.judged >= 0)
    row = pairs.judged[known]
    first = np.full((3, len(pairs.mine)), np.inf)
    first[AS_KNOWN], first[GOES, known], first[BRAKES, known] = np.split(
        _first(
            judged,
            pairs.some(np.concatenate([np.arange(len(pairs.mine)), known, known])),
            np.concatenate([others.goes_m[pairs.theirs], judged.goes_m[row], judged.stops_m[row]]),
            np.concatenate([others.late_m[pairs.theirs], judged.late_m[row], judged.stops_m[row]]),
            others,
            limits,
        ),
        np.cumsum([len(pairs.mine), len(known)]),
    )
    found: dict[int, Meeting] = {}
    soonest: dict[int, float] = {}
    for pair in np.flatnonzero(np.isfinite(first).any(axis=0)).tolist():
        mine, other = int(pairs.mine[pair]), int(pairs.judged[pair])
        does = AS_KNOWN if other < 0 else GOES if passed[other] and other not in found else BRAKES
        when = float(first[does, pair])
        if when < soonest.get(mine, np.inf):
            soonest[mine] = when
            found[mine] = Meeting(int(others.ids[pairs.theirs[pair]]), when // FUTURES * STEP_S)
    return found


def _pairs(judged: Flock, others: Flock, passed: Sequence[bool], limits: Limits) -> _Pairs:
    """Those in the air whose boxes, whatever was decided, come so near that it matters."""
    order = {vehicle: row for row, vehicle in enumerate(judged.ids.tolist())}
    before = np.array([order.get(vehicle, -1) for vehicle in others.ids.tolist()], dtype=np.intp)
    low, high = others.low_m.copy(), others.high_m.copy()
    both = np.flatnonzero(before >= 0)
    low[both] = np.minimum(low[both], judged.low_m[before[both]])
    high[both] = np.maximum(high[both], judged.high_m[before[both]])
    spare = limits.separation_horizontal_m + SPARE_M
    wide = spare + judged.error_m[:, None] + others.error_m[None, :]
    near = np.ones(wide.shape, dtype=bool)
    for axis, reach in ((0, wide), (1, wide), (2, np.array(limits.separation_vertical_m + SPARE_UP_M))):
        near &= low[:, axis] < judged.high_m[:, axis, None] + reach
        near &= high[:, axis] > judged.low_m[:, axis, None] - reach
    near &= judged.ids[:, None] != others.ids[None, :]
    near &= others.here_m[:, 2] >= GROUND_M
    minds = [ok and not sight.in_column for ok, sight in zip(passed, judged.sights, strict=True)]
    near[~np.array(minds, dtype=bool) | (judged.here_m[:, 2] < GROUND_M)] = False
    mine, theirs = np.nonzero(near)
    earlier = np.where(before[theirs] < mine, before[theirs], -1)
    return _Pairs(mine, theirs, earlier, wide[mine, theirs][:, None])


def _first(judged: Flock, pairs: _Pairs, goes: Samples, late: Samples, others: Flock, limits: Limits) -> Samples:
    """(p,) when and how they first get too close: the number of the sample times `FUTURES` plus that of the future.

    Infinite where they do not. `goes` and `late` are (p, k, 3) what the others do.
    """
    high = limits.separation_vertical_m + SPARE_UP_M
    mine, first = pairs.mine, np.full(len(pairs.mine), np.inf)
    stops = others.stops_m[pairs.theirs]
    my_goes, my_late = judged.goes_m[mine], judged.late_m[mine]
    for future, (my_way, their_way) in enumerate(((my_goes, goes), (my_late, late), (my_late, stops))):
        apart = _apart(my_way, their_way, pairs.wide_m, high)
        close = np.flatnonzero((apart < 1.0).any(axis=1))
        if not len(close):
            continue
        wide, other, apart = pairs.wide_m[close], their_way[close], apart[close]
        braking = _apart(judged.stops_m[mine[close]], other, wide, high)
        going = _apart(my_goes[close], other, wide, high)
        excused = (braking.min(axis=1) < 1.0) & (_is_no_worse(apart, braking) | _is_no_worse(going, braking))
        when = FUTURES * np.argmax(apart < 1.0, axis=1) + future
        first[close] = np.minimum(first[close], np.where(excused, np.inf, when))
    return first


def _apart(mine: Samples, theirs: Samples, wide_m: Samples, high_m: float) -> Samples:
    """(p, k) distances, as the larger share of the two limits: below 1 is too close."""
    gap = theirs - mine
    return np.maximum(np.hypot(gap[..., 0], gap[..., 1]) / wide_m, np.abs(gap[..., 2]) / high_m)


def _is_no_worse(going: Samples, braking: Samples) -> NDArray[np.bool_]:
    """(p,) whether going on keeps farther away than braking; where both come about as near, in sum up to then."""
    gained = going.min(axis=1) - braking.min(axis=1)
    nearest = braking.argmin(axis=1)[:, None]
    more = np.take_along_axis((going - braking).cumsum(axis=1), nearest, axis=1)[:, 0]
    better: NDArray[np.bool_] = (gained > BETTER) | ((gained >= -SAME) & (more >= -SAME))
    return better
