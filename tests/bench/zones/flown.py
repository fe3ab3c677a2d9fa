"""Previews and rehearses random scenarios, prints a line for each, and sums them up."""

import argparse
import json
import math
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from tests.bench.zones.baseline import boustrophedon_worst_s
from tests.bench.zones.scenarios import RandomScenario, random_scenario
from tests.bench.zones.vetoes import VetoRecord, recorded
from tui_gcs.cli.files.check_lines import AUTOPILOTS
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.own_limits import own_limits
from tui_gcs.core.firmware.registry import off_course_m
from tui_gcs.core.flight.planner_tasks import crewed, crews, within_own_limits
from tui_gcs.core.protocol.common import FleetFrame, PlannerTask
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.runtime.plan_forecast import SearchLimit, forecast
from tui_gcs.rehearsal.lock_step import FlightConditions
from tui_gcs.rehearsal.rehearse import rehearse

WITHIN = 0.05
"""Share by which the flown worst idleness may differ from the preview."""
QUANTUM_S = 0.3
"""Idleness is measured on pictures 0.1 s apart and predicted in steps of up to 0.25 s."""
MEDIAN = 0.85
"""Of the baseline's worst idleness."""


@dataclass
class ZoneFigures:
    """What one scenario gave. None: not measured."""

    number: int
    kind: str
    holes: str
    n: int
    autopilot: str
    ha: float
    ideal_s: float
    bound_s: float
    preview_s: float
    baseline_s: float
    plan_cpu_s: float
    flown_s: float | None = None
    coverage: float | None = None
    vetoes: float | None = None
    separation: float | None = None
    problem: str = ""
    why: list[str] = field(default_factory=list)
    """A line for each veto."""

    @property
    def share(self) -> float:
        """The preview's share of the baseline's worst idleness; NaN where both watch all of it all the time."""
        if max(self.preview_s, self.baseline_s) <= QUANTUM_S:
            return math.nan
        return self.preview_s / self.baseline_s if self.baseline_s > 0.0 else math.inf

    @property
    def broken(self) -> list[str]:
        """Which promises were not kept."""
        found = [self.problem] if self.problem else []
        if not math.isfinite(self.preview_s):
            found.append("no preview")
        if self.share > 1.0 + 1e-6 and self.preview_s - self.baseline_s > QUANTUM_S:
            found.append("worse than the baseline")
        if self.coverage is not None and self.coverage < 1.0:
            found.append(f"{100 * self.coverage:.2f} % seen")
        if self.vetoes:
            found.append(f"{self.vetoes:.0f} vetoes")
        if self.separation is not None and self.separation < 1.0:
            found.append(f"separation {self.separation:.2f}")
        if self.flown_s is not None and abs(self.flown_s - self.preview_s) > WITHIN * self.preview_s + QUANTUM_S:
            found.append("flown is not as previewed")
        return found


def task_of(scenario: Scenario, autopilot: str) -> PlannerTask:
    """Return the task of the only team, for vehicles with this autopilot."""
    crew = crews(scenario)
    task = crewed(scenario, scenario.rounds[0], scenario.teams[0], crew[scenario.teams[0].name])
    number = AUTOPILOTS[autopilot]
    task = within_own_limits(task, dict.fromkeys(task.members, own_limits(number, {}, simulated=True)))
    return msgspec.structs.replace(task, off_course_m=off_course_m(number))


def previewed(drawn: RandomScenario, scenario: Scenario) -> ZoneFigures:
    """Return the figures without a flight."""
    task = task_of(scenario, drawn.autopilot)
    starts_m = {place.vehicle: place.place_m for place in scenario.places if place.vehicle is not None}
    nobody = FleetFrame(seq=0, t_s=0.0, wall_s=0.0, kind=RunKind.SIM)
    begin_s = time.process_time()
    found = forecast(task, nobody, {}, starts_m, search=SearchLimit())
    cpu_s = time.process_time() - begin_s
    problem = found.plan.error.strip().splitlines()[-1] if found.plan.error else ""
    baseline_s = boustrophedon_worst_s(task) if not problem else math.nan
    return ZoneFigures(
        drawn.number,
        drawn.kind,
        drawn.holes,
        drawn.n,
        drawn.autopilot,
        drawn.area_m2 / 1e4,
        found.ideal_s,
        found.bound_s,
        found.worst_s,
        baseline_s,
        cpu_s,
        problem=problem,
    )


def fly(figures: ZoneFigures, drawn: RandomScenario, scenario: Scenario) -> None:
    """Rehearse the scenario and add what was flown."""
    with tempfile.TemporaryDirectory(prefix="zones") as folder:
        conditions = FlightConditions(autopilots=drawn.autopilot)
        with recorded(record := VetoRecord()):
            result, problem = rehearse(
                scenario,
                drawn.toml,
                Path(folder),
                lambda _share, _text: None,
                conditions,
                rounds=1,
                watch=lambda bus, _referee: record.listen(bus),
            )
    figures.why = [veto.line() for veto in record.vetoes]
    (r,) = result.rounds
    checks = {check.name: check for check in result.checks}
    figures.flown_s, figures.coverage = r.worst_idleness_s, r.coverage
    figures.vetoes = checks["guard vetoes"].value
    figures.separation = checks["separation, x limit"].value
    failed = [f"{c.name} {c.value} {c.why}".strip() for c in result.checks if not c.ok and "veto" not in c.name]
    figures.problem = problem or "; ".join(failed)


def line(f: ZoneFigures) -> str:
    """Return one line of the table."""
    flown = "    --" if f.flown_s is None else f"{f.flown_s:6.1f}"
    text = f"{f.number:4} {f.kind:9} {f.holes:8} {f.n:3} {f.autopilot:9} {f.ha:8.3f} {f.ideal_s:6.1f} {f.bound_s:6.1f}"
    return f"{text} {f.preview_s:7.1f} {flown} {f.baseline_s:8.1f} {f.share:5.2f}  {'; '.join(f.broken) or 'ok'}"[:200]


def main(arguments: list[str]) -> int:
    """Measure; 1 if a promise was not kept."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench zones")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="default: the clock")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first scenario")
    parser.add_argument("--no-flights", action="store_true", help="previews and baseline only")
    parser.add_argument("--vetoes", type=int, default=3, help="so many vetoes of a zone are printed")
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args(arguments)
    warm_up()
    print(f"zones: --seed {chosen.seed} --count {chosen.count}")
    print(
        f"{'':4} {'kind':9} {'holes':8} {'n':>3} {'autopilot':9} {'ha':>8} {'ideal':>6} {'bound':>6} {'preview':>7} ",
        end="",
    )
    print(f"{'flown':>6} {'baseline':>8} {'share':>5}")
    found = []
    for number in range(chosen.first, chosen.first + chosen.count):
        drawn = random_scenario(chosen.seed, number)
        figures = _measured(drawn, flights=not chosen.no_flights)
        found.append(figures)
        print("\n".join([line(figures), *figures.why[: chosen.vetoes]]), flush=True)
        if chosen.json:
            data = {"seed": chosen.seed, "zones": [asdict(f) | {"broken": f.broken} for f in found]}
            chosen.json.write_text(json.dumps(data, indent=1))
    return _summary(found)


def _measured(drawn: RandomScenario, *, flights: bool) -> ZoneFigures:
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write(drawn.toml)
        file.flush()
        scenario = load(Path(file.name))
    figures = previewed(drawn, scenario)
    if flights and not figures.problem:
        fly(figures, drawn, scenario)
    return figures


def _summary(found: list[ZoneFigures]) -> int:
    flown = [f for f in found if f.flown_s is not None]
    broken = [f for f in found if f.broken]
    shares = [f.share for f in found if math.isfinite(f.share) and math.isfinite(f.baseline_s)]
    median, most = (float(np.median(shares)), max(shares)) if shares else (math.nan, math.nan)
    print(f"{len(found)} zones, {len(flown)} flown, {len(broken)} with a promise broken: {[f.number for f in broken]}")
    print(f"{sum(math.isinf(f.baseline_s) for f in found)} in which the baseline does not see every cell,")
    print(f"{sum(math.isnan(f.share) for f in found)} in which both watch everything all the time;")
    print(f"share of the baseline's worst idleness: median {median:.3f} (limit {MEDIAN}), most {most:.3f} (limit 1)")
    return 1 if broken or not median <= MEDIAN else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
