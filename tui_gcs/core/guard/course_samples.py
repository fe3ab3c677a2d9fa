"""Samples of what courses ask for, of many vehicles at once, as arrays."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.motion.course import Course, PositionTarget, Reference, Samples, Trajectory

STEP_S = 0.25
"""Time between samples of a prediction."""
FAR_M = 1e6
"""Positions are clipped to this distance: farther away nothing is computed."""
MAX_NUMBER = 1e100
"""Larger numbers of a course, and times between its samples, are replaced by this or its inverse: no overflow."""


@dataclass(frozen=True)
class CourseSamples:
    """Samples of n courses, one course after the other; 0 where they are not finite, never above `MAX_NUMBER`."""

    finite: NDArray[np.bool_]
    """(m,) whether all numbers of the sample are finite."""
    places_m: Samples
    """(m, 3) positions."""
    velocities_m_s: Samples
    """(m, 3) velocities."""
    step_s: Samples
    """(m,) time between the samples of its course."""
    first: NDArray[np.intp]
    """(n,) index of the first sample of each course."""

    def all_finite(self) -> NDArray[np.bool_]:
        """(n,) whether all samples of a course are finite."""
        finite: NDArray[np.bool_] = np.logical_and.reduceat(self.finite, self.first)
        return finite

    def worst(self, numbers: Samples) -> Samples:
        """(n,) the largest value within each course of (m,) numbers."""
        most: Samples = np.maximum.reduceat(numbers, self.first)
        return most

    def accel_m_s2(self) -> Samples:
        """(m,) acceleration that velocities ask for since the sample before; 0 at the first."""
        return self._since(np.diff(self.velocities_m_s, axis=0))

    def mismatch_m_s(self) -> Samples:
        """(m,) by how much positions move otherwise than the velocities demand, since the sample before.

        0 at the first.
        """
        speeds = self.velocities_m_s
        said_m = (speeds[1:] + speeds[:-1]) / 2 * self.step_s[1:, None]
        return self._since(np.diff(self.places_m, axis=0) - said_m)

    def _since(self, changes: Samples) -> Samples:
        """(m,) size of changes (m - 1, 3) per second; changes from one course to the next are 0."""
        rate = np.zeros(len(self.places_m))
        rate[1:] = length_of(changes) / self.step_s[1:]
        rate[self.first] = 0.0
        return rate


def course_samples(courses: Sequence[Course], now: float, times_s: Samples) -> CourseSamples:
    """What courses ask for in the next seconds. A trajectory is sampled at its own samples, so that none is missed."""
    parts = [_steps(course, now, times_s) for course in courses]
    lengths = [len(places) for _, places, _ in parts]
    places = np.concatenate([part for _, part, _ in parts])
    velocities = np.concatenate([part for *_, part in parts])
    finite = finite_in(places, velocities)
    places[~finite] = velocities[~finite] = 0.0
    step_s = np.repeat(np.clip([step_s for step_s, *_ in parts], 1 / MAX_NUMBER, MAX_NUMBER), lengths)
    first = np.cumsum([0, *lengths[:-1]])
    return CourseSamples(
        finite, np.clip(places, -MAX_NUMBER, MAX_NUMBER), np.clip(velocities, -MAX_NUMBER, MAX_NUMBER), step_s, first
    )


def length_of(vectors: Samples) -> Samples:
    """(k,) lengths of vectors (k, 3)."""
    length: Samples = np.hypot(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2])
    return length


def finite_in(places: Samples, velocities: Samples) -> NDArray[np.bool_]:
    """(k,) whether all numbers of (k, 3) and (k, 3) are finite."""
    both = np.concatenate([places, velocities], axis=1)
    finite: NDArray[np.bool_] = np.isfinite(both).all(axis=1)
    return finite


def _steps(course: Course, now: float, times_s: Samples) -> tuple[float, Samples, Samples]:
    if not isinstance(course, Trajectory):
        return STEP_S, *_samples(course, now, times_s)
    begin = math.floor(min(max((now - course.t0_s) / course.dt_s, 0.0), len(course.positions_m) - 2))
    end = begin + 2 + math.ceil(min(times_s[-1] / course.dt_s, len(course.positions_m)))
    return course.dt_s, course.positions_m[begin:end], course.velocities_m_s[begin:end]


def wanted(courses: Sequence[Course], now: float, times_s: Samples) -> Samples:
    """(n, k, 6) positions and velocities, side by side, that the courses ask for at `now + times_s`."""
    asked = np.empty((len(courses), len(times_s), 6))
    rows = [i for i, course in enumerate(courses) if isinstance(course, Trajectory)]
    tracks = [course for course in courses if isinstance(course, Trajectory)]
    if tracks:
        asked[rows] = _along(tracks, now + times_s)
    for i, course in enumerate(courses):
        if not isinstance(course, Trajectory):
            asked[i] = np.concatenate(_samples(course, now, times_s), axis=1)
    # Courses that are not finite are vetoed elsewhere; here they must only do no harm.
    asked[np.isnan(asked)] = 0.0
    return np.clip(asked, -FAR_M, FAR_M, out=asked)


def _samples(course: Reference, now: float, times_s: Samples) -> tuple[Samples, Samples]:
    """(k, 3) positions and (k, 3) velocities of one course."""
    if isinstance(course, PositionTarget):
        return np.repeat(np.array([course.point_m]), len(times_s), axis=0), np.zeros((len(times_s), 3))
    asked = np.array([course.at(now + t) for t in times_s.tolist()], dtype=float)
    return asked[:, 0], asked[:, 1]


def _along(tracks: list[Trajectory], at_s: Samples) -> Samples:
    """(n, k, 6) what `Trajectory.at` gives, for many trajectories and times at once."""
    samples = np.concatenate(
        [
            np.concatenate([track.positions_m for track in tracks]),
            np.concatenate([track.velocities_m_s for track in tracks]),
        ],
        axis=1,
    )
    lengths = np.array([len(track.positions_m) for track in tracks])
    first, last = (np.cumsum(lengths) - lengths)[:, None], lengths[:, None] - 1
    t0_s, dt_s = np.array([(track.t0_s, track.dt_s) for track in tracks]).T[:, :, None]
    place = np.clip((at_s - t0_s) / dt_s, 0.0, last)
    i = np.minimum(place.astype(np.int64), last - 1)
    share = (place - i)[:, :, None]
    found: Samples = np.take(samples, first + i, axis=0)
    after = np.take(samples, first + i + 1, axis=0)
    found *= 1 - share
    after *= share
    found += after
    found[:, :, 3:] *= ((at_s >= t0_s) & (at_s < t0_s + dt_s * last))[:, :, None]
    return found
