"""The real form at its largest: 250 simulated vehicles in 20 teams fly; all processes of `tui-gcs demo` are counted."""

import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.bench.live import cpu_s, end, family, joined, ps, wait
from tests.bench.row import NotMeasured, Row
from tests.rigs.console_pty import PtyConsole
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import STATUS

VEHICLES, TEAMS, ROUNDS = 250, 20, 3
ALL_UP_WITHIN_S = 900.0
MEASURED_S = 60.0
ROLES = {
    "sitl.launch.simulated": "simulator",
    "station_process": "station",
    "planner.runtime.worker": "planner workers",
    "tui_gcs.cli.main": "console",
}
"""What a process does, by words of its command line; what is none of these is started by them and rests."""
LIMITS_PCT = {"station": 45.0, "planner workers": 45.0, "console": 12.0}


def live_fleet(folder: Path) -> Iterator[Row]:
    """Start all, wait until their planners steer them, then count each role's CPU time for a minute."""
    scenario = folder / "fleet.toml"
    made = [
        "scenario",
        "new",
        str(scenario),
        "--vehicles",
        str(VEHICLES),
        "--teams",
        str(TEAMS),
        "--rounds",
        str(ROUNDS),
    ]
    subprocess.run([sys.executable, "-m", "tui_gcs.cli.main", *made], check=True, capture_output=True)
    console = PtyConsole(["demo", "--scenario", str(scenario)], 120, 40)
    ours = {console.pid}
    try:
        bus = joined()
        status: list[m.StationStatus] = []
        bus.subscribe(STATUS, lambda _, data: status.append(m.decode(data, m.StationStatus)))
        wait(console, lambda: bool(status) and status[-1].heard == VEHICLES, 60, f"{VEHICLES} vehicles heard")
        start = m.encode(m.Start(vehicles=tuple(range(1, VEHICLES + 1))))
        began_s = time.monotonic()
        answers_s: list[float] = []

        def started() -> bool:
            asked_s = time.monotonic()
            reply = m.decode(bus.ask("gcs/req/bench", start, timeout_s=20.0), m.Reply)
            answers_s.append(time.monotonic() - asked_s)
            return reply.ok

        wait(console, started, 120, "vehicles ready to start")
        yield Row(f"{VEHICLES} vehicles: until all were ready and the start was taken", time.monotonic() - began_s, "s")
        yield Row(f"{VEHICLES} vehicles: longest wait for an answer to a start", max(answers_s), "s", 2.0)
        wait(console, lambda: status[-1].run is m.RunPhase.RUNNING, ALL_UP_WITHIN_S, "all on their layers")
        yield Row(f"{VEHICLES} vehicles: from the start until all are on their layers", time.monotonic() - began_s, "s")
        yield Row("of them in the air", status[-1].armed, "", VEHICLES, at_least=True)
        console.read(30)  # ways to their slots
        ours |= family(console.pid)
        seen = len(status)
        yield from _used(ours, console)
        late = sum(team.worker != "running" for one in status[seen:] for team in one.teams)
        yield Row("statuses of a team in which its planner was late or gone", late, "", 0)
        yield Row("on their slots at the end", sum(team.on_slot for team in status[-1].teams), "")
        bus.close()
    finally:
        end(ours | family(console.pid))
        os.waitpid(console.pid, 0)


def _used(pids: set[int], console: PtyConsole) -> Iterator[Row]:
    """Rows with the CPU time of each role while the console is read for `MEASURED_S`, in percent of a core."""
    roles = {pid: _role(pid) for pid in pids}
    before_s, began_s = {pid: cpu_s(pid) for pid in pids}, time.monotonic()
    console.read(MEASURED_S)
    used_s: Counter[str] = Counter()
    for pid in pids:
        used_s[roles[pid]] += cpu_s(pid) - before_s[pid]
    elapsed_s = time.monotonic() - began_s
    if not used_s["station"]:
        raise NotMeasured("no station among the processes of the demo")
    for role, seconds in used_s.items():
        yield Row(
            f"{VEHICLES} vehicles in flight at 1x: {role}, CPU", 100 * seconds / elapsed_s, "%", LIMITS_PCT.get(role)
        )


def _role(pid: int) -> str:
    command = ps("-o", "args=", "-p", str(pid))
    return next((role for words, role in ROLES.items() if words in command), "others")
