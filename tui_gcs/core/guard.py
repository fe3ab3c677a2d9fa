"""The guard: the last wall before the wire. It only passes or vetoes; it never changes what is asked.

Hold, return and land are not its business: they are never vetoed. What leads back inside, or apart, always passes.
The idea is ASTM F3269's run-time assurance: a small trusted monitor around functions nobody has proven.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from tui_gcs.core.course import Course, Reference, Samples, stopping_point
from tui_gcs.core.messages import Vec3
from tui_gcs.core.scenario import Limits, OperatingArea
from tui_gcs.core.zones import Zone, polygon_of

HORIZON_S = 5.0
"""How far ahead separation is predicted."""
STEP_S = 0.5
MIN_SETPOINT_GAP_S = 0.08
"""At most 12.5 set-points a second and vehicle."""
SPEED_TOLERANCE = 1.05
EDGE_TOLERANCE_M = 0.01
GROUND_M = 2.0
"""Below this height above home neither the band nor separation applies."""

STOPS = frozenset({"hold", "land", "disarm", "return"})
"""Actions that are never vetoed."""

PREDICTED_S: Samples = np.arange(0.0, HORIZON_S + STEP_S / 2, STEP_S)


@dataclass(frozen=True)
class Verdict:
    """Passed, or the reason why not. `code` groups reasons for counting."""

    code: str = ""
    text: str = ""

    @property
    def ok(self) -> bool:
        """Whether it passed."""
        return not self.code


PASS = Verdict()


@dataclass(frozen=True)
class Mover:
    """A vehicle as the guard sees it."""

    id: int
    position_m: Vec3
    path_m: Samples
    """(k, 3) predicted positions at `PREDICTED_S` from now."""
    in_column: bool = False
    """Taking off or landing vertically: exempt from separation."""


def predict(position_m: Vec3, velocity_m_s: Vec3, course: Course | None, now: float) -> Samples:
    """(k, 3) positions at `PREDICTED_S` from now: along the course, or straight on without one."""
    if course is not None:
        return course.predict(now, position_m, PREDICTED_S)
    ahead: Samples = np.array(position_m) + PREDICTED_S[:, None] * np.nan_to_num(np.array(velocity_m_s))
    return ahead


class Guard:
    """Judges set-points against area, band, no-fly zones, speed, rate and predicted separation."""

    def __init__(self, limits: Limits, area: OperatingArea, no_fly: tuple[Zone, ...]) -> None:
        """Guard one round; `set_round` for the next."""
        self.vetoes: Counter[str] = Counter()
        self._last_s: dict[int, float] = {}
        self.set_round(limits, area, no_fly)

    def set_round(self, limits: Limits, area: OperatingArea, no_fly: tuple[Zone, ...]) -> None:
        """Take the geometry of another round."""
        self.limits = limits
        self.area = area
        margin = limits.geofence_margin_m
        self.allowed = _without(polygon_of(area.shape), no_fly, 0.0)
        """Where vehicles may be at all: the operating area less no-fly zones."""
        self._inner = _without(polygon_of(area.shape).buffer(-margin), no_fly, margin)
        shapely.prepare(self._inner)
        shapely.prepare(self.allowed)

    def inside(self, position_m: Vec3) -> bool:
        """Whether a place is inside the operating area and outside no-fly zones (no margin)."""
        return bool(shapely.intersects_xy(self.allowed, position_m[0], position_m[1]))

    def outside_m(self, position_m: Vec3) -> float:
        """How far outside the allowed area a place is, 0 inside."""
        if self.inside(position_m):
            return 0.0
        return float(self.allowed.distance(Point(position_m[0], position_m[1])))

    def judge(self, me: Mover, course: Reference, others: list[Mover], now: float) -> Verdict:
        """Judge the set-point that `course` gives now for `me`, whose path follows it; vetoes are counted."""
        verdict = (
            self._rate(me, now)
            or self._speed(course, now)
            or self._region(me, course, now)
            or self._failed(self.separation(me, others))
            or PASS
        )
        if verdict.ok:
            self._last_s[me.id] = now
        else:
            self.vetoes[verdict.code] += 1
        return verdict

    def judge_action(self, what: str, *, lost: bool) -> Verdict:
        """Stops may always go out; everything else only to a vehicle that is heard."""
        if lost and what not in STOPS:
            return self.veto("lost vehicle", f"{what}: nothing has been heard of it")
        return PASS

    def veto(self, code: str, text: str) -> Verdict:
        """Count and return a veto that was found before there was a course (unknown vehicle, wrong kind, …)."""
        self.vetoes[code] += 1
        return Verdict(code, text)

    @staticmethod
    def _failed(verdict: Verdict) -> Verdict | None:
        return None if verdict.ok else verdict

    def _rate(self, me: Mover, now: float) -> Verdict | None:
        if now - self._last_s.get(me.id, -math.inf) < MIN_SETPOINT_GAP_S:
            return Verdict("rate", f"set-points less than {MIN_SETPOINT_GAP_S * 1e3:.0f} ms apart")
        return None

    def _speed(self, course: Reference, now: float) -> Verdict | None:
        speed = math.hypot(*course.at(now)[1])
        if speed > self.limits.speed_m_s * SPEED_TOLERANCE:
            return Verdict("speed", f"{speed:.1f} m/s asked, {self.limits.speed_m_s:.1f} allowed")
        return None

    def _region(self, me: Mover, course: Reference, now: float) -> Verdict | None:
        """Target and stopping point inside area and band, and the way there too, unless it leads back inside."""
        target, velocity = course.at(now)
        for place in (target, stopping_point(target, velocity, self.limits.accel_m_s2)):
            if not shapely.intersects_xy(self._inner, place[0], place[1]):
                if self._leads_back(me, place):
                    continue
                return Verdict(
                    "area", f"({place[0]:.0f}, {place[1]:.0f}) is outside the operating area less its margin"
                )
            if not self.area.alt_min_m - 0.5 <= place[2] <= self.area.alt_max_m + 0.5:
                band = f"{self.area.alt_min_m:.0f}-{self.area.alt_max_m:.0f} m"
                if not self._returns_to_band(me, place):
                    return Verdict("band", f"{place[2]:.1f} m is outside the altitude band {band}")
        for region, what in ((self._inner, " less its margin"), (self.allowed, "")):
            if shapely.intersects_xy(region, me.position_m[0], me.position_m[1]):
                way = LineString([me.position_m[:2], target[:2]])
                if way.length > EDGE_TOLERANCE_M and not region.covers(way):
                    return Verdict("area", f"the straight way there leaves the operating area{what}")
                break
        return None

    def _leads_back(self, me: Mover, place: Vec3) -> bool:
        """From outside: `place` is nearer to the allowed region than the vehicle is now."""
        here = float(self._inner.distance(Point(me.position_m[0], me.position_m[1])))
        there = float(self._inner.distance(Point(place[0], place[1])))
        return here > 0 and there < here

    def _returns_to_band(self, me: Mover, place: Vec3) -> bool:
        def miss(z: float) -> float:
            return max(self.area.alt_min_m - z, z - self.area.alt_max_m, 0.0)

        return miss(me.position_m[2]) > miss(place[2])

    def separation(self, me: Mover, others: list[Mover]) -> Verdict:
        """Whether `me`, on its path, keeps clear of everybody for the next seconds. Not counted.

        Who climbs or descends in its own column gives way to nobody, but others keep clear of it.
        """
        if me.in_column or me.position_m[2] < GROUND_M:
            return PASS
        for other in others:
            if other.id == me.id or other.position_m[2] < GROUND_M:
                continue
            gap = me.path_m - other.path_m
            level = np.hypot(gap[:, 0], gap[:, 1])
            upright = np.abs(gap[:, 2])
            close = (level < self.limits.separation_horizontal_m) & (upright < self.limits.separation_vertical_m)
            if close.any() and not self._moves_apart(level, upright, close):
                when = float(PREDICTED_S[int(np.argmax(close))])
                return Verdict("separation", f"too close to vehicle {other.id} in {when:.1f} s")
        return PASS

    def _moves_apart(self, level: Samples, upright: Samples, close: NDArray[np.bool_]) -> bool:
        """Already too close, and never closer than now: leading apart is always allowed."""
        if not close[0]:
            return False
        distance = np.hypot(level / self.limits.separation_horizontal_m, upright / self.limits.separation_vertical_m)
        return bool(distance.min() >= distance[0] - 1e-6)


def _without(region: BaseGeometry, no_fly: tuple[Zone, ...], margin_m: float) -> BaseGeometry:
    for zone in no_fly:
        region = region.difference(polygon_of(zone.shape).buffer(margin_m))
    return region
