"""Team controller: everything between the station and the planner of one team.

It gives the planner its task, turns its plans into courses, watches over it, and measures what the team achieves. The
newest plan stays valid until its last sample. A planner that fails is started again once; when it fails again it is
quarantined until the operator changes something.

A new task stops no vehicle: all go on with their courses, judged by the guard of the new round, until the first plan
for that task arrives. A vehicle that is vetoed meanwhile holds.
"""

import math
from collections.abc import Sequence

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.base.token_bucket import TokenBucket
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import IN_THE_AIR, Flight
from tui_gcs.core.flight.intents import IntentController
from tui_gcs.core.flight.planner_monitor import MAX_PLANS_PER_S, PlannerMonitor, WorkerState
from tui_gcs.core.flight.planner_tasks import task_of, within_own_limits
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.flight.zone_idleness import ZoneIdleness
from tui_gcs.core.geometry.idleness_grid import serving
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.protocol.common import Annotation, EventClass, Phase, PlannerTask, TeamPlan, TeamStatus
from tui_gcs.core.protocol.plan_limits import (
    MAX_LEARNT_BYTES,
    MAX_METRICS,
    MAX_NOTES,
    NOTES_PER_S,
    shown,
    too_many,
)
from tui_gcs.core.records.event_log import ALERT, NOTICE, WARNING
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.scenario.model import Round, Scenario, Team

MAX_NAME_CELLS = 32
"""Longest name of a planner's metric; the rest is cut."""
# A traceback of foreign code may have any size, and is shown to the operator.
MAX_TRACE_LINES, MAX_TRACE_CELLS = 30, 160
MAX_SNAPSHOT_BYTES = 2_000_000
"""A planner's own snapshot has at most 1 MB; its host adds to that."""
METRICS_GAP_S = 5.0
"""How often the metrics of a planner are journalled: about 30 bytes each."""
ENDS_S = 0.2
"""A hold comes this long before a course ends, where a vehicle would stop abruptly."""
# Both autopilots keep within 1.25 m of a moving course in calm air; in wind of 3 m/s ArduCopter was 8 m off.
ON_SLOT_M = 5.0


class TeamController:
    """Gives one team's planner its task and carries out its plans."""

    def __init__(
        self, services: FlightServices, steering: Steering, journal: Journal, *, judge_steps: bool, team: Team
    ) -> None:
        """`judge_steps`: whether `TeamPlan.step_ms` counts (not in lock-step, where wall time means nothing)."""
        self.team = team
        self.planner = PlannerMonitor(services.clock, check_step_time=judge_steps)
        self.dropped_notes = 0
        """Notes to the operator that were left out because there were too many."""
        self.task: PlannerTask | None = None
        self.annotations: tuple[Annotation, ...] = ()
        self.metrics: dict[str, float] = {}
        self.snapshot = b""
        """State of the planner of the present task, as its host sent it."""
        self.learnt = b""
        """What the team's planners have learnt, for a worker that begins anew; opaque to the station."""
        self.ignored = 0
        """Plans that were made for an older task."""
        self.measured: ZoneIdleness | None = None
        self._announced_on_slot = False
        self._fleet, self._flights, self._guard = services.fleet, services.flights, services.guard
        self._steering = steering
        self._intents = IntentController(team.name, services, steering)
        self._events, self._clock = services.events, services.clock
        self._notes = TokenBucket(NOTES_PER_S, MAX_NOTES, services.clock.now())
        self._journal = journal
        self._next_metrics_s = -math.inf
        self._old_revision = -1
        self._stopped: set[int] = set()
        """Vehicles vetoed on a course of an older task: they hold until the first plan for the new one."""

    def task_for(self, scenario: Scenario, round_: Round, team: Team, revision: int) -> PlannerTask:
        """What the planner of `team` is to do in `round_`, with the vehicles this team has."""
        members = self._flights.members(team.name)
        layers_m = {f.vehicle: f.layer_m for f in self._flights if f.team == team.name}
        own = {vehicle: self._steering.own_limits(vehicle) for vehicle in members}
        return msgspec.structs.replace(
            within_own_limits(task_of(scenario, round_, team, layers_m, members), own),
            revision=revision,
            t_s=self._clock.now(),
            off_course_m=self._steering.off_course_m(members),
        )

    def is_changed(self, scenario: Scenario, round_: Round) -> bool:
        """Whether the planner needs a new task: it would differ, or the planner is quarantined with the present one."""
        if self.task is None or self.planner.quarantined:
            return True
        task = self.task_for(scenario, round_, self.team, self.task.revision)
        return msgspec.structs.replace(task, t_s=self.task.t_s) != self.task

    def set_round(self, scenario: Scenario, round_: Round, revision: int) -> PlannerTask:
        """Make a new task for the planner: another round, zone, parameter or membership."""
        # Plans for the older task go on moving vehicles until the first plan for the new one.
        self._old_revision = self.task.revision if self.task else -1
        self.task = task = self.task_for(scenario, round_, self.team, revision)
        self.annotations, self.metrics, self.snapshot = (), {}, b""
        self.planner.on_task()
        self._stopped.clear()
        self.measured = ZoneIdleness(task)
        self._announced_on_slot = False
        for flight in self._flying():
            flight.slot, flight.joined, flight.waits = "", False, False
            flight.passed = None  # the area may be another one: the guard judges the course again at once
        return task

    @property
    def kept(self) -> bytes:
        """What a worker that begins anew starts from: the snapshot, or before there is one what was learnt."""
        return self.snapshot or self.learnt

    def take(self, plan: TeamPlan) -> list[tuple[int, str]]:
        """Carry out a plan that arrived: its intents become courses.

        Returns:
            (vehicle, reason) of those that the planner wants to send home.
        """
        # Until the first plan for the new task, plans for the older one keep the vehicles moving.
        is_for_old_task = plan.revision == self._old_revision and not self.planner.has_planned and not plan.error
        if self.task is None or not (plan.revision == self.task.revision or is_for_old_task):
            self.ignored += 1
            return []
        self._show_notes(plan.notes)
        for text, well in plan.news[:MAX_NOTES]:
            self._say(clean(text), NOTICE if well else WARNING)
        if plan.error:
            self._take_failure(plan)
            return []
        if self.planner.exceeds_rate():
            self._guard.veto("rate", f"more than {MAX_PLANS_PER_S} plans a second")
            return []
        if problem := too_many(plan, len(self.task.members)):
            self._guard.veto("intents", problem)
            self._fault(f"planner {self.team.planner}: {problem}: its plan is not taken")
            return []
        if is_for_old_task:
            return self._intents.carry_out(self._for_new_task(plan))
        if not self.planner.has_planned:
            self._end_old_courses(plan)
        self.planner.on_plan(plan)
        self._keep_results(plan)
        return self._intents.carry_out(plan)

    def _show_notes(self, notes: Sequence[str]) -> None:
        """Show the notes of a planner or its host as events, as far as the rate limit allows."""
        for note in notes:
            if not self._notes.has_one(self._clock.now()):
                self.dropped_notes += 1
                self._say(
                    f"planner {self.team.planner}: sends too many notes: some are left out", WARNING, every_s=60.0
                )
            elif self._say(clean(note), WARNING, every_s=60.0):
                self._notes.take()

    def _for_new_task(self, plan: TeamPlan) -> TeamPlan:
        """A plan for the older task, without vehicles that were stopped since, and without its slots.

        Flown on eight real ArduCopters: a round was reported to be all on slot 1 s after it began, 23 s too early.
        """
        ours = set(self._flights.members(self.team.name)) - self._stopped  # some may be in another team by now
        moved = (intent for intent in plan.intents if intent.vehicle in ours)
        going_on = tuple(msgspec.structs.replace(intent, joined=False) for intent in moved)
        return msgspec.structs.replace(plan, intents=going_on)

    def _keep_results(self, plan: TeamPlan) -> None:
        if plan.annotations is not None:
            self.annotations = shown(plan.annotations)
        self.metrics = {clean(k, MAX_NAME_CELLS): v for k, v in sorted(plan.metrics.items())[:MAX_METRICS]}
        now = self._clock.now()
        if self.metrics and now >= self._next_metrics_s:
            self._next_metrics_s = now + METRICS_GAP_S
            self._journal.write({"metrics": self.metrics, "team": self.team.name, "wall_s": self._clock.wall()})
        if plan.snapshot is not None and len(plan.snapshot) <= MAX_SNAPSHOT_BYTES:
            self.snapshot = plan.snapshot
        if plan.learnt is not None and len(plan.learnt) <= MAX_LEARNT_BYTES:
            self.learnt = plan.learnt

    def _end_old_courses(self, plan: TeamPlan) -> None:
        """The first plan of a task arrived: vehicles that it does not name do not fly on for the older task."""
        named = {intent.vehicle for intent in plan.intents}
        for flight in self._flying():
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if flight.course is not None and flight.vehicle not in named and vehicle is not None:
                flight.course = None
                self._steering.hold(vehicle)
        self._stopped.clear()

    def _take_failure(self, plan: TeamPlan) -> None:
        lines = [clean(line, MAX_TRACE_CELLS) for line in plan.error.strip().splitlines()[-MAX_TRACE_LINES:]]
        last_line = lines[-1] if lines else clean("it does not say why")
        what = {"restarts": "; it is begun anew", "quarantined": "; it is left alone until you change something"}
        if (last_line, plan.fate) != (self.planner.error, "quarantined" if self.planner.quarantined else ""):
            # The host repeats the failure with every plan: it is journalled and shown once.
            self._journal.write({"planner_failed": self.team.name, "fate": plan.fate, "trace": lines})
            self._fault(f"planner {self.team.planner} failed: {last_line}{what.get(plan.fate, '')}")
        self.planner.on_failure(last_line, "\n".join(lines), plan.fate)

    def tick(self) -> list[int]:
        """The vehicles that must hold now because their planner is not in time; an alarm gives the reason."""
        flying = self._flying()
        if self.task is None:
            return []
        if not self.planner.has_planned:
            self._stop_vetoed(flying)
        vehicles = [flight.vehicle for flight in flying]
        if self.planner.quarantined:
            return vehicles
        self.planner.check_worker(flying=bool(flying))
        if not flying:
            if self.planner.kill_wanted and self.planner.worker_alive:
                self._say("planner worker does not answer: it is ended and started anew", WARNING, every_s=30.0)
            return []
        ends_s = [flight.course.end_s - ENDS_S for flight in flying if isinstance(flight.course, Trajectory)]
        if why := self.planner.overdue(min(flight.since_s for flight in flying), min(ends_s, default=math.inf)):
            self._fault(f"planner {self.team.planner} {why}: {len(flying)} vehicles hold")
            return vehicles
        return []

    def _stop_vetoed(self, flying: list[Flight]) -> None:
        """End courses of an older task that the guard vetoed: they are not resumed where they lead back inside."""
        for flight in flying:
            if flight.course is not None and flight.vetoed:
                flight.course = None
                self._stopped.add(flight.vehicle)

    def on_alive(self, alive: bool) -> None:
        """The worker process came or went."""
        if alive != self.planner.worker_alive:
            word = "planner worker is there" if alive else "planner worker is GONE"
            self._say(word, NOTICE if alive else (ALERT if self._flying() else WARNING))
        self.planner.on_alive(alive)

    def measure(self) -> None:
        """Mark what the team's vehicles see now."""
        if self.measured is None:
            return
        places = {
            flight.vehicle: vehicle.telemetry.position_m[:2]
            for flight in self._flying()
            if (vehicle := self._fleet.vehicles.get(flight.vehicle)) is not None and vehicle.telemetry.has_position()
        }
        if not self._announced_on_slot and self.all_on_slot():
            self._announced_on_slot = True
            self._say(f"all {len(places)} on their slots over {self.team.zone}", NOTICE)
        self.measured.update(self._clock.now(), places)

    def status(self) -> TeamStatus:
        """The team as the bus and the screens show it."""
        flights = self._flights.of_team(self.team.name)
        flying = [flight for flight in flights if flight.phase is Phase.FLYING]
        up = any(flight.phase in IN_THE_AIR for flight in flights)
        measured, planner = self.measured, self.planner
        served_by = serving(len(flying), sum(flight.waits for flight in flying))
        count = served_by or len(flights)
        ideal = measured.ideal_s(count) if measured else math.nan
        worst = measured.worst_s if measured and up else math.nan
        return TeamStatus(
            name=self.team.name,
            zone=self.team.zone,
            role=str(self.task.zone.role) if self.task else "",
            planner=self.team.planner,
            members=tuple([flight.vehicle for flight in flights]),
            worker=planner.worker_state(flying=bool(flying)),
            plan_age_s=planner.plan_age_s,
            rate_hz=planner.measured_rate_hz(),
            on_slot=self.on_slot(),
            slots=len(flying),
            worst_idleness_s=worst,
            average_idleness_s=measured.average_s if measured and up else math.nan,
            coverage=measured.coverage if measured else 0.0,
            ideal_s=ideal,
            bound_s=measured.bound_s(count) if measured else math.nan,
            ratio=worst / ideal if ideal and flying else math.nan,
            metrics=self.metrics,
            error=planner.trace or planner.error,
            reserve=len(flying) - served_by,
        )

    def worker_state(self) -> WorkerState:
        """How its worker is doing, as `TeamStatus.worker`."""
        return self.planner.worker_state(flying=bool(self._flying()))

    def on_slot(self) -> int:
        """How many vehicles are on their slot, or wait in reserve as their planner wants."""
        return sum(1 for flight in self._flying() if self.is_on_slot(flight))

    def is_on_slot(self, flight: Flight) -> bool:
        """Whether the planner reports this vehicle on its slot and the station sees it within `ON_SLOT_M` of it."""
        vehicle = self._fleet.vehicles.get(flight.vehicle)
        if vehicle is None or not flight.joined or flight.course is None:
            return flight.waits
        if flight.roams:
            return True
        return self._steering.slot_error_m(flight, vehicle) <= ON_SLOT_M

    def all_on_slot(self) -> bool:
        """Whether every flying vehicle of the team is on its slot, and there is one."""
        flying = self._flying()
        return bool(flying) and all(self.is_on_slot(flight) for flight in flying)

    def _flying(self) -> list[Flight]:
        return self._flights.flying_for(self.team.name)

    def _fault(self, text: str) -> None:
        self.planner.fault_count += 1
        self._say(text, ALERT, every_s=5)

    def _say(self, text: str, severity: int, every_s: float = 0.0) -> bool:
        return self._events.report(EventClass.PLANNER, f"planner {self.team.name}", text, severity, every_s=every_s)
