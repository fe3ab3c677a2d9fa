"""Smooths a closed tour: moves the control points of a periodic cubic B-spline in time until it is short and covers.

With knots every `interval_s`, velocity and acceleration at the knots are differences of control points. So its duration
k * interval_s and its excess over the speed and acceleration limits are simple smooth functions. Limits and coverage
are penalties: a cell farther than the footprint from the nearest point adds the square of what is missing. `tour.timed`
then gives the path its exact time law.
"""

import math
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.lazy_scipy import nearest as nearest_of
from tui_gcs.planner.lazy_scipy import sparse
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.lbfgs_descent import LbfgsDescent
from tui_gcs.planner.patrol.tour import SENT_STEP_S, Tour, resampled, timed

Floats = NDArray[np.floating[Any]]

INTERVAL_S = 1.8
"""Initial time between knots: two or three of them make a turn."""
PER_KNOT = 4
"""Points per knot at which coverage is evaluated."""
MIN_KNOTS = 10
MAX_KNOTS = 8000
"""A tour of 100 ha has about 5000."""
ROUGH_STEP_M = 14.0
"""Spacing of the control points that round the corners of a first tour."""
PATH_STEPS = 18
"""Points per control point of a path that is to be timed: one every 0.05 s or so of a finished draft."""
ROUGH_STEPS = 14
"""As `PATH_STEPS`, for first tours."""
TIME_SCALE = 100.0
"""Metres of moving a control point that weigh as much as the time interval growing e-fold."""
MAX_STRETCH = 1.5
"""The interval changes by at most exp(this) in one descent."""
LOOK_EVERY = 6
"""Descent steps between looks at all cells."""
WATCH_M = 4.0
"""Cells this far inside the swept band are evaluated, too: they may be outside after a few steps."""
SAME_M = 1e-6
"""Tolerance for rounding in comparisons."""
NEIGHBOURS = np.arange(-3, 4)
"""Points around the nearest one that a cell is tested against between looks."""


@dataclass(frozen=True)
class TourLimits:
    """The limits that a tour is designed with."""

    speed_m_s: float
    accel_m_s2: float
    radius_m: float
    """Footprint radius to plan with."""
    sent_step_s: float = SENT_STEP_S
    """Sample spacing of the trajectories that are sent."""


@dataclass(frozen=True)
class DescentEffort:
    """Weights and length of one descent."""

    pull: float
    """Weight of uncovered cells (s/m²)."""
    limits: float
    """Weight of speed and acceleration beyond the limits, and of points outside the region (s/m²)."""
    iterations: int


@dataclass(frozen=True)
class TourDraft:
    """A tour that is being designed. Field names are stored in snapshots."""

    name: str
    controls: Floats
    """(k, 2) control points, one every `interval_s`."""
    interval_s: float
    cost: float = math.inf

    def path_m(self) -> Floats:
        """Return the closed path as points well under 1 m apart."""
        return _blend(_weights(PATH_STEPS), self.controls).reshape(-1, 2)

    def respaced(self, times: float) -> "TourDraft":
        """Return the same path with `times` as many control points."""
        before, path = len(self.controls), self.path_m()
        count = int(np.clip(round(before * times), MIN_KNOTS, MAX_KNOTS))
        controls = path[np.arange(count) * len(path) // count]
        return replace(self, controls=controls, interval_s=self.interval_s * before / count)


def flown_as(draft: TourDraft, tour: Tour) -> TourDraft:
    """Return the draft with its spline through `tour`, its exact time law, in equal times.

    A spline's own time law is 1 to 6 % slower than its path allows, so descent would shorten the wrong places.
    """
    count = len(draft.controls)
    interval_s = tour.period_s / count
    through = np.fft.rfft(tour.at(interval_s * np.arange(count))[0], axis=0)
    # At its knots a uniform cubic B-spline is (1, 4, 1) / 6 of its control points: a circular filter, inverted here.
    filtered = (2.0 + np.cos(2.0 * np.pi * np.arange(len(through)) / count)) / 3.0
    controls = np.fft.irfft(through / filtered[:, None], count, axis=0)
    return replace(draft, controls=controls, interval_s=interval_s)


def draft_of(name: str, path_m: Floats, motion: TourLimits) -> TourDraft:
    """Return a first draft: the closed polyline with its corners rounded, flown as fast as possible."""
    rough = _blend(_weights(ROUGH_STEPS), resampled(path_m, ROUGH_STEP_M, least=8)).reshape(-1, 2)
    tour = timed(rough, motion.speed_m_s, motion.accel_m_s2)
    knots = int(np.clip(round(tour.period_s / INTERVAL_S), MIN_KNOTS, MAX_KNOTS))
    interval_s = tour.period_s / knots
    return TourDraft(name, tour.at(interval_s * np.arange(knots))[0], interval_s)


def smooth(
    draft: TourDraft,
    cells_m: Floats,
    motion: TourLimits,
    region: FlyableRegion,
    effort: DescentEffort,
    less_m: Floats | float = 0.0,
) -> TourDraft:
    """Return `draft` after descent, its control points inside `region`; `less_m` reduces each cell's footprint."""
    before_s, spline = draft.interval_s, _spline(len(draft.controls))
    descent, watched = (
        LbfgsDescent(np.append(draft.controls.ravel(), 0.0)),
        _CoverageCost(cells_m, motion.radius_m - less_m),
    )

    def cost(x: Floats) -> tuple[float, Floats]:
        interval_s = before_s * math.exp(_stretch(x))
        points, velocity, accel = spline.of(x[:-1].reshape(-1, 2))
        duration_s, to_velocity, to_accel, by_interval = _duration(velocity, accel, interval_s, motion, effort.limits)
        miss_m2, to_points = watched.missing(points)
        way_in = region.ways_inside_m(points)
        to_points = effort.pull * to_points - 2.0 * effort.limits * way_in
        slope = np.empty_like(x)
        slope[:-1] = spline.back(to_points, to_velocity, to_accel).ravel()
        slope[-1] = by_interval * interval_s / TIME_SCALE
        return duration_s + effort.pull * miss_m2 + effort.limits * float((way_in * way_in).sum()), slope

    left, more = effort.iterations, True
    while more and left > 0:
        watched.look(spline.of(descent.x[:-1].reshape(-1, 2))[0])
        more = descent.run(cost, min(left, LOOK_EVERY))
        left -= LOOK_EVERY
    watched.look(spline.of(descent.x[:-1].reshape(-1, 2))[0])
    value = cost(descent.x)[0]
    controls = region.pulled_inside(descent.x[:-1].reshape(-1, 2))
    return replace(draft, controls=controls, interval_s=before_s * math.exp(_stretch(descent.x)), cost=value)


def _stretch(x: Floats) -> float:
    return min(max(float(x[-1]) / TIME_SCALE, -MAX_STRETCH), MAX_STRETCH)


def _duration(
    change: Floats, bend: Floats, step_s: float, motion: TourLimits, weight: float
) -> tuple[float, Floats, Floats, float]:
    """Return the tour's duration plus the penalty for excess at the knots, and its gradient.

    `change` and `bend` are half the sums of first, and the second differences of the control points.
    """
    speed, force = np.hypot(change[:, 0], change[:, 1]) / step_s, np.hypot(bend[:, 0], bend[:, 1]) / step_s**2
    fast, hard = np.maximum(speed - motion.speed_m_s, 0.0), np.maximum(force - motion.accel_m_s2, 0.0)
    excess = float(fast @ fast + hard @ hard)
    to_change = (2.0 * weight / step_s * fast / np.maximum(speed, 1e-9))[:, None] * change
    to_bend = (2.0 * weight / step_s**3 * hard / np.maximum(force, 1e-9))[:, None] * bend
    by_step = len(change) + weight * (excess - 2.0 * float(fast @ speed) - 4.0 * float(hard @ force))
    return len(change) * step_s + weight * step_s * excess, to_change, to_bend, by_step


class _CoverageCost:
    """The cost of cells that are, or may soon be, outside the swept band.

    A look finds each cell's nearest point of the tour. Between looks only cells near the edge of the band are
    evaluated, and only against the points around that one. This makes descent five times faster.
    """

    def __init__(self, cells_m: Floats, radius_m: Floats | float) -> None:
        """`radius_m` is how near a point of the tour must come to each cell."""
        self._cells, self._radius_m = cells_m, np.broadcast_to(radius_m, len(cells_m))
        self._at_most_m = np.full(len(cells_m), np.inf)
        """Upper bound of each cell's distance: that of its last look plus what the tour has moved since."""
        self._seen: Floats = np.empty((0, 2))

    def look(self, points: Floats) -> None:
        """Choose the cells to evaluate and their points; cells well inside the band all the while are skipped."""
        if len(self._seen):
            moved = points - self._seen
            self._at_most_m += float(np.hypot(moved[:, 0], moved[:, 1]).max()) + SAME_M
        self._seen = points
        inner_m = self._radius_m - WATCH_M
        may = np.flatnonzero(self._at_most_m > inner_m)
        away, nearest = nearest_of(points, self._cells[may])
        self._at_most_m[may] = away
        at_edge = away > inner_m[may]
        edge = may[at_edge]
        self._near, self._near_radius_m = self._cells[edge], self._radius_m[edge]
        self._around = (nearest[at_edge][:, None] + NEIGHBOURS) % len(points)
        self._rows = np.arange(len(edge))

    def missing(self, points: Floats) -> tuple[float, Floats]:
        """Return the sum over cells of squared distances outside the swept band, and its gradient by the points."""
        x, y = points[:, 0][self._around] - self._near[:, :1], points[:, 1][self._around] - self._near[:, 1:]
        square = x * x + y * y
        which = square.argmin(axis=1)
        away = np.sqrt(square[self._rows, which])
        out = np.flatnonzero(away > self._near_radius_m)
        which, away = which[out], away[out]
        over, at = away - self._near_radius_m[out], self._around[out, which]
        pull = 2.0 * over / away
        slope = np.empty_like(points)
        slope[:, 0] = np.bincount(at, pull * x[out, which], len(points))
        slope[:, 1] = np.bincount(at, pull * y[out, which], len(points))
        return float(over @ over), slope


class _Spline:
    """Linear maps from k control points to points and differences, and their transposes for gradients."""

    def __init__(self, knots: int) -> None:
        span, place = np.divmod(np.arange(PER_KNOT * knots), PER_KNOT)
        knot, weights = np.arange(knots), _weights(PER_KNOT)
        parts = [(np.arange(PER_KNOT * knots), span + i - 1, weights[i][place]) for i in range(4)]
        velocity, accel = PER_KNOT * knots + knot, (PER_KNOT + 1) * knots + knot
        parts += [(velocity, knot + i, np.full(knots, 0.5 * i)) for i in (-1, 1)]
        parts += [(accel, knot + i, np.full(knots, share)) for i, share in ((-1, 1.0), (0, -2.0), (1, 1.0))]
        rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        self._points, self._knots = PER_KNOT * knots, knots
        self._there = sparse(rows, columns % knots, values, ((PER_KNOT + 2) * knots, knots))
        self._back = sparse(columns % knots, rows, values, (knots, (PER_KNOT + 2) * knots))

    def of(self, controls: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (4 k, 2) points, (k, 2) half first differences at the knots, (k, 2) second differences."""
        all_of_them = self._there @ controls
        return (
            all_of_them[: self._points],
            all_of_them[self._points : -self._knots],
            all_of_them[-self._knots :],
        )

    def back(self, to_points: Floats, to_velocity: Floats, to_accel: Floats) -> Floats:
        """Return the (k, 2) gradient by the control points."""
        return np.asarray(self._back @ np.concatenate([to_points, to_velocity, to_accel]))


@lru_cache(maxsize=64)
def _spline(knots: int) -> _Spline:
    return _Spline(knots)


@cache
def _weights(per_knot: int) -> Floats:
    """Return (4, per_knot) weights of the four control points around a span of the uniform cubic B-spline."""
    u = np.arange(per_knot) / per_knot
    shares = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
    return np.asarray(np.stack(shares) / 6.0)


def _blend(weights: Floats, controls: Floats) -> Floats:
    """Return (k, p, 2) weighted control points around each of the k spans."""
    count = len(controls)
    around = controls[(np.arange(count)[:, None] + np.arange(-1, 3)) % count]
    return np.asarray(np.einsum("kic,ip->kpc", around, weights))
