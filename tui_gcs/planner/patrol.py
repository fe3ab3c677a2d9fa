"""Patrol: one closed smooth tour of the zone, active vehicles as equally timed slots that move along it.

Every place of the zone is then seen at least once per T / n. When vehicles are lost or join, the tour stays and the
slots are re-spaced at once (Elmaliach, Agmon, Kaminka 2009: uniform frequency as long as one vehicle works).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import (
    Annotation,
    Context,
    Fleet,
    Intent,
    Output,
    Param,
    ParamValue,
    Planner,
    PlannerTask,
    area_m2,
    cell_centres_m,
    sweep_bound_s,
)
from tui_gcs.planner.design import design
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.region import Region
from tui_gcs.planner.slots import assign
from tui_gcs.planner.smoothing import Motion
from tui_gcs.planner.tour import Tour, evaluate
from tui_gcs.planner.transit import Mobility, Transit, plan_transit

Floats = NDArray[np.floating[Any]]

HORIZON_S = 3.0
SAMPLE_S = 0.25
JOINED_M = 3.0
LOST_TRACK_M = 8.0
"""A vehicle this far from its reference gets a new transit from where it is."""
PATIENCE_S = 2.0
"""At least this long between two new transits of one vehicle."""
OLD_POSITION_S = 1.0
"""Older positions say nothing about how well a vehicle follows."""
ACCEL_SHARE = 0.9
"""Of the allowed acceleration; the rest is the autopilot's for tracking."""
TRANSIT_SPEED_SHARE = 0.98
DRAWN_POINTS = 120
DRAW_AGAIN_S = 5.0
"""A plan may be dropped on its way, and a station may be new."""


@dataclass
class _Berth:
    """One vehicle's slot: at time t it is at phase `t - origin_s` of the tour."""

    origin_s: float
    slot: int
    transit: Transit | None = None
    planned_s: float = -np.inf
    joined: bool = False
    stuck: bool = False


@dataclass
class _State:
    """What a step leaves for the next."""

    berths: dict[int, _Berth] = field(default_factory=dict)
    drawn_s: float = -np.inf
    predicted_worst_s: float = np.nan


class Patrol(Planner):
    """Equally timed slots on one closed tour of the team's zone."""

    name = "patrol"
    params = (
        Param(
            "speed_fraction",
            float,
            0.95,
            0.3,
            0.97,
            "",
            "tour speed as a share of the speed limit; the rest catches up",
        ),
        Param("margin_m", float, 1.2, 0.0, 5.0, "m", "planned footprint is smaller by this, for tracking errors"),
        Param("direction", str, "auto", choices=("auto", "cw", "ccw"), help="sense of the tour: auto is as designed"),
        Param("seed", int, 0, 0, 2**31 - 1, help="another seed tries other tours"),
    )

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Design the tour. Raises ValueError if nothing of the area may be flown over."""
        super().configure(task, params, rng)
        warm_up()
        limits, radius_m = task.limits, task.footprint_radius_m
        accel = limits.accel_m_s2 * ACCEL_SHARE
        planned_radius_m = max(radius_m - float(params["margin_m"]), radius_m * 0.5)
        motion = Motion(limits.speed_m_s * float(params["speed_fraction"]), accel, planned_radius_m)
        designer = np.random.default_rng([int(params["seed"]), int(rng.integers(2**32))])
        self._region = Region(task.area, task.no_fly, limits.geofence_margin_m, task.zone)
        self._design = design(task.zone.shape, self._region, motion, radius_m, len(task.members), designer)
        self._tour = turned(self._design.tour, str(params["direction"]))
        self._mobility = Mobility(limits.speed_m_s * TRANSIT_SPEED_SHARE, accel)
        self._state = _State()

    def step(self, ctx: Context) -> Output:
        """Intents for active vehicles; slots are re-spaced in the step that sees another set of them."""
        fleet, state = ctx.fleet, self._state
        active = [int(i) for i in np.flatnonzero(fleet.active)]
        if {int(fleet.id[i]) for i in active} != set(state.berths):
            self._respace(ctx.t_s, fleet, active)
        out = Output(intents=[self._intent(ctx.t_s, fleet, i) for i in active])
        if ctx.t_s - state.drawn_s >= DRAW_AGAIN_S:
            out.annotations, state.drawn_s = [_drawing(self._tour)], ctx.t_s
        out.metrics = self._metrics(len(active))
        return out

    # ---------------------------------------------------------------- slots

    def _respace(self, t_s: float, fleet: Fleet, active: list[int]) -> None:
        """New slots for exactly the active vehicles, and a transit to each that is not on its own already."""
        state = self._state
        if not active:
            state.berths = {}
            return
        xy, velocity = np.empty((len(active), 2)), np.empty((len(active), 2))
        phase = np.full(len(active), np.nan)
        for row, i in enumerate(active):
            xy[row], velocity[row] = self._start_of(t_s, fleet, i)
            berth = state.berths.get(int(fleet.id[i]))
            if berth and berth.joined and berth.transit is None:
                phase[row] = t_s - berth.origin_s
        found = assign(xy, velocity, self._tour, self._mobility.speed_m_s, phase)
        berths: dict[int, _Berth] = {}
        for row, i in enumerate(active):
            berth = _Berth(t_s - float(found.phase_s[row]), int(found.slot[row]))
            here, there = phase[row], found.phase_s[row]
            apart = (here - there + self._tour.period_s / 2) % self._tour.period_s - self._tour.period_s / 2
            if np.isfinite(here) and abs(apart) < 1e-3:
                berth.joined = True
            else:
                self._send(berth, t_s, xy[row], velocity[row])
            berths[int(fleet.id[i])] = berth
        state.berths = berths
        state.predicted_worst_s = self._predicted_worst_s(len(active))

    def _start_of(self, t_s: float, fleet: Fleet, i: int) -> tuple[Floats, Floats]:
        """State from which vehicle i's next transit starts: its reference if it follows it, else where it is."""
        xy, velocity = _now(fleet, i)
        berth = self._state.berths.get(int(fleet.id[i]))
        if berth is not None and not berth.stuck:
            reference, speed = self._reference(berth, np.array([t_s]))
            if np.hypot(*(reference[0] - xy)) <= LOST_TRACK_M:
                return reference[0], speed[0]
        return xy, velocity

    def _send(self, berth: _Berth, t_s: float, xy: Floats, velocity: Floats) -> None:
        phase_s = t_s - berth.origin_s
        berth.transit = plan_transit(t_s, xy, velocity, self._tour, phase_s, self._mobility, self._region)
        berth.stuck = berth.transit is None
        berth.planned_s, berth.joined = t_s, False

    def _reference(self, berth: _Berth, times_s: Floats) -> tuple[Floats, Floats]:
        """Where the vehicle should be: on its transit, then on its slot."""
        xy, velocity = self._tour.at(times_s - berth.origin_s)
        if berth.transit is not None:
            under_way = times_s < berth.transit.end_s
            xy[under_way], velocity[under_way] = berth.transit.at(times_s[under_way])
        return xy, velocity

    # ---------------------------------------------------------------- intents

    def _intent(self, t_s: float, fleet: Fleet, i: int) -> Intent:
        vehicle = int(fleet.id[i])
        berth = self._state.berths[vehicle]
        self._follow_up(berth, t_s, fleet, i)
        slot = f"{berth.slot + 1}/{len(self._state.berths)}"
        if berth.stuck:
            return Intent(vehicle, "hold", slot=slot, reason="no way to its slot inside the operating area")
        times = t_s + SAMPLE_S * np.arange(round(HORIZON_S / SAMPLE_S) + 1)
        xy, velocity = self._reference(berth, times)
        z = float(fleet.layer_m[i]) if np.isfinite(fleet.layer_m[i]) else float(fleet.position_m[i, 2])
        return Intent(
            vehicle,
            "trajectory",
            t0_s=t_s,
            dt_s=SAMPLE_S,
            positions_m=tuple([(x, y, z) for x, y in xy.tolist()]),
            velocities_m_s=tuple([(vx, vy, 0.0) for vx, vy in velocity.tolist()]),
            slot=slot,
            joined=berth.joined,
            reason="" if berth.transit is None else "on its way to its slot",
        )

    def _follow_up(self, berth: _Berth, t_s: float, fleet: Fleet, i: int) -> None:
        """End a transit that is over; send a vehicle that lost its reference anew."""
        if berth.transit is not None and t_s >= berth.transit.end_s:
            berth.transit = None
        if fleet.age_s[i] > OLD_POSITION_S:
            return
        xy, velocity = _now(fleet, i)
        error_m = float(np.hypot(*(self._reference(berth, np.array([t_s]))[0][0] - xy)))
        if berth.transit is None and error_m <= JOINED_M:
            berth.joined = True
        if (error_m > LOST_TRACK_M or berth.stuck) and t_s - berth.planned_s >= PATIENCE_S:
            self._send(berth, t_s, xy, velocity)

    # ---------------------------------------------------------------- numbers

    def _predicted_worst_s(self, n: int) -> float:
        if n == max(1, len(self.task.members)):
            return self._design.real.worst_s
        cells = cell_centres_m(self.task.zone.shape, 5.0)
        return evaluate(self._tour, cells, self.task.footprint_radius_m, n).worst_s

    def _metrics(self, n: int) -> dict[str, float]:
        task, worst_s = self.task, self._state.predicted_worst_s
        bound_s = sweep_bound_s(area_m2(task.zone.shape), n, task.limits.speed_m_s, task.footprint_radius_m)
        return {
            "period_s": self._tour.period_s,
            "predicted_worst_s": worst_s if n else np.nan,
            "predicted_ratio": worst_s / bound_s if n else np.nan,
            "slots": n,
            "joined": sum(berth.joined for berth in self._state.berths.values()),
        }


def turned(tour: Tour, direction: str) -> Tour:
    """The tour flown clockwise ("cw"), counter-clockwise ("ccw") or as it is ("auto")."""
    x, y = tour.xy_m.T
    enclosed = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if direction == "auto" or (enclosed > 0.0) == (direction == "ccw"):
        return tour
    return Tour(tour.dt_s, tour.xy_m[::-1].copy(), -tour.velocity_m_s[::-1])


def _now(fleet: Fleet, i: int) -> tuple[Floats, Floats]:
    """Ground position and velocity of vehicle i, carried forward by the age of its position."""
    velocity = np.nan_to_num(fleet.velocity_m_s[i, :2])
    age_s = min(max(float(np.nan_to_num(fleet.age_s[i])), 0.0), OLD_POSITION_S)
    return fleet.position_m[i, :2] + velocity * age_s, velocity


def _drawing(tour: Tour) -> Annotation:
    every = max(1, -(-len(tour.xy_m) // (DRAWN_POINTS - 1)))
    points = [(round(x, 1), round(y, 1)) for x, y in tour.xy_m[::every].tolist()]
    return Annotation("polyline", (*points, points[0]), "tour")
