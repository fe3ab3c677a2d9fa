"""Planners of a lock-step run, each team's in its own process, so that they search while vehicles and station go on.

Plans are the same as those of hosts in the run's own process, and come at the same time of the flight: the run waits
for a step, but not for background work until the next step. A worker's watch over late and silent planners is absent,
for there is no station clock and no bus; `CALL_CPU_LIMIT_S` ends a call that would never return. There are no previews.
"""

import argparse
import contextlib
import gc
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from multiprocessing.connection import Connection, Pipe
from pathlib import Path

import msgspec

from tui_gcs.core.protocol.bus import FLEET, PLAN, TASK, Bus
from tui_gcs.core.protocol.common import Message, PlannerFrame, PlannerTask, decode, encode
from tui_gcs.planner.runtime.background_host import BackgroundHost
from tui_gcs.planner.runtime.cpu_limit import cpu_limit
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.worker import ends_with

SWITCH_S = 0.0005
"""Interval of thread switches: background work must give way soon to a step, which the run waits for."""

CALL_CPU_LIMIT_S = 60.0
"""A planner that takes more CPU time for one task or step hangs: the call is ended, which is a failure of the planner.

The station gives 20 s for a task and 2 s for a step. Background work of other threads counts here, too.
"""


class PlannerProcessError(Exception):
    """A planner's process ended during a run; the text is one line that names the team."""


class FrameTime(msgspec.Struct):
    """The time of a `FleetFrame`, all that the run itself needs to decode."""

    t_s: float


class _FrameAnswer(Message, frozen=True, array_like=True):
    """The answer to a frame."""

    plan: bytes
    """The encoded plan; b"" if the frame was not to be stepped on."""
    due_s: float
    """Frames of earlier times need not be sent."""


class _PlannerSubprocess:
    """The process of one team's host."""

    def __init__(self, team: str, files: Mapping[str, PlannerFile]) -> None:
        self.team = team
        self._due_s = math.inf
        self._pipe, there = Pipe()
        command = [sys.executable, "-m", "tui_gcs.planner.runtime.planner_subprocess", str(there.fileno()), team]
        command += ["--parent", str(os.getpid())]
        command += [part for f in files.values() for part in ("--file", f.name, f.sha256, str(f.path))]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, pass_fds=[there.fileno()], start_new_session=True
        )
        there.close()

    def take(self, _key: str, task: bytes) -> None:
        """Send a task; the process configures its planner before the next frame."""
        self._send(b"task" + task)
        self._due_s = -math.inf

    def foresee(self, task: PlannerTask) -> None:
        """Announce the task that will come next."""
        self._send(b"next" + encode(task))

    def ask(self, frame: bytes, t_s: float) -> bool:
        """Send a frame if it may be due. If this returns True, `answer` must be called."""
        if t_s < self._due_s:
            return False
        self._send(b"step" + frame)
        return True

    def answer(self) -> bytes:
        """Return the plan for the last frame sent; b"" if no step was due."""
        try:
            answer = decode(self._pipe.recv_bytes(), _FrameAnswer)
        except (EOFError, OSError):
            raise self._ended() from None
        self._due_s = answer.due_s
        return answer.plan

    def close(self) -> None:
        """Kill the process and everything that its planner has started."""
        self._pipe.close()
        with contextlib.suppress(ProcessLookupError, PermissionError):
            # The group, because a planner may have started processes of its own.
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _send(self, data: bytes) -> None:
        try:
            self._pipe.send_bytes(data)
        except OSError:
            raise self._ended() from None

    def _ended(self) -> PlannerProcessError:
        code = self._process.wait()
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return PlannerProcessError(f"team {self.team!r}: the planner's process ended in mid-flight ({how})")


class PlannerSubprocesses:
    """The hosts of several teams on the bus of a run.

    They step at the same time, and their plans come in order of teams. They get a frame before all other subscribers of
    the bus, and publish their plans after those.
    """

    def __init__(self, teams: Sequence[str], files: Mapping[str, PlannerFile], bus: Bus) -> None:
        """Start the processes. If one of them ends, publishing to the bus raises `PlannerProcessError`."""
        self._by_team = {team: _PlannerSubprocess(team, files) for team in teams}
        self._bus = bus
        self._asked: list[_PlannerSubprocess] = []
        self._publishes = False
        for team, host in self._by_team.items():
            bus.subscribe(TASK.format(team=team), host.take)
        # Subscribed before all others: planners compute while the station's other subscribers handle the frame.
        bus.subscribe(FLEET, self._ask)

    def begin(self) -> None:
        """Publish plans from now on. Subscribers registered before get each frame while the planners compute."""
        if not self._publishes:
            self._publishes = True
            self._bus.subscribe(FLEET, self._answer)

    def foresee(self, tasks: Iterable[PlannerTask]) -> None:
        """Announce the tasks that will come next, so that planners can work on them while they are idle."""
        for task in tasks:
            self._by_team[task.team].foresee(task)

    def close(self) -> None:
        """Kill the processes of all teams."""
        for host in self._by_team.values():
            host.close()

    def _ask(self, _key: str, payload: bytes) -> None:
        t_s = decode(payload, FrameTime).t_s
        self._asked = [host for host in self._by_team.values() if host.ask(payload, t_s)]

    def _answer(self, _key: str, _payload: bytes) -> None:
        for host in self._asked:
            if plan := host.answer():
                self._bus.publish(PLAN.format(team=host.team), plan)


def serve(host: BackgroundHost, pipe: Connection) -> None:
    """Take tasks and answer frames until the other end of the pipe is closed."""
    while True:
        try:
            data = pipe.recv_bytes()
        except (EOFError, OSError):
            return
        what, payload = data[:4], data[4:]
        if what == b"task":
            with cpu_limit(CALL_CPU_LIMIT_S):
                host.set_task(decode(payload, PlannerTask))
            continue
        if what == b"next":
            host.foresee(decode(payload, PlannerTask))
            continue
        frame = decode(payload, PlannerFrame)
        with cpu_limit(CALL_CPU_LIMIT_S):
            plan = host.answer(frame) if host.due(frame.t_s) else b""
        with contextlib.suppress(OSError):  # the next `recv_bytes` sees it, too
            pipe.send_bytes(encode(_FrameAnswer(plan, host.due_s)))
        collect_garbage()


def collect_garbage() -> None:
    """Look for garbage as often as the interpreter would, but while nothing waits for an answer.

    By itself it looked right after each step, before the answer was sent: a quarter of the time of a step of `patrol`.
    """
    young, middle, old = (count > limit for count, limit in zip(gc.get_count(), gc.get_threshold(), strict=True))
    if young:
        gc.collect(0 if not middle else 1 if not old else 2)


def main(argv: Sequence[str] | None = None) -> int:
    """Run as `python -m` this module, `FD TEAM [--file NAME SHA256 PATH]…`: `FD` is the process's end of a pipe."""
    parser = argparse.ArgumentParser(prog="planner subprocess")
    parser.add_argument("fd", type=int)
    parser.add_argument("team")
    parser.add_argument("--parent", type=int, default=os.getppid(), help="end when this process is gone")
    parser.add_argument("--file", nargs=3, action="append", default=[], metavar=("NAME", "SHA256", "PATH"))
    arguments = parser.parse_args(argv)
    files = {name: PlannerFile(name, Path(path), sha256) for name, sha256, path in arguments.file}
    threading.Thread(target=ends_with, args=(arguments.parent,), daemon=True).start()
    host = BackgroundHost(arguments.team, files)
    sys.setswitchinterval(SWITCH_S)
    gc.freeze()  # what start-up left is never garbage
    gc.disable()  # see `collect_garbage`
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's business
    serve(host, Connection(arguments.fd))
    return 0


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)
