"""Orbit: a circle flown again and again, as a course like any other, so that every autopilot flies it the same way."""

import math
from dataclasses import dataclass, replace

from tui_gcs.core.motion.course import STILL, rest_to_rest_s
from tui_gcs.core.protocol.common import Vec3

# PX4's own DO_ORBIT reaches 88 % of the requested speed and reads the sticks; ArduCopter's CIRCLE sinks without a
# pilot.
ACCEL_SHARE = 0.9
"""Share of the allowed acceleration; the rest is the autopilot's for tracking."""
MIN_RADIUS_M, MIN_SPEED_M_S = 1.0, 0.1
"""Smallest radius and speed of an orbit."""


@dataclass(frozen=True)
class Orbit:
    """Straight to the nearest point of the circle, a stop there, then round and round."""

    begin_s: float
    from_m: Vec3
    centre_m: Vec3
    radius_m: float
    speed_m_s: float
    accel_m_s2: float
    clockwise: bool = True
    """Seen from above."""

    @staticmethod
    def about(
        now: float,
        position_m: Vec3,
        centre_m: Vec3,
        radius_m: float,
        speed_m_s: float,
        accel_m_s2: float,
        *,
        clockwise: bool = True,
    ) -> "Orbit":
        """An orbit from `position_m`, at the height of `centre_m`, no faster than `accel_m_s2` allows on such a circle.

        Raises:
            ValueError: the numbers make no circle.
        """
        numbers = (now, *position_m, *centre_m, radius_m, speed_m_s, accel_m_s2)
        if not all(map(math.isfinite, numbers)) or accel_m_s2 <= 0.0:
            raise ValueError("an orbit needs finite numbers")
        if radius_m < MIN_RADIUS_M or speed_m_s < MIN_SPEED_M_S:
            raise ValueError(f"an orbit needs a radius of {MIN_RADIUS_M:g} m and {MIN_SPEED_M_S:g} m/s at least")
        accel = ACCEL_SHARE * accel_m_s2
        # v²/r is the acceleration of a circle.
        speed = min(speed_m_s, math.sqrt(accel * radius_m))
        return Orbit(now, position_m, centre_m, radius_m, speed, accel, clockwise)

    def anew(self, now: float, velocity_m_s: Vec3, rests_m: Vec3) -> "Orbit":
        """The same circle, from where a vehicle that brakes now comes to rest."""
        return replace(self, begin_s=now + math.hypot(*velocity_m_s) / self.accel_m_s2, from_m=rests_m)

    def same_circle(self, other: "Orbit") -> bool:
        """Whether both fly the same circle, however they came to it."""
        mine = (self.centre_m, self.radius_m, self.speed_m_s, self.clockwise)
        return mine == (other.centre_m, other.radius_m, other.speed_m_s, other.clockwise)

    @property
    def entry_m(self) -> Vec3:
        """Where it reaches the circle; north of the centre where every point is as near."""
        dx, dy = self.from_m[0] - self.centre_m[0], self.from_m[1] - self.centre_m[1]
        away_m = math.hypot(dx, dy)
        east, north = (dx / away_m, dy / away_m) if away_m > 1e-6 else (0.0, 1.0)
        x, y, z = self.centre_m
        return (x + self.radius_m * east, y + self.radius_m * north, z)

    @property
    def circle_s(self) -> float:
        """When the approach ends and the circle begins."""
        return self.begin_s + rest_to_rest_s(math.dist(self.from_m, self.entry_m), self.speed_m_s, self.accel_m_s2)

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity wanted at `t_s`."""
        if t_s < self.circle_s:
            return self._approach(t_s)
        way_m, speed, _ = self._started(t_s - self.circle_s)
        east, north = self._outward(way_m)
        sense = -1.0 if self.clockwise else 1.0
        x, y, z = self.centre_m
        place = (x + self.radius_m * east, y + self.radius_m * north, z)
        return place, (-sense * speed * north, sense * speed * east, 0.0)

    def acceleration(self, t_s: float) -> Vec3:
        """How its velocity changes at `t_s`, m/s²."""
        if t_s < self.circle_s:
            (before, after), step_s = (self._approach(t_s + dt)[1] for dt in (-0.1, 0.1)), 0.2
            x, y, z = ((b - a) / step_s for a, b in zip(before, after, strict=True))
            return (x, y, z)
        way_m, speed, accel = self._started(t_s - self.circle_s)
        east, north = self._outward(way_m)
        sense, inward = -1.0 if self.clockwise else 1.0, speed * speed / self.radius_m
        return (-inward * east - sense * accel * north, -inward * north + sense * accel * east, 0.0)

    def _approach(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity on the straight way to the entry: speed up, cruise, brake."""
        there, left_s = self.entry_m, self.circle_s - t_s
        away_m, since_s = math.dist(self.from_m, there), t_s - self.begin_s
        if since_s <= 0.0 or away_m < 1e-6:
            return self.from_m, STILL
        by_start, by_end = self._started(since_s), self._started(max(left_s, 0.0))
        first = since_s <= left_s
        way_m, speed = (by_start[0], by_start[1]) if first else (away_m - by_end[0], by_end[1])
        unit = [(b - a) / away_m for a, b in zip(self.from_m, there, strict=True)]
        x, y, z = (a + way_m * u for a, u in zip(self.from_m, unit, strict=True))
        return (x, y, z), (speed * unit[0], speed * unit[1], speed * unit[2])

    def _started(self, since_s: float) -> tuple[float, float, float]:
        """(way, speed, acceleration) a time after it began to move."""
        ramp_s = self.speed_m_s / self.accel_m_s2
        if since_s < ramp_s:
            return 0.5 * self.accel_m_s2 * since_s**2, self.accel_m_s2 * since_s, self.accel_m_s2
        return self.speed_m_s * (since_s - 0.5 * ramp_s), self.speed_m_s, 0.0

    def _outward(self, way_m: float) -> tuple[float, float]:
        """East and north parts of the direction from the centre after `way_m` on the circle."""
        x, y, _ = self.entry_m
        begin = math.atan2(y - self.centre_m[1], x - self.centre_m[0])
        angle = begin + (-1.0 if self.clockwise else 1.0) * way_m / self.radius_m
        return math.cos(angle), math.sin(angle)
