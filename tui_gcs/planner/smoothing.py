"""Shapes a closed tour: a periodic cubic B-spline whose control points minimise flying time while covering all cells.

The time is what speed and turning cost (braking and speeding up are left to `tour.timed`):
T = integral of (s^4 / v^4 + c^2 / (a s)^2)^(1/4) over the parameter, with s = |P'|, c = P' x P''; the two terms are
the time at full speed and the time that the turn's lateral acceleration allows, softly the larger of them.
A cell farther than the footprint from the nearest point of the tour adds the square of what is missing.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from tui_gcs.planner.region import Region

Floats = NDArray[np.floating[Any]]

CONTROL_STEP_M = 14.0
PER_CONTROL = 6
"""Points per control point in which the tour is judged."""
LEAST_CONTROLS = 8
MOST_CONTROLS = 400


@dataclass(frozen=True)
class Motion:
    """What bends and drives a tour."""

    speed_m_s: float
    accel_m_s2: float
    radius_m: float
    """Footprint radius to plan with."""


def spline_points(controls: Floats, per_control: int) -> Floats:
    """(k * per_control, 2) points of the closed uniform cubic B-spline with `controls` (k, 2)."""
    return _blend(_weights(per_control)[0], controls)


def controls_of(path_m: Floats, step_m: float = CONTROL_STEP_M) -> Floats:
    """Control points along a closed polyline, as many as its length asks for."""
    closed = np.vstack([path_m, path_m[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    count = int(np.clip(round(way[-1] / step_m), LEAST_CONTROLS, MOST_CONTROLS))
    at = way[-1] * np.arange(count) / count
    return np.stack([np.interp(at, way, closed[:, axis]) for axis in range(2)], axis=1)


def smooth(controls: Floats, cells_m: Floats, motion: Motion, region: Region, pull: float, iterations: int) -> Floats:
    """`controls` after `iterations` of quasi-Newton descent (L-BFGS); `pull` weighs uncovered cells (s/m^2)."""
    shape = controls.shape

    def cost(flat: Floats) -> tuple[float, Floats]:
        points = flat.reshape(shape)
        time_s, time_slope = flying_time(points, motion)
        miss, miss_slope = miss_m2(points, cells_m, motion.radius_m)
        return time_s + pull * miss, (time_slope + pull * miss_slope).ravel()

    found = minimize(cost, controls.ravel(), jac=True, method="L-BFGS-B", options={"maxiter": iterations, "maxcor": 12})
    return region.pulled_inside(np.asarray(found.x).reshape(shape))


def flying_time(controls: Floats, motion: Motion) -> tuple[float, Floats]:
    """Time of the tour (s) and its gradient by the control points."""
    _, first, second = _weights(PER_CONTROL)
    d1, d2 = _blend(first, controls), _blend(second, controls)
    s2 = np.maximum((d1**2).sum(axis=1), 1e-6)
    cross = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    v4, a2 = motion.speed_m_s**4, motion.accel_m_s2**2
    inner = s2**2 / v4 + cross**2 / (a2 * s2)
    root = inner**0.25
    outer = 0.25 * root / np.maximum(inner, 1e-12)
    by_s2 = outer * (2.0 * s2 / v4 - cross**2 / (a2 * s2**2))
    by_cross = outer * 2.0 * cross / (a2 * s2)
    to_d1 = 2.0 * by_s2[:, None] * d1 + by_cross[:, None] * np.stack([d2[:, 1], -d2[:, 0]], axis=1)
    to_d2 = by_cross[:, None] * np.stack([-d1[:, 1], d1[:, 0]], axis=1)
    slope = _unblend(first, to_d1) + _unblend(second, to_d2)
    return float(root.sum()) / PER_CONTROL, slope / PER_CONTROL


def miss_m2(controls: Floats, cells_m: Floats, radius_m: float) -> tuple[float, Floats]:
    """Sum over cells of the squared distance they lie outside the swept band, and its gradient."""
    weights = _weights(PER_CONTROL)[0]
    points = _blend(weights, controls)
    away, nearest = cKDTree(points).query(cells_m)
    out = np.flatnonzero(away > radius_m)
    slope = np.zeros_like(points)
    if not len(out):
        return 0.0, np.zeros_like(controls)
    over, at = away[out] - radius_m, nearest[out]
    pull = (2.0 * over / away[out])[:, None] * (points[at] - cells_m[out])
    for axis in range(2):
        slope[:, axis] = np.bincount(at, pull[:, axis], len(points))
    return float(over @ over), _unblend(weights, slope)


def _weights(per_control: int) -> tuple[Floats, Floats, Floats]:
    """B-spline weights of the four control points around a span, and of first and second derivatives: (4, per)."""
    u = np.arange(per_control) / per_control
    value = np.stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]) / 6.0
    first = np.stack([-((1 - u) ** 2), 3 * u**2 - 4 * u, -3 * u**2 + 2 * u + 1, u**2]) / 2.0
    second = np.stack([1 - u, 3 * u - 2, 1 - 3 * u, u])
    return value, first, second


def _blend(weights: Floats, controls: Floats) -> Floats:
    count, per = len(controls), weights.shape[1]
    total = np.zeros((count, per, 2))
    for i in range(4):
        total += weights[i][None, :, None] * np.roll(controls, 1 - i, axis=0)[:, None, :]
    return total.reshape(count * per, 2)


def _unblend(weights: Floats, slope: Floats) -> Floats:
    """The transpose of `_blend`."""
    per = weights.shape[1]
    spans = slope.reshape(-1, per, 2)
    total = np.zeros((len(spans), 2))
    for i in range(4):
        total += np.roll((weights[i][None, :, None] * spans).sum(axis=1), i - 1, axis=0)
    return total
