"""Planner workers as processes: one per team, started again when it dies, killed when it does not answer.

Each leads a process group: what its planner forked or started is killed with it, in whatever session that is.
"""

import contextlib
import logging
import math
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tui_gcs.core.base.descendants import kill_descendants, kill_orphans
from tui_gcs.core.process.cpu_wait import CpuWaitMonitor
from tui_gcs.core.process.worker_output import WorkerOutput
from tui_gcs.core.protocol.common import PlannerInfo
from tui_gcs.core.protocol.planner_log import PlannerLogLevel
from tui_gcs.core.records.planner_log import PlannerLog

log = logging.getLogger("tui_gcs.station")

FIRST_WAIT_S, LONGEST_WAIT_S = 1.0, 30.0
"""Seconds before a dead worker is started again; doubled each time, until one lived for `LIVED_S`."""
LIVED_S = 60.0
END_S = 2.0
LOOK_GAP_S = 1.0
"""Time between two looks for processes that ended workers have left."""


@dataclass
class _Worker:
    """The worker process of one team, or the wait for its next start."""

    process: subprocess.Popen[bytes]
    output: WorkerOutput
    since_s: float
    cpu: CpuWaitMonitor
    wait_s: float = FIRST_WAIT_S
    again_s: float = -1.0
    """When the next one is started; negative while this one lives."""


@dataclass
class _LeavingWorker:
    """The worker of a team that is gone, until it has ended."""

    process: subprocess.Popen[bytes]
    output: WorkerOutput
    team: str
    kill_s: float
    """When it is killed if it still runs."""


class PlannerWorkers:
    """Keeps one worker process per team. The times of its methods are the caller's."""

    def __init__(
        self, bus_socket: Path, planner_log: PlannerLog, arguments: Sequence[str] = (), *, adopts: bool = False
    ) -> None:
        """`planner_log` takes what the workers print; `arguments` are added to the command line of each.

        With `adopts` this process is the parent of what dead workers leave (`adopt_orphans`), and kills it.
        """
        self._adopts = adopts
        self._socket = bus_socket
        self._log = planner_log
        self._arguments = list(arguments)
        self._workers: dict[str, _Worker] = {}
        self._leaving: list[_LeavingWorker] = []
        self._planners: Mapping[str, str] = {}
        self._refused_until_s: dict[str, float] = {}
        """By team, until when no first worker is started because the last start failed."""
        self._looked_s = -math.inf

    def keep(self, planners: Mapping[str, str], now: float) -> None:
        """Start workers that are missing, end those of teams that are gone, and write down what all of them print.

        `planners` has the name of each team's planner.
        """
        if now >= self._looked_s + LOOK_GAP_S:
            self._looked_s = now
            self._kill_orphans()
        for team in [t for t in self._workers if t not in planners]:
            self._dismiss(team, self._workers.pop(team), now)
        self._planners = planners
        self._end_leaving(now)
        for team in planners:
            worker = self._workers.get(team)
            if worker is None:
                if now >= self._refused_until_s.get(team, -math.inf):
                    self._begin(team, now)
            elif worker.again_s < 0.0:
                self._look_after(team, worker, now)
            elif now >= worker.again_s:
                wait_s = min(2.0 * worker.wait_s, LONGEST_WAIT_S)
                self._begin(team, now, wait_s)
        self._log.flush()

    def _dismiss(self, team: str, worker: _Worker, now: float) -> None:
        """Let the worker of a team that is gone finish; it is killed after `END_S`."""
        if worker.again_s < 0.0:
            worker.process.terminate()
            self._leaving.append(_LeavingWorker(worker.process, worker.output, team, now + END_S))

    def _end_leaving(self, now: float) -> None:
        for leaving in self._leaving:
            if now >= leaving.kill_s or leaving.process.poll() is not None:
                _kill(leaving.process)
        for leaving in self._leaving:
            if leaving.process.poll() is None:
                leaving.output.read("", now)
            else:
                leaving.output.close("", now)
        self._leaving = [leaving for leaving in self._leaving if leaving.process.poll() is None]

    def _look_after(self, team: str, worker: _Worker, now: float) -> None:
        """Write down what a worker prints; if it has died, say when the next one is started."""
        code = worker.process.poll()
        if code is None:
            worker.output.read(self._planners[team], now)
            return
        _kill(worker.process)  # what it has started may still be there
        worker.output.close(self._planners[team], now)
        lived = now - worker.since_s >= LIVED_S
        # A planner that dies at once is retried ever more rarely, so that it does not take a core for itself.
        worker.wait_s = FIRST_WAIT_S if lived else worker.wait_s
        worker.again_s = now + worker.wait_s
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        self._note(team, f"its worker ended ({how}); the next one is started in {worker.wait_s:.0f} s")

    def _note(self, team: str, text: str) -> None:
        self._log.write(team, self._planners.get(team, ""), PlannerLogLevel.STATION, text)

    def end_stuck(self, teams: Iterable[str]) -> None:
        """Kill the workers of these teams: they hang, and may not react to SIGTERM."""
        for team in teams:
            if team in self._workers and self._workers[team].process.poll() is None:
                _kill(self._workers[team].process)

    def waited_s(self, team: str, now: float) -> float:
        """How long a team's worker has waited for a processor since it began; 0 while there is none."""
        worker = self._workers.get(team)
        if worker is None or worker.again_s >= 0.0:
            return 0.0
        worker.cpu.look(now)
        return worker.cpu.waited_s

    def pid(self, team: str) -> int | None:
        """The process id of a team's worker; None while there is none."""
        worker = self._workers.get(team)
        return worker.process.pid if worker is not None and worker.process.poll() is None else None

    def end(self) -> None:
        """End all workers; one that does not end in time is killed."""
        processes = [worker.process for worker in self._workers.values() if worker.again_s < 0.0]
        processes += [leaving.process for leaving in self._leaving]
        for process in processes:
            process.terminate()
        for process in processes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(END_S)
            _kill(process)
        now = self._looked_s
        for team, worker in self._workers.items():
            if worker.again_s < 0.0:
                worker.output.close(self._planners.get(team, ""), now)
        for leaving in self._leaving:
            leaving.output.close("", now)
        self._log.flush()
        if self._adopts:
            kill_orphans({process.pid for process in processes})

    def _kill_orphans(self) -> None:
        """Kill what ended workers, and ended programs of a planner, have left."""
        if self._adopts:
            workers = [worker.process for worker in self._workers.values()]
            kill_orphans({process.pid for process in (*workers, *(leaving.process for leaving in self._leaving))})

    def _begin(self, team: str, now: float, wait_s: float = FIRST_WAIT_S) -> None:
        """Start a worker; where the system gives no process, or no file, it is tried again after `wait_s`."""
        try:
            process = self._start(team)
        except OSError as error:
            log.error("no planner worker for team %s: %s", team, error)
            self._refused_until_s[team] = now + wait_s
            if team in self._workers:
                self._workers[team].again_s = now + wait_s
            return
        self._note(team, f"its worker is started, process {process.pid}")
        output = WorkerOutput(process, team, self._log, now)
        self._workers[team] = _Worker(process, output, now, CpuWaitMonitor(process.pid, now), wait_s)

    def _start(self, team: str) -> subprocess.Popen[bytes]:
        command = [*command_of(self._socket, team), *self._arguments]
        pipe = subprocess.PIPE
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, bufsize=0, start_new_session=True
        )


def command_of(bus_socket: Path, team: str) -> list[str]:
    """The command line of a worker that belongs to this process."""
    command = [sys.executable, "-m", "tui_gcs.planner.runtime.worker", "--bus", str(bus_socket), "--team", team]
    return [*command, "--parent", str(os.getpid())]


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a worker's descendants and its group; at once when it is found dead, as its id may be given again."""
    if process.poll() is None:
        kill_descendants(process.pid)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        # The group: what a planner has forked would otherwise live on.
        os.killpg(process.pid, signal.SIGKILL)


MAX_DECLARED_BYTES = 4_000_000


class Declarations:
    """Asks a process of its own for all planners' declarations, because the station runs none of their code."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        command = [sys.executable, "-m", "tui_gcs.planner.runtime.describe"]
        try:
            self._output = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the answer
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=self._output, stderr=subprocess.DEVNULL
            )
        except OSError as error:
            log.error("planners cannot be described: %s", error)

    def poll(self) -> tuple[PlannerInfo, ...]:
        """Return the declarations once, when they have come; before and after that nothing."""
        if self._process is None or self._process.poll() is None:
            return ()
        self._process = None
        self._output.seek(0)
        data = self._output.read(MAX_DECLARED_BYTES)
        self._output.close()
        try:
            return msgspec.json.decode(data, type=tuple[PlannerInfo, ...])
        except msgspec.MsgspecError as error:
            log.error("planners cannot be described: %s", error)
            return ()

    def end(self) -> None:
        """Stop waiting for the answer and end the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
