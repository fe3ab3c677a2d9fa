"""Where a mission leads and when: legs with times, and the way as a function of time.

Assumed as of multicopters: straight ways in space, each flown as fast as speed, climb and descent allow, with the
acceleration of `Performance` at its ends; where the way turns, no faster than the part of the speed that goes on in
the new direction, so a straight row of way-points is flown through and a right angle is a stop. Without wind. Times
begin when the first item does; arming and spooling up are not in them.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core import plan
from tui_gcs.core.geo import LocalFrame
from tui_gcs.core.messages import Vec3
from tui_gcs.core.missions.build import CHANGE_SPEED
from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.walk import Walk
from tui_gcs.core.plan import PlanItem

Floats = NDArray[np.float64]

CIRCLE_POINTS = 16
"""A circle flown is so many straight ways."""
MOST_TURNS = 50
DEFAULT_RADIUS_M = 10.0
"""Of a circle that says none: ArduCopter's CIRCLE_RADIUS."""
FARTHEST_M = 50_000_000.0
"""Nothing on earth is farther."""
LOW_M = 0.5
"""Below this it stands on the ground."""
_KNOT_SHARES = (0.0, 0.5, 1.0)
"""Of the time of each acceleration, where the way in time has knots: between them it is off by a few decimetres."""


@dataclass(frozen=True)
class Home:
    """Where a vehicle starts, in the scenario's frame, and how high that is above sea level."""

    place_m: tuple[float, float] = (0.0, 0.0)
    amsl_m: float = 0.0


@dataclass(frozen=True)
class Leg:
    """One straight way, to or within an item. Heights are above home."""

    item: int
    from_m: Vec3
    to_m: Vec3
    begin_s: float
    end_s: float
    hold_s: float = 0.0
    """It waits so long at its end."""

    @property
    def length_m(self) -> float:
        """In space."""
        return math.dist(self.from_m, self.to_m)


@dataclass(frozen=True)
class Way:
    """All of a mission."""

    legs: tuple[Leg, ...]
    t_s: Floats
    """(k,) times of the knots, never falling."""
    points_m: Floats
    """(k, 3) where it is then; straight and even between."""
    lands: bool = False
    endless: bool = False
    """It circles, stays or repeats for ever: times are of the first time round."""
    cut: bool = False
    """Longer than is followed."""

    @property
    def duration_s(self) -> float:
        """From the first item to the last."""
        return float(self.t_s[-1]) if len(self.t_s) else 0.0

    @cached_property
    def length_m(self) -> float:
        """Flown, in space."""
        return float(np.sqrt((np.diff(self.points_m, axis=0) ** 2).sum(axis=1)).sum()) if self.legs else 0.0

    @cached_property
    def corners_m(self) -> Floats:
        """(n, 3) the ends of its legs: where it leads, without times."""
        return np.array([self.legs[0].from_m, *(leg.to_m for leg in self.legs)]) if self.legs else np.zeros((0, 3))

    @cached_property
    def arrivals_s(self) -> dict[int, float]:
        """When it has first done each item but waiting, by index: is there, has circled, has landed. Only places."""
        found: dict[int, float] = {}
        for leg, after in zip(self.legs, (*self.legs[1:], None), strict=True):
            if after is None or after.item != leg.item:
                found.setdefault(leg.item, leg.end_s)
        return found

    @cached_property
    def shares(self) -> dict[int, tuple[float, float]]:
        """(metres, seconds) of the way to each item the first time, with what is done there; by index."""
        found: dict[int, tuple[float, float]] = {}
        done: set[int] = set()
        for leg, after in zip(self.legs, (*self.legs[1:], None), strict=True):
            if leg.item not in done:
                length_m, duration_s = found.get(leg.item, (0.0, 0.0))
                found[leg.item] = (length_m + leg.length_m, duration_s + leg.end_s - leg.begin_s + leg.hold_s)
            if after is None or after.item != leg.item:
                done.add(leg.item)
        return found

    @cached_property
    def along_m(self) -> Floats:
        """(k,) how far over ground it is at each knot: with heights, the altitude profile."""
        steps = np.hypot(*np.diff(self.points_m[:, :2], axis=0).T) if len(self.points_m) > 1 else np.zeros(0)
        return np.concatenate([[0.0], np.cumsum(steps)]) if len(self.points_m) else np.zeros(0)

    def at(self, t_s: Floats) -> Floats:
        """(n, 3) where it is at these times; before and after, at its ends."""
        if not len(self.t_s):
            return np.full((len(t_s), 3), np.nan)
        return np.column_stack([np.interp(t_s, self.t_s, self.points_m[:, axis]) for axis in range(3)])


EMPTY = Way((), np.zeros(0), np.zeros((0, 3)))


@dataclass
class _Node:
    """A place to fly to, how fast at most, and how long it stays there."""

    item: int
    to_m: Vec3
    speed_m_s: float
    hold_s: float = 0.0


def way_of(items: Items, home: Home, frame: LocalFrame, performance: Performance) -> Way:
    """Where `items`, a mission begun at `home`, lead."""
    route = _Route(home, frame, performance)
    walk = Walk(items)
    for index in walk.steps():
        if route.over:
            break
        route.take(index, items[index])
    return _timed(route, endless=walk.endless or route.endless, cut=walk.cut)


class _Route:
    """Items made into places one after the other."""

    def __init__(self, home: Home, frame: LocalFrame, performance: Performance) -> None:
        self.nodes: list[_Node] = []
        self.start_m: Vec3 = (*home.place_m, 0.0)
        self.over = self.endless = self.lands = False
        self.performance = performance
        self._home = home
        self._frame = frame
        self._at = self.start_m
        self._speed_m_s = performance.speed_m_s

    def take(self, index: int, item: PlanItem) -> None:
        """The next item."""
        match item.command:
            case plan.TAKE_OFF | plan.VTOL_TAKE_OFF:
                self._fly(index, (self._at[0], self._at[1], self._height_m(item)))
            case plan.LAND | plan.VTOL_LAND:
                x, y = self._place_m(item)
                self._fly(index, (x, y, self._at[2]))
                self._land(index)
            case plan.RETURN:
                x, y = self._home.place_m
                height_m = max(self._at[2], self.performance.return_height_m)
                self._fly(index, (self._at[0], self._at[1], height_m))
                self._fly(index, (x, y, height_m))
                self._land(index)
            case plan.LOITER_TURNS:
                self._circle(index, item)
            case plan.WAYPOINT | plan.SPLINE | plan.LOITER_TIME:
                self._fly(index, (*self._place_m(item), self._height_m(item)), _positive(item.params[0]))
            case plan.LOITER_UNLIMITED | plan.LOITER_TO_ALT | plan.PAYLOAD_PLACE:
                self._fly(index, (*self._place_m(item), self._height_m(item)))
                self.over = self.endless = item.command == plan.LOITER_UNLIMITED
            case plan.DELAY:
                if self.nodes:
                    self.nodes[-1].hold_s += _positive(item.params[0])
            case _ if item.command == CHANGE_SPEED and item.params[1] > 0:
                self._speed_m_s = item.params[1]

    def _fly(self, index: int, to_m: Vec3, hold_s: float = 0.0) -> None:
        if not all(abs(value) <= FARTHEST_M for value in to_m):
            return  # NaN, too; `plan_check` says what is wrong with it
        self.nodes.append(_Node(index, to_m, self._leg_speed_m_s(to_m), hold_s))
        self._at = to_m

    def _land(self, index: int) -> None:
        x, y, height_m = self._at
        slow_m = self.performance.land_slow_m
        if height_m > slow_m:
            self._fly(index, (x, y, slow_m))
        self.nodes.append(_Node(index, (x, y, 0.0), self.performance.land_m_s))
        self._at = (x, y, 0.0)
        self.lands = self.over = True

    def _circle(self, index: int, item: PlanItem) -> None:
        x, y = self._place_m(item)
        height_m = self._height_m(item)
        turns, radius_m = min(_positive(item.params[0]), MOST_TURNS), abs(item.params[2]) or DEFAULT_RADIUS_M
        sense = -1.0 if item.params[2] < 0 else 1.0
        from_rad = math.atan2(self._at[1] - y, self._at[0] - x)
        for step in range(round(turns * CIRCLE_POINTS) + 1):
            angle = from_rad - sense * step * math.tau / CIRCLE_POINTS
            self._fly(index, (x + radius_m * math.cos(angle), y + radius_m * math.sin(angle), height_m))

    def _place_m(self, item: PlanItem) -> tuple[float, float]:
        """An item without a place is where the vehicle is then."""
        if item.x == 0 and item.y == 0:
            return self._at[0], self._at[1]
        return self._frame.to_enu(item.lat_deg, item.lon_deg)

    def _height_m(self, item: PlanItem) -> float:
        """Above home; the ground is taken for level."""
        return item.z - self._home.amsl_m if plan.PLAIN_FRAME.get(item.frame) == plan.AMSL else item.z

    def _leg_speed_m_s(self, to_m: Vec3) -> float:
        """In space, such that neither the speed over ground nor the vertical one is too high."""
        up_m = to_m[2] - self._at[2]
        ground_m = math.dist(self._at[:2], to_m[:2])
        length_m = math.hypot(up_m, ground_m)
        vertical_m_s = self.performance.climb_m_s if up_m > 0 else self.performance.descent_m_s
        if length_m == 0.0:
            return self._speed_m_s
        by_ground = self._speed_m_s * length_m / ground_m if ground_m > 0 else math.inf
        by_height = vertical_m_s * length_m / abs(up_m) if up_m else math.inf
        return min(by_ground, by_height)


def _positive(value: float) -> float:
    """A time or number from a file: what is none counts as 0."""
    return value if math.isfinite(value) and value > 0 else 0.0


# ---------------------------------------------------------------- times


def _timed(route: _Route, *, endless: bool, cut: bool) -> Way:
    nodes, accel = route.nodes, route.performance.accel_m_s2
    if not nodes:
        return EMPTY
    places = [route.start_m, *(node.to_m for node in nodes)]
    lengths = [math.dist(a, b) for a, b in itertools.pairwise(places)]
    ends = _corner_speeds(places, lengths, nodes, accel)
    legs: list[Leg] = []
    times, shares, of = [0.0], [0.0], [0]
    now = 0.0
    for i, (node, length_m) in enumerate(zip(nodes, lengths, strict=True)):
        begin_s = now
        for after_s, share in _leg_knots(length_m, ends[i], ends[i + 1], node.speed_m_s, accel):
            times.append(begin_s + after_s)
            shares.append(share)
            of.append(i)
        now = times[-1]
        legs.append(Leg(node.item, places[i], node.to_m, begin_s, now, node.hold_s))
        if node.hold_s:
            now += node.hold_s
            times.append(now)
            shares.append(1.0)
            of.append(i)
    corners = np.array(places)
    index = np.array(of)
    points = corners[index] + (corners[index + 1] - corners[index]) * np.array(shares)[:, None]
    return Way(tuple(legs), np.array(times), points, route.lands, endless, cut)


def _corner_speeds(
    places: Sequence[Vec3], lengths: Sequence[float], nodes: Sequence[_Node], accel: float
) -> list[float]:
    """At each place: what the turn allows, and what can be reached from the one before and braked to the next."""
    speeds = [0.0]
    for i, (node, after) in enumerate(itertools.pairwise(nodes)):
        speed = 0.0 if node.hold_s else _through(places[i], places[i + 1], places[i + 2], lengths[i], lengths[i + 1])
        speeds.append(speed * min(node.speed_m_s, after.speed_m_s))
    speeds.append(0.0)
    for i, length_m in enumerate(lengths):
        speeds[i + 1] = min(speeds[i + 1], math.sqrt(speeds[i] ** 2 + 2 * accel * length_m))
    for i in range(len(lengths) - 1, -1, -1):
        speeds[i] = min(speeds[i], math.sqrt(speeds[i + 1] ** 2 + 2 * accel * lengths[i]))
    return speeds


def _through(a: Vec3, b: Vec3, c: Vec3, ab_m: float, bc_m: float) -> float:
    """The part of the speed that goes on where the way turns: the cosine of the turn, none from a right angle on."""
    if ab_m < 1e-6 or bc_m < 1e-6:
        return 0.0
    along = sum((q - p) * (r - q) for p, q, r in zip(a, b, c, strict=True))
    return max(0.0, min(1.0, along / (ab_m * bc_m)))


def _leg_knots(
    length_m: float, first_m_s: float, last_m_s: float, most_m_s: float, accel: float
) -> list[tuple[float, float]]:
    """(seconds after its begin, share of the way) of one leg: faster, evenly, slower."""
    if length_m < 1e-6:
        return [(0.0, 1.0)]
    peak = min(most_m_s, math.sqrt(accel * length_m + (first_m_s**2 + last_m_s**2) / 2))
    peak = max(peak, first_m_s, last_m_s)
    up_s, down_s = (peak - first_m_s) / accel, (peak - last_m_s) / accel
    up_m = (first_m_s + peak) / 2 * up_s
    down_m = (last_m_s + peak) / 2 * down_s
    even_m = max(0.0, length_m - up_m - down_m)
    even_s = even_m / peak
    knots = []
    for share in _KNOT_SHARES[1:]:
        t = up_s * share
        knots.append((t, (first_m_s * t + accel * t * t / 2) / length_m))
    if even_s:
        knots.append((up_s + even_s, (up_m + even_m) / length_m))
    for share in _KNOT_SHARES[1:]:
        t = down_s * share
        way_m = up_m + even_m + peak * t - accel * t * t / 2
        knots.append((up_s + even_s + t, min(way_m / length_m, 1.0)))
    return [*knots[:-1], (knots[-1][0], 1.0)]
