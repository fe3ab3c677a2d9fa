"""Assigns slots of a tour to vehicles, and computes each vehicle's reference: its transit, or its place on the tour.

Slots are re-spaced when their number changes (Elmaliach, Agmon, Kaminka 2009: uniform frequency as long as one vehicle
works). Vehicles on the tour stay on it and fall back by flying slower for a while. So no part of the tour is left out,
and no place waits longer than the gap that the lost vehicle left; short cuts to new slots made places wait for another
half of it. A vehicle that only replaces another one goes to that slot, and the others stay on theirs.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import Fleet
from tui_gcs.planner.lazy_scipy import min_cost_columns
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.slots import assign, delayed, waiting_s
from tui_gcs.planner.patrol.tour import Tour
from tui_gcs.planner.patrol.transit import MAX_TRANSIT_S, Mobility, Transit, along, plan_transit

Floats = NDArray[np.floating[Any]]

JOINED_M = 3.0
"""A vehicle this near its reference has joined its slot."""
LATE_M = 4.0
"""A vehicle that is late by less does not count as off its way: the link may be the cause, and everything is still
seen."""
LOST_TRACK_M = 8.0
"""A vehicle this far from its reference gets a new transit from where it is."""
PATIENCE_S, MAX_PATIENCE_S = 2.0, 64.0
"""Time between two new transits of one vehicle; it doubles after each one that was not found."""
OLD_POSITION_S = 1.0
"""Older positions do not show how well a vehicle follows."""
MAX_SMALL_TEAM = 24
"""In larger teams, ways to slots are planned a few in each step."""
WAYS_S_PER_STEP = 60.0
"""In larger teams, seconds of ways that are planned in one step: the cost of a way grows with its duration."""
SLOWER = 0.8
"""Largest share by which a vehicle that falls back flies slower."""
SLOWING_M_S2 = 0.5
"""Deceleration for falling back, beyond what the tour itself takes."""
ON_COURSE_S = 15.0
"""A vehicle that joined its slot this long ago is on its course, if it can be. Flown on eight real ArduCopters: one
that had just joined, 3 m beside its way, slowed the tour of all in still air."""
MIN_FALL_S = 1.0
"""If one vehicle is falling back already, all fall back by at least this: a vehicle that is slow now cannot be on time.
"""


@dataclass
class VehicleSlot:
    """One vehicle's slot: at time t it is at phase `t - origin_s` of the tour. Field names are stored in snapshots."""

    origin_s: float
    slot: int
    transit: Transit | None = None
    planned_s: float = -np.inf
    patience_s: float = PATIENCE_S
    joined: bool = False
    settled_s: float = np.inf
    """When it was first found settled on this slot. One that wind carries off its slot again and again was there."""
    stuck: bool = False
    before: "VehicleSlot | None" = None
    """The slot it flies until its way to this one is planned."""
    back_s: float = 0.0
    """Lead in phase when it began to fall back."""
    back_rate: float = 0.0
    """Rate of the lead at that time."""
    back_from_s: float = -np.inf
    """The time when it began to fall back."""

    @property
    def flown(self) -> "VehicleSlot":
        """The slot it flies: this one, or the one before while the way to this one is not planned yet."""
        berth = self
        while berth.before is not None:
            berth = berth.before
        return berth

    @property
    def waiting(self) -> bool:
        """Whether its way is still to be planned."""
        return self.planned_s == -np.inf and not self.joined

    @property
    def settled(self) -> bool:
        """Whether its reference is on the slot."""
        return self.joined and self.transit is None and not self.stuck

    @property
    def back_took_s(self) -> float:
        """Duration of falling back, long enough that neither speed nor acceleration changes much."""
        return max(1.5 * self.back_s / SLOWER, math.sqrt(6.0 * 8.0 * self.back_s / SLOWING_M_S2))

    def falls_back(self, t_s: float) -> bool:
        """Return whether it still falls back."""
        return self.back_from_s > -math.inf and t_s < self.back_from_s + self.back_took_s


def _lead_s(berths: Sequence[VehicleSlot], times_s: Floats) -> tuple[Floats, Floats]:
    """Return (n, k) how far each vehicle is ahead of its slot, and the rate of change: a cubic that ends at 0 and 0."""
    falls = [(berth.back_s, berth.back_rate, berth.back_from_s, max(berth.back_took_s, 1e-9)) for berth in berths]
    back_s, back_rate, from_s, took_s = np.array(falls).T[:, :, None]
    share = np.clip((times_s - from_s) / took_s, 0.0, 1.0)
    left = 1.0 - share
    begun_s = back_rate * took_s
    ahead_s = left**2 * (back_s * (1.0 + 2.0 * share) + begun_s * share)
    rate = left * (begun_s * (1.0 - 3.0 * share) - 6.0 * back_s * share) / took_s
    return ahead_s, rate


@dataclass
class Formation:
    """The slots of one tour. `berths` holds the vehicles on a slot or on the way to one. Field names are stored."""

    berths: dict[int, VehicleSlot] = field(default_factory=dict)
    reliefs: dict[int, int] = field(default_factory=dict)
    """Vehicle to relieve by relief; both have the same slot until the relief is there."""
    leaving: set[int] = field(default_factory=set)
    """Relieved vehicles, which fly home."""
    slots: int = 0
    failed_s: float = -math.inf
    """The step in which a way was looked for last and not found."""
    worst_vehicle: int = 0
    """The vehicle that was farthest off its course at the last `follow_up`; 0 for none."""

    @property
    def owners(self) -> dict[int, VehicleSlot]:
        """One vehicle per slot: `berths` without reliefs."""
        return {vehicle: berth for vehicle, berth in self.berths.items() if vehicle not in self.reliefs}

    @property
    def at_rest(self) -> bool:
        """Whether no vehicle is on the way to a slot."""
        return all(berth.settled for berth in self.berths.values())

    def falls_back(self, t_s: float) -> bool:
        """Return whether any vehicle falls back."""
        return any(berth.falls_back(t_s) for berth in self.berths.values())


@dataclass(frozen=True)
class TourGuidance:
    """Guides vehicles onto a tour and along it."""

    tour: Tour
    mobility: Mobility
    region: FlyableRegion

    def reference(self, berth: VehicleSlot, times_s: Floats) -> tuple[Floats, Floats]:
        """Return (k, 2) places and velocities where the vehicle should be at `times_s`, on its transit or its slot."""
        xy, velocity = self.references([berth], times_s)
        return xy[0], velocity[0]

    def references(self, berths: Sequence[VehicleSlot], times_s: Floats) -> tuple[Floats, Floats]:
        """As `reference` for n vehicles: (n, k, 2)."""
        flown = [berth.flown for berth in berths]
        xy, velocity = self.on_slots(flown, times_s)
        transits = [(row, berth.transit) for row, berth in enumerate(flown) if berth.transit is not None]
        if transits:
            rows, ways = [row for row, _ in transits], [way for _, way in transits]
            under_way = (times_s < np.array([way.end_s for way in ways])[:, None])[..., None]
            way_xy, way_velocity = along(ways, times_s)
            xy[rows] = np.where(under_way, way_xy, xy[rows])
            velocity[rows] = np.where(under_way, way_velocity, velocity[rows])
        return xy, velocity

    def on_slots(self, berths: Sequence[VehicleSlot], times_s: Floats) -> tuple[Floats, Floats]:
        """Return (n, k, 2) places and velocities of the slots themselves."""
        phase = times_s - np.array([berth.origin_s for berth in berths])[:, None]
        back = [row for row, berth in enumerate(berths) if berth.falls_back(times_s[0])]
        if not back:
            return self.tour.at(phase)
        ahead_s, change = _lead_s([berths[row] for row in back], times_s)
        phase[back] += ahead_s
        xy, velocity = self.tour.at(phase)
        velocity[back] *= 1.0 + change[..., None]
        return xy, velocity

    def respace(self, formation: Formation, t_s: float, fleet: Fleet, vehicles: Iterable[int]) -> None:
        """Assign equally spaced slots to exactly these `vehicles`, and plan ways to them."""
        rows = {int(vehicle): i for i, vehicle in enumerate(fleet.id)}
        chosen = sorted(vehicles)
        formation.reliefs, formation.slots = {}, len(chosen)
        if not chosen:
            formation.berths = {}
            return
        old, formation.berths = formation.berths, {}
        starts = {v: self._start(old.get(v), t_s, fleet, rows[v]) for v in chosen}
        # The optimal assignment is cubic in the number of vehicles and plans all ways at once.
        if len(chosen) <= MAX_SMALL_TEAM and not any(v in old and old[v].settled for v in chosen):
            self._assigned(formation, t_s, starts)
        else:
            self._fallen_back(formation, old, t_s, starts)

    def retime(self, formation: Formation, before: "TourGuidance", rate: float, t_s: float, fleet: Fleet) -> None:
        """Continue on the tour of `before`, flown `rate` times as fast.

        Vehicles on the tour stay on it, the others get new ways; in large teams they wait for them where they are.
        """
        rows = {int(vehicle): i for i, vehicle in enumerate(fleet.id)}
        for vehicle, berth in formation.berths.items():
            origin_s = t_s - (t_s - berth.origin_s) / rate
            if berth.settled:
                berth.origin_s = origin_s
                continue
            new = VehicleSlot(origin_s, berth.slot)
            if formation.slots <= MAX_SMALL_TEAM:
                self._send(formation, new, t_s, *before._start(berth, t_s, fleet, rows[vehicle]))
            formation.berths[vehicle] = new

    def take_over(self, formation: Formation, before: "TourGuidance", t_s: float, fleet: Fleet) -> None:
        """Assign slots of this tour to the vehicles that are on slots of another one. The number of slots stays."""
        rows = {int(vehicle): i for i, vehicle in enumerate(fleet.id)}
        owners = formation.owners
        starts = {v: before._start(owners[v], t_s, fleet, rows[v]) for v in sorted(owners)}
        formation.berths, formation.reliefs = {}, {}
        self._assigned(formation, t_s, starts)

    def replace(self, formation: Formation, t_s: float, fleet: Fleet, vehicles: Sequence[int]) -> None:
        """Let these vehicles take vacant slots; the others stay on theirs."""
        rows = {int(vehicle): i for i, vehicle in enumerate(fleet.id)}
        formation.reliefs = {new: old for new, old in formation.reliefs.items() if new not in vehicles}
        owners = [berth for vehicle, berth in formation.owners.items() if vehicle not in vehicles]
        # Vacant slots keep the spacing of those in use: a replacement must not move the others.
        taken = {berth.slot for berth in owners}
        vacant = [slot for slot in range(formation.slots) if slot not in taken][: len(vehicles)]
        spacing_s = self.tour.period_s / formation.slots
        first_s = owners[0].origin_s + spacing_s * owners[0].slot if owners else t_s
        origins = {slot: first_s - spacing_s * slot for slot in vacant}
        starts = {v: self._start(formation.berths.get(v), t_s, fleet, rows[v]) for v in vehicles}
        self._take(formation, t_s, starts, origins)

    def relieve(self, formation: Formation, t_s: float, fleet: Fleet, relief: int, old: int) -> None:
        """Send `relief` to the slot of `old`, which stays on it until then."""
        berth = formation.berths[old]
        row = int(np.flatnonzero(fleet.id == relief)[0])
        new = VehicleSlot(berth.origin_s, berth.slot)
        self._send(formation, new, t_s, *self._start(None, t_s, fleet, row))
        formation.berths[relief] = new
        formation.reliefs[relief] = old

    def _assigned(self, formation: Formation, t_s: float, starts: "_Starts") -> None:
        """Assign all slots when no vehicle is on this tour yet, with the least waiting, and plan ways there."""
        vehicles = list(starts)
        xy, velocity = np.array([starts[v][0] for v in vehicles]), np.array([starts[v][1] for v in vehicles])
        found = assign(xy, velocity, self.tour, self.mobility.speed_m_s)
        for row, vehicle in enumerate(vehicles):
            berth = VehicleSlot(t_s - float(found.phase_s[row]), int(found.slot[row]))
            self._send(formation, berth, t_s, *starts[vehicle])
            formation.berths[vehicle] = berth

    def _fallen_back(self, formation: Formation, old: dict[int, VehicleSlot], t_s: float, starts: "_Starts") -> None:
        """Let vehicles on the tour keep their order and fall back as far as needed; the others take free slots."""
        on = sorted((v for v in starts if v in old and old[v].settled), key=lambda v: _place(starts[v]))
        n, first_s, taken = len(starts), 0.0, set[int]()
        if on:
            now = np.array([t_s])
            ahead_s, rates = (part[:, 0].tolist() for part in _lead_s([old[v] for v in on], now))
            falls = list(zip(ahead_s, rates, strict=True))
            phase = np.array([t_s - old[v].origin_s + ahead for v, (ahead, _) in zip(on, falls, strict=True)])
            least_s = MIN_FALL_S if any(rate for _, rate in falls) else 0.0
            phases, slots = delayed(phase, n, self.tour.period_s, least_s)
            first_s, taken = float(phases[0]) - self.tour.period_s / n * int(slots[0]), set(slots.tolist())
            for row, vehicle in enumerate(on):
                berth = VehicleSlot(t_s - float(phases[row]), int(slots[row]), joined=True, planned_s=t_s)
                berth.back_s = float(phase[row] - phases[row]) % self.tour.period_s
                berth.back_rate, berth.back_from_s = falls[row][1], t_s
                formation.berths[vehicle] = berth
        free = {k: t_s - first_s - self.tour.period_s / n * k for k in range(n) if k not in taken}
        others = {v: start for v, start in starts.items() if v not in formation.berths}
        formation.berths.update({v: old[v] for v in others if v in old})
        self._take(formation, t_s, others, free)

    def _take(self, formation: Formation, t_s: float, starts: "_Starts", origins: dict[int, float]) -> None:
        """Pair vehicles with slots by the smallest sum of cubed times until they can be there; large teams by way."""
        if not starts:
            return
        vehicles = sorted(starts, key=lambda v: _place(starts[v]))
        numbers = list(origins)
        phases = t_s - np.array([origins[slot] for slot in numbers])
        places, speeds = (np.array([starts[v][part] for v in vehicles]) for part in range(2))
        if formation.slots <= MAX_SMALL_TEAM:
            # A slot that is near and flies away is met a lap later: over a large zone that is minutes.
            cost = waiting_s(places, speeds, phases, self.tour, self.mobility.speed_m_s) ** 3
        else:
            cost = np.hypot(*(places[:, None] - self.tour.at(phases)[0][None]).transpose(2, 0, 1))
        for vehicle, column in zip(vehicles, min_cost_columns(cost).tolist(), strict=True):
            old = formation.berths.get(vehicle)
            berth = VehicleSlot(origins[numbers[column]], numbers[column], before=old.before or old if old else None)
            if formation.slots <= MAX_SMALL_TEAM:
                self._send(formation, berth, t_s, *starts[vehicle])
            formation.berths[vehicle] = berth

    def follow_up(self, formation: Formation, t_s: float, fleet: Fleet) -> float:
        """End finished transits, plan waiting ways, and replan for vehicles that lost their reference.

        Return the largest cross-track error (m) of the vehicles that have been on their slots for `ON_COURSE_S`; NaN if
        there was none.
        """
        rows = {int(vehicle): i for i, vehicle in enumerate(fleet.id)}
        ids = list(formation.berths)
        berths = [formation.berths[v] for v in ids]
        if not berths:
            return math.nan
        for berth in berths:
            if berth.transit is not None and t_s >= berth.transit.end_s:
                berth.transit = None
        index = [rows[v] for v in ids]
        here, _ = _now(fleet, index)
        xy, velocity = (moment[:, 0] for moment in self.references(berths, np.array([t_s])))
        gap_m = here - xy
        error_m = np.hypot(*gap_m.T)
        fresh = ~(fleet.age_s[index] > OLD_POSITION_S)
        settled = fresh & np.array([berth.settled for berth in berths])
        for berth in berths:
            berth.settled_s = min(berth.settled_s, t_s) if berth.settled else berth.settled_s
        settled &= np.array([t_s - berth.settled_s >= ON_COURSE_S for berth in berths])
        off_m = _cross_track_m(gap_m[settled], velocity[settled])
        left_s = WAYS_S_PER_STEP if len(ids) > MAX_SMALL_TEAM else np.inf
        for k, (vehicle, berth) in enumerate(zip(ids, berths, strict=True)):
            if berth.waiting and left_s > 0.0:
                left_s -= self._send(formation, berth, t_s, *self._start(berth, t_s, fleet, rows[vehicle]))
            elif fresh[k] and not berth.waiting:
                if berth.transit is None and not berth.stuck and error_m[k] <= JOINED_M:
                    berth.joined = True
                lost = berth.stuck or error_m[k] > LOST_TRACK_M
                if lost and left_s > 0.0 and t_s - berth.planned_s >= berth.patience_s:
                    place, speed = _now(fleet, [rows[vehicle]])
                    left_s -= self._send(formation, berth, t_s, place[0], speed[0])
        formation.worst_vehicle = ids[np.flatnonzero(settled)[off_m.argmax()]] if len(off_m) else 0
        return float(off_m.max()) if len(off_m) else math.nan

    def _start(self, berth: VehicleSlot | None, t_s: float, fleet: Fleet, row: int) -> tuple[Floats, Floats]:
        """Return where a vehicle's next transit begins: its reference if the vehicle follows it, else where it is."""
        xy, velocity = (rows[0] for rows in _now(fleet, [row]))
        if berth is not None and not berth.stuck and not (berth.waiting and berth.before is None):
            reference, speed = self.reference(berth, np.array([t_s]))
            if np.hypot(*(reference[0] - xy)) <= LOST_TRACK_M:
                return reference[0], speed[0]
        return xy, velocity

    def _send(self, formation: Formation, berth: VehicleSlot, t_s: float, xy: Floats, velocity: Floats) -> float:
        """Plan a vehicle's way; return its duration, a measure of what the planning cost.

        It is left for a later step if a way was not found in this one already: that is the dearest search.
        """
        # Without a way `MAX_TRANSIT_S` are searched in vain, 0.3 s of CPU time. Eight vehicles that were cut off from
        # their tour took longer in one step than a worker may be silent.
        if formation.failed_s == t_s:
            return 0.0
        berth.back_s, berth.before = 0.0, None
        berth.transit = plan_transit(t_s, xy, velocity, self.tour, t_s - berth.origin_s, self.mobility, self.region)
        berth.stuck = berth.transit is None
        if berth.stuck:
            formation.failed_s = t_s
        # A vehicle without a way would else cost a full search in every step.
        berth.patience_s = min(2.0 * berth.patience_s, MAX_PATIENCE_S) if berth.stuck else PATIENCE_S
        berth.planned_s, berth.joined = t_s, False
        return MAX_TRANSIT_S if berth.transit is None else berth.transit.end_s - t_s


def _cross_track_m(error_m: Floats, velocity_m_s: Floats) -> Floats:
    """Return (n,) cross-track errors of vehicles that are off by `error_m` (n, 2); the whole error if very late."""
    speed = np.maximum(np.hypot(velocity_m_s[:, 0], velocity_m_s[:, 1]), 1e-6)
    late_m = np.abs((error_m * velocity_m_s).sum(axis=1)) / speed
    off_m = np.hypot(error_m[:, 0], error_m[:, 1])
    beside_m = np.sqrt(np.maximum(off_m**2 - late_m**2, 0.0))
    return np.where(late_m > LATE_M, off_m, beside_m)


_Starts = dict[int, tuple[Floats, Floats]]


def _place(start: tuple[Floats, Floats]) -> tuple[float, float]:
    """Return the sort key of vehicles: their numbers must not matter."""
    return float(start[0][0]), float(start[0][1])


def _now(fleet: Fleet, rows: list[int]) -> tuple[Floats, Floats]:
    """Return (n, 2) horizontal positions and velocities, extrapolated by the age of the positions."""
    velocity = np.nan_to_num(fleet.velocity_m_s[rows, :2])
    age_s = np.clip(np.nan_to_num(fleet.age_s[rows]), 0.0, OLD_POSITION_S)
    return fleet.position_m[rows, :2] + velocity * age_s[:, None], velocity
