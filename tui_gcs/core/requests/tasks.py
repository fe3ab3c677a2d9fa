"""Tasks: requests about a vehicle that take time, each with a number. They go on when their client is gone."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.services import TaskInfo, TaskResult
from tui_gcs.core.uplink.jobs import Job, JobQueue, JobState

MAX_TASKS = 500
MAX_RESULTS = 50
"""How many results are kept: one may be a file list or a thousand parameters; those of older tasks are dropped."""


MAX_NOTES = 30
"""How many of the vehicle's texts one answer holds, the newest."""


@dataclass(frozen=True)
class Guidance:
    """What the operator of a guided task reads, see `TaskInfo`."""

    prompt: str = ""
    waits: bool = False
    lines: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class Task:
    """One request, carried out for one vehicle."""

    def __init__(self, number: int, vehicle: int, what: str, who: str, began_s: float) -> None:
        """The task runs from now on; the function that carries it out calls `follow` or `end`."""
        self.number, self.vehicle, self.what, self.who, self.began_s = number, vehicle, what, who, began_s
        self.changes = False
        """Whether it changes something on the vehicle, which then holds a part of that if it is cut short."""
        self.text = ""
        self.result: TaskResult | None = None
        self.stop: Callable[[], str | None] | None = None
        """Ends it before its time; returns why it cannot, "" or None if it did."""
        self.confirm: Callable[[], str] | None = None
        """Takes the operator's confirmation of a prompt; returns "" or why it is of no use now."""
        self.guidance: Callable[[], Guidance] = Guidance
        self.waits_for: Callable[[], str] = str
        """What must be over before it begins; "" if nothing."""
        self.progress: Callable[[], tuple[int, int]] = lambda: (0, 0)
        self._job: Job | None = None
        self._state: JobState | None = None
        self._cancelled = False

    @property
    def state(self) -> JobState:
        """Queued, running, or how it ended."""
        if self._state is not None:
            return self._state
        return self._job.state if self._job is not None and not self._job.over else JobState.RUNNING

    @property
    def over(self) -> bool:
        """Whether it has ended."""
        return self._state is not None

    def follow(self, job: Job, jobs: JobQueue) -> None:
        """Take the progress of `job`; the code that submitted the job reports its result with `end`."""
        self._job = job
        self.progress = lambda: (job.done, job.total)
        self.waits_for = lambda: jobs.waits_for(job)
        self.stop = lambda: jobs.cancel_job(job)

    def begin_next_part(self) -> bool:
        """Stop following the job of its first part; returns whether the task goes on: one that was cancelled ends."""
        self._job, self.stop, self.waits_for = None, None, str
        if self._cancelled:
            self.end("cancelled")
        return not self.over

    def end(
        self, error: str = "", *, text: str = "", result: TaskResult | None = None, cancelled: bool = False
    ) -> None:
        """End the task: failed because of `error`, or done with `text` as a remark."""
        if self._state is None:
            # A job knows best whether it was cancelled; without one the task remembers the request.
            of_job = self._job is not None and self._job.state is JobState.CANCELLED
            cancelled = cancelled or (of_job if self._job is not None else self._cancelled)
            self._state = JobState.CANCELLED if cancelled else JobState.FAILED if error else JobState.DONE
            self.text, self.result = error or text, result
            # The last values are kept and the closures dropped: they hold the job and its buffers.
            self.progress = (lambda last: lambda: last)(self.progress())
            self.guidance = (lambda notes: lambda: Guidance(notes=notes))(self.guidance().notes)
            self._job = self.stop = self.confirm = None
            self.waits_for = str

    def cancel(self) -> str:
        """End it before its time; returns "" or why it cannot be ended."""
        if self.over:
            return f"it is over: {self.state.value}"
        if self.stop is None:
            return "it cannot be stopped any more"
        self._cancelled = True
        why = self.stop()
        self._cancelled = self._cancelled and not why
        return why or ""


class TaskTable:
    """The newest tasks by number; the oldest that ended are forgotten."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._tasks: OrderedDict[int, Task] = OrderedDict()
        self._last = 0
        self.note: Callable[[], None] = lambda: None
        """Writes `unfinished` to disk; called before a task begins that changes something on a vehicle."""

    def begin(self, vehicle: int, what: str, who: str) -> Task:
        """A new task under the next number."""
        self._last += 1
        task = Task(self._last, vehicle, what, who, self._clock.now())
        self._tasks[task.number] = task
        ended = [number for number, old in self._tasks.items() if old.over]
        for number in ended[: max(0, len(self._tasks) - MAX_TASKS)]:
            del self._tasks[number]
        # A task is a few hundred bytes, but its result may be a thousand parameters.
        for number in ended[:-MAX_RESULTS]:
            if number in self._tasks:
                self._tasks[number].result = None
        return task

    def forget(self, task: Task) -> None:
        """Forget a task that was refused before it began."""
        self._tasks.pop(task.number, None)

    def get(self, number: int) -> Task | None:
        """The task of that number; None if it is not remembered."""
        return self._tasks.get(number)

    def unfinished(self) -> list[tuple[int, str]]:
        """(vehicle, what) of the tasks under way that change something."""
        return [(task.vehicle, task.what) for task in self._tasks.values() if task.changes and not task.over]

    def infos(self, numbers: tuple[int, ...] = ()) -> tuple[TaskInfo, ...]:
        """Rows of these tasks, as far as they are remembered; of all, if none is named."""
        tasks = [self._tasks[n] for n in numbers if n in self._tasks] if numbers else list(self._tasks.values())
        return tuple(self._info(task) for task in tasks)

    def _info(self, task: Task) -> TaskInfo:
        done, total = task.progress()
        guidance = task.guidance()
        return TaskInfo(
            number=task.number,
            vehicle=task.vehicle,
            what=task.what,
            who=task.who,
            state=task.state.value,
            done=done,
            total=total,
            text=task.text or task.waits_for(),
            age_s=self._clock.now() - task.began_s,
            prompt=guidance.prompt,
            waits=guidance.waits,
            lines=guidance.lines,
            notes=guidance.notes[-MAX_NOTES:],
        )
