"""The planner worker: one process per team, which steps its planner on the station's fleet frames.

It may hang, crash or be killed: the station watches the age of its plans and keeps the vehicles safe without it. A new
task is configured on a thread beside the present planner, which plans on until the new one is ready.
"""

import argparse
import contextlib
import gc
import logging
import os
import resource
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from tui_gcs.core.base.descendants import adopt_orphans, kill_descendants
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import (
    PROTOCOL,
    AnyRequest,
    GetTask,
    Hello,
    PlannerFrame,
    PlannerTask,
    PreviewTask,
    Reply,
    decode,
    encode,
)
from tui_gcs.planner.runtime import worker_logging
from tui_gcs.planner.runtime.file_watching_host import FileWatchingHost
from tui_gcs.planner.runtime.host import PlannerHost, PlannerRun
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.preview import PreviewProcesses
from tui_gcs.planner.runtime.work_budget import WorkBudget

ASK_AGAIN_S = 0.5
"""Time between two requests for the first task."""
PARENT_CHECK_S = 1.0
"""Time between two looks whether the parent process lives."""
LEAVING_S = 2.0
"""A worker that does not hang has ended by itself this long after its parent."""

log = logging.getLogger("tui_gcs.planner")


class PlannerWorker:
    """Steps a host on the newest frame. Callbacks of the bus only fill a mailbox."""

    def __init__(
        self, bus: Bus, team: str, files: dict[str, PlannerFile] | None = None, *, watches: bool = False
    ) -> None:
        """Join the bus as `planner-<team>`.

        `files` are planners in files, by name; with `watches` saved versions take over.
        """
        self.host = FileWatchingHost(team, files or {}) if watches else PlannerHost(team, files)
        self.host.budget = WorkBudget()
        self.stopped = False
        self._bus = bus
        self._team = team
        self._principal = f"planner-{team}"
        self._frame: bytes | None = None
        self._task: bytes | None = None
        self._ready: PlannerRun | None = None
        self._thread: threading.Thread | None = None
        self._wanted: Callable[[], PlannerRun] | None = None
        """Makes what the thread is to prepare when it is free."""
        self._logged = (-1, "")
        """Revision of the task and text of the failure that was logged last."""
        self._previews: deque[bytes] = deque()
        preview_files = {name: replace(file, sha256="") if watches else file for name, file in (files or {}).items()}
        self._preview_processes = PreviewProcesses(preview_files)
        self._mailbox = threading.Condition()
        bus.subscribe(keys.FLEET, lambda _, data: self._put(frame=data))
        bus.subscribe(keys.TASK.format(team=team), lambda _, data: self._put(task=data))
        bus.subscribe(keys.PREVIEW_TASK.format(team=team), lambda _, data: self._previews.append(data))
        self._token = bus.alive(keys.ALIVE.format(principal=self._principal))

    def run(self, parent: int) -> None:
        """Step until stopped, or until the process `parent` that started this one is gone."""
        self._say_hello()
        # The parent is polled: one that is killed cannot notify its children.
        while not self.stopped and os.getppid() == parent:
            task, frame = self._wait()
            if self.host.revision < 0 and (task is not None or not self._preparing):
                self._ask_for_task(task)
            elif task is not None:
                self._want(decode(task, PlannerTask))
            self._prepare_and_adopt()
            self._run_previews()
            if frame is not None:
                self._step(decode(frame, PlannerFrame))

    def stop(self) -> None:
        """Make `run` return after the present step."""
        self.stopped = True

    def _put(self, *, frame: bytes | None = None, task: bytes | None = None) -> None:
        with self._mailbox:
            self._frame = frame or self._frame
            self._task = task or self._task
            self._mailbox.notify()

    def _wait(self) -> tuple[bytes | None, bytes | None]:
        """Return the newest task and frame since the last call; wait a moment if there is none."""
        with self._mailbox:
            if self._frame is None and self._task is None and self._ready is None:
                self._mailbox.wait(ASK_AGAIN_S if self.host.revision < 0 else PARENT_CHECK_S)
            task, frame = self._task, self._frame
            self._task = self._frame = None
        return task, frame

    @property
    def _preparing(self) -> bool:
        return self._thread is not None or self._wanted is not None

    def _want(self, task: PlannerTask, snapshot: bytes = b"") -> None:
        if task.revision != self.host.revision:
            self._wanted = lambda: self.host.prepare(task, snapshot)

    def _prepare_and_adopt(self) -> None:
        """Adopt what is ready if nothing newer is wanted, and begin to prepare what is wanted."""
        ready = self._ready
        if ready is not None and self._thread is not None:
            self._thread.join()
            self._ready = self._thread = None
            # A task that came meanwhile is newer than what was prepared.
            if self._wanted is None:
                self.host.adopt(ready)
        if self.host.restart_due and not self._preparing:
            self._wanted = self.host.prepare_restart
        if self._wanted is not None and self._thread is None:
            make, self._wanted = self._wanted, None
            self._thread = threading.Thread(target=self._prepare, args=(make,), daemon=True)
            self._thread.start()

    def _prepare(self, make: Callable[[], PlannerRun]) -> None:
        job = make()
        with self._mailbox:
            self._ready = job
            self._mailbox.notify()

    def _step(self, frame: PlannerFrame) -> None:
        if self.host.due(frame.t_s) and not self.host.restart_due:
            self._bus.publish(keys.PLAN.format(team=self._team), self.host.answer(frame))
            self._log_failure()

    def _log_failure(self) -> None:
        """Log why the planner cannot work on its task or failed in a step, once: the whole traceback."""
        failure = self.host.revision, self.host.problem or self.host.failure
        if failure != self._logged:
            self._logged = failure
            if failure[1]:
                log.log(logging.WARNING if self.host.refuses else logging.ERROR, "%s", failure[1])

    def _run_previews(self) -> None:
        """Begin and poll previews, which run in processes of their own."""
        while self._previews:
            self._preview_processes.begin(decode(self._previews.popleft(), PreviewTask), time.monotonic())
        for result in self._preview_processes.poll(time.monotonic()):
            self._bus.publish(keys.PREVIEW.format(team=self._team), encode(result))

    def _ask_for_task(self, published: bytes | None = None) -> None:
        """Ask for the first task, even if one was published: only the reply holds the state of the worker before."""
        reply = self._ask(GetTask(team=self._team))
        if reply is not None and reply.task is not None:
            self._want(reply.task, reply.snapshot)
        elif published is not None:
            self._want(decode(published, PlannerTask))

    def _say_hello(self) -> None:
        reply = self._ask(Hello(protocol=PROTOCOL, who=self._principal))
        if reply is not None and not reply.ok:
            log.error("%s", reply.text)
            self.stop()

    def _ask(self, request: AnyRequest) -> Reply | None:
        try:
            return decode(self._bus.ask(keys.REQUEST.format(principal=self._principal), encode(request)), Reply)
        except BusError as error:
            log.warning("%s", error)
            return None


def limit_memory() -> None:
    """Limit this process to half of the memory: a planner that takes more fails alone, and not the station with it."""
    half = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    with contextlib.suppress(OSError, ValueError):  # a lower limit is set already
        resource.setrlimit(resource.RLIMIT_DATA, (half, half))


def ends_with(parent: int) -> None:
    """End this process group soon after `parent` has ended.

    This runs on a thread, because a planner that hangs never returns to `run`.
    """
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK_S)
    time.sleep(LEAVING_S)
    _end_group()
    os._exit(1)


def _end_group() -> None:
    """Kill what the planner has started, and the process group if this process leads it, itself included."""
    kill_descendants(os.getpid())
    if os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)


def main(argv: Sequence[str] | None = None) -> int:
    """`python -m tui_gcs.planner.runtime.worker --bus SOCKET --team NAME [--file NAME SHA256 PATH]… [--watch]`."""
    from tui_gcs.core.protocol.zenoh_bus import connect

    parser = argparse.ArgumentParser(prog="planner worker")
    parser.add_argument("--bus", type=Path, required=True)
    parser.add_argument("--team", required=True)
    parser.add_argument("--parent", type=int, default=os.getppid(), help="end when this process is gone")
    parser.add_argument("--file", nargs=3, action="append", default=[], metavar=("NAME", "SHA256", "PATH"))
    parser.add_argument("--watch", action="store_true", help="fly on with every version of a file that is saved")
    arguments = parser.parse_args(argv)
    worker_logging.set_up()
    try:
        bus = connect(arguments.bus)
    except BusError as error:
        log.error("%s", error)
        return 2
    files = {name: PlannerFile(name, Path(path), sha256) for name, sha256, path in arguments.file}
    limit_memory()
    adopt_orphans()
    # Before the planner is loaded: its module may hang at once.
    threading.Thread(target=ends_with, args=(arguments.parent,), daemon=True).start()
    worker = PlannerWorker(bus, arguments.team, files, watches=arguments.watch)
    gc.freeze()  # what start-up left is never garbage: looking through it would hold steps up
    signal.signal(signal.SIGTERM, lambda *_: worker.stop())
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        worker.run(arguments.parent)
    finally:
        bus.close()
    if os.getppid() != arguments.parent:
        _end_group()  # else the station does
    return 0


if __name__ == "__main__":
    code = main()
    logging.shutdown()
    sys.stdout.flush()
    os._exit(code)
