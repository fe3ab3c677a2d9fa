"""Chooses which vehicle meets which targets, one after the other, and on which circuit the others fly.

Both are one choice: a vehicle that leaves the ring opens a gap, and what may come through it unseen counts against
leaving. Every vehicle has some options; they are improved in turn until no vehicle's change is any better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.guardian.intercept import Interception, TargetCourse, intercept
from tui_gcs.planner.guardian.option_prediction import OptionLegs, first_pass_s, predicted_courses, would_catch
from tui_gcs.planner.guardian.unseen_threats import Threats
from tui_gcs.planner.lazy_scipy import min_cost_pairs
from tui_gcs.planner.patrol.tour import Tour
from tui_gcs.planner.patrol.transit import Mobility

Floats = NDArray[np.floating[Any]]
CircuitDirection = tuple[int, int]
"""Number of a circuit, and 1 or -1: as it is timed or the other way round."""

MAX_LATE_S, MAX_LATE_UNDER_WAY_S = 0.7, 1.7
"""A meeting may be this late; the second value is for a vehicle already under way. Turning is overestimated, so a
meeting that seems late may still succeed."""
MARGIN_S = 1.0
"""Meetings with a smaller margin are worth less."""
MIN_WORTH, MAX_WORTH, WORTH_1_S = 0.3, 0.95, 0.5
"""Worth of a meeting at the latest time, worth with `MARGIN_S`, and loss per second of missing margin."""
TIME_1_S = 0.003
"""Cost of every second until a meeting."""
UNSEEN_IN_50_M = 1.0
"""Number of unseen intruders that are expected all round in 50 m of depth while intruders are known."""
SAME_ROUTE_BONUS, SAME_DIRECTION_BONUS, SAME_CIRCUIT_BONUS = 0.05, 0.05, 0.02
"""Worth of continuing as before."""
MAX_SINGLE_ROUTES, MAX_PAIR_ROUTES = 4, 4
"""Routes that are tried for each vehicle, most useful first."""
IMPROVEMENT_ROUNDS = 4
"""Rounds of improving all vehicles in turn."""
PASSED_SHARE = 0.9
"""Share of the meeting distance for passing a target on the way round: predicted courses are not exact."""
NEVER = 1e6


@dataclass(frozen=True)
class InterceptTask:
    """What one vehicle is to do: targets in order, by their rows."""

    targets: tuple[int, ...]
    place_m: Floats
    """(2,) where it meets the first target."""
    velocity_m_s: Floats
    """(2,) velocity on the way there."""
    after_s: float
    margin_s: float
    """Time left at its first meeting until the target is in the zone; negative if it is too late."""
    waits: bool
    """The target is not yet where vehicles may fly: go there and wait."""


@dataclass(frozen=True)
class VehicleOption:
    """What a vehicle may do: which targets it meets first, and then which circuit it flies."""

    targets: tuple[int, ...]
    way: CircuitDirection
    passes: tuple[int, ...] = ()
    """Targets that it passes near enough without being sent to them."""


@dataclass(frozen=True)
class Engagement:
    """n vehicles and k targets, with places and velocities (…, 2)."""

    xy_m: Floats
    velocity_m_s: Floats
    target_m: Floats
    target_m_s: Floats
    courses: list[TargetCourse]
    before: Sequence[VehicleOption]
    """(n,) what each vehicle does now, without targets that are gone."""
    mobility: Mobility
    within_m: float

    @property
    def enters_s(self) -> Floats:
        """(k,) time until each target is in the zone."""
        return np.array([course.enters_s for course in self.courses])

    @property
    def reachable_s(self) -> Floats:
        """(k,) time until each target is where vehicles may fly."""
        return np.array([course.reachable_s for course in self.courses])


@dataclass(frozen=True)
class ThreatOutlook:
    """What else counts: unseen intruders, and the circuits that may be flown."""

    threats: Threats
    circuits: Sequence[Tour]
    ways: Sequence[Sequence[CircuitDirection]]
    """(n,) what each vehicle may choose. The first one, and others on the same circuit, can follow meetings."""
    sees_m: float
    depth_m: float
    """Depth that one group of unseen intruders stands for."""
    lines: int


class InterceptionTable:
    """Times and places of all first and second meetings."""

    def __init__(self, now: Engagement) -> None:
        """Compute first meetings (n, k), and second ones (n, k, k): of vehicle i with target l after target j."""
        self.now = now
        here, there = now.xy_m[:, None], now.velocity_m_s[:, None]
        found = intercept(here, there, now.target_m, now.target_m_s, now.mobility, now.within_m)
        # A target cannot be met before it is where vehicles may fly.
        self.first = Interception(np.maximum(found.after_s, now.reachable_s), found.place_m, found.velocity_m_s)
        begin = np.where(np.isfinite(self.first.after_s), self.first.after_s, 0.0)[..., None]
        there = now.target_m + now.target_m_s * begin[..., None]
        place, velocity = self.first.place_m[:, :, None], self.first.velocity_m_s[:, :, None]
        then = intercept(place, velocity, there, now.target_m_s, now.mobility, now.within_m)
        after = np.maximum(self.first.after_s[..., None] + then.after_s, now.reachable_s)
        self.second = Interception(after, then.place_m, then.velocity_m_s)

    def worth(self) -> tuple[Floats, Floats]:
        """Return (n, k) and (n, k, k) worths of first and second meetings; 0 where they are too late."""
        enters, kept = self.now.enters_s, np.zeros(self.first.after_s.shape)
        for row, before in enumerate(self.now.before):
            kept[row, list(before.targets[:1])] = MAX_LATE_UNDER_WAY_S - MAX_LATE_S
        return _worth(enters - self.first.after_s, MAX_LATE_S + kept), _worth(enters - self.second.after_s, MAX_LATE_S)


def _worth(margin_s: Floats, late_s: float | Floats) -> Floats:
    worth = np.clip(MAX_WORTH + WORTH_1_S * (margin_s - MARGIN_S), MIN_WORTH, MAX_WORTH)
    return np.where(margin_s >= -late_s, worth, 0.0)


def choose_options(now: Engagement, outlook: ThreatOutlook) -> list[VehicleOption]:
    """Return (n,) the option of each vehicle."""
    meetings = InterceptionTable(now)
    routes = _routes(meetings)
    options = [_options(routes[row], outlook.ways[row]) for row in range(len(now.xy_m))]
    owner = np.repeat(np.arange(len(options)), [len(each) for each in options])
    flat = [choice for each in options for choice in each]
    course = predicted_courses(_option_legs(owner, flat, meetings), outlook.circuits, now.mobility)
    caught = would_catch(course, outlook.threats, now.mobility, outlook.sees_m, now.within_m)
    share = UNSEEN_IN_50_M * outlook.depth_m / 50.0 / outlook.lines
    met, own = _interception_worth(owner, flat, meetings)
    # A vehicle on its circuit may pass a target near enough and then need not leave the ring for it.
    passed_s = first_pass_s(course, now.target_m, now.target_m_s, PASSED_SHARE * now.within_m)
    met = np.maximum(met, _worth(now.enters_s - np.maximum(passed_s, now.reachable_s), 0.0))
    gains = _OptionValues(
        met, caught, share * outlook.threats.weight, own, np.split(np.arange(len(flat)), _cuts(options))
    )
    picked = gains.best(now.before, flat)
    return _with_passes([flat[k] for k in picked], met[picked])


def _with_passes(choices: list[VehicleOption], met: Floats) -> list[VehicleOption]:
    """Return the options with the targets that vehicles pass and that no vehicle is sent to; `met` is (n, k) worths."""
    sent = {target for choice in choices for target in choice.targets}
    found: dict[int, tuple[int, ...]] = {}
    for target in range(met.shape[1]):
        row = int(np.argmax(met[:, target]))
        if target not in sent and met[row, target] > 0.0:
            found[row] = (*found.get(row, ()), target)
    return [replace(choice, passes=found.get(row, ())) for row, choice in enumerate(choices)]


def _cuts(options: list[list[VehicleOption]]) -> NDArray[np.int64]:
    return np.cumsum([len(each) for each in options])[:-1]


def _routes(meetings: InterceptionTable) -> list[list[tuple[int, ...]]]:
    """Return useful routes of each vehicle, and the present one if it is still possible."""
    worth, then = meetings.worth()
    n, k = worth.shape
    both = np.where((worth[..., None] > 0.0) & (then > 0.0), worth[..., None] + then, 0.0)
    # A target is met once.
    both[:, np.arange(k), np.arange(k)] = 0.0
    routes: list[list[tuple[int, ...]]] = []
    for row in range(n):
        single = worth[row] - TIME_1_S * np.minimum(meetings.first.after_s[row], NEVER)
        double = (both[row] - TIME_1_S * np.minimum(meetings.second.after_s[row], NEVER)).ravel()
        found: list[tuple[int, ...]] = [
            (int(j),) for j in np.argsort(-single, kind="stable")[:MAX_SINGLE_ROUTES] if worth[row, j] > 0.0
        ]
        pairs = [divmod(int(p), k) for p in np.argsort(-double, kind="stable")[:MAX_PAIR_ROUTES]]
        found += [pair for pair in pairs if both[row][pair] > 0.0]
        before = meetings.now.before[row].targets
        if before and before not in found and worth[row, before[0]] > 0.0:
            found.append(before if len(before) == 2 and both[row][before] > 0.0 else before[:1])
        routes.append(found)
    return routes


def _options(routes: list[tuple[int, ...]], ways: Sequence[CircuitDirection]) -> list[VehicleOption]:
    after = [way for way in ways if way[0] == ways[0][0]]
    return [VehicleOption((), way) for way in ways] + [VehicleOption(route, way) for route in routes for way in after]


def _option_legs(owner: NDArray[np.int64], flat: list[VehicleOption], meetings: InterceptionTable) -> OptionLegs:
    now = meetings.now
    until, leg = np.zeros((len(flat), 2)), np.zeros((len(flat), 2, 2))
    for m, choice in enumerate(flat):
        if choice.targets:
            first = (owner[m], choice.targets[0])
            until[m], leg[m, 0] = meetings.first.after_s[first], meetings.first.velocity_m_s[first]
        if len(choice.targets) > 1:
            both = (owner[m], *choice.targets)
            until[m, 1], leg[m, 1] = meetings.second.after_s[both], meetings.second.velocity_m_s[both]
    circuit = np.array([choice.way[0] for choice in flat])
    way = np.array([choice.way[1] for choice in flat])
    return OptionLegs(now.xy_m[owner], now.velocity_m_s[owner], until, leg, circuit, way)


def _interception_worth(
    owner: NDArray[np.int64], flat: list[VehicleOption], meetings: InterceptionTable
) -> tuple[Floats, Floats]:
    """Return (m, k) worths of each option's meetings, and (m,) worths that depend on this vehicle's choice alone."""
    worth, then = meetings.worth()
    met, own = np.zeros((len(flat), len(meetings.now.courses))), np.zeros(len(flat))
    for m, choice in enumerate(flat):
        row, before, targets = int(owner[m]), meetings.now.before[owner[m]], choice.targets
        if targets:
            met[m, targets[0]] = worth[row, targets[0]]
            own[m] -= TIME_1_S * meetings.first.after_s[row, targets[0]]
        if len(targets) > 1:
            met[m, targets[1]] = then[(row, *targets)]
            own[m] -= TIME_1_S * meetings.second.after_s[(row, *targets)]
        own[m] += SAME_DIRECTION_BONUS * (choice.way[1] == before.way[1]) + SAME_CIRCUIT_BONUS * (
            choice.way[0] == before.way[0]
        )
        own[m] += SAME_ROUTE_BONUS * (targets == before.targets)
    return met, own


@dataclass(frozen=True)
class _OptionValues:
    """Values of m options: each target and each unseen intruder counts once, however many vehicles meet it."""

    met: Floats
    """(m, k)"""
    caught: NDArray[np.bool_]
    """(m, h)"""
    weight: Floats
    """(h,)"""
    own: Floats
    """(m,) worth that does not depend on the other vehicles."""
    of: list[NDArray[np.int64]]
    """Rows of options by vehicle."""

    def best(self, before: Sequence[VehicleOption], flat: list[VehicleOption]) -> list[int]:
        """Return an option row per vehicle: improved from the present ones and from none, whichever ends better."""
        going_on = [self._same(rows, before[i], flat) for i, rows in enumerate(self.of)]
        anew = [int(rows[0]) for rows in self.of]
        # Improvement in turn ends in a local optimum; two beginnings find the better one of two.
        found = [self._improved(begin) for begin in (going_on, anew)]
        return max(found, key=self._worth)

    def _same(self, rows: NDArray[np.int64], before: VehicleOption, flat: list[VehicleOption]) -> int:
        alike = [int(m) for m in rows if flat[m].way == before.way]
        return next((m for m in alike if flat[m].targets == before.targets), alike[0] if alike else int(rows[0]))

    def _worth(self, picked: list[int]) -> float:
        met = self.met[picked].max(axis=0, initial=0.0).sum()
        return float(met + self.weight[self.caught[picked].any(axis=0)].sum() + self.own[picked].sum())

    def _improved(self, picked: list[int]) -> list[int]:
        picked = list(picked)
        for _ in range(IMPROVEMENT_ROUNDS):
            before = list(picked)
            for i, rows in enumerate(self.of):
                others = picked[:i] + picked[i + 1 :]
                met = self.met[others].max(axis=0, initial=0.0)
                caught = self.caught[others].any(axis=0)
                gain = np.maximum(self.met[rows] - met, 0.0).sum(axis=1) + self.own[rows]
                gain += self.caught[rows] @ np.where(caught, 0.0, self.weight)
                best = int(np.argmax(gain))
                now = int(np.searchsorted(rows, picked[i]))
                # A tie keeps the present option, so that rounding does not make vehicles swap.
                if gain[best] > gain[now] + 1e-9:
                    picked[i] = int(rows[best])
            if picked == before:
                break
        return picked


def intercept_tasks(now: Engagement, choices: Sequence[VehicleOption]) -> dict[int, InterceptTask]:
    """Return tasks by vehicle row: for vehicles with targets, and for those that pursue a target missed by all."""
    if not len(now.courses) or not len(now.xy_m):
        return {}
    first = InterceptionTable(now).first
    routes = {row: choice.targets for row, choice in enumerate(choices) if choice.targets}
    routes |= _pursuits(first, now, routes)
    return {row: _intercept_task(row, route, first, now) for row, route in sorted(routes.items())}


def _pursuits(first: Interception, now: Engagement, routes: dict[int, tuple[int, ...]]) -> dict[int, tuple[int, ...]]:
    """Return pursuits of targets inside the zone, if no vehicle has another target; half of the vehicles stay."""
    # Pursuing targets that are still outside and cannot be met in time opens the ring for the next ones: 6 more of 100
    # came through (4 against 4, 4 against 8).
    n = len(now.xy_m)
    most, left = n // 2, np.flatnonzero(now.enters_s <= 0.0).tolist()
    if routes or not left:
        return {}
    cost = np.minimum(first.after_s[:, left], NEVER)
    found = sorted((float(cost[r, c]), r, left[c]) for r, c in min_cost_pairs(cost) if cost[r, c] < NEVER / 2.0)
    return {row: (target,) for _, row, target in found[:most]}


def _intercept_task(row: int, route: tuple[int, ...], first: Interception, now: Engagement) -> InterceptTask:
    target = route[0]
    after_s = float(first.after_s[row, target])
    waits = after_s <= now.courses[target].reachable_s + 1e-6 and after_s > 0.0
    there = now.target_m[target] + now.target_m_s[target] * after_s
    place = there if waits else first.place_m[row, target]
    return InterceptTask(
        route, place, first.velocity_m_s[row, target], after_s, float(now.courses[target].enters_s - after_s), waits
    )
