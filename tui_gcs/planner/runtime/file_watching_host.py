"""A host that looks at its planner's file: what is saved flies on, if it can, from where the version before was.

For simulated vehicles only (`tui-gcs planner watch`). What becomes of it is told at once: that it is being loaded, that
it flies, or why not. The new version is loaded and configured on a thread beside the
one that flies, and takes its place between two steps with its snapshot; where it fails, the one before flies on.
"""

import ctypes
import sys
import threading
import time
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import ModuleType

from tui_gcs.core.protocol.common import FleetFrame, Plan, PlannerInfo, PlannerTask, decode
from tui_gcs.planner.api import Planner
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import Job, PlannerHost
from tui_gcs.planner.runtime.planner_errors import PlannerError, blame
from tui_gcs.planner.runtime.planner_file import PlannerFile, read_source

TRIAL_STEPS = 10
"""Where a new version fails this early, the one before takes over again."""
CONFIGURE_LIMIT_S = 20.0
"""A version that is not loaded and configured after so long hangs; no station waits longer for one, either."""
SHORT = 8
"""Digits of a sha256 that are shown."""


class WatchingHost(PlannerHost):
    """As its base; `answer` looks at the file first."""

    def __init__(self, team: str, files: dict[str, PlannerFile]) -> None:
        """The files as they are now, whatever they were when the station started."""
        now = {name: replace(file, sha256=_digest(file.path) or file.sha256) for name, file in files.items()}
        super().__init__(team, now)
        self._watched: dict[str, PlannerFile] = now
        self._seen = {name: _stamp(file.path) for name, file in now.items()}
        self._thread: threading.Thread | None = None
        self._ready: list[Job] = []
        """What the present thread has prepared."""
        self._begun_s = 0.0
        """When it began, of the process's own clock: how long a thread hangs is no matter of the flight's time."""
        self._before: Job | None = None
        """The version before, while the new one is on trial."""
        self._trial = 0
        self._begun: tuple[int, int] = (0, 0)
        """Stamp of the file whose content is being prepared."""
        self._module: ModuleType | None = None
        """Of the version that flies, while another is loaded."""

    def answer(self, frame: FleetFrame) -> bytes:
        """As its base, by the newest version that works."""
        job = self._present()
        if job.task.planner in self._watched:
            self._look(job, self._watched[job.task.planner])
            self._take(self._watched[job.task.planner])
            self._give_up(job, self._watched[job.task.planner])
        data = super().answer(frame)
        return self._judged(frame, data) if self._before is not None else data

    def _with_snapshot(self, job: Job, planner: Planner, plan: Plan) -> Plan:
        """Later, while another version is loaded: a pickle would look for its classes in that one."""
        return plan if self._thread is not None else super()._with_snapshot(job, planner, plan)

    def _look(self, job: Job, file: PlannerFile) -> None:
        """Begin to prepare a version that was saved. One that is just being written is looked at later."""
        stamp = _stamp(file.path)
        settled, self._seen[file.name] = stamp == self._seen[file.name], stamp
        if not settled or self._thread is not None or not (digest := _digest(file.path)) or digest == file.sha256:
            return
        self._watched[file.name], self._begun = replace(file, sha256=digest), stamp
        self._begun_s = time.monotonic()
        job.news.append((f"{file.path.name} was saved: loading it ({digest[:SHORT]})", True))
        state = self._state(job)
        self._module = sys.modules.get(type(job.planner).__module__) if job.planner is not None else None
        self._ready = []  # its own: a thread that was given up may still end
        self._thread = threading.Thread(target=self._prepare, args=(job.task, state, self._ready), daemon=True)
        self._thread.start()

    def _prepare(self, task: PlannerTask, state: bytes, ready: list[Job]) -> None:
        """On the thread."""
        ready.append(self.prepare(task, state))

    def _give_up(self, job: Job, file: PlannerFile) -> None:
        """Say of a version that it hangs, and look at the file again: what is saved next may be mended."""
        if self._thread is None or self._ready or time.monotonic() - self._begun_s < CONFIGURE_LIMIT_S:
            return
        thread, self._thread = self._thread.ident, None
        if thread is not None:  # ends what loops in Python, before it takes time from the version that flies
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(SystemExit))
        self._module_back()
        what = f"{file.path.name}: does not finish loading and configure within {CONFIGURE_LIMIT_S:g} s"
        job.news.append((f"{what}; the version before flies on", False))

    def _state(self, job: Job) -> bytes:
        """Its state now; as it was lately where the planner cannot say."""
        found: list[bytes] = []
        error = self._guarded(lambda: found.append(self.snapshot()))
        return job.kept if error else found[0]

    def _take(self, file: PlannerFile) -> None:
        """Let a version that is ready take over, unless it is broken or its task is not wanted any more."""
        if not self._ready or self._thread is None:
            return
        self._thread.join()
        self._thread, new, job = None, self._ready.pop(), self._present()
        if new.task.revision != job.task.revision:
            return
        problem = blame(new.error, file.path) if "\n" in new.error else new.error
        if new.planner is not None and new.planner.name != file.name:
            problem = f"{file.path.name}: its name is {new.planner.name!r} now, and was {file.name!r}"
        if problem:
            self._module_back()
            if _stamp(file.path) != self._begun:  # it was saved again meanwhile, and perhaps read half written
                self._watched[file.name] = replace(file, sha256="")
                return
            job.news.append((f"{problem}; the version before flies on", False))
            return
        took_s = time.monotonic() - self._begun_s
        text = f"{file.path.name}: new version flies ({file.sha256[:SHORT]}) after {took_s:.1f} s"
        new.news = [*job.news, (text, True)]  # also what was to be told with the next plan
        self._before, self._trial, self._job = job, TRIAL_STEPS, new

    def _judged(self, frame: FleetFrame, data: bytes) -> bytes:
        """The plan, if the version on trial has not failed; else that of the one before."""
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
        why = blame(decode(data, Plan).error, file.path)
        before.notes += job.notes
        before.news += [*job.news, (f"{why}; the version before flies on", False)]
        self._module_back()
        return super().answer(frame)

    def _declared(self, job: Job) -> PlannerInfo | None:
        """What the version that flies now takes: forms are drawn of it, and parameters checked."""
        name = job.task.planner
        return None if job.planner is None else registry.described(name, type(job.planner), self._watched[name])

    def _module_back(self) -> None:
        """The version that flies on finds its own classes again, for example when it pickles its state."""
        if self._module is not None:
            sys.modules[self._module.__name__] = self._module


def _stamp(path: Path) -> tuple[int, int]:
    """Changes whenever the file is written; (0, 0) while there is none."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_size


def _digest(path: Path) -> str:
    """Of its content; "" where it cannot be read just now, or is no source."""
    try:
        return sha256(read_source(path)).hexdigest()
    except PlannerError:
        return ""
