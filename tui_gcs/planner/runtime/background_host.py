"""A planner host that prepares the next task on a thread while the present one is flown.

It is for rehearsals only, where the next round is known and the computer's time is free. The plans are the same as
without it; they only come sooner.
"""

import threading

import msgspec

from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.planner.api import Planner
from tui_gcs.planner.runtime.host import PlannerHost, PlannerRun


class BackgroundHost(PlannerHost):
    """A planner host whose `foresee` may be called between steps."""

    _next: "_NextTaskThread | None" = None

    def foresee(self, task: PlannerTask) -> None:
        """Prepare a task that will come next, under another time and revision.

        This works for planners with `ahead`, and not for those in files, which cannot be loaded twice at the same time.
        """
        self._forget()
        planner = self._job.planner if self._job is not None else None
        if planner is None or planner.name != task.planner or task.planner in self.files:
            return
        if type(planner).ahead is not Planner.ahead:
            self._next = _NextTaskThread(self, task)

    def set_task(self, task: PlannerTask, snapshot: bytes = b"") -> None:
        """As in the base class; at once if the task was foreseen."""
        prepared = self._next
        if prepared is None or task.revision == self.revision:
            super().set_task(task, snapshot)
            return
        self._forget()
        job = prepared.job
        same = msgspec.structs.replace(prepared.task, t_s=task.t_s, revision=task.revision) == task
        if not same or job is None or job.planner is None:
            super().set_task(task, snapshot)
            return
        # Only time and revision differ from the task that was prepared.
        job.task = job.planner.task = task
        self.adopt(job)

    def _forget(self) -> None:
        if self._next is not None:
            self._next.stop()
            self._next = None


class _NextTaskThread:
    """The thread that prepares the next task."""

    def __init__(self, host: BackgroundHost, task: PlannerTask) -> None:
        self.task = task
        self.job: PlannerRun | None = None
        """The configured planner; None while it is not ready, or if it failed."""
        self._host = host
        self._stopped = False
        self._thread = threading.Thread(target=self._work, name="next round", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop background work and wait for the thread."""
        self._stopped = True
        self._thread.join()

    def _work(self) -> None:
        job = self._host.prepare(self.task)
        planner = job.planner
        if planner is not None and not self._host._guarded(lambda: planner.ahead(lambda: not self._stopped))[1]:
            self.job = job
