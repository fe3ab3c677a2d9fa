"""Cruise: straight on with one velocity for a while, then at rest; a course like any other.

It turns from the velocity that the vehicle has to the one it is to have, and brakes at the end, no harder than allowed.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.motion.course import STILL
from tui_gcs.core.protocol.common import Vec3

ACCEL_SHARE = 0.9
"""Share of the allowed acceleration; the rest is the autopilot's for tracking."""
MAX_CRUISE_S = 30.0
"""A velocity intent may not be valid for longer: a planner repeats what is to last."""


@dataclass(frozen=True)
class Cruise:
    """From `from_m` with `from_m_s` at `begin_s` to `velocity_m_s` until `end_s`, then to rest."""

    begin_s: float
    from_m: Vec3
    from_m_s: Vec3
    velocity_m_s: Vec3
    end_s: float
    accel_m_s2: float

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s`."""
        since_s = t_s - self.begin_s
        lasts_s = max(self.end_s - self.begin_s, 0.0)
        if since_s <= lasts_s:
            return self._turning(since_s)
        place, velocity = self._turning(lasts_s)
        brake_s = math.hypot(*velocity) / self.accel_m_s2
        if brake_s < 1e-9:
            return place, STILL
        share = min((since_s - lasts_s) / brake_s, 1.0)
        way_s = brake_s * share * (1.0 - share / 2)
        return _add(place, velocity, way_s), _scaled(velocity, 1.0 - share)

    def acceleration(self, t_s: float) -> Vec3:
        """How its velocity changes at `t_s`, m/s²."""
        before, after = self.at(t_s - 0.05)[1], self.at(t_s + 0.05)[1]
        x, y, z = ((b - a) / 0.1 for a, b in zip(before, after, strict=True))
        return (x, y, z)

    def _turning(self, since_s: float) -> tuple[Vec3, Vec3]:
        """Place and velocity while it turns to the velocity asked for, and then with it."""
        if since_s <= 0.0:
            return _add(self.from_m, self.from_m_s, since_s), self.from_m_s
        change = _add(self.velocity_m_s, self.from_m_s, -1.0)
        turn_s = math.hypot(*change) / self.accel_m_s2
        if turn_s < 1e-9:
            return _add(self.from_m, self.velocity_m_s, since_s), self.velocity_m_s
        turning_s = min(since_s, turn_s)
        velocity = _add(self.from_m_s, change, turning_s / turn_s)
        place = _add(_add(self.from_m, self.from_m_s, turning_s), change, turning_s**2 / (2 * turn_s))
        return _add(place, velocity, since_s - turning_s), velocity


def _add(a: Vec3, b: Vec3, share: float) -> Vec3:
    return (a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2])


def _scaled(a: Vec3, share: float) -> Vec3:
    return (a[0] * share, a[1] * share, a[2] * share)
