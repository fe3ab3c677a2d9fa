"""Intruders met by simulated autopilots: waves as in `guardian`, through sensors, station, guard and worker's host.

Sensors find what is within 60 m with p = 0.9, five times a second, 2 m off, and raise a false alarm a minute each.
"""

import math
import os
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np

from sitl.launch.fleet import IntruderSpec, SensorSpec, WorldSpec
from tests.bench.guardian import AREA, FAR_M, GOALS, INTRUDER_M_S, MIDDLE, WITHIN_S, ZONE
from tests.bench.row import Row
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.mission_script import Script
from tui_gcs.core.scenario.load import parse, read_text
from tui_gcs.core.scenario.model import Scenario, Team
from tui_gcs.rehearsal.lock_step import LockStep
from tui_gcs.rehearsal.rehearse import IntruderMonitor

SHIPPED = Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml"
WAVES = int(os.environ.get("TUI_GCS_BENCH_WAVES", "8"))
FIRST_S, EVERY_S = 75.0, 70.0
"""Time for taking off and spreading, and from wave to wave."""
HEIGHT_M = 60.0


def guardian_flown(folder: Path) -> Iterator[Row]:
    """Four vehicles, four and eight intruders a wave."""
    for k in (4, 8):
        result = fly(folder, k, seed=100 + k)
        came, met = sum(r.came for r in result.intruders), sum(r.met for r in result.intruders)
        name = f"intruders met in flight: guardian, 4 v {k} ({met} of {came})"
        yield Row(name, 100.0 * met / max(came, 1), "%", GOALS[4, k], at_least=True)
        for check in result.checks:
            if check.name in ("separation, x limit", "guard vetoes"):
                at_least = check.name.startswith("sep")
                yield Row(f"4 v {k}: {check.name}", check.value or 0.0, "", check.limit, at_least=at_least)


def fly(folder: Path, k: int, seed: int) -> FlightResult:
    """One flight with all waves."""
    scenario = guarded()
    logs = folder / f"flown-{k}-{seed}"
    logs.mkdir()
    world = WorldSpec(waves(scenario, k, seed), SensorSpec(range_m=60.0, probability=0.9, false_per_min=1.0))
    flight = LockStep(scenario, read_text(SHIPPED), logs, world=world)
    script = Script(scenario, flight.bus, principal="bench", whole_duration=True)
    watch = IntruderMonitor(flight)
    while not script.done:
        flight.step()
        script.tick()
        watch.tick()
    flight.close()
    return msgspec.structs.replace(script.referee.result(), intruders=watch.incursions.results())


def guarded() -> Scenario:
    """The shipped scenario with one zone and one team of four."""
    scenario = parse(read_text(SHIPPED))
    round_ = msgspec.structs.replace(
        scenario.rounds[0], area=AREA, zones=(ZONE,), duration_s=FIRST_S + WAVES * EVERY_S - 20.0
    )
    team = Team("defend", ZONE.name, "guardian", (1, 2, 3, 4), 0, {})
    return msgspec.structs.replace(scenario, rounds=(round_,), teams=(team,))


def waves(scenario: Scenario, k: int, seed: int) -> tuple[IntruderSpec, ...]:
    """All intruders of a flight."""
    frame, rng = LocalFrame(scenario.origin), np.random.default_rng(seed)
    goal = frame.to_geodetic(float(MIDDLE[0]), float(MIDDLE[1]))
    height_m = scenario.origin.ground_amsl_m + HEIGHT_M
    made = []
    for wave in range(WAVES):
        for bearing, share in zip(rng.random(k) * 2.0 * math.pi, rng.random(k), strict=True):
            x, y = MIDDLE[0] + FAR_M * math.sin(bearing), MIDDLE[1] + FAR_M * math.cos(bearing)
            begin_s = FIRST_S + wave * EVERY_S + share * WITHIN_S
            made.append(IntruderSpec(*frame.to_geodetic(x, y), height_m, *goal, INTRUDER_M_S, begin_s))
    return tuple(made)
