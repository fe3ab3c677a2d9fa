"""One desk per team: gives its planner the task, takes its plans, judges how alive it is, measures what it achieves.

The station never waits for a planner. The newest plan stays valid until its last sample; a planner that is silent for
2 s, or late three times in a row, costs its vehicles nothing but a hold.
"""

import math
from collections import deque
from typing import Literal

import numpy as np

from tui_gcs.core.clock import Clock
from tui_gcs.core.events import ALERT, NOTICE, WARNING, EventLog
from tui_gcs.core.fleet import Fleet
from tui_gcs.core.flights import Flight, FlightBook
from tui_gcs.core.guard import Guard
from tui_gcs.core.idleness import IdlenessGrid, sweep_bound_s
from tui_gcs.core.intents import IntentDesk
from tui_gcs.core.messages import Annotation, EventClass, Phase, Plan, PlannerTask, TeamStatus
from tui_gcs.core.scenario import Round, Scenario, Team
from tui_gcs.core.steering import Steering
from tui_gcs.core.text import clean
from tui_gcs.core.zones import Zone, area_m2

PERIOD_S = 0.2
"""Planners step at 5 Hz."""
SILENT_S = 2.0
LATE_IN_A_ROW = 3
CONFIGURE_S = 20.0
"""A planner may need this long for its first plan of a new task; its vehicles hold meanwhile."""
MOST_PLANS_PER_S = 25
MOST_ANNOTATIONS, MOST_METRICS = 200, 64
"""What a planner may draw and count; the rest is cut."""
ON_SLOT_M = 5.0
WORST_OVER_S = 60
"""The live worst idleness is the largest of the last minute."""

WorkerState = Literal["absent", "ready", "running", "late", "dead"]


class TeamDesk:
    """Everything between the station and one team's planner."""

    def __init__(
        self,
        fleet: Fleet,
        book: FlightBook,
        guard: Guard,
        steering: Steering,
        events: EventLog,
        clock: Clock,
        *,
        judge_steps: bool,
        team: Team,
    ) -> None:
        """`judge_steps`: whether `Plan.step_ms` counts (not in lock-step, where wall time means nothing)."""
        self.team = team
        self.task: PlannerTask | None = None
        self.annotations: tuple[Annotation, ...] = ()
        self.metrics: dict[str, float] = {}
        self.worker_alive = False
        self.fault_count = 0
        self.error = ""
        """Why the planner cannot plan its present task; empty if it can."""
        self.ignored = 0
        """Plans made for an older task."""
        self.grid: IdlenessGrid | None = None
        self._bound_zone_m2 = 0.0
        self._worst: deque[tuple[float, float]] = deque(maxlen=WORST_OVER_S)
        """(time, largest idleness then), one a second, since every cell was seen."""
        self._average_s = math.nan
        self._told_on_slot = False
        self._fleet = fleet
        self._book = book
        self._guard = guard
        self._steering = steering
        self._intents = IntentDesk(team.name, fleet, book, guard, steering, events, clock)
        self._events = events
        self._clock = clock
        self._judge_steps = judge_steps
        self._plan_s = -math.inf
        self._task_s = -math.inf
        self._first_plan = False
        self._late_in_a_row = 0
        self._arrivals: deque[float] = deque(maxlen=MOST_PLANS_PER_S)

    # ---------------------------------------------------------------- task

    def set_round(self, scenario: Scenario, round_: Round, revision: int) -> PlannerTask:
        """A new task for the planner: another round, zone, parameter or membership. Old courses end here."""
        now = self._clock.now()
        zone = next(z for z in round_.zones if z.name == self.team.zone)
        self.task = PlannerTask(
            team=self.team.name,
            revision=revision,
            t_s=now,
            planner=self.team.planner,
            zone=zone,
            area=round_.area,
            no_fly=round_.no_fly,
            limits=scenario.limits,
            footprint_radius_m=scenario.footprint_radius_m,
            parameters=dict(self.team.parameters),
            seed=scenario.seed,
            members=self._book.members(self.team.name),
            layers_m={f.vehicle: f.layer_m for f in self._book if f.team == self.team.name},
        )
        self.annotations, self.metrics, self.error = (), {}, ""
        self._task_s, self._first_plan, self._late_in_a_row = now, False, 0
        self._restart_measuring(zone, scenario)
        for flight in self._flying():
            flight.course, flight.slot, flight.joined = None, "", False
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if vehicle is not None:
                self._steering.hold(vehicle)
        return self.task

    def _restart_measuring(self, zone: Zone, scenario: Scenario) -> None:
        """Forget what was seen."""
        self.grid = IdlenessGrid(zone.shape, scenario.footprint_radius_m)
        self._bound_zone_m2 = area_m2(zone.shape)
        self._worst.clear()
        self._told_on_slot = False
        self._average_s = math.nan

    # ---------------------------------------------------------------- plans

    def take(self, plan: Plan) -> list[tuple[int, str]]:
        """A plan arrived: its intents become courses. Returns (vehicle, reason) of those it wants to send home."""
        now = self._clock.now()
        if self.task is None or plan.revision != self.task.revision:
            self.ignored += 1
            return []
        if plan.error:
            last_line = clean((plan.error.strip().splitlines() or ["it does not say why"])[-1])
            if last_line != self.error:  # it says so with every plan: told once
                self._fault(f"planner {self.team.planner} failed: {last_line}")
            self.error = last_line
            return []
        self.error = ""
        self._arrivals.append(now)
        if len(self._arrivals) == MOST_PLANS_PER_S and now - self._arrivals[0] < 1.0:
            self._guard.veto("rate", f"more than {MOST_PLANS_PER_S} plans a second")
            return []
        self._plan_s, self._first_plan = now, True
        late = self._judge_steps and plan.step_ms > PERIOD_S * 1e3
        self._late_in_a_row = self._late_in_a_row + 1 if late else 0
        if plan.annotations is not None:
            self.annotations = plan.annotations[:MOST_ANNOTATIONS]
        self.metrics = dict(sorted(plan.metrics.items())[:MOST_METRICS])
        return self._intents.carry_out(plan, self.task.limits)

    # ---------------------------------------------------------------- judging

    def tick(self) -> list[int]:
        """Vehicles that must hold now because their planner does not answer; told as an alarm."""
        flying = self._flying()
        if not flying or self.task is None:
            return []
        now = self._clock.now()
        since = max(self._plan_s, min(f.since_s for f in flying))
        configuring = not self._first_plan
        silent = now - (max(self._task_s, since) if configuring else since) > (CONFIGURE_S if configuring else SILENT_S)
        if silent or self._late_in_a_row >= LATE_IN_A_ROW:
            what = f"silent for {now - since:.1f} s" if silent else f"late {LATE_IN_A_ROW} times in a row"
            self._late_in_a_row = 0
            self._fault(f"planner {self.team.planner} {what}: {len(flying)} vehicles hold")
            return [flight.vehicle for flight in flying]
        return []

    def measure(self) -> None:
        """Mark what the team's vehicles see now."""
        if self.grid is None:
            return
        places = [
            vehicle.position_m[:2]
            for flight in self._flying()
            if (vehicle := self._fleet.vehicles.get(flight.vehicle)) is not None and vehicle.has_position()
        ]
        now = self._clock.now()
        if not self._told_on_slot and self.all_on_slot():
            self._told_on_slot = True
            text = f"all {len(places)} on their slots over {self.team.zone}"
            self._events.say(EventClass.PLANNER, f"planner {self.team.name}", text, NOTICE)
        if places:
            self.grid.update(now, np.array(places))
        if places and self.grid.coverage >= 1.0 and (not self._worst or now - self._worst[-1][0] >= 1.0):
            self._worst.append((now, self.grid.worst_now_s(now)))
            self._average_s = self.grid.average_now_s(now)

    def on_alive(self, alive: bool) -> None:
        """The worker process came or went."""
        if alive != self.worker_alive:
            word = "planner worker is there" if alive else "planner worker is GONE"
            severity = NOTICE if alive else (ALERT if self._flying() else WARNING)
            self._events.say(EventClass.PLANNER, f"planner {self.team.name}", word, severity)
        self.worker_alive = alive

    def status(self) -> TeamStatus:
        """For the screens."""
        now = self._clock.now()
        flying = self._flying()
        members = self._book.members(self.team.name)
        count = max(len(flying) or len(members), 1)
        limits = self.task.limits if self.task else None
        radius = self.task.footprint_radius_m if self.task else 1.0
        bound = sweep_bound_s(self._bound_zone_m2, count, limits.speed_m_s, radius) if limits else math.nan
        worst = max((value for _, value in self._worst), default=math.nan)
        return TeamStatus(
            name=self.team.name,
            zone=self.team.zone,
            role=str(self.task.zone.role) if self.task else "",
            planner=self.team.planner,
            members=members,
            worker=self._worker_state(now, flying),
            plan_age_s=round(now - self._plan_s, 2) if self._first_plan else math.nan,
            rate_hz=self._rate(now),
            on_slot=self.on_slot(),
            slots=len(flying),
            worst_idleness_s=worst,
            average_idleness_s=self._average_s,
            coverage=self.grid.coverage if self.grid is not None else 0.0,
            bound_s=bound,
            ratio=worst / bound if bound else math.nan,
            metrics=self.metrics,
        )

    def on_slot(self) -> int:
        """How many vehicles are on their slot: joined by the planner's word and within 5 m by ours."""
        return sum(1 for flight in self._flying() if self.is_on_slot(flight))

    def is_on_slot(self, flight: Flight) -> bool:
        """Whether this vehicle is on its slot now."""
        vehicle = self._fleet.vehicles.get(flight.vehicle)
        if vehicle is None or not flight.joined or flight.course is None:
            return False
        return self._steering.slot_error_m(flight, vehicle) <= ON_SLOT_M

    def all_on_slot(self) -> bool:
        """Whether every flying vehicle of the team is on its slot, and there is one."""
        flying = self._flying()
        return bool(flying) and all(self.is_on_slot(flight) for flight in flying)

    def _worker_state(self, now: float, flying: list[Flight]) -> WorkerState:
        age = now - self._plan_s
        if not self._first_plan or age > SILENT_S:
            if not self.worker_alive:
                return "dead" if self.fault_count or self._arrivals else "absent"
            return "late" if flying and self._first_plan else "ready"
        return "late" if age > LATE_IN_A_ROW * PERIOD_S else "running"

    def _rate(self, now: float) -> float:
        """Plans per second of the last two seconds."""
        recent = [t for t in self._arrivals if now - t <= 2.0]
        span_s = recent[-1] - recent[0] if len(recent) > 2 else 0.0
        return round((len(recent) - 1) / span_s, 1) if span_s > 0 else 0.0

    def _flying(self) -> list[Flight]:
        return [f for f in self._book.in_phase(Phase.FLYING) if f.team == self.team.name]

    def _fault(self, text: str) -> None:
        self.fault_count += 1
        self._events.say(EventClass.PLANNER, f"planner {self.team.name}", text, ALERT, every_s=5)
