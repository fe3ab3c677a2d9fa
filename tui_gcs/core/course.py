"""Courses: what a vehicle was told to do, as a function of time. Positions are ENU metres, z above home."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.messages import Intent, Vec3

Samples = NDArray[np.float64]

STILL: Vec3 = (0.0, 0.0, 0.0)
LEAST_SPEED_M_S = 0.1
"""Slower is not flying to a place."""


class Reference(Protocol):
    """What is wanted of a vehicle as a function of time."""

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s`."""
        ...


@dataclass(frozen=True)
class Stand:
    """Be at `point_m` and stay: a hold, or a place to fly to at no more than `speed_m_s`."""

    point_m: Vec3
    speed_m_s: float

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s`."""
        return self.point_m, STILL

    def predict(self, now: float, position_m: Vec3, times_s: Samples) -> Samples:
        """(k, 3) where the vehicle will be `times_s` after `now`: straight to the point."""
        here, there = np.array(position_m), np.array(self.point_m)
        distance = float(np.linalg.norm(there - here))
        if distance < 1e-6:
            return np.repeat(here[None, :], len(times_s), axis=0)
        share = np.minimum(times_s * self.speed_m_s / distance, 1.0)
        path: Samples = here + share[:, None] * (there - here)
        return path


@dataclass(frozen=True)
class Trajectory:
    """Follow timed samples; wait at the first one, and stay at the last one."""

    t0_s: float
    dt_s: float
    positions_m: Samples
    velocities_m_s: Samples

    @property
    def end_s(self) -> float:
        """Time of the last sample."""
        return self.t0_s + self.dt_s * (len(self.positions_m) - 1)

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s` (linear between samples)."""
        if t_s >= self.end_s:
            x, y, z = self.positions_m[-1]
            return (float(x), float(y), float(z)), STILL
        if t_s < self.t0_s:
            x, y, z = self.positions_m[0]
            return (float(x), float(y), float(z)), STILL  # not begun: a velocity now would carry it past its place
        place = (t_s - self.t0_s) / self.dt_s
        i = min(int(place), len(self.positions_m) - 2)
        share = place - i
        p = (1 - share) * self.positions_m[i] + share * self.positions_m[i + 1]
        v = (1 - share) * self.velocities_m_s[i] + share * self.velocities_m_s[i + 1]
        return (float(p[0]), float(p[1]), float(p[2])), (float(v[0]), float(v[1]), float(v[2]))

    def acceleration(self, t_s: float) -> Vec3:
        """How its velocity changes about `t_s`, m/s²; none before it begins and after it ends."""
        if not self.t0_s <= t_s < self.end_s:
            return STILL
        place = (t_s - self.t0_s) / self.dt_s
        i = min(max(round(place), 1), len(self.positions_m) - 2) if len(self.positions_m) > 2 else 0
        before, after = (i - 1, i + 1) if len(self.positions_m) > 2 else (0, 1)
        x, y, z = (self.velocities_m_s[after] - self.velocities_m_s[before]) / ((after - before) * self.dt_s)
        return (float(x), float(y), float(z))

    def predict(self, now: float, position_m: Vec3, times_s: Samples) -> Samples:
        """(k, 3) where the vehicle will be `times_s` after `now`; its present error fades within 2 s."""
        at = (now - self.t0_s + times_s) / self.dt_s
        index = np.arange(len(self.positions_m))
        planned = np.stack([np.interp(at, index, self.positions_m[:, axis]) for axis in range(3)], axis=1)
        error = np.array(position_m) - np.array(self.at(now)[0])
        fade = np.clip(1.0 - times_s / 2.0, 0.0, 1.0)
        predicted: Samples = planned + fade[:, None] * error
        return predicted


class Moving(Reference, Protocol):
    """A course that moves: followed by a stream of set-points, led by what its vehicle is late."""

    def acceleration(self, t_s: float) -> Vec3:
        """How its velocity changes at `t_s`, m/s²."""
        ...

    def predict(self, now: float, position_m: Vec3, times_s: Samples) -> Samples:
        """(k, 3) where the vehicle will be `times_s` after `now`."""
        ...


Course = Stand | Moving
"""What a vehicle was told to do."""


def stopping_point(position_m: Vec3, velocity_m_s: Vec3, accel_m_s2: float) -> Vec3:
    """Where a vehicle comes to rest when it brakes now: v² / 2a ahead."""
    speed = math.sqrt(sum(v * v for v in velocity_m_s))
    if not math.isfinite(speed) or speed < 0.05:
        return position_m
    share = speed / (2 * accel_m_s2)
    x, y, z = (p + share * v for p, v in zip(position_m, velocity_m_s, strict=True))
    return (x, y, z)


def course_of(intent: Intent, speed_m_s: float) -> Stand | Trajectory | str:
    """The course a `goto` or `trajectory` asks for, or why it asks for nonsense; `speed_m_s` is the limit."""
    if intent.kind == "goto":
        if intent.position_m is None or not all(map(math.isfinite, intent.position_m)):
            return "goto without a finite position"
        asked = speed_m_s if intent.speed_m_s is None else intent.speed_m_s
        if not asked >= LEAST_SPEED_M_S:
            return f"goto with {asked:g} m/s: at least {LEAST_SPEED_M_S:g}"
        return Stand(intent.position_m, min(asked, speed_m_s))
    positions = np.array(intent.positions_m, dtype=float)
    velocities = np.array(intent.velocities_m_s, dtype=float)
    if positions.ndim != 2 or positions.shape[0] < 2 or positions.shape != velocities.shape or intent.dt_s <= 0:
        return "trajectory needs at least two samples, as many velocities as positions, and dt_s > 0"
    if len(positions) > 600 or not (np.isfinite(positions).all() and np.isfinite(velocities).all()):
        return "trajectory has too many or not finite samples"
    if not (math.isfinite(intent.t0_s) and math.isfinite(intent.dt_s)):
        return "trajectory times are not finite"
    return Trajectory(intent.t0_s, intent.dt_s, positions, velocities)
