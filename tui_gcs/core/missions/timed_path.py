"""The path of a mission with times: legs, and the position as a function of time.

The model of a multicopter: straight legs in space, each flown as fast as speed, climb and descent allow, with the
acceleration of `Performance` at its ends. Through a corner goes the part of the speed that points in the new direction,
so a straight row of way-points is flown through and a right angle is a stop. There is no wind. Times begin with the
first item; arming and spooling up are not in them.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.item_sequence import ItemWalk
from tui_gcs.core.missions.mission_builder import CHANGE_SPEED
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.plans import model as plan
from tui_gcs.core.plans.model import PlanItem
from tui_gcs.core.protocol.common import Vec3

Floats = NDArray[np.float64]

CIRCLE_POINTS = 16
"""A flown circle is approximated by so many straight legs."""
MAX_TURNS = 50
DEFAULT_RADIUS_M = 10.0
"""The radius of a circle that gives none: ArduCopter's CIRCLE_RADIUS."""
MAX_COORDINATE_M = 50_000_000.0
"""No place on earth is farther than this from another one."""
GROUND_HEIGHT_M = 0.5
"""Below this height a vehicle stands on the ground."""
MIN_LEG_M = 1e-6
"""A shorter leg has no direction."""


@dataclass(frozen=True)
class HomePosition:
    """The place where a vehicle starts, in the scenario's frame, and its height above sea level."""

    place_m: tuple[float, float] = (0.0, 0.0)
    amsl_m: float = 0.0
    height_m: float = 0.0
    """Its height above home when it begins: 0 on the ground."""


@dataclass(frozen=True)
class TimedPath:
    """The path of a whole mission, n legs."""

    leg_items: NDArray[np.int64]
    """(n,) the index of the item that each leg belongs to."""
    corners_m: Floats
    """(n + 1, 3) the ends of the legs, without times. Heights are above home."""
    leg_times_s: Floats
    """(n, 3) of each leg: when it begins, when it ends, how long the vehicle waits then."""
    t_s: Floats
    """(k,) the times of the knots, ascending."""
    points_m: Floats
    """(k, 3) the positions at these times; between knots the motion is straight and even."""
    lands: bool = False
    endless: bool = False
    """Whether it circles, stays or repeats for ever: times are those of the first time round."""
    cut: bool = False
    """Whether it is longer than is computed."""

    @property
    def duration_s(self) -> float:
        """The time from the first item to the last."""
        return float(self.t_s[-1]) if len(self.t_s) else 0.0

    @property
    def is_empty(self) -> bool:
        """Whether there are no legs."""
        return not len(self.leg_items)

    @cached_property
    def length_m(self) -> float:
        """The length of the path in space."""
        return float(_lengths_m(np.diff(self.points_m, axis=0)).sum()) if len(self.points_m) else 0.0

    @cached_property
    def arrivals_s(self) -> dict[int, float]:
        """When each item is first done, except for waiting, by index: reached, circled, landed.

        Only places are listed.
        """
        found: dict[int, float] = {}
        if self.is_empty:
            return found
        last = np.append(self._first_legs[1:], len(self.leg_items)) - 1
        for item, end_s in zip(self.leg_items[last].tolist(), self.leg_times_s[last, 1].tolist(), strict=True):
            found.setdefault(item, end_s)
        return found

    @cached_property
    def shares(self) -> dict[int, tuple[float, float]]:
        """(metres, seconds) of the path to each item the first time, with what is done there, by index."""
        found: dict[int, tuple[float, float]] = {}
        if self.is_empty:
            return found
        first = self._first_legs
        begin_s, end_s, hold_s = self.leg_times_s.T
        lengths_m = np.add.reduceat(_lengths_m(np.diff(self.corners_m, axis=0)), first)
        durations_s = np.add.reduceat(end_s - begin_s + hold_s, first)
        shares = zip(lengths_m.tolist(), durations_s.tolist(), strict=True)
        for item, share in zip(self.leg_items[first].tolist(), shares, strict=True):
            found.setdefault(item, share)
        return found

    @cached_property
    def _first_legs(self) -> NDArray[np.intp]:
        """Indices of the legs that begin another item than the leg before."""
        return np.flatnonzero(np.diff(self.leg_items, prepend=-1))

    @cached_property
    def along_m(self) -> Floats:
        """(k,) the distance over ground at each knot: with the heights, the altitude profile."""
        steps = np.hypot(*np.diff(self.points_m[:, :2], axis=0).T) if len(self.points_m) > 1 else np.zeros(0)
        return np.concatenate([[0.0], np.cumsum(steps)]) if len(self.points_m) else np.zeros(0)

    def at(self, t_s: Floats) -> Floats:
        """Return the positions at these times, (n, 3); before and after the mission, those of its ends."""
        if not len(self.t_s):
            return np.full((len(t_s), 3), np.nan)
        return np.column_stack([np.interp(t_s, self.t_s, self.points_m[:, axis]) for axis in range(3)])


def _lengths_m(steps_m: Floats) -> Floats:
    """Return the lengths (n,) of steps (n, 3)."""
    lengths: Floats = np.sqrt((steps_m**2).sum(axis=1))
    return lengths


EMPTY_PATH = TimedPath(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))


def timed_path(
    items: Items,
    home: HomePosition,
    frame: LocalFrame,
    performance: Performance,
    *,
    start_m: Vec3 | None = None,
    first: int = 0,
) -> TimedPath:
    """Compute the path of `items`, a mission that begins at `home`.

    Args:
        items: All items of the mission.
        home: Where the vehicle starts, and where a return leads.
        frame: The frame of the path.
        performance: The vehicle's speeds and accelerations.
        start_m: Where the vehicle is in the air, if it does not start at `home`; its height counts above home.
        first: The index of the item that it flies to first.
    """
    route = _PathBuilder(items, home, frame, performance, start_m)
    walk = ItemWalk(items, first)
    for index in walk.steps():
        if route.over:
            break
        route.take(index, items[index])
    if not route.items:
        return EMPTY_PATH
    return _timed(route, endless=walk.endless or route.endless, cut=walk.cut)


class _PathBuilder:
    """Turns items into places, one after the other."""

    def __init__(
        self,
        items: Items,
        home: HomePosition,
        frame: LocalFrame,
        performance: Performance,
        start_m: Vec3 | None = None,
    ) -> None:
        self.items: list[int] = []
        """The item of each place but the start."""
        self.places_m: list[Vec3] = [start_m or (*home.place_m, home.height_m)]
        self.speeds_m_s: list[float] = []
        """The largest speed over ground to each place; for a vertical descent at the place, its speed."""
        self.holds_s: list[float] = []
        """How long the vehicle stays at each place."""
        self.over = self.endless = self.lands = False
        self.performance = performance
        self._home = home
        # All items in one call: one call for each is many times slower.
        x_m, y_m = frame.to_enu(
            np.array([item.lat_deg for item in items], dtype=float),
            np.array([item.lon_deg for item in items], dtype=float),
        )
        self._there_m = list(zip(x_m.tolist(), y_m.tolist(), strict=True))
        self._speed_m_s = performance.speed_m_s

    def take(self, index: int, item: PlanItem) -> None:
        """Append the places of the next item."""
        at = self.places_m[-1]
        match item.command:
            case plan.WAYPOINT | plan.SPLINE | plan.LOITER_TIME:
                self._fly(index, (*self._place_m(index, item), self._height_m(item)), _positive(item.params[0]))
            case plan.TAKE_OFF | plan.VTOL_TAKE_OFF:
                self._fly(index, (at[0], at[1], self._height_m(item)))
            case plan.LAND | plan.VTOL_LAND:
                x, y = self._place_m(index, item)
                self._fly(index, (x, y, at[2]))
                self._land(index)
            case plan.RETURN:
                x, y = self._home.place_m
                # ArduCopter climbs to RTL_ALT before it flies home.
                height_m = max(at[2], self.performance.return_height_m)
                self._fly(index, (at[0], at[1], height_m))
                self._fly(index, (x, y, height_m))
                self._land(index)
            case plan.LOITER_TURNS:
                self._circle(index, item)
            case plan.LOITER_UNLIMITED | plan.LOITER_TO_ALT | plan.PAYLOAD_PLACE:
                self._fly(index, (*self._place_m(index, item), self._height_m(item)))
                self.over = self.endless = item.command == plan.LOITER_UNLIMITED
            case plan.DELAY:
                if self.items:
                    self.holds_s[-1] += _positive(item.params[0])
            case _ if item.command == CHANGE_SPEED and item.params[1] > 0:
                self._speed_m_s = item.params[1]

    def _fly(self, index: int, to_m: Vec3, hold_s: float = 0.0) -> None:
        x, y, z = to_m
        # A file may hold any number; NaN fails the comparison, too.
        if abs(x) <= MAX_COORDINATE_M and abs(y) <= MAX_COORDINATE_M and abs(z) <= MAX_COORDINATE_M:
            self._append(index, to_m, self._speed_m_s, hold_s)
        # else (NaN, too) it is left out: `core/plans/check` reports what is wrong with it

    def _append(self, index: int, to_m: Vec3, speed_m_s: float, hold_s: float = 0.0) -> None:
        self.items.append(index)
        self.places_m.append(to_m)
        self.speeds_m_s.append(speed_m_s)
        self.holds_s.append(hold_s)

    def _land(self, index: int) -> None:
        x, y, height_m = self.places_m[-1]
        # ArduCopter lands slowly only below LAND_ALT_LOW.
        slow_m = self.performance.land_slow_m
        if height_m > slow_m:
            self._fly(index, (x, y, slow_m))
        self._append(index, (x, y, 0.0), self.performance.land_m_s)
        self.lands = self.over = True

    def _circle(self, index: int, item: PlanItem) -> None:
        x, y = self._place_m(index, item)
        height_m = self._height_m(item)
        turns, radius_m = min(_positive(item.params[0]), MAX_TURNS), abs(item.params[2]) or DEFAULT_RADIUS_M
        # A negative radius means counter-clockwise (MAV_CMD_NAV_LOITER_TURNS).
        sense = -1.0 if item.params[2] < 0 else 1.0
        at = self.places_m[-1]
        from_rad = math.atan2(at[1] - y, at[0] - x)
        for step in range(round(turns * CIRCLE_POINTS) + 1):
            angle = from_rad - sense * step * math.tau / CIRCLE_POINTS
            self._fly(index, (x + radius_m * math.cos(angle), y + radius_m * math.sin(angle), height_m))

    def _place_m(self, index: int, item: PlanItem) -> tuple[float, float]:
        """Return the place of an item; an item without one is where the vehicle is then."""
        if item.x == 0 and item.y == 0:
            return self.places_m[-1][:2]
        return self._there_m[index]

    def _height_m(self, item: PlanItem) -> float:
        """Return the height above home; the ground is assumed to be level."""
        # ArduPilot takes a height of 0 for the present one, as it does with the place (ModeAuto::loc_from_cmd).
        if item.has_no_place and item.z == 0 and item.command not in plan.HERE:
            return self.places_m[-1][2]
        return item.z - self._home.amsl_m if plan.PLAIN_FRAME.get(item.frame) == plan.AMSL else item.z


def _positive(value: float) -> float:
    """Return a time or number of a file; an invalid one counts as 0."""
    return value if math.isfinite(value) and value > 0 else 0.0


def _timed(route: _PathBuilder, *, endless: bool, cut: bool) -> TimedPath:
    corners = np.array(route.places_m)
    holds = np.array(route.holds_s)
    steps = np.diff(corners, axis=0)
    lengths = _lengths_m(steps)
    speeds = _speeds_m_s(route, steps, lengths)
    accel = route.performance.accel_m_s2
    at_corners = _corner_speeds(steps, lengths, speeds, holds, accel)
    after_s, shares, is_knot = _knots(lengths, at_corners[:-1], at_corners[1:], speeds, accel)
    flown_s = after_s[:, -1]
    # Legs and holds alternate, as they are flown.
    clock_s = np.cumsum(np.column_stack([flown_s, holds])).reshape(-1, 2)
    begin_s = np.concatenate([[0.0], clock_s[:-1, 1]])
    is_knot = np.column_stack([is_knot, holds > 0])
    times = np.column_stack([begin_s[:, None] + after_s, clock_s[:, 1]])[is_knot]
    shares = np.column_stack([shares, np.ones(len(holds))])[is_knot]
    of = np.repeat(np.arange(len(holds)), is_knot.sum(axis=1))
    points = corners[of] + steps[of] * shares[:, None]
    return TimedPath(
        np.array(route.items),
        corners,
        np.column_stack([begin_s, clock_s[:, 0], holds]),
        np.concatenate([[0.0], times]),
        np.concatenate([corners[:1], points]),
        route.lands,
        endless,
        cut,
    )


def _speeds_m_s(route: _PathBuilder, steps: Floats, lengths: Floats) -> Floats:
    """Return the speed of each leg in space, (n,), which keeps to both the ground speed and the vertical one."""
    most = np.array(route.speeds_m_s)
    up_m, ground_m = steps[:, 2], np.hypot(steps[:, 0], steps[:, 1])
    vertical_m_s = np.where(up_m > 0, route.performance.climb_m_s, route.performance.descent_m_s)
    if route.lands:
        vertical_m_s[-1] = route.performance.land_m_s
    # Legs that are vertical, level or without length divide by zero: infinity is meant.
    with np.errstate(divide="ignore", invalid="ignore"):
        by_ground = np.where(ground_m > 0, most * lengths / ground_m, np.inf)
        by_height = np.where(up_m != 0, vertical_m_s * lengths / np.abs(up_m), np.inf)
    slower: Floats = np.minimum(by_ground, by_height)
    return np.where(lengths > 0, slower, most)


def _corner_speeds(steps: Floats, lengths: Floats, speeds: Floats, holds: Floats, accel: float) -> Floats:
    """Return the speed at each place, (n + 1,).

    It is what the corner allows, and what can be reached from the place before and braked to the next. The corner
    allows the cosine of its angle as a share of the speed, and nothing from a right angle on.
    """
    before, after = lengths[:-1], lengths[1:]
    along = (steps[:-1] * steps[1:]).sum(axis=1)
    # A stop, or a leg without length, has no direction: the vehicle starts from rest.
    turns = (before >= MIN_LEG_M) & (after >= MIN_LEG_M) & (holds[:-1] == 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        through = np.where(turns, np.clip(along / (before * after), 0.0, 1.0), 0.0)
    at = [0.0, *(through * np.minimum(speeds[:-1], speeds[1:])).tolist(), 0.0]
    gains = (2 * accel * lengths).tolist()
    # Forwards: no place is reached faster than its leg allows. Backwards: each next place can still be braked for.
    for i, gain in enumerate(gains):
        at[i + 1] = min(at[i + 1], math.sqrt(at[i] ** 2 + gain))
    for i in range(len(gains) - 1, -1, -1):
        at[i] = min(at[i], math.sqrt(at[i + 1] ** 2 + gains[i]))
    return np.array(at)


def _knots(
    lengths: Floats, first: Floats, last: Floats, most: Floats, accel: float
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return the knots of each leg: (n, 5) seconds after its begin, shares of its length, which of them exist.

    The knots are those of accelerating, even and braking flight. Half of the time of each acceleration is a knot; the
    last knot always exists, with a share of 1.
    """
    moves = lengths >= MIN_LEG_M
    length_m = np.where(moves, lengths, 1.0)
    # The speed that a leg just reaches if it only accelerates and brakes.
    peak = np.minimum(most, np.sqrt(accel * length_m + (first**2 + last**2) / 2))
    peak = np.maximum(np.maximum(peak, first), last)
    up_s, down_s = (peak - first) / accel, (peak - last) / accel
    up_m, down_m = (first + peak) / 2 * up_s, (last + peak) / 2 * down_s
    even_m = np.maximum(0.0, length_m - up_m - down_m)
    even_s = even_m / peak
    half_up_s, half_down_s = up_s / 2, down_s / 2
    slowing_m = up_m + even_m + peak * half_down_s - accel * half_down_s * half_down_s / 2
    after_s = [half_up_s, up_s, up_s + even_s, up_s + even_s + half_down_s, up_s + even_s + down_s]
    way_m = [
        first * half_up_s + accel * half_up_s * half_up_s / 2,
        first * up_s + accel * up_s * up_s / 2,
        up_m + even_m,
        np.minimum(slowing_m, length_m),
        length_m,
    ]
    is_knot = np.column_stack([moves, moves, moves & (even_s != 0), moves, np.ones_like(moves)])
    return np.column_stack(after_s) * moves[:, None], np.column_stack(way_m) / length_m[:, None], is_knot
