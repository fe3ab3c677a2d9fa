"""The patrol planner: one closed smooth tour of the zone, with active vehicles as equally timed slots moving along it.

Every place of the zone is then seen at least once per T / n. The tour is designed in about a second. A better one is
searched for between steps, and adopted when vehicles are on their slots and the gain is large enough.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import (
    LOW_BATTERY_PCT,
    Context,
    Fleet,
    Intent,
    KeepOut,
    Metric,
    Output,
    Param,
    ParamValue,
    Planner,
    PlannerTask,
    at_heights,
    cells_of,
    sweep_of_task,
)
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.patrol import patrol_state
from tui_gcs.planner.patrol.background_search import BackgroundThread
from tui_gcs.planner.patrol.flyable_region import FlyableRegion, RegionOfTask
from tui_gcs.planner.patrol.formation import MAX_SMALL_TEAM, Formation, TourGuidance, VehicleSlot
from tui_gcs.planner.patrol.patrol_state import PatrolState
from tui_gcs.planner.patrol.speed_adaptation import from_inherited
from tui_gcs.planner.patrol.tour import SENT_STEP_S, SPARSE_SENT_STEP_S, Tour, drawing
from tui_gcs.planner.patrol.tour_search import TourSearch, begin_search
from tui_gcs.planner.patrol.tour_site import TourDesign, site_of
from tui_gcs.planner.patrol.tour_smoothing import TourLimits
from tui_gcs.planner.patrol.transit import Mobility

Floats = NDArray[np.floating[Any]]

HORIZON_S = 3.0
"""Length of the trajectories that are sent."""
# Simulated ArduCopters were up to 0.9 m beside a tour with 0.92, in a wind of 3 m/s, and 0.8 m with 0.88; real ones
# flew 0.95 and 0.84 equally well.
ACCEL_SHARE = 0.88
"""Share of the acceleration limit that is planned with; the rest is the autopilot's for tracking."""
TRANSIT_SPEED_SHARE = 0.995
"""Share of the speed limit for transits: more than any tour's, so that a vehicle that is behind catches up."""
DRAWN_POINTS = 119
DRAW_AGAIN_S = 5.0
"""The tour is sent again: a plan may be lost on its way, and a station may be new."""
GAIN = 0.02
"""Smallest improvement of the worst idleness for which another tour is adopted."""
PATIENCE_S = 15.0
"""A change of speed waits this long for all vehicles to be on their slots; in such a wind one may never be."""
LEAST_LEFT, MOST_LONGER = 0.5, 1.5
"""A tour that is led round lost vehicles is of use if so much of its length is left, in so many times its period."""
FIT_PCT = 15.0
"""Battery that a relief must have beyond the low level."""


class Patrol(Planner):
    """Flies equally timed slots on one closed tour of the team's zone."""

    name = "patrol"
    version = "3"
    judged_by = "idleness"
    metrics = (
        Metric("predicted_worst_s", "s", "lower", help="worst idleness of the tour as it is planned"),
        Metric("period_s", "s", "lower", help="time of one round trip of the tour"),
    )
    iterations_per_s = 30.0
    params = (
        Param(
            "speed_fraction",
            float,
            0.985,
            0.3,
            0.985,
            "",
            "tour speed as a share of the speed limit; the rest catches up",
        ),
        Param("margin_m", float, 0.0, 0.0, 5.0, "m", "planned footprint is smaller by this than autopilots need"),
        Param("direction", str, "auto", choices=("auto", "cw", "ccw"), help="sense of the tour: auto is as designed"),
        Param("reserve", int, 0, 0, 100, help="vehicles that wait to take the place of one that is lost or low"),
        Param("search", int, 300, 0, 100_000, help="units of search for a better tour, 30 a second"),
        Param("seed", int, 0, 0, 2**31 - 1, help="another seed tries other tours"),
    )

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Design the tour. Raises ValueError if no part of the zone can be flown."""
        super().configure(task, params, rng)
        warm_up()
        limits, radius_m = task.limits, task.footprint_radius_m
        accel = limits.accel_m_s2 * ACCEL_SHARE
        planned_radius_m = max(radius_m - task.off_course_m - float(params["margin_m"]), radius_m * 0.5)
        self._planned_off_m = radius_m - planned_radius_m
        sent_step_s = SENT_STEP_S if len(task.members) <= MAX_SMALL_TEAM else SPARSE_SENT_STEP_S
        motion = TourLimits(limits.speed_m_s * float(params["speed_fraction"]), accel, planned_radius_m, sent_step_s)
        self._direction, self._units = str(params["direction"]), int(params["search"])
        self._wanted = max(1, len(task.members) - int(params["reserve"]))
        self._regions = RegionOfTask(task)
        self._region = self._regions.whole
        self._cells = cells_of(task)
        self._site = site_of(task.zone.shape, self._region, motion, radius_m)
        self._accel_m_s2 = accel
        self._round: tuple[TourDesign, tuple[KeepOut, ...], tuple[Tour, FlyableRegion] | None] | None = None
        """The tour that was led round lost vehicles last."""
        search = begin_search(self._site, int(params["seed"]) * 2**32 + int(rng.integers(2**32)), self._wanted)
        if search.best is None:
            raise ValueError(f"zone {task.zone.name!r}: no tour")
        self._state = PatrolState(search, search.best, Formation())
        self._background = BackgroundThread()
        self._searched: dict[int, TourSearch] = {}
        """Searches done ahead of time by number of units; steps adopt what they are granted."""
        self._apply_speed(self._state.design)

    def learnt(self) -> bytes:
        """Hand on the speed adaptation: the wind does not change with the zone."""
        return self._state.tempo.handed_on()

    def inherit(self, learnt: bytes) -> None:
        """Start with the speed that was right in the zone before."""
        self._state.tempo = from_inherited(learnt)
        self._apply_speed(self._state.design)

    def step(self, ctx: Context) -> Output:
        """Return intents for active vehicles. Slots are re-spaced in the first step with another set of vehicles."""
        fleet, state, t_s = ctx.fleet, self._state, ctx.t_s
        self._background.wait()
        self._adopt_better(t_s, fleet)
        self._keep_clear(t_s, fleet, ctx.keep_out)
        self._fill_slots(t_s, fleet)
        off_m = self._guidance.follow_up(state.formation, t_s, fleet)
        self._release()
        notes = self._adapt_speed(t_s, fleet, off_m)
        out = Output(notes=notes, intents=self._intents(t_s, fleet))
        if t_s - state.drawn_s >= DRAW_AGAIN_S:
            out.annotations, state.drawn_s = [drawing(self._guidance.tour.xy_m, DRAWN_POINTS, "tour")], t_s
        out.metrics = self._metrics(t_s)
        self._search_on(ctx.iterations)
        return out

    def ahead(self, go_on: Callable[[], bool]) -> None:
        """Search now; later steps adopt the results that they are granted."""
        search = replace(self._state.search)
        while search.units < self._units and go_on():
            search.work(self._site)
            self._searched[search.units] = replace(search)

    def stop(self, reason: str) -> None:
        """Wait for the search thread."""
        self._background.wait()

    def snapshot(self) -> bytes:
        """Return tour, slots, transits and search."""
        self._background.wait()
        return patrol_state.encode(self._state)

    def restore(self, data: bytes) -> None:
        """Continue on the same tour. Raises ValueError if the bytes are no state of a patrol."""
        self._state = patrol_state.decode(data, self._site)
        self._apply_speed(self._state.design)

    def _apply_speed(self, design: TourDesign) -> None:
        """Fly `design` at the present speed, which holds for the ways to its slots, too."""
        self._state.design, rate = design, self._state.tempo.share
        mobility = Mobility(self.task.limits.speed_m_s * TRANSIT_SPEED_SHARE * rate, self._accel_m_s2 * rate**2)
        tour, region = self._led_round(design, self._state.keep_out) or (self._turned(design), self._region)
        self._guidance = TourGuidance(tour.times(rate), mobility, region)

    def _led_round(self, design: TourDesign, keep_out: tuple[KeepOut, ...]) -> tuple[Tour, FlyableRegion] | None:
        """Return the tour led round where lost vehicles may be, and the region that is left to fly in.

        Return None where there are none, or nothing of use is left: the guard keeps vehicles apart then.
        """
        if not keep_out:
            return None
        if self._round is None or self._round[0] is not design or self._round[1] != keep_out:
            self._round = design, keep_out, self._timed_round(design, keep_out)
        return self._round[2]

    def _timed_round(self, design: TourDesign, keep_out: tuple[KeepOut, ...]) -> tuple[Tour, FlyableRegion] | None:
        region = self._regions.clear_of(keep_out)
        draft = design.draft
        if is_turned(design.tour, self._direction):
            draft = replace(draft, controls=draft.controls[::-1].copy())
        tour = replace(self._site, region=region).timed(draft, MOST_LONGER * design.tour.period_s)
        longer, left = tour.period_s / design.tour.period_s, tour.length_m / design.tour.length_m
        return (tour, region) if longer < MOST_LONGER and left > LEAST_LEFT else None

    def _keep_clear(self, t_s: float, fleet: Fleet, keep_out: tuple[KeepOut, ...]) -> None:
        """Lead the tour round where lost vehicles may be, and back onto its own course once they cannot be there."""
        state, formation, active = self._state, self._state.formation, _active(fleet)
        met = at_heights(keep_out, fleet.layer_m[fleet.active].tolist())
        if met == state.keep_out or len(active) > MAX_SMALL_TEAM:
            return
        before, state.keep_out = self._guidance, met
        self._apply_speed(state.design)
        if np.array_equal(before.tour.xy_m, self._guidance.tour.xy_m):
            return
        formation.berths = {vehicle: berth for vehicle, berth in formation.berths.items() if vehicle in active}
        formation.slots = len(formation.owners)
        if formation.slots:
            self._guidance.take_over(formation, before, t_s, fleet)
        state.drawn_s = -np.inf

    def _turned(self, design: TourDesign) -> Tour:
        """Return the tour in the wanted direction: near walls braking and speeding up are no mirror images."""
        tour = design.tour
        if not is_turned(tour, self._direction):
            return tour
        back = Tour(tour.dt_s, tour.xy_m[::-1].copy(), -tour.velocity_m_s[::-1])
        states = back.xy_m, back.velocity_m_s, back.sent_accels_m_s2(self._site.motion.sent_step_s)
        if self._region.are_sendable(*states, self._accel_m_s2).all():
            return back
        return self._site.timed(replace(design.draft, controls=design.draft.controls[::-1].copy()))

    def _adapt_speed(self, t_s: float, fleet: Fleet, off_m: float) -> list[str]:
        """Slow down if a vehicle cannot follow (`off_m` off course), speed up when all can again; return notes."""
        tempo, formation, wanted = self._state.tempo, self._state.formation, self._state.tempo.wanted
        gap_s = tempo.judge(t_s, off_m - self._planned_off_m)
        tempo.blame(wanted, formation.worst_vehicle, formation.owners)
        due = tempo.share != tempo.wanted and not formation.falls_back(t_s)
        if due and (formation.at_rest or t_s > tempo.stepped_s + PATIENCE_S):
            before, rate = self._guidance, tempo.advance(gap_s)
            self._apply_speed(self._state.design)
            self._guidance.retime(formation, before, rate, t_s, fleet)
        return tempo.news(wanted)

    def _search_on(self, units: int) -> None:
        """Start to search for a better tour until the next step."""
        search = self._state.search
        units = min(units, self._units - search.units)
        if (found := self._searched.get(search.units + units)) is not None:
            self._state.search = found
            return

        def work() -> None:
            for _ in range(units):
                search.work(self._site)

        if units > 0:
            self._background.begin(work)

    def _adopt_better(self, t_s: float, fleet: Fleet) -> None:
        """Adopt a better tour: at once if no vehicle flies, else when all are on their slots and have flown a round."""
        state, formation = self._state, self._state.formation
        found = state.search.best
        if found is None or not _better(found, state.design):
            return
        # A change of tour gives every vehicle a transit, during which places wait longer. So it must be worth it and
        # rare.
        if formation.berths:
            if not formation.at_rest or formation.slots > MAX_SMALL_TEAM or t_s < state.quiet_s:
                return
            if not set(formation.berths) <= _active(fleet):
                return
            before = self._guidance
            self._apply_speed(found)
            self._guidance.take_over(formation, before, t_s, fleet)
            state.quiet_s = t_s + found.tour.period_s
        else:
            self._apply_speed(found)
        state.drawn_s = -np.inf

    def _fill_slots(self, t_s: float, fleet: Fleet) -> None:
        """Give slots to the active vehicles except the reserve, and reliefs to vehicles with a low battery."""
        formation, active = self._state.formation, _active(fleet)
        formation.leaving &= active
        formation.reliefs = {new: old for new, old in formation.reliefs.items() if {new, old} <= active}
        formation.berths = {v: berth for v, berth in formation.berths.items() if v in active}
        spare = self._spare(fleet, active)
        owners = formation.owners
        # The same tour with other slots is 1.14 x the ideal after a loss; without a reaction it is 1.73 x (C2).
        slots = min(len(owners) + len(spare), self._wanted)
        missing = slots - len(owners)
        if slots != formation.slots:
            self._guidance.respace(formation, t_s, fleet, [*owners, *spare[:missing]])
        elif missing > 0:
            self._guidance.replace(formation, t_s, fleet, spare[:missing])
        self._relieve(t_s, fleet)

    def _spare(self, fleet: Fleet, active: set[int]) -> list[int]:
        """Return active vehicles without a slot of their own, in the order in which they get one.

        The nearest comes first; reliefs under way and vehicles with a low battery come last.
        """
        formation = self._state.formation
        free = active - set(formation.owners) - formation.leaving
        rows = [i for i, vehicle in enumerate(fleet.id) if int(vehicle) in free]
        if not rows:  # in nearly every step
            return []
        middle = self._guidance.tour.middle_m
        low = fleet.battery_pct[rows] < LOW_BATTERY_PCT
        away_m = np.hypot(*(fleet.position_m[rows, :2] - middle).T)
        busy = np.array([int(fleet.id[i]) in formation.reliefs for i in rows], dtype=bool)
        order = np.lexsort((fleet.position_m[rows, 0], away_m, busy, low))
        return [int(fleet.id[rows[k]]) for k in order]

    def _relieve(self, t_s: float, fleet: Fleet) -> None:
        """Send a fit spare vehicle to the slot of each vehicle with a low battery; their layers keep the two apart."""
        formation = self._state.formation
        apart_m = self.task.limits.separation_vertical_m
        row = {int(vehicle): i for i, vehicle in enumerate(fleet.id)}
        low = [v for v in formation.owners if fleet.battery_pct[row[v]] < LOW_BATTERY_PCT]
        spare = [v for v in self._spare(fleet, _active(fleet)) if v not in formation.reliefs] if low else []
        for old in low:
            if old in formation.reliefs.values():
                continue
            # The relief comes before the old vehicle leaves: an empty slot doubles the worst idleness (C2 of
            # docs/planning.md).
            for new in spare:
                fit = not fleet.battery_pct[row[new]] < LOW_BATTERY_PCT + FIT_PCT
                if fit and abs(fleet.layer_m[row[new]] - fleet.layer_m[row[old]]) >= apart_m:
                    self._guidance.relieve(formation, t_s, fleet, new, old)
                    spare.remove(new)
                    break

    def _release(self) -> None:
        """Let relieved vehicles leave once their relief is on the slot."""
        formation = self._state.formation
        for new, old in list(formation.reliefs.items()):
            if formation.berths[new].settled:
                del formation.reliefs[new], formation.berths[old]
                formation.leaving.add(old)

    def _intents(self, t_s: float, fleet: Fleet) -> list[Intent]:
        formation = self._state.formation
        rows = [i for i in np.flatnonzero(fleet.active).tolist() if int(fleet.id[i]) in formation.berths]
        flown = self._trajectories(t_s, fleet, rows)
        intents = []
        for i in np.flatnonzero(fleet.active).tolist():
            vehicle = int(fleet.id[i])
            if vehicle in flown:
                intents.append(flown[vehicle])
            elif vehicle in formation.leaving:
                intents.append(Intent(vehicle, "return", reason="relieved: its battery is low"))
            else:
                intents.append(Intent(vehicle, "hold", slot="reserve", joined=True, reason="in reserve"))
        return intents

    def _trajectories(self, t_s: float, fleet: Fleet, rows: list[int]) -> dict[int, Intent]:
        formation = self._state.formation
        if not rows:
            return {}
        sample_s = self._site.motion.sent_step_s
        times = t_s + sample_s * np.arange(round(HORIZON_S / sample_s) + 1)
        berths = [formation.berths[int(fleet.id[i])] for i in rows]
        xy, velocity = self._guidance.references(berths, times)
        layer_m = fleet.layer_m[rows]
        z = np.where(np.isfinite(layer_m), layer_m, fleet.position_m[rows, 2])
        places = [tuple(zip(x, y, repeat(up))) for x, y, up in zip(*_lists(xy), z.tolist(), strict=True)]
        speeds = [tuple(zip(east, north, repeat(0.0))) for east, north in zip(*_lists(velocity), strict=True)]
        found = {}
        for k, (i, berth) in enumerate(zip(rows, berths, strict=True)):
            vehicle, slot = int(fleet.id[i]), f"{berth.slot + 1}/{formation.slots}"
            if berth.stuck or (berth.waiting and berth.before is None):
                why = "no way to its slot inside the operating area" if berth.stuck else "its way is being planned"
                found[vehicle] = Intent(vehicle, "hold", slot=slot, reason=why)
                continue
            found[vehicle] = Intent(
                vehicle,
                "trajectory",
                t0_s=t_s,
                dt_s=sample_s,
                positions_m=places[k],
                velocities_m_s=speeds[k],
                slot=slot,
                joined=berth.joined and not berth.falls_back(t_s),
                reason=_reason(berth, t_s),
            )
        return found

    def _metrics(self, t_s: float) -> dict[str, float]:
        task, state, n = self.task, self._state, self._state.formation.slots
        tour = self._guidance.tour
        slower = tour.period_s / state.design.tour.period_s
        worst_s = predicted_worst_s(state.design, n) * slower if n else np.nan
        sweep = sweep_of_task(task, max(1, n))
        ideal_s, bound_s = self._cells.ideal_s(*sweep), self._cells.bound_s(*sweep)
        owners = state.formation.owners.values()
        return state.tempo.metrics | {
            "period_s": tour.period_s,
            "predicted_worst_s": worst_s,
            "predicted_ratio": worst_s / ideal_s,
            "ideal_s": ideal_s if n else np.nan,
            "bound_s": bound_s if n else np.nan,
            "coverage": state.design.real.coverage,
            "slots": n,
            "joined": sum(berth.joined and not berth.falls_back(t_s) for berth in owners),
            "searched": min(1.0, state.search.units / self._units) if self._units else 1.0,
        }


def predicted_worst_s(design: TourDesign, n: int) -> float:
    """Return the worst idleness of `n` slots on a tour that may have been evaluated for another number.

    The worst place is seen once a round, for a time that does not depend on their number.
    """
    period_s = design.tour.period_s
    return period_s / n - (period_s / design.n - design.real.worst_s)


def is_turned(tour: Tour, direction: str) -> bool:
    """Return whether a tour must be reversed to be flown clockwise ("cw") or counter-clockwise ("ccw")."""
    x, y = tour.xy_m.T
    enclosed = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    return direction != "auto" and (enclosed > 0.0) != (direction == "ccw")


def _better(found: TourDesign, flown: TourDesign) -> bool:
    """Return whether changing over to `found` is worth it."""
    if found.rank[:3] != flown.rank[:3]:
        return found.rank < flown.rank
    return found.real.worst_s < (1.0 - GAIN) * flown.real.worst_s


def _reason(berth: VehicleSlot, t_s: float) -> str:
    if berth.transit is not None:
        return "on its way to its slot"
    return "slower, to fall back to its slot" if berth.falls_back(t_s) else ""


def _active(fleet: Fleet) -> set[int]:
    return set(fleet.id[fleet.active].tolist())


def _lists(vectors: Floats) -> tuple[list[list[float]], list[list[float]]]:
    """Return east and north of (n, k, 2)."""
    return vectors[..., 0].tolist(), vectors[..., 1].tolist()
