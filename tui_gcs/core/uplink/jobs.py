"""Long exchanges with vehicles (plans, parameters, files, logs): one at a time per vehicle, few at a time per link.

A job is a small state machine; its own service begins it, ticks it and hands it what arrives. The queue decides when it
may begin: never two on one vehicle, for autopilots have one FTP session and one mission transfer, and at most
`MAX_PER_LINK` on one link, so that fifty vehicles do not download at once over one radio (docs/autopilots.md D). Long
jobs are counted by themselves: a plan does not wait for other vehicles' logs.
"""

from collections.abc import Callable
from enum import StrEnum
from typing import TypeVar

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass, Freshness
from tui_gcs.core.records.event_log import INFO, WARNING, EventLog

MAX_PER_LINK = 2
MAX_QUEUED = 1000
PAUSE_AFTER_S = 10.0
"""A job that can pause gives way after this long to another job of its vehicle."""
MAX_RUNNING_S = 1800.0
"""How long a job may run. 1400 parameters take some minutes over a radio that loses every third frame."""
MAX_LONG_RUNNING_S = 4 * 3600.0
"""The same for jobs that move megabytes; a vehicle may announce 4 GiB (docs/threats.md B.6-89)."""


class JobState(StrEnum):
    """Where a job is; the value is the operator's word."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class Job:
    """One long exchange with one vehicle. Subclasses override `begin`, `tick` and `abort`, and call `finish`."""

    waits_for_operator = False
    """It sends next to nothing and takes minutes (a calibration): it takes no other vehicle's place on its link."""

    takes_long = False
    """It moves megabytes, which takes minutes of a radio's time."""

    max_running_s = MAX_RUNNING_S
    """It ends after having run so long, its pauses not counted, unless it waits for the operator."""

    def __init__(self, vehicle: int, name: str, on_done: "Callable[[Job], None] | None" = None) -> None:
        """`name` is the operator's word for it, e.g. "mission upload"; `on_done` is called once, however it ends."""
        self.vehicle = vehicle
        self.name = name
        self.state = JobState.QUEUED
        self.done, self.total = 0, 0
        """Progress in whatever the job counts (items, bytes); a total of 0 is not known yet."""
        self.error = ""
        """Why it failed: one line for the operator."""
        self.link = ""
        """The link it began on."""
        self.begun_s = 0.0
        self.ran_s = 0.0
        """How long it ran before it was paused."""
        self.on_done = on_done

    @property
    def over(self) -> bool:
        """Whether it has ended, well or not."""
        return self.state not in (JobState.QUEUED, JobState.RUNNING)

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Its turn has come: send the first frame."""

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered, and give up in time."""

    def pause(self) -> bool:
        """End the exchange so that `begin` can take it up later; False for a job that cannot."""
        return False

    def abort(self) -> None:
        """It is cancelled while it runs.

        End the exchange with the vehicle, where the protocol has a message for that.
        """

    def finish(self, error: str = "") -> None:
        """End the job: done, or failed because of `error`."""
        if not self.over:
            self.state = JobState.FAILED if error else JobState.DONE
            self.error = error


J = TypeVar("J", bound=Job)


class JobQueue:
    """Lets jobs run, in order of submission."""

    def __init__(self, vehicles: dict[int, Vehicle], clock: Clock, events: EventLog) -> None:
        """`vehicles` is the fleet's own table."""
        self._vehicles = vehicles
        self._clock = clock
        self._events = events
        self._queue: list[Job] = []
        self._running: dict[int, Job] = {}

    def submit(self, job: J, *, first: bool = False) -> J:
        """Queue and return `job`; `first` puts it before all others, for the vehicle that an operator is looking at."""
        if len(self._queue) >= MAX_QUEUED:
            job.finish("too many transfers are waiting")
            self._over(job)
        else:
            self._queue.insert(0 if first else len(self._queue), job)
            self._begin_some()
        return job

    def running(self, vehicle: int) -> Job | None:
        """The job under way with a vehicle."""
        return self._running.get(vehicle)

    def under_way(self) -> list[Job]:
        """All jobs that run now."""
        return list(self._running.values())

    def jobs(self, vehicle: int) -> list[Job]:
        """The jobs that run and wait for a vehicle, in order."""
        running = self._running.get(vehicle)
        return ([running] if running is not None else []) + [job for job in self._queue if job.vehicle == vehicle]

    @property
    def busy(self) -> bool:
        """Whether answers are expected: the station then reads its links without delay."""
        return any(not job.waits_for_operator for job in self._running.values())

    def cancel(self, vehicle: int, name: str = "") -> int:
        """Cancel the jobs that run and wait for `vehicle` (all, or those called `name`); returns how many."""
        cancelled = [job for job in self.jobs(vehicle) if not job.over and (not name or job.name == name)]
        for job in cancelled:
            self._cancel(job)
        self._begin_some()
        return len(cancelled)

    def cancel_job(self, job: Job) -> None:
        """Cancel this job, if it runs or waits."""
        if not job.over:
            self._cancel(job)
            self._begin_some()

    def _cancel(self, job: Job) -> None:
        if job.state is JobState.RUNNING:
            job.abort()
        job.state, job.error = JobState.CANCELLED, "cancelled"
        self._over(job)

    def tick(self) -> None:
        """Move running jobs on, and begin those that may begin."""
        now = self._clock.now()
        for job in list(self._running.values()):
            vehicle = self._vehicles.get(job.vehicle)
            if not job.over:
                if vehicle is None or vehicle.freshness(now) is Freshness.LOST:
                    job.finish("the vehicle is LOST")
                else:
                    job.tick(vehicle, now)
            too_long = job.ran_s + now - job.begun_s > job.max_running_s and not job.waits_for_operator
            if too_long and not job.over:
                job.abort()
                job.finish(f"not complete after {_duration(job.max_running_s)}: begin it again")
            if job.over:
                self._over(job)
            elif now - job.begun_s >= PAUSE_AFTER_S:
                self._pause(job)
        self._begin_some()

    def _pause(self, job: Job) -> None:
        """Let a short job of the same vehicle go first, if the long one that runs can be taken up again."""
        # A vehicle may announce a log of 4 GiB: its parameters and missions cannot wait for that.
        others = [other for other in self._queue if other.vehicle == job.vehicle and not other.takes_long]
        if job.takes_long and others and job.pause():
            del self._running[job.vehicle]
            job.state = JobState.QUEUED
            job.ran_s += self._clock.now() - job.begun_s
            self._queue.append(job)

    def _begin_some(self) -> None:
        now = self._clock.now()
        for job in list(self._queue):
            vehicle = self._vehicles.get(job.vehicle)
            if vehicle is None or vehicle.freshness(now) is Freshness.LOST:
                job.finish("the vehicle is LOST" if vehicle is not None else "unknown vehicle")
                self._over(job)
            elif vehicle.path.high_latency:
                job.finish("heard over a high-latency link: commands only")
                self._over(job)
            elif not self._in_its_way(job, vehicle):
                self._queue.remove(job)
                self._running[job.vehicle] = job
                job.state, job.link, job.begun_s = JobState.RUNNING, vehicle.link, now
                job.begin(vehicle, now)

    def waits_for(self, job: Job) -> str:
        """Which jobs must be over before a queued one begins, e.g. "vehicle 3: download log 12 (34 %)"; "" if none."""
        vehicle = self._vehicles.get(job.vehicle)
        others = self._in_its_way(job, vehicle) if vehicle is not None and job.state is JobState.QUEUED else []
        return ", ".join(map(_far, others)) or ("others that wait, too" if job.state is JobState.QUEUED else "")

    def _in_its_way(self, job: Job, vehicle: Vehicle) -> list[Job]:
        """The running jobs that keep `job` from running."""
        mine = self._running.get(job.vehicle)
        if mine is not None:
            return [mine]
        on_link = [
            other
            for other in self._running.values()
            if other.link == vehicle.link and not other.waits_for_operator and other.takes_long == job.takes_long
        ]
        return [] if job.waits_for_operator or len(on_link) < MAX_PER_LINK else on_link

    def _over(self, job: Job) -> None:
        """Remove a job from the queue and report how it ended."""
        if job in self._queue:
            self._queue.remove(job)
        if self._running.get(job.vehicle) is job:
            del self._running[job.vehicle]
        good = job.state is JobState.DONE
        text = f"{job.name}: {job.state.value}" + (f" ({job.error})" if job.error else "")
        self._events.report(EventClass.MISSION, f"vehicle {job.vehicle}", text, INFO if good else WARNING)
        if job.on_done is not None:
            job.on_done(job)


def _duration(seconds: float) -> str:
    return f"{seconds / 3600:.0f} h" if seconds >= 3600 else f"{seconds / 60:.0f} min"


def _far(job: Job) -> str:
    how = f" ({100 * job.done // job.total} %)" if job.total else ""
    return f"vehicle {job.vehicle}: {job.name}{how}"
