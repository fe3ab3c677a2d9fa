"""Separation check: whether predicted vehicles keep apart, going on, braking, or braking late."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.guard.course_samples import STEP_S
from tui_gcs.core.guard.motion_prediction import FleetPrediction, MotionModel
from tui_gcs.core.motion.course import Samples
from tui_gcs.core.scenario.model import Limits

GROUND_M = 2.0
"""Below this height above home neither the altitude band nor separation applies."""
# Measured in the simulator in wind up to 4 m/s: two that hold wander 0.3 to 0.6 m sideways and 0.1 m in height.
SPARE_M, SPARE_UP_M = 1.0, 0.3
"""Kept beyond the limits, horizontally and vertically: holding vehicles wander, and predictions are a little wrong."""
SAME = 1e-6
BETTER = 0.3
"""Share of the limits by which going on must be better than braking: less is luck, of when samples are taken."""
FUTURES = 3
"""Futures that are checked: both go on, both brake a moment later, the other one brakes now."""
AS_KNOWN, GOES, BRAKES = range(3)
"""What the other vehicle does: as is known of it, or as was decided on it just before."""

Rows = NDArray[np.intp]
Plane = NDArray[np.complex128]
"""Positions as east + i north."""


@dataclass(frozen=True)
class SeparationConflict:
    """The vehicle that comes too close, and when."""

    vehicle: int
    in_s: float


@dataclass(frozen=True)
class _Reach:
    """Where n vehicles may be at k moments: on the straight between two places, at any height between them."""

    short_m: Samples
    """(n, k, 3) one end of the straight."""
    far_m: Samples
    """(n, k, 3) its other end."""
    slack_m: Samples
    """(n, k or 1, 2) how far from the straight they may be, sideways and in height."""
    middle_m: Samples
    """(n, k, 3) centre of all that."""
    reach_m: Samples
    """(n, k, 2) how far it reaches from its centre, sideways and in height."""

    @staticmethod
    def between(short_m: Samples, far_m: Samples, slack_m: Samples) -> "_Reach":
        """Segments between two arrays of places, with centre and reach."""
        if short_m is far_m:
            return _Reach(short_m, short_m, slack_m, short_m, slack_m)
        half = np.abs(far_m - short_m) / 2
        reach = np.stack([np.hypot(half[..., 0], half[..., 1]), half[..., 2]], axis=2) + slack_m
        return _Reach(short_m, far_m, slack_m, (short_m + far_m) / 2, reach)

    def some(self, rows: Rows) -> "_Reach":
        """The segments of these rows."""
        short = self.short_m[rows]
        far = short if self.is_exact else self.far_m[rows]
        return _Reach(short, far, self.slack_m[rows], self.middle_m[rows], self.reach_m[rows])

    @property
    def is_exact(self) -> bool:
        """Whether all segments are points."""
        return self.short_m is self.far_m


@dataclass(frozen=True)
class _Futures:
    """What n vehicles may do: go on; go on for a moment and then brake; brake now; brake now as hard as they can."""

    goes: _Reach
    late: _Reach
    stops: _Reach
    short: _Reach

    @staticmethod
    def of(prediction: FleetPrediction) -> "_Futures":
        """The futures of predicted vehicles."""
        goes = _Reach.between(prediction.from_m, prediction.goes_m, np.zeros((len(prediction.ids), 1, 2)))
        late, stops = (
            _Reach.between(prediction.short_m, far, prediction.slack_m)
            for far in (prediction.late_m, prediction.stops_m)
        )
        return _Futures(goes, late, stops, _Reach.between(prediction.short_m, prediction.short_m, prediction.slack_m))


@dataclass(frozen=True)
class _VehiclePairs:
    """p pairs of a vehicle that is judged and another one, sorted by the first."""

    mine: Rows
    """Rows of the vehicles that are judged."""
    theirs: Rows
    """Rows of the others."""
    judged: Rows
    """The other's row among the judged vehicles, if it was judged before; else -1."""
    wide_m: Samples
    """(p, 1) horizontal distance to be kept."""
    free: NDArray[np.bool_]
    """(p,) whether the other vehicle drifts: nothing here decides what it does."""

    def some(self, pairs: Rows) -> "_VehiclePairs":
        """The pairs with these indices."""
        return _VehiclePairs(
            self.mine[pairs], self.theirs[pairs], self.judged[pairs], self.wide_m[pairs], self.free[pairs]
        )


def separation_conflicts(
    judged: FleetPrediction, others: FleetPrediction, passed: Sequence[bool], limits: Limits
) -> dict[int, SeparationConflict]:
    """By row, the first vehicle that each of `judged` gets too close to if it goes on, or brakes a moment later.

    Vehicles are judged in their order: one that has `passed` and meets no other goes on, all others brake, and those
    that are judged later see that. A vehicle that climbs or descends in its own column gives way to none, but others
    keep clear of it.

    What leads apart passes: what is at no time nearer than the hardest braking is. Towards vehicles that do not brake
    for others, weak braking is the measure.
    """
    pairs = _pairs(judged, others, passed, limits)
    if not len(pairs.mine):
        return {}
    # That it comes nearer now to be farther away later is no excuse, for a planner may change its mind before.
    # Flown: with 0.5 m of noise in their positions two vehicles came to 2 m of each other, each time with a
    # promise.
    is_known = pairs.judged >= 0
    known, new = np.flatnonzero(is_known), np.flatnonzero(~is_known)
    before, high = pairs.some(known), limits.separation_vertical_m + SPARE_UP_M
    me, they = _Futures.of(judged), _Futures.of(others)
    first = np.full((3, len(pairs.mine)), np.inf)
    later = pairs.some(new)
    first[AS_KNOWN, new] = _first(me, later, (they.goes, they.late, they.stops), later.theirs, high)
    first[GOES, known] = _first(me, before, (me.goes, me.late, me.stops), before.judged, high)
    first[BRAKES, known] = _first(me, before, (me.stops,) * FUTURES, before.judged, high)
    found: dict[int, SeparationConflict] = {}
    soonest: dict[int, float] = {}
    for pair in np.flatnonzero(np.isfinite(first).any(axis=0)).tolist():
        mine, other = int(pairs.mine[pair]), int(pairs.judged[pair])
        motion = AS_KNOWN if other < 0 else GOES if passed[other] and other not in found else BRAKES
        when = float(first[motion, pair])
        if when < soonest.get(mine, np.inf):
            soonest[mine] = when
            found[mine] = SeparationConflict(int(others.ids[pairs.theirs[pair]]), when // FUTURES * STEP_S)
    return found


def _pairs(judged: FleetPrediction, others: FleetPrediction, passed: Sequence[bool], limits: Limits) -> _VehiclePairs:
    """Pairs in the air whose boxes of predicted places, before and after the decisions, are near each other."""
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
    keeps_clear = [ok and not state.in_column for ok, state in zip(passed, judged.states, strict=True)]
    # Vehicles that are vetoed already, or in their columns, or on the ground, are not judged.
    near[~np.array(keeps_clear, dtype=bool) | (judged.here_m[:, 2] < GROUND_M)] = False
    mine, theirs = np.nonzero(near)
    earlier = np.where(before[theirs] < mine, before[theirs], -1)
    free = np.array([state.motion is MotionModel.DRIFTS for state in others.states], dtype=bool)
    return _VehiclePairs(mine, theirs, earlier, wide[mine, theirs][:, None], free[theirs])


def _first(me: _Futures, pairs: _VehiclePairs, they: tuple[_Reach, ...], theirs: Rows, high_m: float) -> Samples:
    """(p,) when, and in which future, the vehicles of each pair first get too close; infinite where they do not.

    The value is the number of the sample times `FUTURES` plus that of the future. `they`: what the others do in each
    future, each in its row of `theirs` (p,).
    """
    first = np.full(len(pairs.mine), np.inf)
    for future, (my_way, their_way) in enumerate(zip((me.goes, me.late, me.late), they, strict=True)):
        close = np.flatnonzero(_may_be_close(my_way, pairs, their_way, theirs, high_m))
        if not len(close):  # as nearly always: what follows costs ten times as much
            continue
        apart = _apart(my_way.some(pairs.mine[close]), their_way.some(theirs[close]), pairs.wide_m[close], high_m)
        near = apart < 1.0
        met = near.any(axis=1)
        close, apart, near = close[met], apart[met], near[met]
        if not len(close):
            continue
        mine, wide, other = pairs.mine[close], pairs.wide_m[close], their_way.some(theirs[close])
        hardest = _apart(me.short.some(mine), other, wide, high_m)
        leads_apart: NDArray[np.bool_] = np.logical_and.reduce(apart >= hardest - SAME, axis=1)
        free = np.flatnonzero(pairs.free[close])
        if len(free):
            me_free, they_free, wide = pairs.mine[close[free]], other.some(free), wide[free]
            braking, going = (_apart(way.some(me_free), they_free, wide, high_m) for way in (me.stops, me.goes))
            better = _is_no_worse(apart[free], braking) | _is_no_worse(going, braking)
            leads_apart[free] |= (braking.min(axis=1) < 1.0) & better
        when = FUTURES * np.argmax(near, axis=1) + future
        first[close] = np.minimum(first[close], np.where(leads_apart, np.inf, when))
    return first


def _may_be_close(mine: _Reach, pairs: _VehiclePairs, theirs: _Reach, rows: Rows, high_m: float) -> NDArray[np.bool_]:
    """(p,) whether the circles about them are ever nearer than the limits: those of most pairs are not."""
    gap = theirs.middle_m[rows] - mine.middle_m[pairs.mine]
    reach = theirs.reach_m[rows] + mine.reach_m[pairs.mine]
    level = np.hypot(gap[..., 0], gap[..., 1]) - reach[..., 0]
    upright = np.abs(gap[..., 2]) - reach[..., 1]
    return np.asarray((_both(level / pairs.wide_m, upright / high_m) < 1.0).any(axis=1))


def _apart(mine: _Reach, theirs: _Reach, wide_m: Samples, high_m: float) -> Samples:
    """(p, k) least distances, as the larger share of the two limits: below 1 is too close."""
    short, far, their_short, their_far = (z[..., 2] for z in (mine.short_m, mine.far_m, theirs.short_m, theirs.far_m))
    low, high = np.minimum(short, far), np.maximum(short, far)
    their_low, their_high = np.minimum(their_short, their_far), np.maximum(their_short, their_far)
    slack = mine.slack_m + theirs.slack_m
    upright = np.maximum(their_low - high, low - their_high) - slack[..., 1]
    return _both((_level_m(mine, theirs) - slack[..., 0]) / wide_m, upright / high_m)


def _both(level: Samples, upright: Samples) -> Samples:
    """(p, k) the larger share, each at its least since the moment before: one may lessen before the other grows."""
    for share in (level, upright):
        share[:, 1:] = np.minimum(share[:, 1:], share[:, :-1])
    return np.maximum(level, upright)


def _level_m(mine: _Reach, theirs: _Reach) -> Samples:
    """(p, k) horizontal distance of the straights between the two places of each."""
    if mine.is_exact and theirs.is_exact:
        gap = theirs.short_m - mine.short_m
        return np.asarray(np.hypot(gap[..., 0], gap[..., 1]))
    a, b, c, d = (way[..., 0] + 1j * way[..., 1] for way in (mine.short_m, mine.far_m, theirs.short_m, theirs.far_m))
    to_them, to_me = np.minimum(_to_line(a, c, d), _to_line(b, c, d)), np.minimum(_to_line(c, a, b), _to_line(d, a, b))
    crossed = (_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)
    return np.where(crossed, 0.0, np.minimum(to_them, to_me))


def _to_line(point: Plane, begin: Plane, end: Plane) -> Samples:
    """Distance of points from the straights between two others."""
    way, off = end - begin, point - begin
    along = (off * way.conj()).real / np.maximum((way * way.conj()).real, 1e-12)
    share = np.minimum(np.maximum(along, 0.0), 1.0)  # `clip` takes three times as long
    away: Samples = np.abs(off - share * way)
    return away


def _side(begin: Plane, end: Plane, point: Plane) -> Samples:
    """On which side of a straight a point is: positive to the left."""
    side: Samples = ((end - begin).conj() * (point - begin)).imag
    return side


def _is_no_worse(going: Samples, braking: Samples) -> NDArray[np.bool_]:
    """(p,) whether going on keeps farther away than braking; where both come about as near, in sum up to then."""
    gained = going.min(axis=1) - braking.min(axis=1)
    nearest = braking.argmin(axis=1)[:, None]
    more = np.take_along_axis((going - braking).cumsum(axis=1), nearest, axis=1)[:, 0]
    better: NDArray[np.bool_] = (gained > BETTER) | ((gained >= -SAME) & (more >= -SAME))
    return better
