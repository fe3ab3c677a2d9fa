"""Courses: what a vehicle is to do, as a function of time. Positions are ENU metres, z above home."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.protocol.common import Intent, Vec3

Samples = NDArray[np.float64]

STILL: Vec3 = (0.0, 0.0, 0.0)
"""The velocity of a vehicle at rest."""
MIN_SPEED_M_S = 0.1
"""A goto may not be slower."""


class Reference(Protocol):
    """Position and velocity wanted of a vehicle as a function of time."""

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s`."""
        ...


@dataclass(frozen=True)
class PositionTarget:
    """Be at `point_m` and stay: a hold, or a place to fly to at no more than `speed_m_s`."""

    point_m: Vec3
    speed_m_s: float

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s`."""
        return self.point_m, STILL


@dataclass(frozen=True)
class Trajectory:
    """Follow timed samples; wait at the first one, and stay at the last one."""

    t0_s: float
    dt_s: float
    positions_m: Samples
    velocities_m_s: Samples

    @cached_property
    def end_s(self) -> float:
        """Time of the last sample."""
        return self.t0_s + self.dt_s * (len(self.positions_m) - 1)

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s` (linear between samples)."""
        if t_s >= self.end_s:
            x, y, z = self.positions_m[-1].tolist()
            return (x, y, z), STILL
        if t_s < self.t0_s:
            x, y, z = self.positions_m[0].tolist()
            # Before its begin a trajectory has no velocity: that would carry the vehicle past its first place.
            return (x, y, z), STILL
        place = (t_s - self.t0_s) / self.dt_s
        i = min(int(place), len(self.positions_m) - 2)
        share = place - i
        rest = 1 - share
        x, y, z, x1, y1, z1, vx, vy, vz, vx1, vy1, vz1 = self._samples_from(i)
        return (
            (rest * x + share * x1, rest * y + share * y1, rest * z + share * z1),
            (rest * vx + share * vx1, rest * vy + share * vy1, rest * vz + share * vz1),
        )

    def acceleration(self, t_s: float) -> Vec3:
        """How its velocity changes about `t_s`, m/s²; none before it begins and after it ends."""
        if not self.t0_s <= t_s < self.end_s:
            return STILL
        place = (t_s - self.t0_s) / self.dt_s
        i = min(max(round(place), 1), len(self.positions_m) - 2) if len(self.positions_m) > 2 else 0
        known = self._accelerations.get(i)
        if known is None:
            before, after = (i - 1, i + 1) if len(self.positions_m) > 2 else (0, 1)
            took_s = (after - before) * self.dt_s
            (x, y, z), (x1, y1, z1) = self.velocities_m_s[[before, after]].tolist()
            known = self._accelerations[i] = (x1 - x) / took_s, (y1 - y) / took_s, (z1 - z) / took_s
        return known

    def _samples_from(self, i: int) -> list[float]:
        """Positions i and i + 1, then velocities i and i + 1, as twelve plain floats.

        Plain floats take a third of numpy's time. Only the few samples about now are converted: a planner replaces its
        trajectories several times a second.
        """
        known = self._samples.get(i)
        if known is None:
            known = self._samples[i] = [
                *self.positions_m[i : i + 2].ravel().tolist(),
                *self.velocities_m_s[i : i + 2].ravel().tolist(),
            ]
        return known

    @cached_property
    def _samples(self) -> dict[int, list[float]]:
        """What `_samples_from` has converted, by its first sample."""
        return {}

    @cached_property
    def _accelerations(self) -> dict[int, Vec3]:
        """What `acceleration` has found, by its middle sample."""
        return {}


class MovingCourse(Reference, Protocol):
    """A course that moves: followed by a stream of set-points, with lead compensation for the vehicle's lag."""

    def acceleration(self, t_s: float) -> Vec3:
        """How its velocity changes at `t_s`, m/s²."""
        ...


Course = PositionTarget | MovingCourse
"""What a vehicle is to do."""


def stopping_point(position_m: Vec3, velocity_m_s: Vec3, accel_m_s2: float) -> Vec3:
    """Where a vehicle comes to rest when it brakes now: v² / 2a ahead, sideways and in height each by its own speed."""
    # A vehicle that sinks a little while it is fast must not be sent lower for being fast: it would sink faster
    # than before.
    level, up = math.hypot(velocity_m_s[0], velocity_m_s[1]), abs(velocity_m_s[2])
    if not math.isfinite(level + up) or math.hypot(level, up) < 0.05:
        return position_m
    seconds = (level / (2 * accel_m_s2), level / (2 * accel_m_s2), up / (2 * accel_m_s2))
    x, y, z = (p + t * v for p, t, v in zip(position_m, seconds, velocity_m_s, strict=True))
    return (x, y, z)


def rest_to_rest_s(way_m: float, speed_m_s: float, accel_m_s2: float) -> float:
    """How long a straight way takes from rest to rest, at no more than `speed_m_s` (a trapezium of speeds)."""
    ramp_m = speed_m_s * speed_m_s / accel_m_s2
    return way_m / speed_m_s + speed_m_s / accel_m_s2 if way_m > ramp_m else 2.0 * math.sqrt(way_m / accel_m_s2)


def course_of(intent: Intent, speed_m_s: float) -> PositionTarget | Trajectory | str:
    """The course of a `goto` or `trajectory` intent, or why it has none; `speed_m_s` is the limit."""
    if intent.kind == "goto":
        if intent.position_m is None or not all(map(math.isfinite, intent.position_m)):
            return "goto without a finite position"
        speed = speed_m_s if intent.speed_m_s is None else intent.speed_m_s
        if not speed >= MIN_SPEED_M_S:
            return f"goto with {speed:g} m/s: at least {MIN_SPEED_M_S:g}"
        return PositionTarget(intent.position_m, min(speed, speed_m_s))
    count = len(intent.positions_m)
    # Vectors of an intent have three numbers. Of nested tuples numpy makes an array in twice the time.
    positions, velocities = (
        np.fromiter(chain.from_iterable(vectors), dtype=float).reshape(-1, 3)
        for vectors in (intent.positions_m, intent.velocities_m_s)
    )
    if count < 2 or not len(positions) == len(velocities) == count or intent.dt_s <= 0:
        return "trajectory needs at least two samples, as many velocities as positions, and dt_s > 0"
    if len(positions) > 600 or not (np.isfinite(positions).all() and np.isfinite(velocities).all()):
        return "trajectory has too many or not finite samples"
    if not (math.isfinite(intent.t0_s) and math.isfinite(intent.dt_s)):
        return "trajectory times are not finite"
    return Trajectory(intent.t0_s, intent.dt_s, positions, velocities)
