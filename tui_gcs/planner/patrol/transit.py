"""Transits: how a vehicle gets from where it is onto a slot that moves.

The way is simulated with a point mass of limited speed and acceleration. It flies towards the earliest point of its
slot's path that it can reach in time. As soon as one smooth manoeuvre (a cubic in time) ends on the slot with the
slot's velocity within the limits, that manoeuvre is taken. The result is stored and followed.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.patrol.flyable_region import SHIFT_S2, FlyableRegion, Pair
from tui_gcs.planner.patrol.tour import SENT_STEP_S, Tour

Floats = NDArray[np.floating[Any]]

STEP_S = 0.1
"""Spacing of a transit's samples."""
LOOK_EVERY = 5
"""Steps between two attempts to find a manoeuvre onto the slot."""
LOOK_AHEAD_S = 0.5
"""Spacing of the points of a lap that a rendezvous is looked for at."""
ALLOWANCE_S = 3.0
"""Time that a rendezvous takes beyond way / speed, for speeding up and turning in."""
MANOEUVRES_S: Floats = np.arange(1.0, 16.01, 0.5)
"""Durations of manoeuvres that are tried."""
CHECKED: Floats = np.linspace(0.0, 1.0, 9)[1:-1]
"""Shares of a manoeuvre's duration at which its speed is checked first."""
MAX_TRANSIT_S = 600.0
"""Longer transits are given up."""
STANDS_M = 1.0
"""A vehicle that stays this near a place while its slot comes round once will not get away from there."""
CORNER_SPEED_M_S = 3.0
"""Speed at the corners of a way around obstacles."""
TURN_SHARES = (1.0, 0.5, 0.25, 0.0)
"""Shares of the acceleration towards the aim that are tried where the whole of it would not pass the guard."""
SLOWER_SHARE = 0.999
"""On a tour no faster than this share of the vehicle's speed, a place that can be met can be met at any later time,
too."""
SAME_M = 1e-6
"""Tolerance for rounding in shortcuts that must be exact."""


@dataclass(frozen=True)
class Transit:
    """Samples every `STEP_S` from `t0_s`; after the last one the vehicle is on its slot."""

    t0_s: float
    xy_m: Floats
    velocity_m_s: Floats

    @property
    def end_s(self) -> float:
        """The time when the slot is reached."""
        return self.t0_s + STEP_S * (len(self.xy_m) - 1)

    def at(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Return positions and velocities (k, 2) at ascending times (k,); after the end the last ones."""
        xy, velocity = along([self], t_s)
        return xy[0], velocity[0]


def along(transits: Sequence[Transit], t_s: Floats) -> tuple[Floats, Floats]:
    """Return (n, k, 2) positions and velocities on n transits at the same ascending times (k,).

    After its end a transit stays at its last sample.
    """
    place = (t_s - np.array([transit.t0_s for transit in transits])[:, None]) / STEP_S
    last = np.array([len(transit.xy_m) - 1 for transit in transits])[:, None]
    place = np.clip(place, 0.0, last)
    index = np.minimum(place.astype(np.intp), np.maximum(last - 1, 0))
    share = (place - index)[..., None]
    begins, ends = index[:, 0].tolist(), (index[:, -1] + 2).tolist()  # of the samples that count
    parts = [(t.xy_m[i:j], t.velocity_m_s[i:j]) for t, i, j in zip(transits, begins, ends, strict=True)]
    xy, velocity = (np.concatenate([part[which] for part in parts]) for which in range(2))
    first = np.cumsum([0, *(len(part) for part, _ in parts[:-1])])
    low = first[:, None] + index - index[:, :1]
    high = low + (last > 0)
    return (1.0 - share) * xy[low] + share * xy[high], (1.0 - share) * velocity[low] + share * velocity[high]


@dataclass(frozen=True)
class Mobility:
    """The limits of a vehicle on its way."""

    speed_m_s: float
    accel_m_s2: float


def rendezvous_s(places_m: Floats, lap_m: Floats, step_s: float, speed_m_s: float) -> Floats:
    """Return (n, k) times until each of n vehicles can meet a slot that is now at each of the k points of a lap.

    `lap_m` (k, 2) are points of the tour every `step_s`. The estimate is way / speed + `ALLOWANCE_S`.
    """
    count = len(lap_m)
    needed = np.hypot(*(places_m[:, None, :] - lap_m[None, :, :]).transpose(2, 0, 1)) / speed_m_s + ALLOWANCE_S
    waits = np.arange(math.ceil(float(needed.max(initial=0.0)) / step_s) + count + 1)
    at = (np.arange(count)[:, None] + waits[None, :]) % count
    return np.stack([step_s * np.argmax(need[at] <= step_s * waits, axis=1) for need in needed])


def plan_transit(
    t_s: float,
    xy_m: Floats,
    velocity_m_s: Floats,
    tour: Tour,
    phase_s: float,
    mobility: Mobility,
    region: FlyableRegion,
) -> Transit | None:
    """Return the way from a state at `t_s` onto the slot that is at `phase_s` of the tour then.

    Return None if there is none within `MAX_TRANSIT_S`, if walls stop the vehicle on it, or if it leads through a
    no-fly zone.
    """
    flight = _PointMass(xy_m, velocity_m_s, mobility, region)
    meeting = _Rendezvous(xy_m, tour, phase_s, mobility)
    aim, corner, near_s = xy_m, False, 0.0
    stopped, stopped_s, comes_round_s = flight.xy, 0.0, tour.period_s + float(MANOEUVRES_S[-1])
    for step in range(round(MAX_TRANSIT_S / STEP_S)):
        now_s = step * STEP_S
        if step % LOOK_EVERY == 0:
            if now_s >= near_s:
                slots = tour.at(phase_s + now_s + MANOEUVRES_S)
                near_s = now_s + _too_far_s(flight, slots[0], tour.top_speed_m_s, mobility)
                ending = _manoeuvre(flight, slots, mobility, region) if now_s >= near_s else None
                if ending is not None:
                    found = flight.transit(t_s, ending)
                    # The operating area's edge may be crossed on the way back inside, a no-fly zone never.
                    return None if region.enters_no_fly(found.xy_m) else found
            if math.dist(flight.xy, stopped) > STANDS_M:
                stopped, stopped_s = flight.xy, now_s
            elif now_s - stopped_s > comes_round_s:
                return None
            aim, corner = region.next_leg(np.array(flight.xy), meeting.point(flight.xy, now_s))
        flight.step(aim, corner)
    return None


class _PointMass:
    """The simulated point mass and its way so far."""

    def __init__(self, xy_m: Floats, velocity_m_s: Floats, mobility: Mobility, region: FlyableRegion) -> None:
        self._mobility, self._region = mobility, region
        self.xy = (float(xy_m[0]), float(xy_m[1]))
        self.velocity = (float(velocity_m_s[0]), float(velocity_m_s[1]))
        speed = math.hypot(*self.velocity)
        if speed > mobility.speed_m_s:
            share = mobility.speed_m_s / speed
            self.velocity = (self.velocity[0] * share, self.velocity[1] * share)
        self._way, self._speeds = [self.xy], [self.velocity]

    def step(self, aim: Floats, corner: bool) -> None:
        """Turn towards `aim` as fast as acceleration allows, and slow down for it if it is a corner of the way."""
        dx, dy = float(aim[0]) - self.xy[0], float(aim[1]) - self.xy[1]
        away, wanted, accel = math.hypot(dx, dy), self._mobility.speed_m_s, self._mobility.accel_m_s2
        if corner:
            # v² = v_corner² + 2 * 0.8 a s: braking with 0.8 of the acceleration leaves the rest for turning.
            wanted = min(wanted, math.sqrt(CORNER_SPEED_M_S**2 + 1.6 * accel * away))
        scale = wanted / away if away > 0.1 else 0.0
        vx, vy = self.velocity
        ax, ay = dx * scale - vx, dy * scale - vy
        change = math.hypot(ax, ay)
        share = min(1.0, accel * STEP_S / change) if change > 0.0 else 0.0
        self._go_on(self._passing((share * ax, share * ay)))

    def _go_on(self, change: Pair) -> None:
        """Fly one step with this change of velocity."""
        self.xy, self.velocity = self._after(change)
        self._way.append(self.xy)
        self._speeds.append(self.velocity)

    def _after(self, change: Pair) -> tuple[Pair, Pair]:
        """Return place and velocity after one step with this change of velocity."""
        (vx, vy), (ax, ay) = self.velocity, change
        xy = self.xy[0] + (vx + ax / 2) * STEP_S, self.xy[1] + (vy + ay / 2) * STEP_S
        return xy, (vx + ax, vy + ay)

    def _passing(self, wanted: Pair) -> Pair:
        """Return the wanted change of velocity, or near a wall as much of it as passes the guard, or that of braking.

        What is sent is shifted along the acceleration, so beside a no-fly zone a vehicle turns later and wider. After
        the step it must still be able to stop inside.
        """
        accel, speed = self._mobility.accel_m_s2, math.hypot(*self.velocity)
        stop_m = float(self._region.stopping_m(np.array(speed + accel * STEP_S), accel))
        if self._region.is_roomy(self.xy, stop_m + SHIFT_S2 * accel):
            return wanted
        slower = min(1.0, accel * STEP_S / speed) if speed > 0.0 else 0.0
        changes = [(share * wanted[0], share * wanted[1]) for share in TURN_SHARES]
        changes.append((-slower * self.velocity[0], -slower * self.velocity[1]))
        xy, velocity = np.array([self._after(change) for change in changes]).transpose(1, 0, 2)
        xy, velocity = (
            np.vstack([np.tile(self.xy, (len(changes), 1)), xy]),
            np.vstack([np.tile(self.velocity, (len(changes), 1)), velocity]),
        )
        accels = np.vstack([np.array(changes) / STEP_S, np.zeros((len(changes), 2))])
        passes = self._region.are_sendable(xy, velocity, accels, accel).reshape(2, -1).all(axis=0)
        return changes[int(np.argmax(passes))] if passes.any() else wanted

    def transit(self, t_s: float, ending: tuple[Floats, Floats]) -> Transit:
        """Return the way so far with the manoeuvre that ends it."""
        xy, velocity = ending
        return Transit(t_s, np.vstack([np.array(self._way), xy]), np.vstack([np.array(self._speeds), velocity]))


def _longest_wait_s(xy_m: Floats, tour: Tour, mobility: Mobility) -> float:
    """Return a time after which every slot can be met from everywhere: a large lap need not be searched whole."""
    least, most = tour.bounds_m
    low, high = np.minimum(least, xy_m), np.maximum(most, xy_m)
    across_s = 1.5 * float(np.hypot(*(high - low))) / mobility.speed_m_s + ALLOWANCE_S
    lap_s = max(tour.period_s, 2 * MANOEUVRES_S[-1]) + MAX_TRANSIT_S / 4
    return float(min(lap_s, across_s + 2 * MANOEUVRES_S[-1]))


class _Rendezvous:
    """Finds where a slot will be when a vehicle can first be there, too."""

    def __init__(self, xy_m: Floats, tour: Tour, phase_s: float, mobility: Mobility) -> None:
        self._tour, self._phase_s, self._speed_m_s = tour, phase_s, mobility.speed_m_s
        self._lap_s = np.arange(0.0, _longest_wait_s(xy_m, tour, mobility), LOOK_AHEAD_S)
        self._first = 0
        """Row of `_lap_s` of the last answer; the next answer is earlier by about the time that went by."""

    def point(self, xy: tuple[float, float], now_s: float) -> Floats:
        """Return the rendezvous of a vehicle that is at `xy` then; the slot's present place if there is none."""
        tour, lap_s, speed_m_s, phase_s = self._tour, self._lap_s, self._speed_m_s, self._phase_s + now_s
        if tour.top_way_m_s > SLOWER_SHARE * speed_m_s:
            path = tour.places(phase_s + lap_s)
            needed = np.hypot(path[:, 0] - xy[0], path[:, 1] - xy[1]) / speed_m_s + ALLOWANCE_S
            return np.asarray(path[int(np.argmax(needed <= lap_s))])

        def in_time(row: int) -> bool:
            wait_s = float(lap_s[row])
            x, y = tour.place(phase_s + wait_s)
            return math.hypot(x - xy[0], y - xy[1]) / speed_m_s + ALLOWANCE_S <= wait_s

        self._first = _first(in_time, len(lap_s), max(self._first - 1, 0)) % len(lap_s)
        return np.array(tour.place(phase_s + float(lap_s[self._first])))


def _first(holds: Callable[[int], bool], count: int, guess: int) -> int:
    """Return the first of 0 … count - 1 for which `holds`, if it holds for all after it; `count` without one.

    It is fast near `guess`.
    """
    stride = 1
    if holds(guess):
        low, high = guess - 1, guess
        while low >= 0 and holds(low):
            low, high, stride = low - stride, low, 2 * stride
    else:
        low, high = guess, guess + 1
        while high < count and not holds(high):
            low, high, stride = high, high + stride, 2 * stride
    return bisect_left(range(count), True, max(low + 1, 0), min(high, count), key=holds)


def _too_far_s(flight: _PointMass, path: Floats, top_speed_m_s: float, mobility: Mobility) -> float:
    """Return a time during which no manoeuvre ends on the slot, even if both fly towards each other.

    `path` (k, 2) is where the slot is after each of `MANOEUVRES_S`. No manoeuvre's mean speed is above the vehicle's
    limit.
    """
    away_m = np.hypot(path[:, 0] - flight.xy[0], path[:, 1] - flight.xy[1])
    beyond_m = float((away_m - mobility.speed_m_s * MANOEUVRES_S).min()) - SAME_M
    return max(0.0, beyond_m / (mobility.speed_m_s + top_speed_m_s))


def _manoeuvre(
    flight: _PointMass, slots: tuple[Floats, Floats], mobility: Mobility, region: FlyableRegion
) -> tuple[Floats, Floats] | None:
    """Return the shortest cubic onto the slot that keeps all limits, without its first sample; None without one.

    `slots` is the place and velocity of the slot after each of `MANOEUVRES_S`. A cubic's acceleration is linear in
    time, so its ends are its extremes: (6 d / T - 4 v0 - 2 v1) / T at the start and (-6 d / T + 2 v0 + 4 v1) / T at the
    end. Its velocity half way is (6 d / T - v0 - v1) / 4.
    """
    p0, v0, took = np.array(flight.xy), np.array(flight.velocity), MANOEUVRES_S[:, None]
    p1, v1 = slots
    mean = (p1 - p0) / took
    half_way = 6 * mean - v0 - v1
    begin, end = (6 * mean - 4 * v0 - 2 * v1) / took, (-6 * mean + 2 * v0 + 4 * v1) / took
    good = np.maximum(np.hypot(*begin.T), np.hypot(*end.T)) <= mobility.accel_m_s2
    good &= np.hypot(*half_way.T) <= 4 * mobility.speed_m_s + SAME_M  # excludes most
    rows = np.flatnonzero(good)
    if not len(rows):
        return None
    share = CHECKED[:, None, None]
    speed = v0 + share * took[rows] * begin[rows] + share**2 / 2 * took[rows] * (end - begin)[rows]
    slow = np.hypot(speed[..., 0], speed[..., 1]).max(axis=0) <= mobility.speed_m_s
    for i in rows[slow].tolist():
        duration = float(MANOEUVRES_S[i])
        at = STEP_S * np.arange(1, round(duration / STEP_S) + 1)[:, None]
        jerk = (end[i] - begin[i]) / duration
        xy = p0 + v0 * at + begin[i] * at**2 / 2 + jerk * at**3 / 6
        velocity = v0 + begin[i] * at + jerk * at**2 / 2
        soon = np.minimum(at + SENT_STEP_S, duration)
        keeps_speed = np.hypot(*velocity.T).max() <= mobility.speed_m_s
        # What the vehicle does now is sent, too, and everything with the acceleration of what comes.
        accels = np.stack([np.vstack([begin[i], begin[i] + jerk * when]) for when in (at, soon)])
        states = np.vstack([p0, xy]), np.vstack([v0, velocity]), accels
        if keeps_speed and region.are_sendable(*states, mobility.accel_m_s2).all():
            return xy, velocity
    return None
