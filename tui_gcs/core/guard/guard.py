"""The guard is the last check before the wire: it passes or vetoes courses and actions, and never changes them.

Hold, return and land are never vetoed. What leads back inside the region, or apart, always passes. The idea is ASTM
F3269's run-time assurance: a small trusted monitor around functions that are not proven.

It keeps one thing true, step by step: a vehicle that brakes now comes to rest inside, and apart from all the others. So
a course passes only if that is still true after it was flown until it is judged again.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import msgspec
import numpy as np
from numpy.typing import NDArray
from shapely.geometry import LineString, Point

from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.guard.course_samples import FAR_M, CourseSamples, course_samples, finite_in, length_of
from tui_gcs.core.guard.flight_region import FlightRegion, band_miss_m
from tui_gcs.core.guard.lost_link_paths import lost_link_paths
from tui_gcs.core.guard.motion_prediction import (
    CLIMB_M_S,
    DESCENT_M_S,
    LOST_AGE_S,
    FleetPrediction,
    VehicleState,
    predict,
    prediction_times,
)
from tui_gcs.core.guard.permission import PASS, Order, OrderClass, Verdict
from tui_gcs.core.guard.separation_check import SeparationConflict, separation_conflicts
from tui_gcs.core.motion.course import PositionTarget, Reference, Samples
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits, OperatingArea, VehicleClass

MIN_SETPOINT_GAP_S = 0.08
"""At most 12.5 set-points a second for each vehicle."""
SPEED_TOLERANCE = 1.05
"""Factor on the scenario's speed limit: a planner's rounding is no reason for a veto."""
ACCEL_TOLERANCE = 1.25
"""Factor on the acceleration limit, between two samples of a course: a tour is smooth in time, not in its samples."""
CATCH_UP_S = 2.0
"""A course may ask for a velocity that the vehicle can have within this time after it was heard."""
CATCH_UP_M = 15.0
"""A course may be this far from the vehicle. A larger gap would be closed at the autopilot's own speed, unlimited by
us."""
BRAKES_BELOW_M_S = 1.0
"""A course slower than this asks the vehicle to brake, which it always may."""
MATCH_M_S = 1.0
"""Places of a trajectory may move by this much faster or slower than its velocities."""
# Barometers wander by decimetres: a vehicle exactly on the edge of its band is inside.
BAND_TOLERANCE_M = 0.5
BAND_OVERSHOOT_M = 1.0
"""A braking vehicle may leave the altitude band by this much more."""

Rows = NDArray[np.intp]


@dataclass
class CourseBatch:
    """The set-points of n vehicles that are judged together, and the verdicts on them."""

    prediction: FleetPrediction
    """The n vehicles, each following its course."""
    points_m: Samples
    """(n, 3) the set-points."""
    velocities_m_s: Samples
    """(n, 3) the velocities of the set-points."""
    places_m: Samples
    """(n, 3) where the vehicles were last heard to be."""
    has_m_s: Samples
    """(n, 3) what velocities they really have."""
    now: float
    verdicts: list[Verdict] = field(default_factory=list)

    def left(self) -> Rows:
        """Rows of the vehicles against which nothing has been found so far."""
        return np.array([row for row, verdict in enumerate(self.verdicts) if verdict.ok], dtype=np.intp)

    def refuse(self, rows: Rows, bad: NDArray[np.bool_], code: str, text: Callable[[int], str]) -> None:
        """Veto those of `rows` that are `bad` and have not been vetoed yet; `text` gets the position within `rows`."""
        for place in bad.nonzero()[0].tolist():
            if self.verdicts[rows[place]].ok:
                self.verdicts[rows[place]] = Verdict(code, text(place))


class Guard:
    """Judges courses by rate, motion, area, altitude band, no-fly zones and separation."""

    def __init__(
        self,
        limits: Limits,
        area: OperatingArea,
        no_fly: tuple[Zone, ...],
        classes: tuple[VehicleClass, ...] = (),
    ) -> None:
        """Guard one round; `set_round` for the next."""
        self.vetoes: Counter[str] = Counter()
        self._last_s: dict[int, float] = {}
        self.set_round(limits, area, no_fly, classes)

    def set_round(
        self,
        limits: Limits,
        area: OperatingArea,
        no_fly: tuple[Zone, ...],
        classes: tuple[VehicleClass, ...] = (),
    ) -> None:
        """Take the geometry and limits of another round. Vehicle classes tighten the limits of their vehicles."""
        self.limits = limits
        self._own = {vehicle: _tightened(limits, kind) for kind in classes for vehicle in kind.vehicles}
        # One vehicle that brakes weakly is enough: all are predicted to brake no harder than it does.
        weakest = min((own.accel_m_s2 for own in self._own.values()), default=limits.accel_m_s2)
        self._braking = msgspec.structs.replace(limits, accel_m_s2=weakest)
        self.area = area
        self._times_s = prediction_times(self._braking)
        # At every height: no-fly zones lose their altitude limits here.
        everywhere = tuple(Zone(zone.name, zone.role, zone.shape) for zone in no_fly)
        self.allowed = FlightRegion(area, everywhere, 0.0).free
        """Where vehicles may be at every height: the operating area less all no-fly zones."""
        self._outer = FlightRegion(area, no_fly, 0.0)
        self._inner = FlightRegion(area, no_fly, limits.geofence_margin_m)

    def limits_of(self, vehicle: int) -> Limits:
        """Return the limits of one vehicle: those of its class, or those of the scenario."""
        return self._own.get(vehicle, self.limits)

    def inside(self, position_m: Vec3) -> bool:
        """Whether a place is inside the operating area and outside no-fly zones, whatever its height (no margin)."""
        return self.outside_m(position_m) == 0.0

    def outside_m(self, position_m: Vec3) -> float:
        """How far outside the region that is allowed at every height a place is, 0 inside."""
        return float(self.allowed.distance(_point(position_m)))

    def outside_walls_m(self, places_m: Samples) -> Samples:
        """(n,) how far places (n, 3) are outside the operating area, or inside no-fly zones at their height."""
        return self._outer.outside_m(places_m)

    @property
    def looks_ahead_s(self) -> float:
        """How far ahead vehicles are predicted."""
        return float(self._times_s[-1])

    def is_way_inside(self, here_m: Vec3, there_m: Vec3) -> bool:
        """Whether the straight way to a place stays inside at every height, less the margin if it begins there."""
        line = LineString([here_m[:2], there_m[:2]])
        walls = self._inner if self._inner.free.covers(_point(here_m)) else self._outer
        return bool(walls.free.covers(line)) and self.allowed.covers(line)

    def judge(
        self, judged: list[VehicleState], sent: Sequence[Reference], known: list[VehicleState], now: float
    ) -> list[Verdict]:
        """Judge the set-points that `sent` gives now for the vehicles `judged`, which follow their courses.

        Vetoes are counted.

        Vehicles are judged in their order: each later one sees which of the earlier ones go on and which brake. `known`
        is every vehicle in the air, `judged` among them, doing what was decided before.
        """
        prediction, others = self._look(judged, known, now)
        batch = _batch_of(prediction, sent, now)
        for rule in (self._numbers, self._rate, self._motion, self._asked_region, self._braking_region):
            rows = batch.left()
            if len(rows):
                rule(batch, rows)
        passed = [verdict.ok for verdict in batch.verdicts]
        for row, found in separation_conflicts(prediction, others, passed, self.limits).items():
            batch.verdicts[row] = _too_close(found)
        for state, verdict in zip(judged, batch.verdicts, strict=True):
            if verdict.ok:
                # Only set-points that pass are sent, so only these count for the rate.
                self._last_s[state.id] = now
            else:
                self.vetoes[verdict.code] += 1
        return batch.verdicts

    def separation(self, me: VehicleState, known: list[VehicleState], now: float) -> Verdict:
        """Whether `me`, following its course, keeps clear of all others and can still brake then.

        It is not counted as a veto.
        """
        prediction, others = self._look([me], known, now)
        found = separation_conflicts(prediction, others, [True], self.limits).get(0)
        return PASS if found is None else _too_close(found)

    def _look(
        self, judged: list[VehicleState], known: list[VehicleState], now: float
    ) -> tuple[FleetPrediction, FleetPrediction]:
        """Predict judged and known vehicles in one go: most of the cost does not depend on how many they are."""
        others = known + lost_link_paths(known, self.limits, self.looks_ahead_s)
        return predict(judged + others, self.limits, self._times_s, now, self._braking).split(len(judged))

    def judge_action(self, order: Order, *, lost: bool) -> Verdict:
        """Pass stops always, and every other action only to a vehicle that is heard."""
        if lost and order.order_class is not OrderClass.STOP:
            return self.veto("lost vehicle", f"{order.what}: nothing has been heard of it")
        return PASS

    def veto(self, code: str, text: str) -> Verdict:
        """Count and return a veto that was found before there was a course (unknown vehicle, wrong kind of run, …)."""
        self.vetoes[code] += 1
        return Verdict(code, text)

    @staticmethod
    def _numbers(batch: CourseBatch, rows: Rows) -> None:
        asked = finite_in(batch.points_m[rows], batch.velocities_m_s[rows])
        batch.refuse(rows, ~asked, "number", lambda _: "the set-point is not finite")
        known = finite_in(batch.places_m[rows], batch.has_m_s[rows])
        batch.refuse(rows, ~known, "number", lambda _: "its position or velocity is not known")

    def _rate(self, batch: CourseBatch, rows: Rows) -> None:
        last_s = np.array([self._last_s.get(batch.prediction.states[row].id, -math.inf) for row in rows])
        text = f"set-points less than {MIN_SETPOINT_GAP_S * 1e3:.0f} ms apart"
        batch.refuse(rows, batch.now - last_s < MIN_SETPOINT_GAP_S, "rate", lambda _: text)

    def _motion(self, batch: CourseBatch, rows: Rows) -> None:
        """Veto courses that cannot be flown in the next seconds, or do not follow from what the vehicle does now."""
        velocity = batch.velocities_m_s[rows]
        self._speed(batch, rows, length_of(velocity), velocity[:, 2], velocity[:, 2])
        stands, moving = [], []
        for row in batch.left().tolist():
            course = batch.prediction.states[row].course
            # The autopilot flies to a place with its own speed profile: only its limit can be judged.
            if isinstance(course, PositionTarget):
                stands.append((row, course.speed_m_s))
            elif course is not None:
                moving.append((row, course))
        if stands:
            speed = np.array([speed for _, speed in stands])
            self._speed(batch, _rows(stands), speed, np.zeros_like(speed), np.zeros_like(speed))
        if moving:
            self._course(
                batch, _rows(moving), course_samples([course for _, course in moving], batch.now, self._times_s)
            )
            self._jump(batch, _rows(moving))

    def _speed(self, batch: CourseBatch, rows: Rows, speed: Samples, least_up: Samples, most_up: Samples) -> None:
        allowed = self._each(batch, rows, "speed_m_s")
        batch.refuse(
            rows,
            ~(speed <= allowed * SPEED_TOLERANCE),
            "speed",
            lambda i: f"{min(speed[i], FAR_M):.1f} m/s asked, {allowed[i]:.1f} allowed",
        )
        climbs = most_up > CLIMB_M_S * SPEED_TOLERANCE
        worst = np.clip(np.where(climbs, most_up, least_up), -FAR_M, FAR_M)
        batch.refuse(
            rows,
            climbs | (least_up < -DESCENT_M_S * SPEED_TOLERANCE),
            "speed",
            lambda i: f"{worst[i]:+.1f} m/s up asked, -{DESCENT_M_S:.1f} to {CLIMB_M_S:+.1f} allowed",
        )

    def _each(self, batch: CourseBatch, rows: Rows, limit: str) -> Samples:
        """Return (len(rows),) the limit of this name of each vehicle."""
        if not self._own:  # nearly always
            return np.full(len(rows), getattr(self.limits, limit), dtype=float)
        states = batch.prediction.states
        return np.array([getattr(self.limits_of(states[row].id), limit) for row in rows.tolist()], dtype=float)

    def _course(self, batch: CourseBatch, rows: Rows, steps: CourseSamples) -> None:
        """Veto speeds, accelerations between samples, and places of a course that do not fit its velocities."""
        batch.refuse(rows, ~steps.all_finite(), "number", lambda _: "its course is not finite")
        up = steps.velocities_m_s[:, 2]
        self._speed(batch, rows, steps.worst(length_of(steps.velocities_m_s)), -steps.worst(-up), steps.worst(up))
        accel, allowed = steps.worst(steps.accel_m_s2()), self._each(batch, rows, "accel_m_s2")
        batch.refuse(
            rows,
            accel > allowed * ACCEL_TOLERANCE,
            "acceleration",
            lambda i: f"{min(accel[i], FAR_M):.1f} m/s² asked, {allowed[i]:.1f} allowed",
        )
        contradict = steps.worst(steps.mismatch_m_s()) > MATCH_M_S
        batch.refuse(rows, contradict, "motion", lambda _: "places and velocities of its course contradict each other")

    def _jump(self, batch: CourseBatch, rows: Rows) -> None:
        velocity = batch.velocities_m_s[rows]
        away_m = length_of(batch.points_m[rows] - batch.prediction.here_m[rows])
        batch.refuse(rows, away_m > CATCH_UP_M, "jump", lambda i: f"its course is {away_m[i]:.0f} m away from it")
        change = length_of(velocity - batch.has_m_s[rows])
        # A vehicle whose link fell silent in a bend was vetoed for turning as it was told. Containment and separation
        # do not rest on this rule: they are predicted from where it may be after that age, within its acceleration.
        ages_s = np.array([batch.prediction.states[row].age_s for row in rows.tolist()], dtype=float)
        within_s = CATCH_UP_S + np.nan_to_num(np.clip(ages_s, 0.0, LOST_AGE_S))
        batch.refuse(
            rows,
            (change > within_s * self._each(batch, rows, "accel_m_s2")) & (length_of(velocity) > BRAKES_BELOW_M_S),
            "jump",
            lambda i: f"its course moves {change[i]:.1f} m/s otherwise than it does",
        )

    def _asked_region(self, batch: CourseBatch, rows: Rows) -> None:
        """Veto set-points, stopping points or ways outside the region less its margin, unless they lead back inside."""
        here, point, velocity = batch.places_m[rows], batch.points_m[rows], batch.velocities_m_s[rows]
        stop = point + (length_of(velocity) / (2 * self._each(batch, rows, "accel_m_s2")))[:, None] * velocity
        places = np.clip(np.stack([here, point, stop], axis=1), -FAR_M, FAR_M)
        out = self._inner.outside_m(places.reshape(-1, 3)).reshape(-1, 3)
        asked = out[:, 1:].max(axis=1)
        batch.refuse(
            rows,
            (asked > 0) & (asked >= out[:, 0]),
            "area",
            lambda i: self._outside_text(places[i, 1 + int(np.argmax(out[i, 1:]))]),
        )
        miss = band_miss_m(self.area, places[:, :, 2])
        asked = miss[:, 1:].max(axis=1)
        band = f"{self.area.alt_min_m:.0f}-{self.area.alt_max_m:.0f} m"
        batch.refuse(
            rows,
            (asked > BAND_TOLERANCE_M) & (asked >= miss[:, 0]),
            "band",
            lambda i: f"{places[i, 1 + int(np.argmax(miss[i, 1:])), 2]:.1f} m is outside the altitude band {band}",
        )
        self._ways(batch, rows, places, out)

    def _ways(self, batch: CourseBatch, rows: Rows, places: Samples, out: Samples) -> None:
        """Veto ways that leave the region."""
        # Between margin and edge the way may not leave the outer region either; from outside no straight way can be
        # demanded.
        inside = out.max(axis=1) == 0
        blocked = inside & ~self._inner.are_clear(places)
        batch.refuse(rows, blocked, "area", lambda i: _way_text(self._inner, places[i], " less its margin"))
        if not inside.all():
            free = self._outer.outside_m(places.reshape(-1, 3)).reshape(-1, 3).max(axis=1) == 0
            blocked = ~inside & free & ~self._outer.are_clear(places)
            batch.refuse(rows, blocked, "area", lambda i: _way_text(self._outer, places[i], ""))

    def _outside_text(self, place_m: Samples) -> str:
        """Say which wall a set-point or stopping point is beyond."""
        wall, where = self._inner.wall_at(place_m), f"({place_m[0]:.0f}, {place_m[1]:.0f})"
        if wall:
            return f"{where} is in no-fly zone {wall} or its margin"
        return f"{where} is outside the operating area less its margin"

    def _braking_region(self, batch: CourseBatch, rows: Rows) -> None:
        """Veto courses after which a braking vehicle would end outside, and farther outside than if it brakes now."""
        prediction = batch.prediction
        going = np.concatenate([prediction.late_m[rows], prediction.rests_m[rows, :1]], axis=1)
        braking = np.concatenate([prediction.stops_m[rows], prediction.rests_m[rows, 1:]], axis=1)
        out, out_now = np.zeros(len(rows)), np.zeros(len(rows))
        error = np.array([prediction.states[row].error_m for row in rows])
        doubtful = np.flatnonzero(~self._outer.hold(going.min(axis=1), going.max(axis=1), error))  # nearly always none
        for far, ways in ((out, going), (out_now, braking)) if len(doubtful) else ():
            far[doubtful] = self._farthest_outside_m(ways[doubtful], error[doubtful])
        batch.refuse(
            rows,
            out > out_now,
            "area",
            lambda i: (
                f"its place is known to ±{error[i]:.0f} m only: it could come {out[i]:.0f} m outside the operating area"
                if error[i] > 0.0
                else f"it could not brake in time: {out[i]:.0f} m {_beyond(self._outer, going[i])}"
            ),
        )
        miss, miss_now = (band_miss_m(self.area, way[:, :, 2]).max(axis=1) for way in (going, braking))
        batch.refuse(
            rows,
            (miss > BAND_TOLERANCE_M + BAND_OVERSHOOT_M) & (miss > miss_now),
            "band",
            lambda i: f"it could not brake in time: {miss[i]:.0f} m outside the altitude band",
        )

    def _farthest_outside_m(self, ways_m: Samples, error_m: Samples) -> Samples:
        """(n,) how far outside the farthest place of each way (n, k, 3) is."""
        each = self._outer.outside_m(ways_m.reshape(-1, 3), np.repeat(error_m, ways_m.shape[1]))
        farthest: Samples = each.reshape(ways_m.shape[:2]).max(axis=1)
        return farthest


def _batch_of(judged: FleetPrediction, sent: Sequence[Reference], now: float) -> CourseBatch:
    asked = np.array([reference.at(now) for reference in sent], dtype=float).reshape(-1, 2, 3)
    places = np.array([state.position_m for state in judged.states], dtype=float).reshape(-1, 3)
    has = np.array([state.velocity_m_s for state in judged.states], dtype=float).reshape(-1, 3)
    return CourseBatch(judged, asked[:, 0], asked[:, 1], places, has, now, [PASS] * len(judged.states))


def _rows(numbered: Sequence[tuple[int, object]]) -> Rows:
    return np.array([row for row, _ in numbered], dtype=np.intp)


def _way_text(region: FlightRegion, places_m: Samples, less: str) -> str:
    """Say which wall the straight way from place to place runs into."""
    wall = region.wall_at(*places_m)
    if wall:
        return f"the straight way there crosses no-fly zone {wall}"
    return f"the straight way there leaves the operating area{less}"


def _beyond(region: FlightRegion, way_m: Samples) -> str:
    """Say which wall a way (k, 3) ends beyond."""
    wall = region.wall_at(*way_m)
    return f"inside no-fly zone {wall}" if wall else "outside the operating area"


def _too_close(found: SeparationConflict) -> Verdict:
    return Verdict("separation", f"too close to vehicle {found.vehicle} in {found.in_s:.1f} s")


def _point(place_m: Vec3) -> Point:
    return Point(place_m[0], place_m[1])


def _tightened(limits: Limits, kind: VehicleClass) -> Limits:
    """Return the limits of a class, which are never above those of the scenario."""
    speed_m_s, accel_m_s2 = min(limits.speed_m_s, kind.speed_m_s), min(limits.accel_m_s2, kind.accel_m_s2)
    return msgspec.structs.replace(limits, speed_m_s=speed_m_s, accel_m_s2=accel_m_s2)
