"""Shapes a closed tour: a periodic cubic B-spline in time whose control points are moved until it is short and covers.

With knots every `interval_s` the spline's velocity and acceleration at the knots are differences of control points,
so its duration k * interval_s and what it exceeds of the speed and acceleration limits are simple smooth functions,
turning and braking alike. Limits and coverage are penalties: a cell farther than the footprint from the nearest point
adds the square of what is missing. `tour.timed` then gives the path its exact time law.
"""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.descent import descend
from tui_gcs.planner.lazy_scipy import nearest as nearest_of
from tui_gcs.planner.region import Region
from tui_gcs.planner.tour import resampled, timed

Floats = NDArray[np.floating[Any]]

INTERVAL_S = 1.8
"""Time between knots at first: two or three of them make a turn."""
PER_KNOT = 4
"""Points per knot in which coverage is judged."""
LEAST_KNOTS = 10
MOST_KNOTS = 600
ROUGH_STEP_M = 14.0
"""Spacing of the control points that round the corners of a first guess."""
PATH_STEPS = 36
"""Points per control point of a path that is to be timed: one every 0.05 s or so."""
ROUGH_STEPS = 14
TIME_SCALE = 100.0
"""Metres of moving a control point that count like the time interval growing e-fold."""
MOST_STRETCH = 1.5
"""The interval changes by no more than exp(this) in one descent."""


@dataclass(frozen=True)
class Motion:
    """What bends and drives a tour."""

    speed_m_s: float
    accel_m_s2: float
    radius_m: float
    """Footprint radius to plan with."""


@dataclass(frozen=True)
class Effort:
    """How hard to descend."""

    pull: float
    """Weight of uncovered cells (s/m^2)."""
    limits: float
    """Weight of speed and acceleration beyond the limits, and of points outside the region (s/m^2)."""
    iterations: int


@dataclass(frozen=True)
class Draft:
    """A tour being shaped."""

    name: str
    controls: Floats
    """(k, 2), one every `interval_s`."""
    interval_s: float
    cost: float = math.inf

    def path_m(self) -> Floats:
        """The closed path as points well under 1 m apart."""
        return _blend(_weights(PATH_STEPS), self.controls).reshape(-1, 2)


def draft_of(name: str, path_m: Floats, motion: Motion) -> Draft:
    """A first guess: the closed polyline with its corners rounded, flown as fast as it can be."""
    rough = _blend(_weights(ROUGH_STEPS), resampled(path_m, ROUGH_STEP_M, least=8)).reshape(-1, 2)
    tour = timed(rough, motion.speed_m_s, motion.accel_m_s2)
    knots = int(np.clip(round(tour.period_s / INTERVAL_S), LEAST_KNOTS, MOST_KNOTS))
    interval_s = tour.period_s / knots
    return Draft(name, tour.at(interval_s * np.arange(knots))[0], interval_s)


def smooth(draft: Draft, cells_m: Floats, motion: Motion, region: Region, effort: Effort) -> Draft:
    """`draft` after descent, its control points inside `region`."""
    before_s = draft.interval_s

    def cost(x: Floats) -> tuple[float, Floats]:
        stretch = float(np.clip(x[-1] / TIME_SCALE, -MOST_STRETCH, MOST_STRETCH))
        interval_s = before_s * math.exp(stretch)
        controls = x[:-1].reshape(-1, 2)
        value, slope, by_interval = tour_cost(controls, interval_s, cells_m, motion, region, effort)
        return value, np.append(slope.ravel(), by_interval * interval_s / TIME_SCALE)

    found, value = descend(cost, np.append(draft.controls.ravel(), 0.0), effort.iterations)
    interval_s = before_s * math.exp(float(np.clip(found[-1] / TIME_SCALE, -MOST_STRETCH, MOST_STRETCH)))
    controls = region.pulled_inside(found[:-1].reshape(-1, 2))
    return replace(draft, controls=controls, interval_s=interval_s, cost=value)


def tour_cost(
    controls: Floats, interval_s: float, cells_m: Floats, motion: Motion, region: Region, effort: Effort
) -> tuple[float, Floats, float]:
    """Duration plus penalties (s), and the gradient by control points and by interval."""
    weights = _weights(PER_KNOT)
    points = _blend(weights, controls)
    duration_s, to_controls, by_interval = _duration(controls, interval_s, motion, effort.limits)
    miss_m2, to_points = _missing(points.reshape(-1, 2), cells_m, motion.radius_m)
    way_in = region.ways_inside_m(points.reshape(-1, 2))
    to_points = effort.pull * to_points - 2.0 * effort.limits * way_in
    slope = to_controls + _unblend(weights, to_points.reshape(points.shape))
    return duration_s + effort.pull * miss_m2 + effort.limits * float((way_in * way_in).sum()), slope, by_interval


def _duration(controls: Floats, step_s: float, motion: Motion, weight: float) -> tuple[float, Floats, float]:
    """Duration of the tour with the penalty for breaking limits at the knots."""
    count = len(controls)
    after, before = np.roll(controls, -1, axis=0), np.roll(controls, 1, axis=0)
    velocity, accel = (after - before) / (2.0 * step_s), (after - 2.0 * controls + before) / step_s**2
    speed, force = np.hypot(velocity[:, 0], velocity[:, 1]), np.hypot(accel[:, 0], accel[:, 1])
    fast, hard = np.maximum(speed - motion.speed_m_s, 0.0), np.maximum(force - motion.accel_m_s2, 0.0)
    scale = weight * step_s
    excess = float((fast * fast).sum() + (hard * hard).sum())
    to_velocity = (fast / np.maximum(speed, 1e-9))[:, None] * velocity * scale / step_s
    to_accel = (hard / np.maximum(force, 1e-9))[:, None] * accel * (2.0 * scale / step_s**2)
    slope = np.roll(to_velocity + to_accel, 1, axis=0) + np.roll(to_accel - to_velocity, -1, axis=0) - 2.0 * to_accel
    by_step = count + weight * excess - 2.0 * weight * float((fast * speed).sum() + 2.0 * (hard * force).sum())
    return count * step_s + scale * excess, slope, by_step


def _missing(points: Floats, cells_m: Floats, radius_m: float) -> tuple[float, Floats]:
    """Sum over cells of the squared distance they lie outside the swept band, and its gradient by the points."""
    away, nearest = nearest_of(points, cells_m)
    out = np.flatnonzero(away > radius_m)
    slope = np.zeros_like(points)
    over, at = away[out] - radius_m, nearest[out]
    pull = (2.0 * over / away[out])[:, None] * (points[at] - cells_m[out])
    for axis in range(2):
        slope[:, axis] = np.bincount(at, pull[:, axis], len(points))
    return float((over * over).sum()), slope


@cache
def _weights(per_knot: int) -> Floats:
    """(4, per_knot) weights of the four control points around a span of the uniform cubic B-spline."""
    u = np.arange(per_knot) / per_knot
    shares = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
    return np.asarray(np.stack(shares) / 6.0)


def _blend(weights: Floats, controls: Floats) -> Floats:
    """(k, p, 2) the weighted control points around each of the k spans."""
    count = len(controls)
    around = controls[(np.arange(count)[:, None] + np.arange(-1, 3)) % count]
    return np.asarray(np.einsum("kic,ip->kpc", around, weights))


def _unblend(weights: Floats, slope: Floats) -> Floats:
    """The transpose of `_blend`."""
    parts = np.einsum("kpc,ip->ikc", slope, weights)
    return np.asarray(sum(np.roll(parts[i], i - 1, axis=0) for i in range(4)))
