"""Motion prediction: what all vehicles will do in the next seconds, at once, as arrays.

A vehicle is a point that chases its course within its limits of acceleration, or brakes, or flies straight on. Three
futures of each are predicted: it goes on; it goes on for a moment and then brakes; it brakes now. How hard it brakes is
not known beforehand: a braking vehicle is between where the hardest and the weakest braking takes it.
"""

import math
from dataclasses import dataclass, fields, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.guard.course_samples import FAR_M, STEP_S, wanted
from tui_gcs.core.motion.course import Course, PositionTarget, Samples
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits

HORIZON_S = 5.0
"""How far ahead separation is predicted at least; farther where braking takes longer."""
GO_ON_STEPS = 2
"""Samples for which a course that passed is flown whatever happens: until it is judged again, and that arrives and
shows."""
# From a veto to a vehicle that brakes: the link, and the autopilot's controller.
BRAKE_DELAY_S = 0.25
# Measured in the simulator at 8 m/s from order to rest: ArduCopter 13.2 to 13.8 m, PX4 11.9 to 16.7 m. v²/2a would
# be 12.8 m, this is 18 m.
BRAKE_SHARE = 0.8
"""A vehicle brakes after this delay, with this share of its acceleration."""
HARD_SHARE = 1.25
"""It may also brake at once, with this share: 10.2 m. Others must not rely on its sliding out of the way."""
CLIMB_M_S, DESCENT_M_S = 3.0, 1.5
"""Scenarios have no vertical limits: PX4's MPC_Z_V_AUTO_UP (WPNAV_SPEED_UP is 2.5); both autopilots' descent."""
ACCEL_Z_M_S2 = 1.0
"""WPNAV_ACCEL_Z."""
HARD_Z_M_S2 = 4.0
"""MPC_ACC_UP_MAX."""
JERK_M_S3 = 4.0
"""MPC_JERK_AUTO (ArduCopter's PSC_JERK_XY is 5): this is how fast an acceleration ends."""
SURGE_Z_M_S = 0.5
"""What a climb gains until braking begins: half a second of that jerk until the order comes, and its end."""
POSITION_GAIN_HZ = 1.0
"""PSC_POSXY_P; MPC_XY_P is 0.95."""
MAX_AGE_S = 5.0
"""By this age of its position a vehicle without a link brakes or turns home: it is not looked for ever farther away,
except on its way to a place it was sent to."""
LOST_AGE_S = 3.0
"""A drifting vehicle with an older position is anywhere between where it was and where it may be by now. This is a
limit of the prediction; whether a vehicle is LOST is decided in `Vehicle.freshness`."""
TURNED_S = 1.0
"""The last set-point that it received may have turned it for this long."""


RETURN_M_S = 12.0
"""By its own failsafe it may be faster than the scenario's limit: MPC_XY_VEL_MAX (WPNAV_SPEED is 10)."""


class MotionModel(Enum):
    """What a vehicle is doing, as far as the station knows."""

    FOLLOWS = "follows its course"
    STOPS = "brakes and holds"
    DRIFTS = "whatever it wants: straight on is the best guess"


@dataclass(frozen=True)
class LostLinkBehaviour:
    """What a vehicle does by its own failsafe when it hears nothing."""

    home_m: Vec3
    leaves_s: float
    """By when it has begun to, after it was heard last."""
    height_m: float = math.nan
    """The least height above home at which it returns; NaN: it does not return."""
    sinks: bool = False
    """It may come down where it is."""


@dataclass(frozen=True)
class VehicleState:
    """What the guard knows of one vehicle."""

    id: int
    position_m: Vec3
    velocity_m_s: Vec3
    motion: MotionModel = MotionModel.DRIFTS
    course: Course | None = None
    """The course that it follows, if it follows one."""
    age_s: float = 0.0
    """Age of position and velocity."""
    error_m: float = 0.0
    """By how much its position may be wrong, beyond what the limits allow for."""
    in_column: bool = False
    """It takes off or lands vertically: exempt from separation."""
    goal_m: Vec3 | None = None
    """Of a lost vehicle: the place it was sent to, and flies to by itself."""
    lost_link_behaviour: LostLinkBehaviour | None = None
    """Of a lost vehicle: what else it may do by itself; None if it does nothing."""
    on_own_way: bool = False
    """It is not a vehicle but the beginning of a segment that one may fly by its failsafe, to `goal_m`, since
    `age_s`."""

    @property
    def is_lost(self) -> bool:
        """Whether it is not known what it does, nor where it is by now."""
        return self.motion is MotionModel.DRIFTS and (self.age_s >= LOST_AGE_S or self.on_own_way)


@dataclass(frozen=True)
class FleetPrediction:
    """n vehicles predicted; k samples, `STEP_S` apart, from now."""

    states: tuple[VehicleState, ...]
    ids: NDArray[np.int64]
    """(n,) vehicle ids."""
    here_m: Samples
    """(n, 3) where they are now."""
    error_m: Samples
    """(n,) by how much that may be wrong."""
    from_m: Samples
    """(n, k, 3) where each is if it goes on; a lost vehicle is anywhere from there to `goes_m`."""
    goes_m: Samples
    late_m: Samples
    """(n, k, 3) if it goes on for a moment and then brakes."""
    stops_m: Samples
    """(n, k, 3) if it brakes now."""
    short_m: Samples
    """(n, k, 3) if it brakes at once and as hard as it can."""
    slack_m: Samples
    """(n, k, 2) how far from all these it may be, sideways and in height: a vehicle that speeds up or turns when it is
    told to brake goes on doing so for a while."""
    rests_m: Samples
    """(n, 2, 3) where it comes to rest if it brakes after a moment, and now."""
    low_m: Samples
    """(n, 3) lower corner of the box around all that."""
    high_m: Samples
    """(n, 3) its upper corner."""

    def split(self, first: int) -> tuple["FleetPrediction", "FleetPrediction"]:
        """The prediction of the `first` so many vehicles, and of the others."""
        parts = [getattr(self, name.name) for name in fields(self)]
        both = FleetPrediction(*(part[:first] for part in parts)), FleetPrediction(*(part[first:] for part in parts))
        if self.from_m is not self.goes_m:
            return both
        return replace(both[0], from_m=both[0].goes_m), replace(both[1], from_m=both[1].goes_m)


def prediction_times(limits: Limits) -> Samples:
    """(k,) seconds from now that are predicted: until every braking vehicle stands."""
    brake_s = GO_ON_STEPS * STEP_S + BRAKE_DELAY_S + limits.speed_m_s / (BRAKE_SHARE * limits.accel_m_s2)
    times: Samples = np.arange(0.0, max(HORIZON_S, brake_s) + STEP_S / 2, STEP_S)
    return times


def predict(
    states: list[VehicleState], limits: Limits, times_s: Samples, now: float, braking: Limits | None = None
) -> FleetPrediction:
    """The futures of all vehicles; `times_s` as `prediction_times` gives them.

    With `braking` vehicles are predicted to brake as weakly as these limits say; all else is predicted by `limits`.
    """
    weakly = _weakly(braking or limits)
    place, velocity = _seen(states)
    age = _ages(states)
    here = _now_at(states, place, velocity)
    error = np.array([s.error_m for s in states], dtype=float) + np.hypot(velocity[:, 0], velocity[:, 1]) * age / 2
    (stops, stop_rest, seconds), (short, *_) = _brake(here, velocity, times_s, weakly, _hard(limits))
    slack = seconds * _surge(velocity, limits)[:, None, :]
    goes, late, late_rest = stops.copy(), stops.copy(), stop_rest.copy()
    drifts = [i for i, s in enumerate(states) if s.motion is MotionModel.DRIFTS]
    goes[drifts] = late[drifts] = stops[drifts] = short[drifts] = (
        here[drifts, None, :] + times_s[None, :, None] * velocity[drifts, None, :]
    )
    slack[drifts] = 0.0
    begins = goes
    lost = [i for i, s in enumerate(states) if s.is_lost]
    if lost:
        begins = goes.copy()
        begins[lost] = short[lost] = place[lost, None, :]
        goes[lost] = late[lost] = stops[lost] = [lost_link_reach(states[i], limits, times_s) for i in lost]
        error[lost] = [states[i].error_m + turning_error_m(states[i], limits) for i in lost]
    follows, courses = _following(states)
    if follows:
        goes[follows], speeds = _follow(courses, here[follows], velocity[follows], limits, times_s, now)
        begin = goes[follows, GO_ON_STEPS]
        late[follows] = goes[follows]
        ((late[follows, GO_ON_STEPS:], late_rest[follows], _),) = _brake(
            begin, speeds[:, GO_ON_STEPS], times_s[:-GO_ON_STEPS], weakly
        )
    room = slack[:, -1][:, [0, 0, 1]]
    low = folded(np.minimum, goes, late, stops, short) - room  # `begins` is one of them
    high = folded(np.maximum, goes, late, stops, short) + room
    ids = np.array([s.id for s in states], dtype=np.int64)
    rests = np.stack([late_rest, stop_rest], axis=1)
    return FleetPrediction(tuple(states), ids, here, error, begins, goes, late, stops, short, slack, rests, low, high)


def predicted_ways(states: list[VehicleState], limits: Limits, times_s: Samples, now: float) -> Samples:
    """(n, k, 3) where all vehicles are if each goes on: `FleetPrediction.goes_m` alone, at half the cost."""
    place, velocity = _seen(states)
    here = _now_at(states, place, velocity)
    ((goes, *_),) = _brake(here, velocity, times_s, _weakly(limits))
    drifts = [i for i, s in enumerate(states) if s.motion is MotionModel.DRIFTS]
    goes[drifts] = here[drifts, None, :] + times_s[None, :, None] * velocity[drifts, None, :]
    lost = [i for i, s in enumerate(states) if s.is_lost]
    if lost:
        goes[lost] = [lost_link_reach(states[i], limits, times_s) for i in lost]
    follows, courses = _following(states)
    if follows:
        goes[follows], _ = _follow(courses, here[follows], velocity[follows], limits, times_s, now)
    return goes


def _following(states: list[VehicleState]) -> tuple[list[int], list[Course]]:
    """Rows of the vehicles that follow a course, and their courses."""
    follows = [i for i, s in enumerate(states) if s.motion is MotionModel.FOLLOWS and s.course is not None]
    return follows, [course for i in follows if (course := states[i].course) is not None]


def _follow(
    courses: list[Course], here: Samples, velocity: Samples, limits: Limits, times_s: Samples, now: float
) -> tuple[Samples, Samples]:
    """(n, k, 3) positions and velocities of vehicles at `here` (n, 3) that follow their courses."""
    most = np.array([_speed_of(course, limits) for course in courses])
    return _chase(here, velocity, wanted(courses, now, times_s), most, limits)


def folded(extreme: np.ufunc, *ways_m: Samples) -> Samples:
    """(n, 3) the least, or largest, of all of (n, k, 3)."""
    found = ways_m[0]
    for way_m in ways_m[1:]:
        found = extreme(found, way_m)
    # Halving k again and again takes a fifth of the time that numpy's reduction along an axis takes.
    while (count := found.shape[1]) > 1:
        half = count // 2
        found = extreme(found[:, : count - half], found[:, half:])
    folded: Samples = found[:, 0]
    return folded


def _ages(states: list[VehicleState]) -> Samples:
    """(n,) ages of their positions, as far as they count."""
    ages: Samples = np.clip(np.array([s.age_s for s in states], dtype=float), 0.0, MAX_AGE_S)
    return ages


def _now_at(states: list[VehicleState], place: Samples, velocity: Samples) -> Samples:
    """(n, 3) where they are taken to be now: between where they were seen and straight on from there."""
    here: Samples = place + velocity * (_ages(states) / 2)[:, None]
    return here


def _seen(states: list[VehicleState]) -> tuple[Samples, Samples]:
    """(n, 3) positions and velocities with which they were seen; numbers that are not finite do no harm."""
    place, velocity = _array([s.position_m for s in states]), _array([s.velocity_m_s for s in states])
    place[np.isnan(place)] = 0.0
    velocity[~np.isfinite(velocity)] = 0.0
    return np.minimum(np.maximum(place, -FAR_M, out=place), FAR_M, out=place), velocity


def lost_link_reach(state: VehicleState, limits: Limits, times_s: Samples) -> Samples:
    """(k, 3) how far a lost vehicle may have come: to where it was sent, or straight on until it braked.

    Horizontally and vertically as fast as it may, each for itself: it may climb first.
    """
    place, velocity = (both[0] for both in _seen([state]))
    if state.goal_m is None:
        brakes_s = math.hypot(velocity[0], velocity[1]) / (2 * BRAKE_SHARE * limits.accel_m_s2)
        return np.repeat([place + (min(state.age_s, MAX_AGE_S) + brakes_s) * velocity], len(times_s), axis=0)
    way = np.nan_to_num(_array([state.goal_m])[0]) - place
    speed = max(RETURN_M_S, limits.speed_m_s) if state.on_own_way else limits.speed_m_s
    level_s = math.hypot(way[0], way[1]) / speed
    upright_s = abs(way[2]) / (CLIMB_M_S if way[2] > 0.0 else DESCENT_M_S)
    least_s = np.maximum([level_s, level_s, upright_s], 1e-9)
    come: Samples = place + np.clip((state.age_s + times_s[:, None]) / least_s, 0.0, 1.0) * way
    return come


def turning_error_m(state: VehicleState, limits: Limits) -> float:
    """How far from that way it may be, because it flew with another velocity than it was last seen to have."""
    velocity, age_s = _seen([state])[1][0], min(state.age_s, MAX_AGE_S)
    speed = math.hypot(velocity[0], velocity[1])
    return min(speed, TURNED_S * limits.accel_m_s2) * age_s


def _speed_of(course: Course, limits: Limits) -> float:
    """The speed of a course within the limits; the limit, too, where the course's speed is not finite."""
    return (
        float(np.fmin(course.speed_m_s, limits.speed_m_s)) if isinstance(course, PositionTarget) else limits.speed_m_s
    )


def _chase(here: Samples, velocity: Samples, asked: Samples, most: Samples, limits: Limits) -> tuple[Samples, Samples]:
    """(n, k, 3) positions and velocities of points that chase what is asked, (n, k, 6), no faster than `most` (n,)."""
    accel_step, rise_step = limits.accel_m_s2 * STEP_S, ACCEL_Z_M_S2 * STEP_S
    # With the vehicles side by side in memory this takes two thirds of the time, of 250 vehicles half of it.
    asked = np.ascontiguousarray(asked.transpose(1, 2, 0))
    places, speeds = np.empty_like(asked[:, :3]), np.empty_like(asked[:, 3:])
    places[0], speeds[0] = here.T, velocity.T
    # Of a small fleet nearly all the time is numpy's overhead per call: results go into arrays that exist already.
    pull, ask, change = _Pull(limits.accel_m_s2, len(here)), _Limited(len(here)), _Limited(len(here))
    for wanted_m, wanted_m_s, before, v, after, speed in zip(
        asked[:, :3], asked[1:, 3:], places, speeds, places[1:], speeds[1:], strict=False
    ):
        np.add(wanted_m_s, pull.towards(wanted_m, before), ask.vectors)
        ask.limit(most, -DESCENT_M_S, CLIMB_M_S)
        np.subtract(ask.vectors, v, change.vectors)
        change.limit(accel_step, -rise_step, rise_step)
        np.add(v, change.vectors, speed)
        np.multiply(np.add(v, speed, change.vectors), STEP_S / 2, change.vectors)
        np.add(before, change.vectors, after)
    return places.transpose(2, 0, 1), speeds.transpose(2, 0, 1)


class _Limited:
    """n vectors, (3, n), that are brought within limits again and again."""

    def __init__(self, n: int) -> None:
        self.vectors = np.empty((3, n))
        # Views that are made once: each costs as much as a call.
        self._x, self._y, self._z = self.vectors
        self._level, self._share = self.vectors[:2], np.empty(n)

    def limit(self, most: Samples | float, least_up: float, most_up: float) -> None:
        """Make their horizontal parts no longer than `most`, and bring their vertical parts within limits."""
        share, z = self._share, self._z
        np.maximum(np.hypot(self._x, self._y, share), 1e-9, out=share)
        np.minimum(1.0, np.divide(most, share, share), out=share)
        np.multiply(self._level, share, self._level)
        np.minimum(np.maximum(z, least_up, out=z), most_up, out=z)


class _Pull:
    """Velocities that work off position errors of n points, no faster than they can still brake there."""

    def __init__(self, accel_m_s2: float, n: int) -> None:
        self._gap, self._pull = np.empty((3, n)), np.empty((3, n))
        self._size, self._speed, self._least = np.empty((2, n)), np.empty((2, n)), np.empty((2, n))
        self._twice_accel = np.array([[2 * BRAKE_SHARE * accel_m_s2], [2 * BRAKE_SHARE * ACCEL_Z_M_S2]])
        # Views that are made once: each costs as much as a call.
        self._parts = (*self._gap, *self._size, *self._speed, self._gap[:2], self._pull[:2], self._pull[2])
        self._share = np.empty(n)

    def towards(self, wanted_m: Samples, places_m: Samples) -> Samples:
        """(3, n) velocities that lead from places (3, n) to wanted ones; overwritten by the next call."""
        size, speed, least, share = self._size, self._speed, self._least, self._share
        x, y, z, level, upright, level_speed, upright_speed, flat, flat_pull, rise = self._parts
        np.subtract(wanted_m, places_m, self._gap)
        np.hypot(x, y, level)
        np.abs(z, upright)
        np.sqrt(np.multiply(self._twice_accel, size, speed), speed)
        np.minimum(np.multiply(POSITION_GAIN_HZ, size, least), speed, out=speed)
        np.divide(level_speed, np.maximum(level, 1e-9, out=share), share)
        np.multiply(flat, share, flat_pull)
        np.copysign(upright_speed, z, rise)
        return self._pull


@dataclass(frozen=True)
class _Braking:
    """Delay and accelerations with which a vehicle brakes."""

    delay_s: float
    accel_m_s2: float
    accel_z_m_s2: float


def _weakly(limits: Limits) -> _Braking:
    return _Braking(BRAKE_DELAY_S, BRAKE_SHARE * limits.accel_m_s2, BRAKE_SHARE * ACCEL_Z_M_S2)


def _hard(limits: Limits) -> _Braking:
    return _Braking(0.0, HARD_SHARE * limits.accel_m_s2, HARD_Z_M_S2)


def _brake(
    here: Samples, velocity: Samples, times_s: Samples, *how: _Braking
) -> list[tuple[Samples, Samples, Samples]]:
    """Brake now, in each of these ways.

    Each gives (n, k, 3) positions, (n, 3) where the vehicles come to rest, and (n, k, 2) seconds of their speeds: the
    way they have come by then, sideways and in height, divided by their speed before.
    """
    # Of a small fleet nearly all the time is numpy's overhead per call: all ways, level and upright, are one array.
    speeds = np.abs(velocity)
    np.hypot(velocity[:, 0], velocity[:, 1], speeds[:, 0])
    accel = np.array([(each.accel_m_s2, each.accel_z_m_s2) for each in how])[:, None, :]
    delay = np.array([each.delay_s for each in how])[:, None, None]
    seconds = _braked(speeds[:, ::2], accel, delay, times_s)
    shares = seconds[..., [0, 0, 1]]
    rests = here + shares[:, :, -1] * velocity
    places = here[:, None, :] + shares[:, :, :-1] * velocity[:, None, :]
    return [(places[way], rests[way], seconds[way, :, :-1]) for way in range(len(how))]


def _surge(velocity: Samples, limits: Limits) -> Samples:
    """(n, 2) by how much they may be faster than they seem when they begin to brake, in any direction, and upwards.

    Full acceleration takes this long to end, at the jerk limit. A standing vehicle has none.
    """
    level = np.minimum(np.hypot(velocity[:, 0], velocity[:, 1]), limits.accel_m_s2**2 / (2 * JERK_M_S3))
    return np.stack([level, np.minimum(np.abs(velocity[:, 2]), SURGE_Z_M_S)], axis=1)


def _braked(speeds: Samples, accel_m_s2: Samples, delay_s: Samples, times_s: Samples) -> Samples:
    """(w, n, k + 1, 2) way after `times_s`, and at rest, of points that brake from `speeds` (n, 2) in w ways.

    Ways are in seconds of the speed. `accel_m_s2` is (w, 1, 2), `delay_s` (w, 1, 1).
    """
    to_rest_s = (speeds / accel_m_s2)[:, :, None, :]
    delay = delay_s[..., None]
    t = np.empty((len(accel_m_s2), len(speeds), len(times_s) + 1, 2))
    t[:, :, :-1], t[:, :, -1:] = times_s[:, None], delay + to_rest_s
    braking_s = np.minimum(np.maximum(t - delay, 0.0), to_rest_s)
    way: Samples = np.minimum(t, delay) + braking_s - braking_s**2 / (2 * np.maximum(to_rest_s, 1e-9))
    return way


def _array(rows: list[Vec3]) -> Samples:
    return np.array(rows, dtype=float).reshape(-1, 3)
