"""Hosts one planner for one team: loads it, feeds it fleet frames, turns what it wants into a `Plan`.

No bus, no clock, no process here: the worker process and lock-step runs use the same host.

A planner that fails in a step is begun anew once, from its last snapshot; when it fails again it is left alone until
the operator changes something (a new task comes).
"""

import gc
import math
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from zlib import crc32

import msgspec
import numpy as np

from tui_gcs.core.protocol.common import (
    FleetFrame,
    Plan,
    PlannerInfo,
    PlannerTask,
    decode,
    encode,
)
from tui_gcs.core.protocol.plan_limits import MAX_ANNOTATIONS, MAX_NOTES, most_intents, too_large, too_many
from tui_gcs.planner.api import Context, Output, Planner
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime import snapshot_cache as keeping
from tui_gcs.planner.runtime.message_conversion import plain_annotation, plain_intent, team_view, tracks_view
from tui_gcs.planner.runtime.planner_errors import PlannerError, is_meant, is_operators, last_line
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.team_changes import Changes
from tui_gcs.planner.runtime.work_budget import SLOW_SHARE, Pace

DEADLINE_SHARE = 0.5
"""A step may take this share of the period; longer is late."""
EARLY_S = 0.02
"""A step may come this much before its time, so that 10 Hz frames give 5 Hz steps in spite of jitter."""
SNAPSHOT_S = 2.0
"""A snapshot is taken so often."""
MOST_GRANTED_S = 1.0
"""Iterations of at most so much mission time are granted at once, however many frames were dropped."""
MOST_TRACE_CHARS, MOST_NOTE_CHARS = 4000, 400


@dataclass
class Job:
    """One task being worked on."""

    task: PlannerTask
    rng: np.random.Generator
    planner: Planner | None = None
    error: str = ""
    """Why it cannot plan, until the next task."""
    refuses: bool = False
    """It says so itself: the task cannot be done."""
    started: bool = False
    restarted: bool = False
    """It failed once already."""
    restart_due: bool = False
    changes: Changes = field(default_factory=Changes)
    credit: float = 0.0
    """Iterations not granted yet: less than one."""
    stepped_s: float = math.nan
    kept: bytes = b""
    kept_s: float = -math.inf
    notes: list[str] = field(default_factory=list)
    news: list[tuple[str, bool]] = field(default_factory=list)
    declares: PlannerInfo | None = None
    """Said with every plan: of a file that was saved."""


class PlannerHost:
    """Steps the planner of one team."""

    def __init__(self, team: str, files: Mapping[str, PlannerFile] | None = None) -> None:
        """A host without a task does nothing. `files`: planners in files of their own, by name."""
        self.team = team
        self.files = files or {}
        self.pace: Pace | None = None
        """Of a worker in the air; without one all work is done, however long it takes."""
        self.searches = True
        """False: no background work is granted, only what a step needs."""
        self._job: Job | None = None
        self._next_s = -np.inf
        self._seq = 0

    @property
    def revision(self) -> int:
        """Revision of the present task, -1 without one."""
        return self._job.task.revision if self._job else -1

    @property
    def problem(self) -> str:
        """Why the planner cannot work on the present task (a traceback, or one line), "" if it can."""
        return self._job.error if self._job else ""

    @property
    def refuses(self) -> bool:
        """Whether `problem` is what the planner's author wrote for the operator, and no mistake."""
        return self._job is not None and self._job.refuses

    @property
    def rate_hz(self) -> float:
        """Steps per second of the present planner."""
        planner = self._job.planner if self._job else None
        return _within(planner.rate_hz, *registry.RATE_HZ, Planner.rate_hz) if planner else Planner.rate_hz

    # ---------------------------------------------------------------- tasks

    def set_task(self, task: PlannerTask, snapshot: bytes = b"") -> None:
        """Take a task: check parameters, load and configure its planner. Errors are told in the next plans.

        The same task again changes nothing, so that a slot is not lost because a task was repeated. With a
        `snapshot` of the same planner and task it goes on from there.

        Raises:
            ValueError: the task is another team's.
        """
        if self._job and msgspec.structs.replace(task, t_s=self._job.task.t_s) == self._job.task:
            return
        self.adopt(self.prepare(task, snapshot))

    def prepare(self, task: PlannerTask, snapshot: bytes = b"") -> Job:
        """Load and configure the planner of a task, for `adopt`. Slow; nothing of this host changes meanwhile.

        Raises:
            ValueError: the task is another team's.
        """
        if task.team != self.team:
            raise ValueError(f"this is the planner host of team {self.team!r}, the task is of {task.team!r}")
        job = self._configured(task)
        if snapshot and job.planner is not None:
            job = self._went_on(job, job.planner, snapshot)
        return job

    def _went_on(self, job: Job, planner: Planner, snapshot: bytes) -> Job:
        """The job with what was kept, or begun anew without: its vehicles are to fly in any case."""
        found = keeping.of_kind(snapshot, planner)
        if isinstance(found, str):
            job.notes.append(f"begins anew: the snapshot {found}")
            return job
        if found.data and found.task == keeping.digest(job.task):
            what, error = "restore failed", self._restored(job, planner, found)
        else:
            job.notes += ["begins anew: the snapshot is of another task"] if found.data else []
            what, error = "what was learnt is of no use", self._inherited(planner, found.learnt)
        if error:
            job = self._configured(job.task)
            job.notes.append(f"begins anew: {what}: {last_line(error)}")
        return job

    def adopt(self, job: Job) -> None:
        """Work on this from the next step on."""
        if self._job is not None and self._job.planner is not None and not self._job.restart_due:
            self._stop(self._job.planner)
            self._hand_on(self._job.planner, job)
        self._job = job
        self._next_s = -np.inf

    def _hand_on(self, before: Planner, job: Job) -> None:
        """Let a new task's planner know what the one before has learnt."""
        after, learnt = job.planner, list[bytes]()
        if after is None or job.started or type(after) is not type(before):
            return
        if error := self._guarded(lambda: learnt.append(keeping.learnt_by(before))):
            job.notes.append(f"begins anew: what it learnt is lost: {last_line(error)}")
            return
        self._inherit(job, learnt[0])

    def inherit(self, snapshot: bytes) -> None:
        """Let the planner of a task that has not begun know what another one had learnt when this was taken."""
        job = self._present()
        if job.planner is None or job.started:
            return
        found = keeping.of_kind(snapshot, job.planner)
        if isinstance(found, keeping.Kept):
            self._inherit(job, found.learnt)

    def _inherit(self, job: Job, learnt: bytes) -> None:
        if job.planner is not None and (error := self._inherited(job.planner, learnt)):
            job.error, job.planner = error, None

    def _inherited(self, planner: Planner, learnt: bytes) -> str:
        """Let it know what was learnt; the traceback if it cannot take that."""
        return self._guarded(lambda: planner.inherit(learnt)) if learnt else ""

    def _stop(self, planner: Planner) -> None:
        self._guarded(lambda: planner.stop("new task"))

    @property
    def restart_due(self) -> bool:
        """The planner failed, and is to be begun anew before the next step."""
        return self._job is not None and self._job.restart_due

    def prepare_restart(self) -> Job:
        """The failed planner anew, from its last snapshot, for `adopt`. Slow, as `prepare`."""
        failed = self._present()
        job = self.prepare(failed.task, failed.kept)
        job.restarted = True
        return job

    def _present(self) -> Job:
        if self._job is None:
            raise RuntimeError(f"planner host of team {self.team!r} has no task")
        return self._job

    def snapshot(self) -> bytes:
        """What another host needs to go on from here (`set_task`), taken now; b"" if the planner keeps nothing.

        Raises:
            ValueError: its snapshot is no bytes, or too many. Anything else may come out of the planner, too.
        """
        job = self._job
        if job is None or job.planner is None or not job.started:
            return b""
        return keeping.pack(job.planner, job.task, job.stepped_s, job.rng, job.changes, job.credit)

    def _configured(self, task: PlannerTask) -> Job:
        seed = np.random.SeedSequence([task.seed % 2**63, crc32(self.team.encode())])
        job = Job(task, np.random.default_rng(seed))
        made: list[Planner] = []

        def make() -> None:
            try:
                kind = registry.load(task.planner, self.files)
                params = registry.checked(task.planner, kind.params, task.parameters)
            except PlannerError as problem:
                job.error = str(problem)
                return
            planner = kind()
            try:
                planner.configure(task, params, job.rng)
            except ValueError as error:
                job.refuses = is_meant(error, kind)
                words = " ".join(str(error).split()) if job.refuses else ""
                if not words:
                    raise
                job.error = words  # the author's, for the operator; where they stand is nothing to him
                return
            made.append(planner)

        job.error = self._guarded(make) or job.error
        job.planner = made[0] if made else None
        return job

    def _restored(self, job: Job, planner: Planner, found: keeping.Kept) -> str:
        """Let the planner go on from what was kept; the traceback if it cannot."""
        if error := self._guarded(lambda: planner.restore(found.data)):
            return error
        job.rng.bit_generator.state = keeping.rng_state(found)
        job.changes.state, job.changes.low, job.changes.begun = dict(found.state), list(found.low), True
        job.started, job.stepped_s, job.credit = True, found.t_s, found.credit
        job.kept, job.kept_s = encode(found), found.t_s
        return ""

    # ---------------------------------------------------------------- steps

    @property
    def due_s(self) -> float:
        """The time from which on a frame should be stepped on; infinite without a task."""
        return self._next_s - EARLY_S if self._job is not None else math.inf

    def due(self, t_s: float) -> bool:
        """Whether a frame of time `t_s` should be stepped on. False without a task."""
        return t_s >= self.due_s

    def answer(self, frame: FleetFrame) -> bytes:
        """As `step`, as bytes for the bus; what cannot travel is an error of the planner, too."""
        plan, job = self.step(frame), self._present()
        members = len(job.task.members)
        try:
            data = encode(plan)
            problem = too_large(len(data), members) or too_many(plan, members)
            if not plan.error and not problem:
                decode(data, Plan)
        except Exception as error:  # noqa: BLE001 - the edge to foreign code: what it put in may be anything
            data, problem = b"", str(error)
        if problem:
            text = f"planner {job.task.planner!r}: its plan cannot be sent: {problem}"
            data = encode(self._failed(job, self._blank(job, frame), text))
        return data

    def step(self, frame: FleetFrame) -> Plan:
        """The planner's plan for this frame; an error in it is told in `Plan.error`.

        Raises:
            RuntimeError: there is no task yet.
        """
        if self.restart_due:
            self.adopt(self.prepare_restart())
        job = self._present()
        period_s = 1.0 / self.rate_hz
        late = frame.t_s - self._next_s > period_s
        self._next_s = frame.t_s + period_s if late else self._next_s + period_s
        begin_s, begin_cpu_s = time.perf_counter(), time.thread_time()
        with _without_collections():
            plan = self._plan(job, frame, period_s)
        took_s, cpu_s = time.perf_counter() - begin_s, time.thread_time() - begin_cpu_s
        if self.pace is not None and self.pace.took(took_s, period_s):
            why = "computer too busy: steps come first"
            if cpu_s > SLOW_SHARE * period_s:  # it would be as slow on a computer that does nothing else
                why = f"its steps take {took_s * 1e3:.0f} ms of {period_s * 1e3:.0f}"
            job.notes.append(f"{why}, background work is cut")
        return msgspec.structs.replace(plan, step_ms=took_s * 1e3)

    def _blank(self, job: Job, frame: FleetFrame) -> Plan:
        self._seq += 1
        notes, job.notes = tuple(job.notes), []
        news, job.news = tuple(job.news), []
        return Plan(
            self.team,
            job.task.revision,
            self._seq,
            frame.t_s,
            rate_hz=self.rate_hz,
            notes=notes,
            news=news,
            declares=job.declares,
        )

    def _plan(self, job: Job, frame: FleetFrame, period_s: float) -> Plan:
        planner = job.planner
        blank = self._blank(job, frame)
        if planner is None or job.error:
            return msgspec.structs.replace(blank, error=job.error, fate="quarantined")
        t_s, fleet = frame.t_s, team_view(frame, job.task)
        deadline_s = period_s * DEADLINE_SHARE
        iterations = self._granted(job, planner, t_s, period_s)
        context = Context(t_s, fleet, job.rng, iterations, deadline_s, tracks_view(frame), frame.wind_m_s)
        plans: list[Plan] = []

        def run() -> None:
            if not job.started:
                planner.start(t_s, fleet)
                job.started = True
            for event in job.changes.look(frame, job.task):
                planner.event(event)
            plans.append(_filled(blank, planner.step(context), job.task))

        if error := self._guarded(run):
            return self._failed(job, blank, error)
        return self._with_snapshot(job, planner, plans[0])

    def _granted(self, job: Job, planner: Planner, t_s: float, period_s: float) -> int:
        """Iterations for the mission time since the last step: as many in the end, however it was cut into steps."""
        since_s = period_s if math.isnan(job.stepped_s) else min(max(t_s - job.stepped_s, 0.0), MOST_GRANTED_S)
        job.stepped_s = t_s
        job.credit += _within(planner.iterations_per_s, 0.0, registry.MOST_ITERATIONS_PER_S, 0.0) * since_s
        whole = math.floor(job.credit + 1e-9)
        job.credit = max(job.credit - whole, 0.0)
        if not self.searches:
            return 0
        return whole if self.pace is None else math.floor(whole * self.pace.share)

    def _failed(self, job: Job, blank: Plan, error: str) -> Plan:
        """The first time it is begun anew before the next step, the second time it is left alone."""
        if job.restarted:
            job.error = error
            return msgspec.structs.replace(blank, error=error, fate="quarantined")
        job.restart_due = True
        return msgspec.structs.replace(blank, error=error, fate="restarts")

    def _with_snapshot(self, job: Job, planner: Planner, plan: Plan) -> Plan:
        if plan.t_s - job.kept_s < SNAPSHOT_S - EARLY_S:
            return plan
        job.kept_s = plan.t_s
        packed: list[bytes] = []

        def pack() -> None:
            packed.append(keeping.pack(planner, job.task, plan.t_s, job.rng, job.changes, job.credit))

        if error := self._guarded(pack):
            return msgspec.structs.replace(plan, notes=(*plan.notes, f"no snapshot: {last_line(error)}"))
        job.kept = packed[0]
        plan = msgspec.structs.replace(plan, snapshot=packed[0])
        if error := self._guarded(lambda: packed.append(keeping.pack_learnt(planner))):
            return msgspec.structs.replace(plan, notes=(*plan.notes, f"not kept: {last_line(error)}"))
        return msgspec.structs.replace(plan, learnt=packed[1])

    @staticmethod
    def _guarded(call: Callable[[], None]) -> str:
        """The traceback of `call`, "" if it went well. Planners are foreign code: anything may come out of them."""
        try:
            call()
        except BaseException as error:
            if is_operators(error):
                raise
            return _trace()
        return ""


@contextmanager
def _without_collections() -> Iterator[None]:
    """What a step makes lives until its plan is sent: to look through it for garbage meanwhile takes half of the time.

    With 250 vehicles whose ways are planned, 50 ms of one step in ten.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _within(value: object, least: float, most: float, otherwise: float) -> float:
    """A number of a planner, which may have put anything there since it was loaded."""
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        return otherwise
    return float(min(max(value, least), most))


def _trace() -> str:
    return traceback.format_exc(limit=8)[-MOST_TRACE_CHARS:]


def _filled(blank: Plan, output: object, task: PlannerTask) -> Plan:
    """The plan with what a step wants; of what is too many, one too many.

    Raises:
        TypeError, ValueError: it is no output.
    """
    if not isinstance(output, Output):
        raise TypeError(f"planner {task.planner!r}: step returned {type(output).__name__}, not Output")
    intents, drawn = islice(output.intents, most_intents(len(task.members)) + 1), output.annotations
    shown = None if drawn is None else tuple(map(plain_annotation, islice(drawn, MAX_ANNOTATIONS + 1)))
    return msgspec.structs.replace(
        blank,
        intents=tuple(map(plain_intent, intents)),
        annotations=shown,
        metrics={str(key): float(value) for key, value in output.metrics.items()},
        notes=(*blank.notes, *(str(note)[:MOST_NOTE_CHARS] for note in islice(output.notes, MAX_NOTES))),
    )
