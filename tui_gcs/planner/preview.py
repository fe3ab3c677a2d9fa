"""What a planner would make of a task, without flying it: its first plan with the whole team in the air.

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

from tui_gcs.core.messages import FleetFrame, Freshness, Phase, PlannerTask, PreviewResult, PreviewTask, decode, encode
from tui_gcs.core.zones import polygon_of
from tui_gcs.planner.host import PlannerHost
from tui_gcs.planner.registry import PlannerFile

LIMIT_S = 60.0
NICE = 10
"""The planners that fly come first."""


def preview(ask: PreviewTask, files: Mapping[str, PlannerFile]) -> PreviewResult:
    """Configure and step once. Raises ValueError if there is nothing to look at."""
    if ask.task is None or ask.frame is None:
        raise ValueError("nothing to look at")
    host = PlannerHost(ask.task.team, files)
    host.set_task(ask.task)
    plan = host.step(all_in_the_air(ask.task, ask.frame))
    if plan.error:
        text = plan.error.strip().splitlines()[-1]
        return PreviewResult(ask.task.team, ask.number, "failed", text=text)
    return PreviewResult(ask.task.team, ask.number, "done", plan.metrics, plan.annotations or ())


def all_in_the_air(task: PlannerTask, frame: FleetFrame) -> FleetFrame:
    """The team on its layers, above where it is; above the middle of the area where nobody knows."""
    place = {vehicle: i for i, vehicle in enumerate(frame.ids)}
    middle = polygon_of(task.area.shape).representative_point()
    ids = tuple(sorted(task.members))
    spots = []
    for k, vehicle in enumerate(ids):
        x, y, _ = frame.position_m[place[vehicle]] if vehicle in place else (math.nan,) * 3
        known = math.isfinite(x) and math.isfinite(y)
        layer_m = task.layers_m.get(vehicle, task.area.alt_min_m)
        spots.append((x, y, layer_m) if known else (float(middle.x) + k, float(middle.y), layer_m))
    n = len(ids)
    return FleetFrame(
        seq=frame.seq,
        t_s=frame.t_s,
        wall_s=frame.wall_s,
        kind=frame.kind,
        ids=ids,
        team=(task.team,) * n,
        phase=(Phase.FLYING,) * n,
        freshness=(Freshness.OK,) * n,
        position_m=tuple(spots),
        velocity_m_s=((0.0, 0.0, 0.0),) * n,
        heading_deg=(0.0,) * n,
        battery_pct=(100.0,) * n,
        age_s=(0.0,) * n,
        wind_m_s=frame.wind_m_s,
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
