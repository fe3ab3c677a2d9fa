"""Tours: closed paths with a time law, and the exact worst idleness of n vehicles equally spaced in time on one."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import Annotation, IdlenessGrid, ZoneCells

Floats = NDArray[np.floating[Any]]
Rows = NDArray[np.intp]

CRAWL_M_S = 0.01
"""No path is flown slower. Beside an obstacle a draft may have places at which nothing faster is allowed."""
MAX_SAMPLES = 1_000_000
"""Longer tours are sampled more coarsely. A draft that crawls (ten days in a zone of 0.08 ha) took 24 GB of memory."""
SAMPLE_S = 0.1
"""Spacing of a tour's samples. Straight lines between them are within a dt² / 8 = 3 mm at 2.5 m/s²."""
PATH_STEP_M = 1.0
"""Spacing of a path's points."""
SAME_M = 1e-6
"""Points nearer than this are one point."""
CORNER_RAD = 0.25
"""A path that turns by more than this at one point has a corner there."""
CORNER_S = SAMPLE_S
"""A corner is turned within this time, at a speed that the acceleration allows."""
AVERAGING_S = 1.0
"""Window of the moving average of a tour. It turns a change from 2.5 m/s² back to 2.5 m/s² forth into a jerk of 5 m/s³,
ArduCopter's limit (PSC_JERK_XY), and moves no point by more than a AVERAGING_S² / 24 = 0.1 m."""
# Simulated ArduCopters on three tours at 0.88 of the acceleration, wind 3 m/s, were 0.6 to 0.8 m off with this, with
# half of it and without. With half of it tours take 1.5 % longer.
MAX_TURN_JERK_M_S3 = 2.0
"""Limit of v³ / R² round a bend, where acceleration turns with the vehicle: radii under 3 m are flown slower for it."""
SENT_STEP_S, SPARSE_SENT_STEP_S = 0.25, 0.5
"""Sample spacing of the trajectories in which tours are sent to small and to large teams; straight lines between
samples are up to a dt² / 8 = 0.02 and 0.08 m off."""
EVALUATION_STEP_S, EXACT_STEP_S = 0.25, 0.05
"""Time steps of a first and of an exact evaluation."""
SPACING_STEPS, LARGE_STEP_S = 400, 0.5
"""Time steps within one slot spacing of a large zone; they are at most so long, 4 m at 8 m/s."""
BLOCK = 2_000_000
"""Cells times samples that are evaluated at once, to bound memory."""


@dataclass(frozen=True)
class Tour:
    """A closed path as a function of time: samples every `dt_s`, `period_s` = len(xy_m) * dt_s."""

    dt_s: float
    xy_m: Floats
    """(k, 2)"""
    velocity_m_s: Floats
    """(k, 2)"""

    @property
    def period_s(self) -> float:
        """Time of one round trip."""
        return self.dt_s * len(self.xy_m)

    @property
    def length_m(self) -> float:
        """Length of one round trip."""
        return float(np.hypot(*np.diff(self.xy_m, axis=0, append=self.xy_m[:1]).T).sum())

    def times(self, rate: float) -> "Tour":
        """Return the same path flown `rate` times as fast."""
        return Tour(self.dt_s / rate, self.xy_m, self.velocity_m_s * rate)

    @cached_property
    def top_speed_m_s(self) -> float:
        """The highest speed on the tour."""
        return float(np.hypot(self.velocity_m_s[:, 0], self.velocity_m_s[:, 1]).max())

    @cached_property
    def accel_m_s2(self) -> Floats:
        """(k, 2) accelerations."""
        velocity = self.velocity_m_s
        return np.asarray((np.roll(velocity, -1, axis=0) - np.roll(velocity, 1, axis=0)) / (2.0 * self.dt_s))

    def sent_accels_m_s2(self, sent_step_s: float) -> Floats:
        """Return (2, k, 2) accelerations with which each sample may be sent: its own, and that of `sent_step_s` later.

        The station shifts set-points along the acceleration of the trajectory's nearest sample that has one on either
        side (`Trajectory.acceleration`). A trajectory that begins now has none there before its second sample, which is
        `sent_step_s` later.
        """
        at_s = self.dt_s * np.arange(len(self.xy_m)) + np.array([[0.0], [sent_step_s]])
        change = self.at(at_s + sent_step_s)[1] - self.at(at_s - sent_step_s)[1]
        return np.asarray(change / (2.0 * sent_step_s))

    @cached_property
    def top_way_m_s(self) -> float:
        """The highest mean speed between two samples."""
        return float(np.hypot(*np.diff(self.xy_m, axis=0, append=self.xy_m[:1]).T).max()) / self.dt_s

    @cached_property
    def middle_m(self) -> Floats:
        """(2,) mean of its samples."""
        return np.asarray(self.xy_m.mean(axis=0))

    @cached_property
    def bounds_m(self) -> tuple[Floats, Floats]:
        """(2,) and (2,): smallest and largest east and north."""
        return self.xy_m.min(axis=0), self.xy_m.max(axis=0)

    def at(self, phase_s: Floats) -> tuple[Floats, Floats]:
        """Return positions and velocities (…, 2) at times (…) since the first point, for any number of round trips."""
        i, j, share = self._samples(phase_s)
        states = (1.0 - share) * self._states[i] + share * self._states[j]
        return states[..., :2], states[..., 2:]

    def places(self, phase_s: Floats) -> Floats:
        """As `at`, for positions only."""
        i, j, share = self._samples(phase_s)
        xy: Floats = (1.0 - share) * self.xy_m[i] + share * self.xy_m[j]
        return xy

    def place(self, phase_s: float) -> tuple[float, float]:
        """As `places` for one time, in plain floats, which takes a tenth of the time."""
        place = phase_s / self.dt_s
        whole = math.floor(place)
        i, share = whole % len(self.xy_m), place - whole
        (x, y), (x1, y1) = self._points[i], self._points[(i + 1) % len(self.xy_m)]
        return (1.0 - share) * x + share * x1, (1.0 - share) * y + share * y1

    @cached_property
    def _states(self) -> Floats:
        """(k, 4) places and velocities side by side, which halves the gathering."""
        return np.hstack([self.xy_m, self.velocity_m_s])

    @cached_property
    def _points(self) -> list[list[float]]:
        points: list[list[float]] = self.xy_m.tolist()
        return points

    def _samples(self, phase_s: Floats) -> tuple[Rows, Rows, Floats]:
        """Return the sample before, the one after, and the share of the way between them."""
        place = np.asarray(phase_s, dtype=float) / self.dt_s
        whole = np.floor(place)
        i = whole.astype(np.intp) % len(self.xy_m)
        return i, (i + 1) % len(self.xy_m), (place - whole)[..., None]


@dataclass(frozen=True)
class TourEvaluation:
    """The idleness that n vehicles on equally spaced slots achieve."""

    worst_s: float
    """Infinite if a cell is never seen."""
    average_s: float
    coverage: float


def evaluate(tour: Tour, cells_m: Floats, radius_m: float, n: int) -> TourEvaluation:
    """Return the idleness of `cells_m` when `n` vehicles follow `tour`, each `period_s / n` behind the next.

    Folded by the slot spacing, all vehicles are one, so one sweep of the tour is enough. `average_s` is computed in
    steps of about `EVALUATION_STEP_S`. Cells that may be the worst are evaluated again in steps of about
    `EXACT_STEP_S`, so that `worst_s` is too long by at most two of these.
    """
    worst_s, average_s = _waits_s(tour, cells_m, radius_m, n, EVALUATION_STEP_S)
    seen = np.isfinite(worst_s)
    if not seen.all():
        return TourEvaluation(math.inf, math.inf, float(seen.mean()))
    may_be_worst = worst_s >= worst_s.max() - 2.0 * EVALUATION_STEP_S
    exact_s, _ = _waits_s(tour, cells_m[may_be_worst], radius_m, n, EXACT_STEP_S)
    return TourEvaluation(float(exact_s.max()), float(average_s.mean()), 1.0)


def evaluate_large(tour: Tour, cells: ZoneCells, radius_m: float, n: int) -> TourEvaluation:
    """As `evaluate`, for many cells: looks only at the cells under each footprint, for two slot spacings."""
    spacing_s = tour.period_s / n
    steps = math.ceil(spacing_s / min(max(spacing_s / SPACING_STEPS, EXACT_STEP_S), LARGE_STEP_S))
    dt_s, grid = spacing_s / steps, IdlenessGrid(cells, radius_m)
    xy = tour.places(dt_s * np.arange(steps * n)).reshape(n, steps, 2)
    for step in range(2 * steps + 1):
        if step == steps:
            grid.begin_window(step * dt_s)
        lap, place = divmod(step, steps)
        # After a slot spacing every vehicle is where the one before it was.
        grid.update(step * dt_s, np.roll(xy[:, place], -lap, axis=0))
    return TourEvaluation(grid.worst_idleness_s, grid.average_idleness_s, grid.coverage)


def _waits_s(tour: Tour, cells_m: Floats, radius_m: float, n: int, about_s: float) -> tuple[Floats, Floats]:
    """Return (cells,) longest and mean waits in steps of at most `about_s`; infinite for a cell that is never seen."""
    steps = max(4, math.ceil(tour.period_s / n / about_s))
    dt_s = tour.period_s / n / steps
    xy = tour.at(dt_s * np.arange(n * steps))[0].astype(np.float32)
    worst_s, average_s = np.full(len(cells_m), math.inf), np.full(len(cells_m), math.inf)
    block = max(1, BLOCK // len(xy))
    for begin in range(0, len(cells_m), block):
        cells = cells_m[begin : begin + block].astype(np.float32)
        away = (cells[:, 0, None] - xy[:, 0]) ** 2 + (cells[:, 1, None] - xy[:, 1]) ** 2
        seen = np.any(np.reshape(away <= np.float32(radius_m**2), (len(cells), n, steps)), axis=1)
        found = np.flatnonzero(seen.any(axis=1))
        if len(found):
            since = _steps_since_seen(seen[found])
            worst_s[begin + found] = (since.max(axis=1) + 1) * dt_s
            average_s[begin + found] = since.mean(axis=1) * dt_s
    return worst_s, average_s


def _steps_since_seen(seen: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return (cells, steps) steps since each cell was last seen, in a periodic pattern."""
    steps = seen.shape[1]
    index = np.arange(steps, dtype=np.int32)
    last = np.where(seen, index, np.int32(-1))
    before = last.max(axis=1) - steps
    np.maximum.accumulate(last, axis=1, out=last)
    last = np.where(last < 0, before[:, None].astype(np.int32), last)
    return index - last


def timed(path_m: Floats, speed_m_s: float, accel_m_s2: float, speed_cap_m_s: Floats | None = None) -> Tour:
    """Return the closed path (m, 2) flown as fast as speed and acceleration allow.

    Lateral and longitudinal acceleration share one circle. `speed_cap_m_s` (m,) is a further limit along the path. The
    result is averaged, because a vehicle must lean over before its acceleration changes. A path whose points are all in
    one place gives a tour that stands there.
    """
    step_m = np.hypot(*np.diff(path_m, axis=0, append=path_m[:1]).T)
    limit = np.full(len(path_m), speed_m_s) if speed_cap_m_s is None else np.minimum(speed_cap_m_s, speed_m_s)
    apart = step_m > SAME_M  # the path's turn would be lost between two points in one place
    if not apart.any():
        return standing(path_m[0])
    path_m, step_m, limit = path_m[apart], step_m[apart], limit[apart]
    curvature = curvature_1_m(path_m)
    limit = np.minimum(limit, np.sqrt(accel_m_s2 / np.maximum(curvature, 1e-9)))
    limit = np.minimum(limit, np.cbrt(MAX_TURN_JERK_M_S3 / np.maximum(curvature, 1e-9) ** 2))
    turn_rad = curvature * (step_m + np.roll(step_m, 1)) / 2.0
    at_corner = accel_m_s2 * CORNER_S / np.maximum(turn_rad, CORNER_RAD)
    limit = np.where(turn_rad > CORNER_RAD, np.minimum(limit, at_corner), limit)
    limit = np.maximum(limit, CRAWL_M_S)
    first = int(np.argmin(limit))
    speed = _brake_and_speed_up(np.roll(limit, -first), np.roll(step_m, -first), np.roll(curvature, -first), accel_m_s2)
    speed = np.roll(speed, first)
    return _averaged(*_sampled(path_m, step_m, speed))


def standing(xy_m: Floats) -> Tour:
    """Return a tour that stays at one place (2,)."""
    return Tour(1.0, np.stack([xy_m, xy_m]), np.zeros((2, 2)))


def _averaged(dt_s: float, xy_m: Floats) -> Tour:
    """Return the moving average over `AVERAGING_S`: never faster, harder or longer than the tour it averages."""
    side = max(1, round(AVERAGING_S / dt_s / 2.0))
    xy = np.mean([np.roll(xy_m, shift, axis=0) for shift in range(-side, side + 1)], axis=0)
    velocity = (np.roll(xy, -1, axis=0) - np.roll(xy, 1, axis=0)) / (2.0 * dt_s)
    return Tour(dt_s, xy, velocity)


def _sampled(path_m: Floats, step_m: Floats, speed: Floats) -> tuple[float, Floats]:
    """Return time step and places of a path in equal times, with constant acceleration between its points."""
    after = np.roll(speed, -1)
    took_s = 2.0 * step_m / (speed + after)
    begin_s = np.concatenate([[0.0], np.cumsum(took_s)])
    count = min(max(8, math.ceil(begin_s[-1] / SAMPLE_S)), MAX_SAMPLES)
    dt_s = float(begin_s[-1]) / count
    when = dt_s * np.arange(count)
    i = np.clip(np.searchsorted(begin_s, when, side="right") - 1, 0, len(path_m) - 1)
    in_leg_s = when - begin_s[i]
    way_m = speed[i] * in_leg_s + (after[i] - speed[i]) / took_s[i] * in_leg_s**2 / 2.0
    share = (way_m / step_m[i])[:, None]
    return dt_s, (1.0 - share) * path_m[i] + share * path_m[(i + 1) % len(path_m)]


def _brake_and_speed_up(limit: Floats, step_m: Floats, curvature: Floats, accel_m_s2: float) -> Floats:
    """Limit speeds on a closed path, which begins where it is slowest, to what braking and speeding up allow.

    Two passes apply v'² <= v² + 2 a ds, with the acceleration that turning leaves.
    """
    square: list[float] = (limit**2).tolist()
    steps, curves, count = step_m.tolist(), curvature.tolist(), len(limit)
    accel2 = accel_m_s2**2
    for i in range(count):
        j, v2 = (i + 1) % count, square[i]
        if v2 < square[j]:  # a shortcut, because this loop is a fifth of a search
            spare = accel2 - (curves[i] * v2) ** 2
            square[j] = min(square[j], v2 + 2.0 * steps[i] * math.sqrt(spare)) if spare > 0.0 else v2
    for i in range(count - 1, -1, -1):
        j = (i + 1) % count
        v2 = square[j]
        if v2 < square[i]:
            spare = accel2 - (curves[j] * v2) ** 2
            square[i] = min(square[i], v2 + 2.0 * steps[i] * math.sqrt(spare)) if spare > 0.0 else v2
    return np.asarray(np.sqrt(np.array(square)))


def curvature_1_m(path_m: Floats) -> Floats:
    """Return the turn per metre at each point of a closed path; a hairpin between two points counts, too."""
    before, after = path_m - np.roll(path_m, 1, axis=0), np.roll(path_m, -1, axis=0) - path_m
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn_rad = np.abs(np.arctan2(cross, (before * after).sum(axis=1)))
    step_m = (np.hypot(*before.T) + np.hypot(*after.T)) / 2.0
    return np.asarray(turn_rad / np.maximum(step_m, 1e-9))


def resampled(path_m: Floats, step_m: float = PATH_STEP_M, least: int = 24) -> Floats:
    """Return the closed polyline in equal steps of about `step_m`, at least `least` of them."""
    closed = np.vstack([path_m, path_m[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    count = max(least, round(way[-1] / step_m))
    at = way[-1] * np.arange(count) / count
    return np.stack([np.interp(at, way, closed[:, axis]) for axis in range(2)], axis=1)


def drawing(xy_m: Floats, points: int, name: str) -> Annotation:
    """Return a closed line with about so many of the points (n, 2), rounded to decimetres, for the map."""
    every = max(1, -(-len(xy_m) // points))
    drawn = [(round(x, 1), round(y, 1)) for x, y in xy_m[::every].tolist()]
    return Annotation("polyline", (*drawn, drawn[0]), name)
