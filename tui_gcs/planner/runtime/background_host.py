"""A host that can be told what will be asked next: that is prepared on a thread while the present task is flown.

For rehearsals only, where the next round is known and nobody else needs the computer's time. What comes of it is the
same as without, only sooner done.
"""

import threading

import msgspec

from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.planner.api import Planner
from tui_gcs.planner.runtime.host import Job, PlannerHost


class HostAhead(PlannerHost):
    """As its base; `foresee` may be called between steps."""

    _coming: "_Coming | None" = None

    def foresee(self, task: PlannerTask) -> None:
        """This task will come next, under another time and revision.

        Only for planners that can work `ahead`; not for those in files, which cannot be loaded twice at a time.
        """
        self._forget()
        planner = self._job.planner if self._job is not None else None
        if planner is None or planner.name != task.planner or task.planner in self.files:
            return
        if type(planner).ahead is not Planner.ahead:
            self._coming = _Coming(self, task)

    def set_task(self, task: PlannerTask, snapshot: bytes = b"") -> None:
        """As its base, at once if it was foreseen."""
        coming = self._coming
        if coming is None or task.revision == self.revision:
            super().set_task(task, snapshot)
            return
        self._forget()
        job = coming.job if msgspec.structs.replace(coming.task, t_s=task.t_s, revision=task.revision) == task else None
        if job is None or job.planner is None:
            super().set_task(task, snapshot)
            return
        job.task = job.planner.task = task
        self.adopt(job)

    def _forget(self) -> None:
        if self._coming is not None:
            self._coming.stop()
            self._coming = None


class _Coming:
    """The thread of one task that will come."""

    def __init__(self, host: HostAhead, task: PlannerTask) -> None:
        self.task = task
        self.job: Job | None = None
        """Configured; None: not yet, or it failed."""
        self._host = host
        self._stopped = False
        self._thread = threading.Thread(target=self._work, name="next round", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Wait for what is being done, and no longer."""
        self._stopped = True
        self._thread.join()

    def _work(self) -> None:
        job = self._host.prepare(self.task)
        planner = job.planner
        if planner is not None and not self._host._guarded(lambda: planner.ahead(lambda: not self._stopped)):
            self.job = job
