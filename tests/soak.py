"""Soak test: eight simulated vehicles behind lossy links and a real station, looked at once a minute.

python -m tests.soak [HOURS]; prints a line for each look. It exits 1 if the station was restarted, lost a vehicle in
the end, opened more and more files, or its memory grew by more than 1 MB/h after the first hour (R1).
"""

import sys
import tempfile
import time
from pathlib import Path

from tests.rigs.own_station import Watcher, processes, station_in, until
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[1] / "tui_gcs/scenarios/swarm-challenge.toml"
FAULT = "loss=0.1,flap=3600s/10s"
LOOK_S, WARM_UP_H = 60.0, 1.0
MAX_GROWTH_MB_H, MAX_MORE_FILES = 1.0, 4


def main(hours: float) -> int:
    """Fly for so long; 1 if a limit was exceeded."""
    vehicles = spec_of(load(SCENARIO))
    options = LaunchOptions(vehicles, fault=FAULT)
    folder = Path(tempfile.mkdtemp(prefix="soak-"))
    with station_in(folder, lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], options)) as watcher:
        until(lambda: watcher.status is not None and watcher.status.heard == 8, 60, "8 vehicles heard")
        until(lambda: watcher.ask(m.Start(vehicles=tuple(range(1, 9)))).ok, 60, "vehicles ready")
        return _watch(watcher, hours)


def _watch(watcher: Watcher, hours: float) -> int:
    begun_s, (pid, *_) = time.monotonic(), processes("tui_gcs.core.process.station_process")
    looks: list[tuple[float, float, int]] = []
    while not looks or looks[-1][0] < hours:
        time.sleep(min(LOOK_S, max(1.0, 3600.0 * hours)))
        if pid not in processes("tui_gcs.core.process.station_process"):
            print("FAILED: the station died")
            return 1
        looks.append(((time.monotonic() - begun_s) / 3600.0, _rss_mb(pid), _files(pid)))
        heard = watcher.status.heard if watcher.status is not None else 0
        print("{:7.3f} h  {:7.1f} MB  {:3d} files".format(*looks[-1]), f" {heard} heard", flush=True)
    warm = [look for look in looks if look[0] >= WARM_UP_H]
    grown = (warm[-1][1] - warm[0][1]) / max(warm[-1][0] - warm[0][0], 1e-9) if len(warm) > 10 else 0.0
    more = looks[-1][2] - looks[0][2]
    print(f"memory {grown:+.2f} MB/h after the first hour, {more:+d} files")
    return int(grown > MAX_GROWTH_MB_H or more > MAX_MORE_FILES)


def _rss_mb(pid: int) -> float:
    lines = (Path("/proc") / str(pid) / "status").read_text().splitlines()
    return next(float(line.split()[1]) / 1000.0 for line in lines if line.startswith("VmRSS"))


def _files(pid: int) -> int:
    return sum(1 for _ in (Path("/proc") / str(pid) / "fd").iterdir())


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 24.0))
