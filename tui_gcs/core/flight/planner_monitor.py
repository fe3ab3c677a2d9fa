"""Watchdog of one team's planner: is its worker process there, does it answer in time, did it fail?

The station never waits for a planner. One that is silent for `SILENT_S` while its vehicles fly, or late `LATE_IN_A_ROW`
times in a row, has its vehicles held (`TeamController.tick`, `Station._steer`). Its worker process is ended and started
again by `core/process/planner_workers.py`, which `kill_wanted` requests. While a worker gets no CPU time, its last plan
is flown to its end instead, for `CONFIGURE_S` at most.
"""

import math
from collections import deque
from typing import Literal

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.common import TeamPlan

SILENT_S = 2.0
"""A planner that sends no plan for this long while its vehicles fly is taken for dead: they hold."""
LATE_IN_A_ROW = 3
"""So many steps in a row that took longer than the planner's period count as a fault; one or two do not."""
LATE_SHOWN_S = 0.6
"""A plan is shown as late only when it is older than this, however fast its planner is meant to be."""
CONFIGURE_S = 20.0
"""A planner may need this long for its first plan of a new task; its vehicles end their courses meanwhile."""
BUSY_SHARE = 0.5
"""A worker that has waited for a processor for this share of the time is not judged by that time: the computer is too
busy."""
MIN_RATE_HZ, MAX_RATE_HZ = 1.0, 20.0
"""Limits of how often a planner steps."""
MAX_PLANS_PER_S = 25
"""Plans above this rate are refused: no planner steps faster than `MAX_RATE_HZ`, a wrong one may send without end."""

WorkerState = Literal["absent", "ready", "running", "late", "dead", "quarantined"]


class PlannerMonitor:
    """What is known of one team's planner and its worker process."""

    def __init__(self, clock: Clock, *, check_step_time: bool) -> None:
        """`check_step_time`: whether `TeamPlan.step_ms` counts: not in lock-step, where wall time means nothing."""
        self.worker_alive = False
        self.fault_count = 0
        self.error = ""
        """Why the planner cannot plan its present task, in one line; empty if it can."""
        self.trace = ""
        """The lines of its last failure."""
        self.quarantined = False
        """It failed twice and is not started again until the operator changes something."""
        self.kill_wanted = False
        """Its worker does not answer in time: the supervisor of the workers is to end it and start another."""
        self.rate_hz = 5.0
        """How often the planner steps, as it declares."""
        self.has_planned = False
        """A plan for the present task has arrived."""
        self._clock = clock
        self._check_step_time = check_step_time
        self._plan_s = self._task_s = self._configuring_s = -math.inf
        self._configured = False
        """This worker has sent a plan or a failure since it came, or since its present task."""
        self._late_in_a_row = 0
        self._step_ms = 0.0
        self._waited_s = self._waited_before_s = 0.0
        """How long the worker has waited for a processor by now, and had when it was last heard or begun."""
        self._arrivals: deque[float] = deque(maxlen=MAX_PLANS_PER_S)

    def on_cpu_wait(self, waited_s: float) -> None:
        """The worker has waited for a processor for so long in all; a new worker begins at 0."""
        if waited_s < self._waited_s:
            self._waited_before_s = 0.0
        self._waited_s = waited_s

    @property
    def is_starved(self) -> bool:
        """Whether no plan has come for a while because the worker gets no CPU time."""
        since_s = max(self._plan_s, self._configuring_s)
        silent_s = self._clock.now() - since_s
        return silent_s > LATE_SHOWN_S and self._waited_s - self._waited_before_s > BUSY_SHARE * silent_s

    def _given_s(self, since_s: float) -> float:
        """The time since then without that in which the worker waited for a processor."""
        return self._clock.now() - since_s - (self._waited_s - self._waited_before_s)

    @property
    def plan_age_s(self) -> float:
        """Seconds since the newest plan of the present task; NaN before the first one."""
        return round(self._clock.now() - self._plan_s, 2) if self.has_planned else math.nan

    def on_task(self) -> None:
        """A new task was given: all that is known of the planner's state belongs to the older one."""
        self.error, self.trace, self.quarantined = "", "", False
        self._task_s = self._configuring_s = self._clock.now()
        self._waited_before_s = self._waited_s
        self.has_planned, self._configured, self._late_in_a_row = False, False, 0

    def on_alive(self, alive: bool) -> None:
        """The worker process came or went."""
        if alive:
            self._configuring_s, self._configured = self._clock.now(), False
            self._waited_before_s = self._waited_s
        self.worker_alive, self.kill_wanted = alive, False

    def exceeds_rate(self) -> bool:
        """Note that a plan arrived; whether more than `MAX_PLANS_PER_S` did within the last second."""
        now = self._clock.now()
        self._arrivals.append(now)
        return len(self._arrivals) == MAX_PLANS_PER_S and now - self._arrivals[0] < 1.0

    def on_plan(self, plan: TeamPlan) -> None:
        """A plan for the present task is taken."""
        self.error, self.quarantined = "", False  # a newer version of its file may have mended it
        self._plan_s, self.has_planned, self._configured = self._clock.now(), True, True
        self.rate_hz = min(max(plan.rate_hz, MIN_RATE_HZ), MAX_RATE_HZ) if math.isfinite(plan.rate_hz) else MIN_RATE_HZ
        # A step takes long on a busy computer, too: what counts is the time that the worker was given for it.
        waited_ms = 1e3 * (self._waited_s - self._waited_before_s)
        self._waited_before_s = self._waited_s
        late = self._check_step_time and plan.step_ms - waited_ms > 1e3 / self.rate_hz
        self._late_in_a_row = self._late_in_a_row + 1 if late else 0
        self._step_ms = plan.step_ms

    def on_failure(self, error: str, trace: str, fate: str) -> None:
        """The planner raised `error`; its host begins it again (`fate` "restarts") or leaves it ("quarantined")."""
        self.error, self.trace = error, trace
        if fate == "restarts":
            self._task_s = self._configuring_s = self._clock.now()
            self.has_planned = self._configured = False
            self.error = ""
        elif fate == "quarantined":
            self.quarantined, self._configured = True, True

    def check_worker(self, *, flying: bool) -> None:
        """Set `kill_wanted` where the worker is late while vehicles fly, or has been silent for too long."""
        if self.worker_alive and ((self._is_late and flying) or self._is_stuck()):
            self.kill_wanted = True

    def overdue(self, flying_since_s: float, plan_ends_s: float = -math.inf) -> str:
        """Why the vehicles, the first of which has flown since then, must hold; "" if the planner is in time.

        The last plan of a worker without CPU time is flown until `plan_ends_s`, when the first of its courses ends.
        """
        now = self._clock.now()
        since = max(self._plan_s, flying_since_s)
        begin_s, limit_s = (since, SILENT_S) if self.has_planned else (max(self._task_s, since), CONFIGURE_S)
        silent = now - begin_s > limit_s and not (self.is_starved and now < min(plan_ends_s, begin_s + CONFIGURE_S))
        if not silent and not self._is_late:
            return ""
        why = f"silent for {now - since:.1f} s"
        if not silent:
            took = f"a step takes {self._step_ms:.0f} ms, may take {1e3 / self.rate_hz:.0f}"
            why = f"late {LATE_IN_A_ROW} times in a row ({took})"
        self._late_in_a_row = 0
        return why

    def worker_state(self, *, flying: bool) -> WorkerState:
        """The worker's state as `TeamStatus.worker` shows it; `flying`: whether vehicles fly for the planner."""
        if self.quarantined:
            return "quarantined"
        age = self._clock.now() - self._plan_s
        if not self.has_planned or age > SILENT_S:
            if not self.worker_alive:
                return "dead" if self.fault_count or self._arrivals else "absent"
            # Resumed now, its vehicles would be held again 2 s later: it is late even while none flies.
            begun_anew = not self._configured
            return "late" if self.has_planned and (flying or begun_anew) else "ready"
        return "late" if age > max(LATE_IN_A_ROW / self.rate_hz, LATE_SHOWN_S) else "running"

    def measured_rate_hz(self) -> float:
        """Plans per second over the last two seconds."""
        now = self._clock.now()
        recent = [t for t in self._arrivals if now - t <= 2.0]
        span_s = recent[-1] - recent[0] if len(recent) > 2 else 0.0
        return round((len(recent) - 1) / span_s, 1) if span_s > 0 else 0.0

    @property
    def _is_late(self) -> bool:
        return self._late_in_a_row >= LATE_IN_A_ROW

    def _is_stuck(self) -> bool:
        """Whether the worker has been silent for longer than it may, planning or configuring."""
        if self._configured:
            return self._given_s(max(self._plan_s, self._configuring_s)) > SILENT_S
        return self._given_s(self._configuring_s) > CONFIGURE_S
