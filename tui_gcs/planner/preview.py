"""What a planner would make of a task, without flying it, with the whole team in the air.

`python -m tui_gcs.planner.preview [--file NAME SHA256 PATH]…` reads a `PreviewTask` and writes a `PreviewResult`: a
process of its own, which can be killed when nobody wants to know any more.
"""

import argparse
import math
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import msgspec

from tui_gcs.core.messages import PreviewResult, PreviewTask, decode, encode
from tui_gcs.planner.foresight import foresee, vehicles_for
from tui_gcs.planner.registry import PlannerFile

LIMIT_S = 60.0
NICE = 10
"""The planners that fly come first."""


def preview(ask: PreviewTask, files: Mapping[str, PlannerFile]) -> PreviewResult:
    """What comes of it. Raises ValueError if there is nothing to look at."""
    task, frame = ask.task, ask.frame
    if task is None or frame is None:
        raise ValueError("nothing to look at")
    layers_m = dict.fromkeys(task.members, task.area.alt_min_m) | task.layers_m
    task = msgspec.structs.replace(task, members=tuple(sorted(task.members)), layers_m=layers_m)
    vehicles = len(task.members)
    try:
        if ask.idleness_s > 0.0:
            vehicles, found = vehicles_for(ask.idleness_s, task, frame, files)
        else:
            found = foresee(task, frame, files)
    except ValueError as why:
        return PreviewResult(task.team, ask.number, "failed", text=str(why))
    if found.plan.error:
        return PreviewResult(task.team, ask.number, "failed", text=found.plan.error.strip().splitlines()[-1])
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
    )


class SidePreview:
    """One preview in a process of its own, watched from a worker's loop."""

    def __init__(self, files: Mapping[str, PlannerFile]) -> None:
        """Nothing runs."""
        self._arguments = [part for f in files.values() for part in ("--file", f.name, f.sha256, str(f.path))]
        self._process: subprocess.Popen[bytes] | None = None
        self._ask: PreviewTask | None = None
        self._since_s = 0.0

    def begin(self, ask: PreviewTask, now: float) -> None:
        """End the last one, and begin this one; without a task only end."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None
        if ask.task is None:
            return
        self._ask, self._since_s = ask, now
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the answer
        command = [sys.executable, "-m", "tui_gcs.planner.preview", *self._arguments]
        with tempfile.TemporaryFile() as question:
            question.write(encode(ask))
            question.seek(0)
            self._process = subprocess.Popen(command, stdin=question, stdout=self._output)

    def poll(self, now: float) -> PreviewResult | None:
        """The answer, once."""
        process, ask = self._process, self._ask
        if process is None or ask is None or ask.task is None:
            return None
        if process.poll() is None and now - self._since_s < LIMIT_S:
            return None
        late = process.poll() is None
        process.kill()
        process.wait()
        self._process = None
        self._output.seek(0)
        data = self._output.read()
        self._output.close()
        try:
            return decode(data, PreviewResult)
        except msgspec.MsgspecError:
            text = f"does not configure within {LIMIT_S:.0f} s" if late else "the planner's process died"
            return PreviewResult(ask.task.team, ask.number, "failed", text=text)


def main() -> int:
    """One question, one answer; what the planner prints goes to stderr."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(NICE)
    signal.alarm(math.ceil(LIMIT_S))  # who asked may be gone
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
