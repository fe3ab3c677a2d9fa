"""`make bench`: the measured figures, as a table. Each is measured here, now; what cannot be is said, with the reason.

Takes about six minutes on an idle machine; with other work on it the figures are too high. Parts are chosen by name,
the longest only so: python -m tests.bench wire load commands. Random inputs: python -m tests.bench fleets --seed 1,
and `zones` likewise
"""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.bench import fleets
from tests.bench.commands import commands
from tests.bench.console import console
from tests.bench.decode import decoder
from tests.bench.files import files
from tests.bench.flood import flood
from tests.bench.guard import guard
from tests.bench.headless import help_cpu, lock_step
from tests.bench.hold import hold
from tests.bench.live import live
from tests.bench.live_fleet import live_fleet
from tests.bench.load import latency, load
from tests.bench.planning.guardian_figures import guardian
from tests.bench.planning.guardian_flown import guardian_flown
from tests.bench.planning.losses import planning_losses
from tests.bench.planning.planning import planning, planning_long
from tests.bench.planning.runs import planning_runs
from tests.bench.planning.turns import planning_turns
from tests.bench.promises.counted import promises
from tests.bench.restart import restart
from tests.bench.row import NotMeasured, Row
from tests.bench.screens.editing import editing
from tests.bench.screens.figures import screens
from tests.bench.sim import sim
from tests.bench.wire import wire
from tests.bench.zones.flown import main as zones

PARTS: dict[str, Callable[[Path], Iterator[Row]]] = {
    "help": help_cpu,
    "decoder": decoder,
    "wire": wire,
    "commands": commands,
    "lock-step": lock_step,
    "sim": sim,
    "load": load,
    "latency": latency,
    "hold": hold,
    "restart": restart,
    "flood": flood,
    "live": live,
    "live-fleet": live_fleet,
    "console": console,
    "screens": screens,
    "editing": editing,
    "files": files,
    "planning": planning,
    "planning-long": planning_long,
    "planning-turns": planning_turns,
    "planning-losses": planning_losses,
    "planning-runs": planning_runs,
    "guardian": guardian,
    "guardian-flown": guardian_flown,
    "guard": guard,
    "promises": promises,
}
LONG_S = {
    "lock-step": 150,
    "planning": 150,
    "planning-long": 1500,
    "planning-turns": 200,
    "planning-runs": 350,
    "load": 95,
    "live": 150,
    "live-fleet": 600,
    "console": 420,
    "screens": 150,
    "files": 70,
    "commands": 650,
    "guardian": 1800,
    "guardian-flown": 400,
    "guard": 1200,
    "promises": 400,
}
"""Parts that take more than a minute say so."""
RANDOM: dict[str, Callable[[list[str]], int]] = {"fleets": fleets.main, "zones": zones}
"""Parts with arguments of their own: random inputs from a seed."""
BY_NAME_ONLY = {
    "commands",
    "live-fleet",
    "planning-long",
    "planning-turns",
    "guardian",
    "guardian-flown",
    "guard",
    "promises",
}


def main(chosen: list[str]) -> int:
    """Measure the chosen parts, all but the longest by default; 1 if a limit is not kept."""
    if chosen and chosen[0] in RANDOM:
        return RANDOM[chosen[0]](chosen[1:])
    unknown = set(chosen) - set(PARTS)
    if unknown:
        print(f"bench: no part {', '.join(sorted(unknown))}; there are: {', '.join(PARTS)}", file=sys.stderr)
        return 2
    kept = True
    print(f"load average before: {os.getloadavg()[0]:.2f} on {os.cpu_count()} cores")
    print(f"{'figure':<60}{'measured':>14}{'limit':>12}")
    for name in chosen or [name for name in PARTS if name not in BY_NAME_ONLY]:
        if name in LONG_S:
            print(f"{name}: takes about {LONG_S[name]} s", flush=True)
        with tempfile.TemporaryDirectory(prefix="tg", ignore_cleanup_errors=True) as folder:
            os.environ["TUI_GCS_RUNTIME_DIR"] = f"{folder}/run"
            os.environ["TUI_GCS_STATE_DIR"] = f"{folder}/state"
            try:
                for row in PARTS[name](Path(folder)):
                    kept &= row.kept
                    print(row, flush=True)
            except NotMeasured as why:
                kept = False
                print(f"{name}: not measured: {why}", flush=True)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
