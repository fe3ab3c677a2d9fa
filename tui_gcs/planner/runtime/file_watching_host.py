"""A host that watches its planner's file: a saved version takes over the flight, if it can, from where the old one was.

It is for simulated vehicles only (`tui-gcs planner watch`). The author is notified when a version is being loaded, when
it flies, and why it does not. The new version is loaded and configured on a thread beside the one that flies, and takes
its place between two steps with its snapshot. Where it fails, the version before flies on.
"""

import ctypes
import sys
import threading
import time
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import ModuleType

from tui_gcs.core.protocol.common import AnyFrame, PlannerInfo, TeamPlan, decode
from tui_gcs.planner.api import Planner
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import PlannerHost, PlannerRun
from tui_gcs.planner.runtime.planner_errors import PlannerError, error_with_line
from tui_gcs.planner.runtime.planner_file import PlannerFile, read_source

TRIAL_STEPS = 10
"""If a new version fails within this many steps, the version before takes over again."""
CONFIGURE_LIMIT_S = 20.0
"""A version that takes longer to load and configure hangs; the station does not wait longer for a planner either."""
DIGEST_DIGITS = 8
"""Digits of a sha256 that are shown."""


class FileWatchingHost(PlannerHost):
    """A planner host that looks at the planner's file before each answer."""

    def __init__(self, team: str, files: dict[str, PlannerFile]) -> None:
        """Take the files as they are now, whatever they were when the station started."""
        now = {name: replace(file, sha256=_digest(file.path) or file.sha256) for name, file in files.items()}
        super().__init__(team, now)
        self._watched: dict[str, PlannerFile] = now
        self._seen = {name: _stamp(file.path) for name, file in now.items()}
        self._thread: threading.Thread | None = None
        self._ready: list[PlannerRun] = []
        """What the present thread has prepared."""
        self._begun_s = 0.0
        """The process's own clock when the thread began: a thread hangs by this clock, not by the flight's time."""
        self._before: PlannerRun | None = None
        """The version before, while the new one is on trial."""
        self._trial = 0
        self._begun: tuple[int, int] = (0, 0)
        """Stamp of the file whose content is being prepared."""
        self._module: ModuleType | None = None
        """Module of the version that flies, while another version is loaded."""

    def answer(self, frame: AnyFrame) -> bytes:
        """As in the base class, by the newest version that works."""
        job = self._present()
        if job.task.planner in self._watched:
            self._look(job, self._watched[job.task.planner])
            self._take_over(self._watched[job.task.planner])
            self._give_up(job, self._watched[job.task.planner])
        data = super().answer(frame)
        return self._plan_on_trial(frame, data) if self._before is not None else data

    def _with_snapshot(self, job: PlannerRun, planner: Planner, plan: TeamPlan) -> TeamPlan:
        """Postpone snapshots while another version is loaded: a pickle would look for its classes in that one."""
        return plan if self._thread is not None else super()._with_snapshot(job, planner, plan)

    def _look(self, job: PlannerRun, file: PlannerFile) -> None:
        """Begin to prepare a saved version. A file that changed since the last look may be half written and waits."""
        stamp = _stamp(file.path)
        settled, self._seen[file.name] = stamp == self._seen[file.name], stamp
        if not settled or self._thread is not None or not (digest := _digest(file.path)) or digest == file.sha256:
            return
        self._watched[file.name], self._begun = replace(file, sha256=digest), stamp
        self._begun_s = time.monotonic()
        job.news.append((f"{file.path.name} was saved: loading it ({digest[:DIGEST_DIGITS]})", True))
        state = self._state(job)
        self._module = sys.modules.get(type(job.planner).__module__) if job.planner is not None else None
        self._ready = []  # its own: a thread that was given up may still end
        task, ready = job.task, self._ready
        self._thread = threading.Thread(target=lambda: ready.append(self.prepare(task, state)), daemon=True)
        self._thread.start()

    def _give_up(self, job: PlannerRun, file: PlannerFile) -> None:
        """Report a version that hangs and watch the file again: the next version saved may be mended."""
        if self._thread is None or self._ready or time.monotonic() - self._begun_s < CONFIGURE_LIMIT_S:
            return
        thread, self._thread = self._thread.ident, None
        if thread is not None:  # ends what loops in Python, before it takes time from the version that flies
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(SystemExit))
        self._restore_module()
        what = f"{file.path.name}: does not finish loading and configure within {CONFIGURE_LIMIT_S:g} s"
        job.news.append((f"{what}; the version before flies on", False))

    def _state(self, job: PlannerRun) -> bytes:
        """Return the planner's state now, or its latest snapshot where it cannot give one."""
        state, _ = self._guarded(self.snapshot)
        return job.snapshot if state is None else state

    def _take_over(self, file: PlannerFile) -> None:
        """Let a version that is ready take over, unless it is broken or its task is not wanted any more."""
        if not self._ready or self._thread is None:
            return
        self._thread.join()
        self._thread, new, job = None, self._ready.pop(), self._present()
        if new.task.revision != job.task.revision:
            return
        problem = error_with_line(new.error, file.path) if "\n" in new.error else new.error
        if new.planner is not None and new.planner.name != file.name:
            problem = f"{file.path.name}: its name is {new.planner.name!r} now, and was {file.name!r}"
        if problem:
            self._restore_module()
            if _stamp(file.path) != self._begun:  # it was saved again meanwhile, and perhaps read half written
                self._watched[file.name] = replace(file, sha256="")
                return
            job.news.append((f"{problem}; the version before flies on", False))
            return
        took_s = time.monotonic() - self._begun_s
        text = f"{file.path.name}: new version flies ({file.sha256[:DIGEST_DIGITS]}) after {took_s:.1f} s"
        new.news = [*job.news, (text, True)]  # with news that no plan has carried yet
        self._before, self._trial, self._job = job, TRIAL_STEPS, new

    def _plan_on_trial(self, frame: AnyFrame, data: bytes) -> bytes:
        """Return the plan if the version on trial works, else the plan of the version before."""
        job, before = self._present(), self._before
        if before is None or job.task.revision != before.task.revision:
            self._before = None
            return data
        if not (job.restart_due or job.error):
            self._trial -= 1
            if not self._trial:
                self._before, job.declares = None, self._declared(job)
            return data
        self._job, self._before, self._next_s = before, None, frame.t_s
        file = self._watched[job.task.planner]
        why = error_with_line(decode(data, TeamPlan).error, file.path)
        before.notes += job.notes
        before.news += [*job.news, (f"{why}; the version before flies on", False)]
        self._restore_module()
        return super().answer(frame)

    def _declared(self, job: PlannerRun) -> PlannerInfo | None:
        """Return what the version that flies now declares, for forms and parameter checks."""
        name = job.task.planner
        return None if job.planner is None else registry.described(name, type(job.planner), self._watched[name])

    def _restore_module(self) -> None:
        """Put the flying version's module back: a pickle of its state looks for its classes there."""
        if self._module is not None:
            sys.modules[self._module.__name__] = self._module


def _stamp(path: Path) -> tuple[int, int]:
    """Return a stamp that changes whenever the file is written; (0, 0) while there is none."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_size


def _digest(path: Path) -> str:
    """Return the digest of the file's content; "" where it cannot be read now or is no source."""
    try:
        return sha256(read_source(path)).hexdigest()
    except PlannerError:
        return ""
