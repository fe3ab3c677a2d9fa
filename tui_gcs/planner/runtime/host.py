"""Hosts one planner for one team: loads it, steps it on fleet frames, and makes a `TeamPlan` of its output.

The host has no bus, clock or process of its own: worker processes and lock-step runs use the same one. A planner that
fails in a step is restarted once from its last snapshot. After a second failure it stays stopped until a new task
comes.
"""

import gc
import math
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from typing import TypeVar
from zlib import crc32

import msgspec
import numpy as np

from tui_gcs.core.protocol.common import AnyFrame, PlannerInfo, PlannerTask, TeamPlan, decode, encode
from tui_gcs.core.protocol.plan_limits import MAX_ANNOTATIONS, MAX_NOTES, most_intents, too_large, too_many
from tui_gcs.planner.api import Context, Output, Planner
from tui_gcs.planner.runtime import registry, snapshot_cache
from tui_gcs.planner.runtime.message_conversion import (
    plain_annotation,
    plain_intent,
    points_view,
    team_view,
    tracks_view,
)
from tui_gcs.planner.runtime.per_vehicle import hosted
from tui_gcs.planner.runtime.planner_errors import PlannerError, is_keyboard_interrupt, is_refusal, last_line
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.team_changes import TeamChangeDetector
from tui_gcs.planner.runtime.work_budget import SLOW_SHARE, WorkBudget

T = TypeVar("T")

DEADLINE_SHARE = 0.5
"""A step should take at most this share of its period; a longer one is late."""
EARLY_S = 0.02
"""A step may come this much before its time, so that 10 Hz frames give 5 Hz steps in spite of jitter."""
SNAPSHOT_S = 2.0
"""Seconds between two snapshots of a planner."""
MAX_STEP_CPU_S, LONG_IN_A_ROW = 2.0, 3
"""So many steps in a row that each took more CPU time are a failure, also in a rehearsal, which waits for every step.

In flight the vehicles hold after 2 s without a plan, and the worker is ended (`planner_monitor.SILENT_S`). Planners
with background work are left out: a rehearsal grants all of it, and a flight on a slow computer less.
"""
MAX_GRANTED_S = 1.0
"""Iterations of at most this much mission time are granted at once, however many frames were dropped."""
MAX_TRACE_CHARS, MAX_NOTE_CHARS = 4000, 400
"""Longer tracebacks and notes are cut: both are sent to every console."""


@dataclass
class PlannerRun:
    """One planner working on one task."""

    task: PlannerTask
    rng: np.random.Generator
    planner: Planner | None = None
    error: str = ""
    """The reason why it cannot plan, until the next task."""
    refuses: bool = False
    """`error` is the planner's own refusal of the task, not a mistake."""
    started: bool = False
    restarted: bool = False
    """It has failed once already."""
    restart_due: bool = False
    """It failed and is to be restarted before the next step."""
    changes: TeamChangeDetector = field(default_factory=TeamChangeDetector)
    credit: float = 0.0
    """Fraction of an iteration that is not granted yet, less than one."""
    long_steps: int = 0
    """The latest steps in a row that each took more than `MAX_STEP_CPU_S`."""
    stepped_s: float = math.nan
    snapshot: bytes = b""
    snapshot_s: float = -math.inf
    """Time of `snapshot`, the latest one."""
    notes: list[str] = field(default_factory=list)
    news: list[tuple[str, bool]] = field(default_factory=list)
    """(text, whether it is good news) for the author of a watched planner file."""
    declares: PlannerInfo | None = None
    """New declarations of a file that was saved; sent with every plan."""


class PlannerHost:
    """Steps the planner of one team."""

    def __init__(self, team: str, files: Mapping[str, PlannerFile] | None = None) -> None:
        """Create a host without a task. `files` are planners in files of their own, by name."""
        self.team = team
        self.files = files or {}
        self.budget: WorkBudget | None = None
        """Limit of background work for a worker in flight; None grants all of it, however long it takes."""
        self.searches = True
        """False: no background work is granted, only what a step itself needs."""
        self.failure = ""
        """Traceback of the step that failed last, or why its plan could not be sent."""
        self._job: PlannerRun | None = None
        self._next_s = -np.inf
        self._seq = 0

    @property
    def revision(self) -> int:
        """Revision of the present task, -1 without one."""
        return self._job.task.revision if self._job else -1

    @property
    def problem(self) -> str:
        """The reason why the planner cannot work on the present task (a traceback or one line), "" if it can."""
        return self._job.error if self._job else ""

    @property
    def refuses(self) -> bool:
        """Whether `problem` is a refusal that the planner's author wrote for the operator, and no mistake."""
        return self._job is not None and self._job.refuses

    @property
    def rate_hz(self) -> float:
        """Steps per second of the present planner."""
        planner = self._job.planner if self._job else None
        return _clamped(planner.rate_hz, *registry.RATE_HZ, Planner.rate_hz) if planner else Planner.rate_hz

    def set_task(self, task: PlannerTask, snapshot: bytes = b"") -> None:
        """Take a task: check its parameters, load and configure its planner. The next plans report errors.

        The same task again changes nothing, so that a repeated task costs no slot. With a `snapshot` of the same
        planner and task the planner continues from there.

        Raises:
            ValueError: the task is another team's.
        """
        if self._job and msgspec.structs.replace(task, t_s=self._job.task.t_s) == self._job.task:
            return
        self.adopt(self.prepare(task, snapshot))

    def prepare(self, task: PlannerTask, snapshot: bytes = b"") -> PlannerRun:
        """Load and configure the planner of a task, for `adopt`. This is slow and changes nothing in this host.

        Raises:
            ValueError: the task is another team's.
        """
        if task.team != self.team:
            raise ValueError(f"this is the planner host of team {self.team!r}, the task is of {task.team!r}")
        job = self._configured(task)
        if snapshot and job.planner is not None:
            job = self._restored_run(job, job.planner, snapshot)
        return job

    def _restored_run(self, job: PlannerRun, planner: Planner, snapshot: bytes) -> PlannerRun:
        """Continue the run from a snapshot, or restart it without: its vehicles are to fly in any case."""
        found = snapshot_cache.unpack_for(snapshot, planner)
        if isinstance(found, str):
            job.notes.append(f"begins anew: the snapshot {found}")
            return job
        if found.data and found.task == snapshot_cache.task_digest(job.task):
            what, error = "restore failed", self._restored(job, planner, found)
        else:
            job.notes += ["begins anew: the snapshot is of another task"] if found.data else []
            what, error = "what was learnt is of no use", self._inherited(planner, found.learnt)
        if error:
            job = self._configured(job.task)
            job.notes.append(f"begins anew: {what}: {last_line(error)}")
        return job

    def adopt(self, job: PlannerRun) -> None:
        """Work on `job` from the next step on; the planner before it is stopped."""
        if self._job is not None and self._job.planner is not None and not self._job.restart_due:
            before = self._job.planner
            self._guarded(lambda: before.stop("new task"))
            self._hand_on(before, job)
        self._job = job
        self._next_s = -np.inf

    def _hand_on(self, before: Planner, job: PlannerRun) -> None:
        """Give a new task's planner what the planner of the task before has learnt."""
        after = job.planner
        if after is None or job.started or type(after) is not type(before):
            return
        learnt, error = self._guarded(lambda: snapshot_cache.learnt_bytes(before))
        if learnt is None:
            job.notes.append(f"begins anew: what it learnt is lost: {last_line(error)}")
        else:
            self._inherit(job, learnt)

    def inherit(self, snapshot: bytes) -> None:
        """Give a planner that has not started what another one had learnt when `snapshot` was taken."""
        job = self._present()
        if job.planner is None or job.started:
            return
        found = snapshot_cache.unpack_for(snapshot, job.planner)
        if isinstance(found, snapshot_cache.PlannerSnapshot):
            self._inherit(job, found.learnt)

    def _inherit(self, job: PlannerRun, learnt: bytes) -> None:
        if job.planner is not None and (error := self._inherited(job.planner, learnt)):
            job.error, job.planner = error, None

    def _inherited(self, planner: Planner, learnt: bytes) -> str:
        """Call the planner's `inherit`; return the traceback if that fails."""
        return self._guarded(lambda: planner.inherit(learnt))[1] if learnt else ""

    @property
    def restart_due(self) -> bool:
        """Whether the planner failed and is to be restarted before the next step."""
        return self._job is not None and self._job.restart_due

    def prepare_restart(self) -> PlannerRun:
        """Return the failed planner restarted from its last snapshot, for `adopt`. This is as slow as `prepare`."""
        failed = self._present()
        job = self.prepare(failed.task, failed.snapshot)
        job.restarted = True
        return job

    def _present(self) -> PlannerRun:
        if self._job is None:
            raise RuntimeError(f"planner host of team {self.team!r} has no task")
        return self._job

    def snapshot(self) -> bytes:
        """Return what another host needs to continue from here (`set_task`); b"" if the planner keeps nothing.

        Raises:
            ValueError: the snapshot is no bytes, or too large. The planner itself may raise anything.
        """
        job = self._job
        if job is None or job.planner is None or not job.started:
            return b""
        return snapshot_cache.pack(job.planner, job.task, job.stepped_s, job.rng, job.changes, job.credit)

    def _configured(self, task: PlannerTask) -> PlannerRun:
        # The team's name is part of the seed, so that two teams with one planner do not draw the same numbers. crc32,
        # because `hash` of a text differs from process to process.
        seed = np.random.SeedSequence([task.seed % 2**63, crc32(self.team.encode())])
        job = PlannerRun(task, np.random.default_rng(seed))

        def make() -> Planner | None:
            try:
                kind = registry.load(task.planner, self.files)
                params = registry.checked(task.planner, kind.params, task.parameters)
            except PlannerError as problem:
                job.error = str(problem)
                return None
            planner = hosted(kind, task)()
            try:
                planner.configure(task, params, job.rng)
            except ValueError as error:
                job.refuses = is_refusal(error, kind)
                words = " ".join(str(error).split()) if job.refuses else ""
                if not words:
                    raise
                job.error = words  # the author's, for the operator; where they stand is nothing to him
                return None
            return planner

        job.planner, error = self._guarded(make)
        job.error = error or job.error
        return job

    def _restored(self, job: PlannerRun, planner: Planner, found: snapshot_cache.PlannerSnapshot) -> str:
        """Restore the planner from a snapshot; return the traceback if that fails."""
        if error := self._guarded(lambda: planner.restore(found.data))[1]:
            return error
        job.rng.bit_generator.state = snapshot_cache.rng_state(found)
        job.changes.state, job.changes.low, job.changes.begun = dict(found.state), list(found.low), True
        job.started, job.stepped_s, job.credit = True, found.t_s, found.credit
        job.snapshot, job.snapshot_s = encode(found), found.t_s
        return ""

    @property
    def due_s(self) -> float:
        """The time from which a frame should be stepped on; infinite without a task."""
        return self._next_s - EARLY_S if self._job is not None else math.inf

    def due(self, t_s: float) -> bool:
        """Return whether a frame of time `t_s` should be stepped on. False without a task."""
        return t_s >= self.due_s

    def answer(self, frame: AnyFrame) -> bytes:
        """As `step`, encoded for the bus. A plan that cannot be encoded counts as a failure of the planner."""
        plan, job = self.step(frame), self._present()
        members = len(job.task.members)
        try:
            data = encode(plan)
            problem = too_large(len(data), members) or too_many(plan, members)
            if not plan.error and not problem:
                decode(data, TeamPlan)
        except Exception as error:  # noqa: BLE001 - the edge to foreign code: what it put in may be anything
            data, problem = b"", str(error) or type(error).__name__
        if problem:
            text = f"planner {job.task.planner!r}: its plan cannot be sent: {problem}"
            data = encode(self._failed(job, self._blank(job, frame), text))
        return data

    def step(self, frame: AnyFrame) -> TeamPlan:
        """Return the planner's plan for this frame; `TeamPlan.error` reports a failure.

        Raises:
            RuntimeError: there is no task yet.
        """
        if self.restart_due:
            self.adopt(self.prepare_restart())
        job = self._present()
        period_s = 1.0 / self.rate_hz
        late = frame.t_s - self._next_s > period_s
        # After a pause steps are counted anew: to catch up would make several steps in a row.
        self._next_s = frame.t_s + period_s if late else self._next_s + period_s
        begin_s, begin_cpu_s = time.perf_counter(), time.thread_time()
        # perf_counter is what the vehicles notice, thread_time what the planner itself used: the difference is a busy
        # computer.
        with _garbage_collection_paused():
            plan = self._plan(job, frame, period_s)
        took_s, cpu_s = time.perf_counter() - begin_s, time.thread_time() - begin_cpu_s
        if self.budget is not None and self.budget.took(took_s, period_s):
            why = "this computer is too busy"
            if cpu_s > SLOW_SHARE * period_s:  # it would be as slow on a computer that does nothing else
                why = f"its steps take {took_s * 1e3:.0f} ms of {period_s * 1e3:.0f}"
            job.notes.append(f"{why}: its vehicles fly on, no better plan is searched meanwhile")
        if not plan.error:
            plan = self._judged_by_cpu(job, plan, cpu_s)
        return msgspec.structs.replace(plan, step_ms=took_s * 1e3)

    def _judged_by_cpu(self, job: PlannerRun, plan: TeamPlan, cpu_s: float) -> TeamPlan:
        """Return the plan of a step that took so much CPU time, or a failure after too many long steps in a row."""
        planner = job.planner
        is_long = cpu_s > MAX_STEP_CPU_S and planner is not None and not planner.iterations_per_s
        job.long_steps = job.long_steps + 1 if is_long else 0
        if job.long_steps < LONG_IN_A_ROW:
            return plan
        text = (
            f"planner {job.task.planner!r}: {LONG_IN_A_ROW} steps in a row took more than {MAX_STEP_CPU_S:g} s of CPU "
            f"time, the last one {cpu_s:.1f} s: in flight its vehicles hold"
        )
        return self._failed(job, msgspec.structs.replace(plan, intents=(), annotations=None, metrics={}), text)

    def _blank(self, job: PlannerRun, frame: AnyFrame) -> TeamPlan:
        self._seq += 1
        notes, job.notes = tuple(job.notes), []
        news, job.news = tuple(job.news), []
        return TeamPlan(
            self.team,
            job.task.revision,
            self._seq,
            frame.t_s,
            rate_hz=self.rate_hz,
            notes=notes,
            news=news,
            declares=job.declares,
        )

    def _plan(self, job: PlannerRun, frame: AnyFrame, period_s: float) -> TeamPlan:
        planner = job.planner
        blank = self._blank(job, frame)
        if planner is None or job.error:
            return msgspec.structs.replace(blank, error=job.error, fate="quarantined")
        t_s, fleet = frame.t_s, team_view(frame, job.task)
        deadline_s = period_s * DEADLINE_SHARE
        iterations = self._granted(job, planner, t_s, period_s)
        tracks, wind_m_s, points = tracks_view(frame), frame.wind_m_s, points_view(frame, self.team)
        view = (fleet, job.rng, iterations, deadline_s, tracks, wind_m_s, job.task, points)
        context = Context(t_s, *view, keep_out=frame.keep_out)

        def run() -> TeamPlan:
            if not job.started:
                planner.start(t_s, fleet)
                job.started = True
            # Events before the step that sees them, in the same guarded call: an author's mistake in either restarts
            # the planner.
            for event in job.changes.update(frame, job.task):
                planner.event(event)
            return _filled(blank, planner.step(context), job.task)

        plan, error = self._guarded(run)
        return self._failed(job, blank, error) if plan is None else self._with_snapshot(job, planner, plan)

    def _granted(self, job: PlannerRun, planner: Planner, t_s: float, period_s: float) -> int:
        """Return iterations for the mission time since the last step.

        Their sum does not depend on the number of steps.
        """
        since_s = period_s if math.isnan(job.stepped_s) else min(max(t_s - job.stepped_s, 0.0), MAX_GRANTED_S)
        job.stepped_s = t_s
        job.credit += _clamped(planner.iterations_per_s, 0.0, registry.MAX_ITERATIONS_PER_S, 0.0) * since_s
        # 1e-9 against rounding: ten steps of 0.1 s must grant what one second does.
        whole = math.floor(job.credit + 1e-9)
        job.credit = max(job.credit - whole, 0.0)
        if not self.searches:
            return 0
        return whole if self.budget is None else math.floor(whole * self.budget.share)

    def _failed(self, job: PlannerRun, blank: TeamPlan, error: str) -> TeamPlan:
        """Mark a failed step: the first failure restarts the planner, the second one stops it."""
        self.failure = error
        # Once is allowed: what failed on a rare frame may go on from the snapshot. A second failure would only repeat.
        if job.restarted:
            job.error = error
            return msgspec.structs.replace(blank, error=error, fate="quarantined")
        job.restart_due = True
        return msgspec.structs.replace(blank, error=error, fate="restarts")

    def _with_snapshot(self, job: PlannerRun, planner: Planner, plan: TeamPlan) -> TeamPlan:
        if plan.t_s - job.snapshot_s < SNAPSHOT_S - EARLY_S:
            return plan
        job.snapshot_s = plan.t_s
        packed, error = self._guarded(
            lambda: snapshot_cache.pack(planner, job.task, plan.t_s, job.rng, job.changes, job.credit)
        )
        if packed is None:
            return msgspec.structs.replace(plan, notes=(*plan.notes, f"no snapshot: {last_line(error)}"))
        job.snapshot = packed
        plan = msgspec.structs.replace(plan, snapshot=packed)
        learnt, error = self._guarded(lambda: snapshot_cache.pack_learnt(planner))
        if learnt is None:
            return msgspec.structs.replace(plan, notes=(*plan.notes, f"not kept: {last_line(error)}"))
        return msgspec.structs.replace(plan, learnt=learnt)

    @staticmethod
    def _guarded(call: Callable[[], T]) -> tuple[T | None, str]:
        """Return (result of `call`, ""), or (None, traceback). Planners are foreign code and may raise anything."""
        try:
            return call(), ""
        except BaseException as error:
            if is_keyboard_interrupt(error):
                raise
            return None, traceback.format_exc(limit=8)[-MAX_TRACE_CHARS:]


@contextmanager
def _garbage_collection_paused() -> Iterator[None]:
    """Pause garbage collection during a step.

    A step's objects live until its plan is sent. With 250 planned vehicles, looking through them took 50 ms of one step
    in ten, half of its time.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _clamped(value: object, minimum: float, maximum: float, default: float) -> float:
    """Return a planner's number within bounds; the author may have put anything there since it was loaded."""
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        return default
    return float(min(max(value, minimum), maximum))


def _filled(blank: TeamPlan, output: object, task: PlannerTask) -> TeamPlan:
    """Return the plan with a step's output. One element too many of a long list is kept for the error text.

    Raises:
        TypeError, ValueError: the step did not return a valid Output.
    """
    if not isinstance(output, Output):
        raise TypeError(f"planner {task.planner!r}: step returned {type(output).__name__}, not Output")
    # An endless generator must not hang the host.
    intents, drawn = islice(output.intents, most_intents(len(task.members)) + 1), output.annotations
    shown = None if drawn is None else tuple(map(plain_annotation, islice(drawn, MAX_ANNOTATIONS + 1)))
    return msgspec.structs.replace(
        blank,
        intents=tuple(map(plain_intent, intents)),
        annotations=shown,
        metrics={str(key): float(value) for key, value in output.metrics.items()},
        notes=(*blank.notes, *(str(note)[:MAX_NOTE_CHARS] for note in islice(output.notes, MAX_NOTES))),
    )
