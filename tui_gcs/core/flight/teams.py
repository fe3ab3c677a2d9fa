"""One desk per team: gives its planner the task, takes its plans, judges how alive it is, measures what it achieves.

The station never waits for a planner. The newest plan stays valid until its last sample; a planner that is silent for
2 s, or late three times in a row, costs its vehicles nothing but a hold, and its worker is ended and begun anew.
One that fails is begun anew once; failing again it is left alone until the operator changes something.

A new task does not stop anybody: vehicles go on with their courses, judged by the new round's guard, until the first
plan for it comes; who is vetoed meanwhile holds.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import Literal

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import IN_THE_AIR, Flight
from tui_gcs.core.flight.intents import IntentController
from tui_gcs.core.flight.planner_tasks import task_of
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.flight.team_measures import ZoneIdleness
from tui_gcs.core.geometry.idleness_grid import serving
from tui_gcs.core.protocol.common import Annotation, EventClass, Phase, Plan, PlannerTask, TeamStatus
from tui_gcs.core.protocol.plan_limits import (
    MOST_LEARNT_BYTES,
    MOST_METRICS,
    MOST_NOTES,
    NOTES_PER_S,
    shown,
    too_many,
)
from tui_gcs.core.records.event_log import ALERT, NOTICE, WARNING
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.scenario.model import Round, Scenario, Team

SILENT_S = 2.0
LATE_IN_A_ROW = 3
LATE_SHOWN_S = 0.6
"""A plan is not called old before, however fast its planner is meant to be."""
CONFIGURE_S = 20.0
"""A planner may need this long for its first plan of a new task; its vehicles end their courses meanwhile."""
SLOWEST_HZ, FASTEST_HZ = 1.0, 20.0
"""Of planners' steps."""
MAX_PLANS_PER_S = 25
MAX_NAME_CELLS = 32
"""What a planner may count; the rest is cut."""
MAX_TRACE_LINES, MAX_TRACE_CELLS = 30, 160
MAX_SNAPSHOT_BYTES = 2_000_000
"""Of a planner's own 1 MB, and what its host adds."""
ON_SLOT_M = 5.0

WorkerState = Literal["absent", "ready", "running", "late", "dead", "quarantined"]


class TeamController:
    """Everything between the station and one team's planner."""

    def __init__(
        self,
        services: FlightServices,
        steering: Steering,
        journal: Journal,
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
        """Why the planner cannot plan its present task, in one line; empty if it can."""
        self.trace = ""
        """As its last failure said it, with all lines."""
        self.quarantined = False
        self.kill_wanted = False
        """Its worker does not answer as it should: whoever keeps workers ends it and starts another."""
        self.snapshot = b""
        """Of the planner of the present task."""
        self.learnt = b""
        """What its planners have learnt, for a worker that begins anew; opaque, its host knows whose it is."""
        self.rate_hz = 5.0
        """How often its planner steps, by its own word."""
        self.ignored = 0
        """Plans made for an older task."""
        self.unsaid = 0
        """Notes that were left out because there were too many."""
        self._may_say, self._spoke_s = float(MOST_NOTES), -math.inf
        self.measured: ZoneIdleness | None = None
        self._told_on_slot = False
        self._fleet, self._flights, self._guard = services.fleet, services.flights, services.guard
        self._steering = steering
        self._intents = IntentController(team.name, services, steering)
        self._events, self._clock = services.events, services.clock
        self._journal = journal
        self._judge_steps = judge_steps
        self._plan_s = -math.inf
        self._task_s = -math.inf
        self._begun_s = -math.inf
        """When the planner began to configure."""
        self._first_plan = False
        """There was a plan for the present task."""
        self._configured = False
        """This worker has planned, or said why it cannot, since it came, or since its task."""
        self._old_revision = -1
        self._stopped: set[int] = set()
        """Vetoed on a course of an older task: they hold until the new one's first plan."""
        self._late_in_a_row = 0
        self._step_ms = 0.0
        """How long its newest step took."""
        self._arrivals: deque[float] = deque(maxlen=MAX_PLANS_PER_S)

    # ---------------------------------------------------------------- task

    def task_for(self, scenario: Scenario, round_: Round, team: Team, revision: int) -> PlannerTask:
        """What the planner of `team` is to do in `round_`, with the vehicles this team has."""
        members = self._flights.members(team.name)
        layers_m = {f.vehicle: f.layer_m for f in self._flights if f.team == team.name}
        return msgspec.structs.replace(
            task_of(scenario, round_, team, layers_m, members),
            revision=revision,
            t_s=self._clock.now(),
            off_course_m=self._steering.off_course_m(members),
        )

    def is_changed(self, scenario: Scenario, round_: Round) -> bool:
        """Whether its planner must hear of this: another task, or one it was left alone with."""
        if self.task is None or self.quarantined:
            return True
        task = self.task_for(scenario, round_, self.team, self.task.revision)
        return msgspec.structs.replace(task, t_s=self.task.t_s) != self.task

    def set_round(self, scenario: Scenario, round_: Round, revision: int) -> PlannerTask:
        """A new task for the planner: another round, zone, parameter or membership."""
        now = self._clock.now()
        self._old_revision = self.task.revision if self.task else -1
        self.task = task = self.task_for(scenario, round_, self.team, revision)
        self.annotations, self.metrics, self.error, self.trace = (), {}, "", ""
        self.quarantined, self.snapshot = False, b""
        self._task_s = self._begun_s = now
        self._first_plan, self._configured, self._late_in_a_row = False, False, 0
        self._stopped.clear()
        self.measured = ZoneIdleness(task.zone.shape, scenario)
        self._told_on_slot = False
        for flight in self._flying():
            flight.slot, flight.joined, flight.waits = "", False, False
            flight.passed = None  # judged anew at once: another area
        return task

    @property
    def kept(self) -> bytes:
        """For a worker that begins anew: a snapshot, or what was learnt before there is one for the present task."""
        return self.snapshot or self.learnt

    # ---------------------------------------------------------------- plans

    def take(self, plan: Plan) -> list[tuple[int, str]]:
        """A plan arrived: its intents become courses. Returns (vehicle, reason) of those it wants to send home."""
        now = self._clock.now()
        bridges = plan.revision == self._old_revision and not self._first_plan and not plan.error
        if self.task is None or not (plan.revision == self.task.revision or bridges):
            self.ignored += 1
            return []
        self._tell(plan.notes, now)
        for text, well in plan.news[:MOST_NOTES]:
            self._say(clean(text), NOTICE if well else WARNING)
        if plan.error:
            self._take_failure(plan)
            return []
        self._arrivals.append(now)
        if len(self._arrivals) == MAX_PLANS_PER_S and now - self._arrivals[0] < 1.0:
            self._guard.veto("rate", f"more than {MAX_PLANS_PER_S} plans a second")
            return []
        if problem := too_many(plan, len(self.task.members)):
            self._guard.veto("intents", problem)
            self._fault(f"planner {self.team.planner}: {problem}: its plan is not taken")
            return []
        if bridges:
            return self._intents.carry_out(self._bridged(plan), self.task.limits)
        if not self._first_plan:
            self._end_old_courses(plan)
        self._take_numbers(plan, now)
        return self._intents.carry_out(plan, self.task.limits)

    def _tell(self, notes: Sequence[str], now: float) -> None:
        """What a planner or its host has to say; who says too much is not listened to, and that is said."""
        self._may_say = min(float(MOST_NOTES), self._may_say + NOTES_PER_S * (now - self._spoke_s))
        self._spoke_s = now
        for note in notes:
            if self._may_say < 1.0:
                self.unsaid += 1
                self._say(f"planner {self.team.planner}: says too much: notes are left out", WARNING, every_s=60.0)
            elif self._say(clean(note), WARNING, every_s=60.0):
                self._may_say -= 1.0

    def _bridged(self, plan: Plan) -> Plan:
        """A plan of the older task: whom the new one stopped is not moved, and its slots are not those of the new one.

        Flown on eight real ArduCopters: a round was said to be all on slot 1 s after it began, 23 s too early.
        """
        ours = set(self._flights.members(self.team.name)) - self._stopped  # some may be in another team by now
        moved = (intent for intent in plan.intents if intent.vehicle in ours)
        going_on = tuple(msgspec.structs.replace(intent, joined=False) for intent in moved)
        return msgspec.structs.replace(plan, intents=going_on)

    def _take_numbers(self, plan: Plan, now: float) -> None:
        self.error, self.quarantined = "", False  # a version of its file that was saved may mend it
        self._plan_s, self._first_plan, self._configured = now, True, True
        self.rate_hz = min(max(plan.rate_hz, SLOWEST_HZ), FASTEST_HZ) if math.isfinite(plan.rate_hz) else SLOWEST_HZ
        late = self._judge_steps and plan.step_ms > 1e3 / self.rate_hz
        self._late_in_a_row = self._late_in_a_row + 1 if late else 0
        self._step_ms = plan.step_ms
        if plan.annotations is not None:
            self.annotations = shown(plan.annotations)
        self.metrics = {clean(k, MAX_NAME_CELLS): v for k, v in sorted(plan.metrics.items())[:MOST_METRICS]}
        if plan.snapshot is not None and len(plan.snapshot) <= MAX_SNAPSHOT_BYTES:
            self.snapshot = plan.snapshot
        if plan.learnt is not None and len(plan.learnt) <= MOST_LEARNT_BYTES:
            self.learnt = plan.learnt

    def _end_old_courses(self, plan: Plan) -> None:
        """The first plan of a task: whom it does not name does not fly on for the older one."""
        named = {intent.vehicle for intent in plan.intents}
        for flight in self._flying():
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if flight.course is not None and flight.vehicle not in named and vehicle is not None:
                flight.course = None
                self._steering.hold(vehicle)
        self._stopped.clear()

    def _take_failure(self, plan: Plan) -> None:
        lines = [clean(line, MAX_TRACE_CELLS) for line in plan.error.strip().splitlines()[-MAX_TRACE_LINES:]]
        last_line = lines[-1] if lines else clean("it does not say why")
        what = {"restarts": "; it is begun anew", "quarantined": "; it is left alone until you change something"}
        if (last_line, plan.fate) != (self.error, "quarantined" if self.quarantined else ""):
            # it says so with every plan: told once
            self._journal.write({"planner_failed": self.team.name, "fate": plan.fate, "trace": lines})
            self._fault(f"planner {self.team.planner} failed: {last_line}{what.get(plan.fate, '')}")
        self.error, self.trace = last_line, "\n".join(lines)
        if plan.fate == "restarts":
            self._task_s = self._begun_s = self._clock.now()
            self._first_plan = self._configured = False
            self.error = ""
        elif plan.fate == "quarantined":
            self.quarantined, self._configured = True, True

    # ---------------------------------------------------------------- judging

    def tick(self) -> list[int]:
        """Vehicles that must hold now because their planner does not answer; told as an alarm."""
        flying = self._flying()
        if self.task is None:
            return []
        if not self._first_plan:
            self._stop_vetoed(flying)
        if self.quarantined:
            return [flight.vehicle for flight in flying]
        now = self._clock.now()
        late = self._late_in_a_row >= LATE_IN_A_ROW
        if self.worker_alive and ((late and flying) or self._is_stuck(now)):
            self.kill_wanted = True
        if not flying:
            if self.kill_wanted and self.worker_alive:
                self._say("planner worker does not answer: it is ended and started anew", WARNING, every_s=30.0)
            return []
        since = max(self._plan_s, min(f.since_s for f in flying))
        configuring = not self._first_plan
        silent = now - (max(self._task_s, since) if configuring else since) > (CONFIGURE_S if configuring else SILENT_S)
        if silent or late:
            what = f"silent for {now - since:.1f} s"
            if not silent:
                took = f"a step takes {self._step_ms:.0f} ms, may take {1e3 / self.rate_hz:.0f}"
                what = f"late {LATE_IN_A_ROW} times in a row ({took})"
            self._late_in_a_row = 0
            self._fault(f"planner {self.team.planner} {what}: {len(flying)} vehicles hold")
            return [flight.vehicle for flight in flying]
        return []

    def _is_stuck(self, now: float) -> bool:
        """Its worker is there and says nothing for longer than it may."""
        if self._configured:
            return now - max(self._plan_s, self._begun_s) > SILENT_S
        return now - self._begun_s > CONFIGURE_S

    def _stop_vetoed(self, flying: list[Flight]) -> None:
        """A course of an older task that the guard vetoed ends: it is not taken up again where it leads back in."""
        for flight in flying:
            if flight.course is not None and flight.vetoed:
                flight.course = None
                self._stopped.add(flight.vehicle)

    def measure(self) -> None:
        """Mark what the team's vehicles see now."""
        if self.measured is None:
            return
        places = [
            vehicle.telemetry.position_m[:2]
            for flight in self._flying()
            if (vehicle := self._fleet.vehicles.get(flight.vehicle)) is not None and vehicle.telemetry.has_position()
        ]
        if not self._told_on_slot and self.all_on_slot():
            self._told_on_slot = True
            self._say(f"all {len(places)} on their slots over {self.team.zone}", NOTICE)
        self.measured.update(self._clock.now(), places)

    def on_alive(self, alive: bool) -> None:
        """The worker process came or went."""
        if alive != self.worker_alive:
            word = "planner worker is there" if alive else "planner worker is GONE"
            self._say(word, NOTICE if alive else (ALERT if self._flying() else WARNING))
        if alive:
            self._begun_s, self._configured = self._clock.now(), False
        self.worker_alive, self.kill_wanted = alive, False

    # ---------------------------------------------------------------- status

    def status(self) -> TeamStatus:
        """For the screens."""
        now = self._clock.now()
        flying, members = self._flying(), self._flights.members(self.team.name)
        up = any(flight.team == self.team.name for flight in self._flights.in_phase(*IN_THE_AIR))
        measured = self.measured
        served_by = serving(len(flying), sum(flight.waits for flight in flying))
        bound = measured.bound_s(served_by or len(members)) if measured else math.nan
        worst = measured.worst_s if measured and up else math.nan
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
            average_idleness_s=measured.average_s if measured and up else math.nan,
            coverage=measured.coverage if measured else 0.0,
            bound_s=bound,
            ratio=worst / bound if bound and flying else math.nan,
            metrics=self.metrics,
            error=self.trace or self.error,
            reserve=len(flying) - served_by,
        )

    def on_slot(self) -> int:
        """How many vehicles are on their slot: joined by the planner's word and within 5 m by ours, or in reserve."""
        return sum(1 for flight in self._flying() if self.is_on_slot(flight))

    def is_on_slot(self, flight: Flight) -> bool:
        """Whether this vehicle is on its slot now."""
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

    def worker_state(self) -> WorkerState:
        """How its worker is doing, as `TeamStatus.worker`."""
        return self._worker_state(self._clock.now(), self._flying())

    def _worker_state(self, now: float, flying: list[Flight]) -> WorkerState:
        if self.quarantined:
            return "quarantined"
        age = now - self._plan_s
        if not self._first_plan or age > SILENT_S:
            if not self.worker_alive:
                return "dead" if self.fault_count or self._arrivals else "absent"
            begun_anew = not self._configured  # who resumes now is held again, 2 s later
            return "late" if self._first_plan and (flying or begun_anew) else "ready"
        return "late" if age > max(LATE_IN_A_ROW / self.rate_hz, LATE_SHOWN_S) else "running"

    def _rate(self, now: float) -> float:
        """Plans per second of the last two seconds."""
        recent = [t for t in self._arrivals if now - t <= 2.0]
        span_s = recent[-1] - recent[0] if len(recent) > 2 else 0.0
        return round((len(recent) - 1) / span_s, 1) if span_s > 0 else 0.0

    def _flying(self) -> list[Flight]:
        return [f for f in self._flights.in_phase(Phase.FLYING) if f.team == self.team.name]

    def _fault(self, text: str) -> None:
        self.fault_count += 1
        self._say(text, ALERT, every_s=5)

    def _say(self, text: str, severity: int, every_s: float = 0.0) -> bool:
        return self._events.say(EventClass.PLANNER, f"planner {self.team.name}", text, severity, every_s=every_s)
