"""Hosts one planner for one team: loads it, feeds it fleet frames, turns what it wants into a `Plan`.

No bus, no clock, no process here: the worker process and lock-step runs use the same host.
"""

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from zlib import crc32

import msgspec
import numpy as np

from tui_gcs.core.bus import FLEET, PLAN, TASK, Bus, Closable
from tui_gcs.core.messages import FleetFrame, Freshness, Phase, Plan, PlannerTask, decode, encode
from tui_gcs.planner import registry
from tui_gcs.planner.api import Context, Fleet, Output, Planner, Tracks

DEADLINE_SHARE = 0.5
"""A step may take this share of the period; longer is late."""
EARLY_S = 0.02
"""A step may come this much before its time, so that 10 Hz frames give 5 Hz steps in spite of jitter."""


@dataclass
class _Job:
    """One task being worked on."""

    task: PlannerTask
    planner: Planner | None
    rng: np.random.Generator
    error: str = ""
    started: bool = False


class PlannerHost:
    """Steps the planner of one team."""

    def __init__(self, team: str) -> None:
        """A host without a task does nothing."""
        self.team = team
        self._job: _Job | None = None
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
    def rate_hz(self) -> float:
        """Steps per second of the present planner."""
        planner = self._job.planner if self._job else None
        return planner.rate_hz if planner else Planner.rate_hz

    def set_task(self, task: PlannerTask) -> None:
        """Take a task: check parameters, load and configure its planner. Errors are told in the next plans.

        The same task again changes nothing, so that a slot is not lost because a task was repeated.

        Raises:
            ValueError: the task is another team's.
        """
        if task.team != self.team:
            raise ValueError(f"this is the planner host of team {self.team!r}, the task is of {task.team!r}")
        if self._job and msgspec.structs.replace(task, t_s=self._job.task.t_s) == self._job.task:
            return
        if self._job and self._job.planner:
            self._guarded(self._job, lambda planner: planner.stop("new task"))
        seed = np.random.SeedSequence([task.seed % 2**63, crc32(self.team.encode())])
        self._job = job = _Job(task, None, np.random.default_rng(seed))
        self._next_s = -np.inf
        try:
            params = registry.complete(task.planner, task.parameters)
            job.planner = registry.load(task.planner)()
        except registry.PlannerError as problem:
            job.error = str(problem)
            return
        error = self._guarded(job, lambda planner: planner.configure(task, params, job.rng))
        if error:
            job.error, job.planner = error, None

    def due(self, t_s: float) -> bool:
        """Whether a frame of time `t_s` should be stepped on. False without a task."""
        return self._job is not None and t_s >= self._next_s - EARLY_S

    def step(self, frame: FleetFrame) -> Plan:
        """The planner's plan for this frame; an error in it is told in `Plan.error`.

        Raises:
            RuntimeError: there is no task yet.
        """
        job = self._job
        if job is None:
            raise RuntimeError(f"planner host of team {self.team!r} has no task")
        period_s = 1.0 / self.rate_hz
        late = frame.t_s - self._next_s > period_s
        self._next_s = frame.t_s + period_s if late else self._next_s + period_s
        begin_s = time.perf_counter()
        output = self._output(job, frame, period_s)
        step_ms = (time.perf_counter() - begin_s) * 1e3
        self._seq += 1
        plan = Plan(self.team, job.task.revision, self._seq, frame.t_s, step_ms=step_ms)
        if isinstance(output, str):
            return msgspec.structs.replace(plan, error=output)
        return msgspec.structs.replace(
            plan,
            intents=tuple(output.intents),
            annotations=None if output.annotations is None else tuple(output.annotations),
            metrics={name: float(value) for name, value in output.metrics.items()},
        )

    def _output(self, job: _Job, frame: FleetFrame, period_s: float) -> Output | str:
        """What the planner wants, or the text of its error. Configuration errors stay until the next task."""
        if job.planner is None:
            return job.error
        iterations = round(job.planner.iterations_per_s * period_s)
        t_s, fleet = frame.t_s, team_view(frame, job.task)
        deadline_s = period_s * DEADLINE_SHARE
        context = Context(t_s, fleet, job.rng, iterations, deadline_s, tracks_view(frame), frame.wind_m_s)
        outputs: list[Output] = []

        def run(planner: Planner) -> None:
            if not job.started:
                planner.start(t_s, fleet)
                job.started = True
            outputs.append(planner.step(context))

        error = self._guarded(job, run)
        if not error and not isinstance(outputs[0], Output):
            error = f"planner {job.task.planner!r}: step returned {type(outputs[0]).__name__}, not Output"
        return error or outputs[0]

    @staticmethod
    def _guarded(job: _Job, call: Callable[[Planner], None]) -> str:
        """The traceback of `call`, "" if it went well. Planners are foreign code: anything may come out of them."""
        try:
            if job.planner is not None:
                call(job.planner)
        except Exception:  # noqa: BLE001 - the edge to foreign code
            return traceback.format_exc(limit=8)
        return ""


def team_view(frame: FleetFrame, task: PlannerTask) -> Fleet:
    """The task's members in `frame`, ordered by id. A vehicle without a position is not active."""
    place = {vehicle: i for i, vehicle in enumerate(frame.ids)}
    ids = sorted(m for m in task.members if m in place)
    rows = [place[vehicle] for vehicle in ids]
    position = np.array([frame.position_m[i] for i in rows], dtype=float).reshape(-1, 3)
    flying = [frame.phase[i] == Phase.FLYING and frame.freshness[i] != Freshness.LOST for i in rows]
    return Fleet(
        id=np.array(ids, dtype=np.int64),
        active=np.array(flying, dtype=bool) & np.isfinite(position).all(axis=1),
        position_m=position,
        velocity_m_s=np.array([frame.velocity_m_s[i] for i in rows], dtype=float).reshape(-1, 3),
        heading_deg=np.array([frame.heading_deg[i] for i in rows], dtype=float),
        age_s=np.array([frame.age_s[i] for i in rows], dtype=float),
        layer_m=np.array([task.layers_m.get(vehicle, np.nan) for vehicle in ids], dtype=float),
        battery_pct=np.array([frame.battery_pct[i] for i in rows], dtype=float),
        held=np.array([frame.phase[i] == Phase.HOLDING for i in rows], dtype=bool),
    )


def tracks_view(frame: FleetFrame) -> Tracks:
    """The frame's tracks as struct of arrays, carried forward to its time."""
    tracks = frame.tracks
    age_s = np.array([frame.t_s - track.seen_s for track in tracks], dtype=float)
    velocity = np.array([track.velocity_m_s for track in tracks], dtype=float).reshape(-1, 3)
    position = np.array([track.position_m for track in tracks], dtype=float).reshape(-1, 3)
    cov = np.array([track.covariance_m2 for track in tracks], dtype=float).reshape(-1, 3)
    mean, half = (cov[:, 0] + cov[:, 2]) / 2, (cov[:, 0] - cov[:, 2]) / 2
    return Tracks(
        id=np.array([track.id for track in tracks], dtype=np.int64),
        position_m=position + velocity * age_s[:, None],
        velocity_m_s=velocity,
        sigma_m=np.sqrt(np.maximum(mean + np.hypot(half, cov[:, 1]), 0.0)),
        age_s=age_s,
        confirmed=np.array([track.confirmed for track in tracks], dtype=bool),
        seen_by=tuple(track.seen_by for track in tracks),
    )


def attach(host: PlannerHost, bus: Bus) -> Closable:
    """Run `host` on the caller's stack: steps on fleet frames and publishes plans (lock-step runs)."""

    def on_task(_key: str, payload: bytes) -> None:
        host.set_task(decode(payload, PlannerTask))

    def on_fleet(_key: str, payload: bytes) -> None:
        frame = decode(payload, FleetFrame)
        if host.due(frame.t_s):
            bus.publish(PLAN.format(team=host.team), encode(host.step(frame)))

    return _Attached(bus.subscribe(TASK.format(team=host.team), on_task), bus.subscribe(FLEET, on_fleet))


class _Attached:
    """Two subscriptions closed as one."""

    def __init__(self, *parts: Closable) -> None:
        self._parts = parts

    def close(self) -> None:
        for part in self._parts:
            part.close()
