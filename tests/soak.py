"""Soak test: eight simulated vehicles behind lossy links and a real station, looked at once a minute.

python -m tests.soak [HOURS]; prints a line for each look. It exits 1 if the station was restarted, lost a vehicle in
the end, opened more and more files, or its memory grew by more than 1 MB/h after the first hour (R1).
"""

import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.rigs.own_station import Watcher, processes, station_in, until
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[1] / "tui_gcs/scenarios/swarm-challenge.toml"
FAULT = "loss=0.1,flap=3600s/10s"
STATION = "tui_gcs.core.process.station_process"
VEHICLES = 8
LOOK_S, WARM_UP_H, MIN_WARM_LOOKS = 60.0, 1.0, 11
RETURN_S = 30.0
"""Time in which all vehicles must be heard at the end: a flap of a link takes 10 s."""
MAX_GROWTH_MB_H, MAX_MORE_FILES = 1.0, 4


@dataclass(frozen=True)
class Look:
    """What was seen of the station at one time."""

    hours: float
    """Since the vehicles flew."""
    rss_mb: float
    files: int
    heard: int


def main(hours: float) -> int:
    """Fly for so long; 1 if a limit was exceeded."""
    options = LaunchOptions(spec_of(load(SCENARIO)), fault=FAULT)
    folder = Path(tempfile.mkdtemp(prefix="soak-"))
    with station_in(folder, lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], options)) as watcher:
        until(lambda: watcher.status is not None and watcher.status.heard == VEHICLES, 60, "8 vehicles heard")
        until(lambda: watcher.ask(m.Start(vehicles=tuple(range(1, VEHICLES + 1)))).ok, 60, "vehicles ready")
        looks = _watch(watcher, hours)
        with suppress(AssertionError):  # the flap of a link may be now
            until(lambda: _heard(watcher) == VEHICLES, RETURN_S, "all heard")
        problems = problems_of(looks, heard_at_end=_heard(watcher), alive=looks[-1].files > 0)
    print(f"memory {growth_mb_h(looks):+.2f} MB/h after the first hour, {looks[-1].files - looks[0].files:+d} files")
    for problem in problems:
        print(f"FAILED: {problem}")
    return int(bool(problems))


def problems_of(looks: Sequence[Look], *, heard_at_end: int, alive: bool) -> list[str]:
    """What was not as it should be, in words."""
    problems = [] if alive else ["the station died"]
    if heard_at_end < VEHICLES:
        problems.append(f"{heard_at_end} of {VEHICLES} vehicles are heard at the end")
    if alive and (more := looks[-1].files - looks[0].files) > MAX_MORE_FILES:
        problems.append(f"{more} more files are open")
    if (grown := growth_mb_h(looks)) > MAX_GROWTH_MB_H:
        problems.append(f"memory grew by {grown:.2f} MB/h")
    return problems


def growth_mb_h(looks: Sequence[Look]) -> float:
    """Growth of the memory after the first hour; 0 if there was not much of a second one."""
    warm = [look for look in looks if look.hours >= WARM_UP_H and look.files > 0]
    if len(warm) < MIN_WARM_LOOKS:
        return 0.0
    return (warm[-1].rss_mb - warm[0].rss_mb) / (warm[-1].hours - warm[0].hours)


def _watch(watcher: Watcher, hours: float) -> list[Look]:
    """One look a minute; the last one has no files if the station has died."""
    begun_s, (pid, *_) = time.monotonic(), processes(STATION)
    looks: list[Look] = []
    while not looks or looks[-1].hours < hours:
        time.sleep(min(LOOK_S, max(1.0, 3600.0 * hours)))
        passed_h = (time.monotonic() - begun_s) / 3600.0
        if pid not in processes(STATION):
            looks.append(Look(passed_h, 0.0, 0, 0))
            break
        looks.append(Look(passed_h, _rss_mb(pid), _files(pid), _heard(watcher)))
        print("{0.hours:7.3f} h  {0.rss_mb:7.1f} MB  {0.files:3d} files  {0.heard} heard".format(looks[-1]), flush=True)
    return looks


def _heard(watcher: Watcher) -> int:
    return watcher.status.heard if watcher.status is not None else 0


def _rss_mb(pid: int) -> float:
    lines = (Path("/proc") / str(pid) / "status").read_text().splitlines()
    return next(float(line.split()[1]) / 1000.0 for line in lines if line.startswith("VmRSS"))


def _files(pid: int) -> int:
    return sum(1 for _ in (Path("/proc") / str(pid) / "fd").iterdir())


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 24.0))
