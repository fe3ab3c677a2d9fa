"""Previews: what a planner would make of a task, without flying it, with the whole team in the air.

`python -m tui_gcs.planner.runtime.preview [--file NAME SHA256 PATH]…` reads a `PreviewTask` and writes a
`PreviewResult`. It runs in a process of its own, which can be killed when its answer is no longer needed.
"""

import argparse
import contextlib
import math
import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import msgspec

from tui_gcs.core.protocol.common import PlannerTask, PreviewResult, PreviewTask, decode, encode
from tui_gcs.core.protocol.planning import cells_of
from tui_gcs.planner.runtime.plan_forecast import SearchLimit, forecast, vehicles_for
from tui_gcs.planner.runtime.planner_errors import error_with_line
from tui_gcs.planner.runtime.planner_file import PlannerFile

LIMIT_S = 60.0
"""Time after which a preview is given up."""
MAX_DATA_BYTES = 1_000_000_000
"""Memory after which it is given up; 250 MB of it are reserved by the libraries and mostly not used."""
FULL_SEARCH = SearchLimit()
NICE = 10
"""Lower priority than the planners that fly."""


def preview(ask: PreviewTask, files: Mapping[str, PlannerFile], search: SearchLimit = FULL_SEARCH) -> PreviewResult:
    """Return the result of a preview. Raises ValueError if the request holds no task or frame.

    The planner's search ends at the limit of `search`, if it is not over before.
    """
    task, frame = ask.task, ask.frame
    if task is None or frame is None:
        raise ValueError("nothing to look at")
    layers_m = dict.fromkeys(task.members, task.area.alt_min_m) | task.layers_m
    task = msgspec.structs.replace(task, members=tuple(sorted(task.members)), layers_m=layers_m)
    vehicles = len(task.members)
    try:
        if ask.idleness_s > 0.0:
            vehicles, found = vehicles_for(ask.idleness_s, task, frame, files, ask.starts_m, ask.snapshot)
        else:
            found = forecast(task, frame, files, ask.starts_m, ask.snapshot, search=search)
    except ValueError as why:
        return PreviewResult(task.team, ask.number, "failed", text=str(why))
    if found.plan.error:
        return PreviewResult(task.team, ask.number, "failed", text=_why(found.plan.error, files.get(task.planner)))
    return PreviewResult(
        task.team,
        ask.number,
        "done",
        found.plan.metrics,
        found.plan.annotations or (),
        worst_s=found.worst_s,
        ratio=found.ratio,
        separation=found.separation,
        vehicles=vehicles,
        ideal_s=found.ideal_s,
        bound_s=found.bound_s,
        unreachable=cells_of(task).unreachable_text(),
        ways=found.ways,
    )


def _why(error: str, file: PlannerFile | None) -> str:
    """Return one line for a traceback; for a planner in a file it names the line of the file."""
    lines = error.strip().splitlines() or ["it does not say why"]
    return error_with_line(error, file.path) if file is not None and len(lines) > 1 else lines[-1]


@dataclass
class _PreviewProcess:
    """One request and the process that answers it."""

    task: PlannerTask
    number: int
    process: subprocess.Popen[bytes]
    output: IO[bytes]
    since_s: float


class PreviewProcesses:
    """Previews of a worker's team and of new teams, each in a process of its own, polled from the worker's loop."""

    def __init__(self, files: Mapping[str, PlannerFile]) -> None:
        self._arguments = [part for f in files.values() for part in ("--file", f.name, f.sha256, str(f.path))]
        self._running: list[_PreviewProcess] = []
        self._not_begun: list[PreviewResult] = []

    def begin(self, ask: PreviewTask, now: float) -> None:
        """Kill the processes of older requests and start this one. A request without a task only kills.

        Where the system gives no process or no room for its files, the preview fails; the planner that flies goes on.
        """
        for old in [each for each in self._running if ask.task is None or each.number != ask.number]:
            self._end(old)
        if ask.task is None:
            return
        try:
            self._running.append(self._start(ask.task, ask, now))
        except OSError as error:
            text = f"cannot be begun: {error.strerror or error}"
            self._not_begun.append(PreviewResult(ask.task.team, ask.number, "failed", text=text))

    def _start(self, task: PlannerTask, ask: PreviewTask, now: float) -> _PreviewProcess:
        """Start the process that answers. Raises OSError."""
        command = [sys.executable, "-m", "tui_gcs.planner.runtime.preview", *self._arguments]
        # Files instead of pipes: the worker's loop must not block on a full pipe.
        with contextlib.ExitStack() as files, tempfile.TemporaryFile() as question:
            output = files.enter_context(tempfile.TemporaryFile())
            question.write(encode(ask))
            question.seek(0)
            process = subprocess.Popen(command, stdin=question, stdout=output)
            files.pop_all()  # the output is closed with the answer
        return _PreviewProcess(task, ask.number, process, output, now)

    def poll(self, now: float) -> list[PreviewResult]:
        """Return the results that have come since the last call, each once."""
        over = [each for each in self._running if each.process.poll() is not None or now - each.since_s >= LIMIT_S]
        not_begun, self._not_begun = self._not_begun, []
        return not_begun + [self._answer(each) for each in over]

    def _answer(self, running: _PreviewProcess) -> PreviewResult:
        late = running.process.poll() is None
        running.process.kill()
        running.process.wait()
        running.output.seek(0)
        data = running.output.read()
        self._end(running)
        try:
            return decode(data, PreviewResult)
        except msgspec.MsgspecError:
            text = f"does not configure within {LIMIT_S:.0f} s" if late else "the planner's process died"
            return PreviewResult(running.task.team, running.number, "failed", text=text)

    def _end(self, running: _PreviewProcess) -> None:
        running.process.kill()
        running.process.wait()
        running.output.close()
        self._running.remove(running)


def main() -> int:
    """Answer one request on stdin. What the planner prints goes to stderr."""
    out = os.fdopen(os.dup(1), "wb")  # for the result alone
    os.dup2(2, 1)
    os.nice(NICE)
    # The process that asked may be gone and unable to kill this one.
    signal.alarm(math.ceil(LIMIT_S))
    resource.setrlimit(resource.RLIMIT_DATA, (MAX_DATA_BYTES, MAX_DATA_BYTES))
    parser = argparse.ArgumentParser(prog="planner preview")
    parser.add_argument("--file", nargs=3, action="append", default=[])
    files = {name: PlannerFile(name, Path(path), sha256) for name, sha256, path in parser.parse_args().file}
    out.write(encode(preview(decode(sys.stdin.buffer.read(), PreviewTask), files)))
    out.close()
    return 0


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)
