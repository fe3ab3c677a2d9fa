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
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tui_gcs.core.base.descendants import kill_descendants, kill_orphans
from tui_gcs.core.process.cpu_wait import CpuWaitMonitor
from tui_gcs.core.protocol.common import PlannerInfo

log = logging.getLogger("tui_gcs.station")

FIRST_WAIT_S, LONGEST_WAIT_S = 1.0, 30.0
"""Seconds before a dead worker is started again; doubled each time, until one lived for `LIVED_S`."""
LIVED_S = 60.0
END_S = 2.0
MAX_LOG_BYTES, KEPT_LOG_BYTES, LOOK_GAP_S = 10_000_000, 5_000_000, 1.0
"""The workers append to one log. It is looked at every second, and shortened to the newest part when it is too long."""


@dataclass
class _Worker:
    """The worker process of one team, or the wait for its next start."""

    process: subprocess.Popen[bytes]
    since_s: float
    cpu: CpuWaitMonitor
    wait_s: float = FIRST_WAIT_S
    again_s: float = -1.0
    """When the next one is started; negative while this one lives."""


class PlannerWorkers:
    """Keeps one worker process per team. The times of its methods are the caller's."""

    def __init__(
        self, bus_socket: Path, log_file: Path, arguments: Sequence[str] = (), *, adopts: bool = False
    ) -> None:
        """`log_file` takes what the workers print; `arguments` are added to the command line of each.

        With `adopts` this process is the parent of what dead workers leave (`adopt_orphans`), and kills it.
        """
        self._adopts = adopts
        self._socket = bus_socket
        self._log_file = log_file
        self._arguments = list(arguments)
        self._workers: dict[str, _Worker] = {}
        self._leaving: list[tuple[subprocess.Popen[bytes], float]] = []
        """Workers of teams that are gone, and the time at which each is killed if it still runs."""
        self._refused_until_s: dict[str, float] = {}
        """By team, until when no first worker is started because the last start failed."""
        self._looked_s = -math.inf

    def keep(self, teams: list[str], now: float) -> None:
        """Start workers that are missing, and end those of teams that are gone."""
        if now >= self._looked_s + LOOK_GAP_S:
            self._looked_s = now
            self._shorten_log()
            self._kill_orphans()
        for team in [t for t in self._workers if t not in teams]:
            leaving = self._workers.pop(team).process
            # The worker gets time to finish its log; it is killed after `END_S`.
            leaving.terminate()
            self._leaving.append((leaving, now + END_S))
        for process, _ in [one for one in self._leaving if now >= one[1] or one[0].poll() is not None]:
            _kill(process)
        self._leaving = [one for one in self._leaving if one[0].poll() is None]
        for team in teams:
            worker = self._workers.get(team)
            if worker is None:
                if now >= self._refused_until_s.get(team, -math.inf):
                    self._begin(team, now)
            elif worker.again_s < 0.0:
                if worker.process.poll() is not None:
                    _kill(worker.process)  # what it has started may still be there
                    lived = now - worker.since_s >= LIVED_S
                    # A planner that dies at once is retried ever more rarely, so that it does not take a core for
                    # itself.
                    worker.wait_s = FIRST_WAIT_S if lived else worker.wait_s
                    worker.again_s = now + worker.wait_s
            elif now >= worker.again_s:
                wait_s = min(2.0 * worker.wait_s, LONGEST_WAIT_S)
                self._begin(team, now, wait_s)

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
        processes += [process for process, _ in self._leaving]
        for process in processes:
            process.terminate()
        for process in processes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(END_S)
            _kill(process)
        if self._adopts:
            kill_orphans({process.pid for process in processes})

    def _kill_orphans(self) -> None:
        """Kill what ended workers, and ended programs of a planner, have left."""
        if self._adopts:
            workers = [worker.process for worker in self._workers.values()]
            kill_orphans({process.pid for process in (*workers, *(leaving for leaving, _ in self._leaving))})

    def _shorten_log(self) -> None:
        """Keep what planners print from filling the disk: the beginning and the newest lines stay."""
        try:
            if self._log_file.stat().st_size > MAX_LOG_BYTES:
                os.truncate(self._log_file, KEPT_LOG_BYTES)
                with self._log_file.open("ab") as output:
                    output.write(b"\n--- planners print too much: what came here is not kept ---\n")
        except FileNotFoundError:
            return  # nobody has printed anything yet
        except OSError as error:
            log.warning("%s cannot be shortened: %s", self._log_file, error)

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
        self._workers[team] = _Worker(process, now, CpuWaitMonitor(process.pid, now), wait_s)

    def _start(self, team: str) -> subprocess.Popen[bytes]:
        command = [*command_of(self._socket, team), *self._arguments]
        with self._log_file.open("ab") as output:
            return subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
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
