"""The guard: the last wall before the wire. It only passes or vetoes; it never changes what is asked.

Hold, return and land are not its business: they are never vetoed. What leads back inside, or apart, always passes.
The idea is ASTM F3269's run-time assurance: a small trusted monitor around functions nobody has proven.

What it keeps true, step by step: whoever brakes now comes to rest inside, and apart from all the others. So a course
passes only if that is still true after it was flown until it is judged again.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Point

from tui_gcs.core.course import Course, Reference, Samples, Stand, Trajectory, stopping_point
from tui_gcs.core.guard_motion import (
    CLIMB_M_S,
    DESCENT_M_S,
    FAR_M,
    STEP_S,
    Flock,
    Mover,
    Sight,
    foresee,
    samples_of,
    times_of,
)
from tui_gcs.core.guard_region import Walls, band_miss_m
from tui_gcs.core.guard_separation import meeting
from tui_gcs.core.messages import Vec3
from tui_gcs.core.scenario import Limits, OperatingArea
from tui_gcs.core.zones import Zone

MIN_SETPOINT_GAP_S = 0.08
"""At most 12.5 set-points a second and vehicle."""
SPEED_TOLERANCE = 1.05
ACCEL_TOLERANCE = 1.25
"""Of what a course asks between two samples of it: a tour is smooth in time, not in its samples."""
CATCH_UP_S = 2.0
"""A vehicle may be asked for another velocity than it has, if it can have it within this time..."""
CATCH_UP_M = 15.0
"""... and to be somewhere else than it is, if that is no farther: more would be flown at the autopilot's own speed."""
BRAKES_BELOW_M_S = 1.0
"""Who is asked for less brakes, and may."""
MATCH_M_S = 1.0
"""Places of a trajectory may move by this much faster or slower than its velocities say."""
BAND_TOLERANCE_M = 0.5
BAND_OVERSHOOT_M = 1.0
"""A vehicle that brakes may leave the band by so much more."""

STOPS = frozenset({"hold", "land", "disarm", "return"})
"""Actions that are never vetoed."""
STARTS = frozenset({"arm", "take-off", "mission start"})
"""Actions by which something on the ground begins to fly."""


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


class Guard:
    """Judges courses by authority, motion, area, band, no-fly zones and separation."""

    def __init__(self, limits: Limits, area: OperatingArea, no_fly: tuple[Zone, ...]) -> None:
        """Guard one round; `set_round` for the next."""
        self.vetoes: Counter[str] = Counter()
        self._last_s: dict[int, float] = {}
        self.set_round(limits, area, no_fly)

    def set_round(self, limits: Limits, area: OperatingArea, no_fly: tuple[Zone, ...]) -> None:
        """Take the geometry of another round."""
        self.limits = limits
        self.area = area
        self._times_s = times_of(limits)
        everywhere = tuple(Zone(zone.name, zone.role, zone.shape) for zone in no_fly)
        self.allowed = Walls(area, everywhere, 0.0).free
        """Where vehicles may be at every height: the operating area less all no-fly zones."""
        self._outer = Walls(area, no_fly, 0.0)
        self._inner = Walls(area, no_fly, limits.geofence_margin_m)

    def inside(self, position_m: Vec3) -> bool:
        """Whether a place is inside the operating area and outside no-fly zones, whatever its height (no margin)."""
        return self.outside_m(position_m) == 0.0

    def outside_m(self, position_m: Vec3) -> float:
        """How far outside the region that is allowed at every height a place is, 0 inside."""
        return float(self.allowed.distance(_point(position_m)))

    def outside_walls_m(self, places_m: Samples) -> Samples:
        """(n,) how far places (n, 3) are outside the operating area, or inside no-fly zones at their height."""
        return self._outer.outside_m(places_m)

    # ---------------------------------------------------------------- judging

    def look(self, sights: list[Sight], now: float) -> Flock:
        """Foresee all of them."""
        return foresee(sights, self.limits, self._times_s, now)

    def judge(self, me: Mover, sent: Reference, others: Flock, now: float) -> Verdict:
        """Judge the set-point that `sent` gives now for `me`, who follows its course by it; vetoes are counted."""
        verdict = (
            self._numbers(me, sent, now)
            or self._rate(me, now)
            or self._motion(me, sent, now)
            or self._asked_region(me, sent, now)
            or self._braking_region(me)
            or self._failed(self.separation(me, others))
            or PASS
        )
        if verdict.ok:
            self._last_s[me.sight.id] = now
        else:
            self.vetoes[verdict.code] += 1
        return verdict

    def separation(self, me: Mover, others: Flock) -> Verdict:
        """Whether `me` keeps clear of everybody for the next seconds, and can still brake then. Not counted."""
        found = meeting(me, others, self.limits)
        if found is None:
            return PASS
        return Verdict("separation", f"too close to vehicle {found.vehicle} in {found.in_s:.1f} s")

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

    # ---------------------------------------------------------------- rules; None: nothing against it

    @staticmethod
    def _numbers(me: Mover, sent: Reference, now: float) -> Verdict | None:
        numbers = [number for part in sent.at(now) for number in part]
        if not all(map(math.isfinite, numbers)):
            return Verdict("number", "the set-point is not finite")
        if not all(map(math.isfinite, (*me.sight.position_m, *me.sight.velocity_m_s))):
            return Verdict("number", "its position or velocity is not known")
        return None

    def _rate(self, me: Mover, now: float) -> Verdict | None:
        if now - self._last_s.get(me.sight.id, -math.inf) < MIN_SETPOINT_GAP_S:
            return Verdict("rate", f"set-points less than {MIN_SETPOINT_GAP_S * 1e3:.0f} ms apart")
        return None

    def _motion(self, me: Mover, sent: Reference, now: float) -> Verdict | None:
        """What the course asks in the next seconds can be flown, and follows from what the vehicle does now."""
        course = me.sight.course
        if isinstance(course, Stand):
            return self._speed(course.speed_m_s, 0.0, 0.0)
        point, velocity = sent.at(now)
        too_fast = self._speed(math.hypot(*velocity), velocity[2], velocity[2])
        if too_fast or course is None:
            return too_fast
        step_s, places, speeds = self._samples(course, now)
        if not (np.isfinite(places).all() and np.isfinite(speeds).all()):
            return Verdict("number", "its course is not finite")
        length = np.sqrt((speeds**2).sum(axis=1))
        too_fast = self._speed(float(length.max()), float(speeds[:, 2].min()), float(speeds[:, 2].max()))
        return too_fast or self._changes(step_s, places, speeds) or self._jump(me, point, velocity)

    def _speed(self, speed: float, least_up: float, most_up: float) -> Verdict | None:
        if not speed <= self.limits.speed_m_s * SPEED_TOLERANCE:
            return Verdict("speed", f"{speed:.1f} m/s asked, {self.limits.speed_m_s:.1f} allowed")
        if least_up < -DESCENT_M_S * SPEED_TOLERANCE or most_up > CLIMB_M_S * SPEED_TOLERANCE:
            worst = most_up if most_up > CLIMB_M_S * SPEED_TOLERANCE else least_up
            return Verdict("speed", f"{worst:+.1f} m/s up asked, -{DESCENT_M_S:.1f} to {CLIMB_M_S:+.1f} allowed")
        return None

    def _samples(self, course: Course, now: float) -> tuple[float, Samples, Samples]:
        """Step, places (k, 3), velocities (k, 3) of the next seconds: a trajectory's own, so that none is missed."""
        if not isinstance(course, Trajectory):
            return STEP_S, *samples_of(course, now, self._times_s)
        begin = math.floor(min(max((now - course.t0_s) / course.dt_s, 0.0), len(course.positions_m) - 2))
        end = begin + 2 + math.ceil(min(self._times_s[-1] / course.dt_s, len(course.positions_m)))
        return course.dt_s, course.positions_m[begin:end], course.velocities_m_s[begin:end]

    def _changes(self, step_s: float, places: Samples, speeds: Samples) -> Verdict | None:
        """From sample to sample: no more acceleration than allowed, and places that move as the velocities say."""
        accel = float(np.sqrt((np.diff(speeds, axis=0) ** 2).sum(axis=1)).max()) / step_s
        if accel > self.limits.accel_m_s2 * ACCEL_TOLERANCE:
            return Verdict("acceleration", f"{accel:.1f} m/s² asked, {self.limits.accel_m_s2:.1f} allowed")
        moves = np.diff(places, axis=0) / step_s - (speeds[1:] + speeds[:-1]) / 2
        if float(np.sqrt((moves**2).sum(axis=1)).max()) > MATCH_M_S:
            return Verdict("motion", "places and velocities of its course contradict each other")
        return None

    def _jump(self, me: Mover, point: Vec3, velocity: Vec3) -> Verdict | None:
        away_m = math.dist(point, me.here_m.tolist())
        if away_m > CATCH_UP_M:
            return Verdict("jump", f"its course is {away_m:.0f} m away from it")
        change = math.dist(velocity, me.sight.velocity_m_s)
        if change > CATCH_UP_S * self.limits.accel_m_s2 and math.hypot(*velocity) > BRAKES_BELOW_M_S:
            return Verdict("jump", f"its course moves {change:.1f} m/s otherwise than it does")
        return None

    def _asked_region(self, me: Mover, sent: Reference, now: float) -> Verdict | None:
        """Set-point, where it would stop, and the way there: inside less the margin, unless it leads back inside."""
        target, velocity = sent.at(now)
        stop = stopping_point(target, velocity, self.limits.accel_m_s2)
        places = np.clip(np.array([me.sight.position_m, target, stop]), -FAR_M, FAR_M)
        out = self._inner.outside_m(places)
        leads_back = 0 < out[0] > out[1:].max()
        if out[1:].max() > 0 and not leads_back:
            x, y, _ = places[1 + int(np.argmax(out[1:]))]
            return Verdict("area", f"({x:.0f}, {y:.0f}) is outside the operating area less its margin")
        miss = band_miss_m(self.area, places[:, 2])
        if miss[1:].max() > BAND_TOLERANCE_M and not miss[0] > miss[1:].max():
            band = f"{self.area.alt_min_m:.0f}-{self.area.alt_max_m:.0f} m"
            z = places[1 + int(np.argmax(miss[1:])), 2]
            return Verdict("band", f"{z:.1f} m is outside the altitude band {band}")
        if out.max() == 0:
            clear, what = self._inner.is_clear(places), " less its margin"
        else:  # between the two walls the way may not leave the outer one either; outside of both nothing can be asked
            clear, what = self._outer.outside_m(places).max() > 0 or self._outer.is_clear(places), ""
        return None if clear else Verdict("area", f"the straight way there leaves the operating area{what}")

    def _braking_region(self, me: Mover) -> Verdict | None:
        """Where the vehicle gets to if it is told to brake only after the next moment: inside, or no worse than now."""
        going = np.concatenate([me.late_m, me.rests_m[:1]])
        braking = np.concatenate([me.stops_m, me.rests_m[1:]])
        out = self._outer.outside_m(going, me.sight.error_m).max()
        if out > 0 and out > self._outer.outside_m(braking, me.sight.error_m).max():
            return Verdict("area", f"it could not brake in time: {out:.0f} m outside the operating area")
        miss = band_miss_m(self.area, going[:, 2]).max()
        if miss > BAND_TOLERANCE_M + BAND_OVERSHOOT_M and miss > band_miss_m(self.area, braking[:, 2]).max():
            return Verdict("band", f"it could not brake in time: {miss:.0f} m outside the altitude band")
        return None


def _point(place_m: Vec3) -> Point:
    return Point(place_m[0], place_m[1])
