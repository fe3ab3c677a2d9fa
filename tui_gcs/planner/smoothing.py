"""Shapes a closed tour: a periodic cubic B-spline whose control points minimise flying time while covering all cells.

The time is what speed and turning cost (braking and speeding up are left to `tour.timed`):
T = integral of (s^4 / v^4 + c^2 / (a s)^2)^(1/4) over the parameter, with s = |P'|, c = P' x P''; the two terms are
the time at full speed and the time that the turn's lateral acceleration allows, softly the larger of them.
A cell farther than the footprint from the nearest point of the tour adds the square of what is missing.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tui_gcs.planner.descent import descend
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
    return _blend(_weights(per_control)[:, :per_control], controls).reshape(-1, 2)


def controls_of(path_m: Floats, step_m: float = CONTROL_STEP_M) -> Floats:
    """Control points along a closed polyline, as many as its length asks for."""
    closed = np.vstack([path_m, path_m[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    count = int(np.clip(round(way[-1] / step_m), LEAST_CONTROLS, MOST_CONTROLS))
    at = way[-1] * np.arange(count) / count
    return np.stack([np.interp(at, way, closed[:, axis]) for axis in range(2)], axis=1)


def smooth(
    controls: Floats, cells_m: Floats, motion: Motion, region: Region, pull: float, iterations: int
) -> tuple[Floats, float]:
    """`controls` after `iterations` of descent, and their cost; `pull` (s/m^2) weighs uncovered cells."""

    def cost(flat: Floats) -> tuple[float, Floats]:
        value, slope = tour_cost(flat.reshape(-1, 2), cells_m, motion, pull)
        return value, slope.ravel()

    found, value = descend(cost, controls.ravel(), iterations)
    inside = region.pulled_inside(found.reshape(-1, 2))
    return inside, value


def tour_cost(controls: Floats, cells_m: Floats, motion: Motion, pull: float) -> tuple[float, Floats]:
    """Flying time plus `pull` times what is not covered (s), and the gradient by the control points."""
    weights = _weights(PER_CONTROL)
    curve = _blend(weights, controls)
    points, first, second = (curve[:, i * PER_CONTROL : (i + 1) * PER_CONTROL] for i in range(3))
    time_s, to_first, to_second = _flying_time(first, second, motion)
    miss_m2, to_points = _missing(points.reshape(-1, 2), cells_m, motion.radius_m)
    to_points = (pull * to_points).reshape(points.shape)
    slope = _unblend(weights, np.concatenate([to_points, to_first, to_second], axis=1))
    return time_s + pull * miss_m2, slope


def _flying_time(d1: Floats, d2: Floats, motion: Motion) -> tuple[float, Floats, Floats]:
    """Time of the tour (s) and its gradients by the derivatives (k, p, 2) of the curve."""
    x1, y1, x2, y2 = d1[..., 0], d1[..., 1], d2[..., 0], d2[..., 1]
    s2 = np.maximum(x1 * x1 + y1 * y1, 1e-6)
    cross = x1 * y2 - y1 * x2
    v4, a2 = motion.speed_m_s**4, motion.accel_m_s2**2
    by_turn = cross / (a2 * s2)
    inner = s2 * s2 / v4 + cross * by_turn
    root = np.sqrt(np.sqrt(inner))
    outer = 0.25 / PER_CONTROL * root / np.maximum(inner, 1e-12)
    by_s = outer * 2.0 * (2.0 * s2 / v4 - by_turn * by_turn * a2)
    by_cross = outer * 2.0 * by_turn
    to_first = np.stack([by_s * x1 + by_cross * y2, by_s * y1 - by_cross * x2], axis=-1)
    to_second = np.stack([-by_cross * y1, by_cross * x1], axis=-1)
    return float(root.sum()) / PER_CONTROL, to_first, to_second


def _missing(points: Floats, cells_m: Floats, radius_m: float) -> tuple[float, Floats]:
    """Sum over cells of the squared distance they lie outside the swept band, and its gradient."""
    away, nearest = cKDTree(points, balanced_tree=False, compact_nodes=False).query(cells_m)
    out = np.flatnonzero(away > radius_m)
    slope = np.zeros_like(points)
    over, at = away[out] - radius_m, nearest[out]
    pull = (2.0 * over / away[out])[:, None] * (points[at] - cells_m[out])
    for axis in range(2):
        slope[:, axis] = np.bincount(at, pull[:, axis], len(points))
    return float((over * over).sum()), slope


@cache
def _weights(per_control: int) -> Floats:
    """B-spline weights of the four control points around a span: (4, 3 p) for value, first and second derivative."""
    u = np.arange(per_control) / per_control
    value = np.stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]) / 6.0
    first = np.stack([-((1 - u) ** 2), 3 * u**2 - 4 * u, -3 * u**2 + 2 * u + 1, u**2]) / 2.0
    second = np.stack([1 - u, 3 * u - 2, 1 - 3 * u, u])
    return np.concatenate([value, first, second], axis=1)


def _blend(weights: Floats, controls: Floats) -> Floats:
    """(k, p, 2) the weighted control points around each of the k spans."""
    count = len(controls)
    around = controls[(np.arange(count)[:, None] + np.arange(-1, 3)) % count]
    return np.asarray(np.einsum("kic,ip->kpc", around, weights))


def _unblend(weights: Floats, slope: Floats) -> Floats:
    """The transpose of `_blend`."""
    parts = np.einsum("kpc,ip->ikc", slope, weights)
    return sum((np.roll(parts[i], i - 1, axis=0) for i in range(1, 4)), np.roll(parts[0], -1, axis=0))
