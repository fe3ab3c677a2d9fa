"""The guard: what it costs, and whether any of many random streams of intents gets the better of it.

`GUARD_RUNS=1000 GUARD_FIRST=0 nice -n 15 python -m tests.bench guard` may run in the background; which seeds are done
is printed as it goes, so that it can be taken up again there, and `GUARD_FIRST=417 GUARD_RUNS=1` repeats one.
"""

import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from tests.bench.row import Row
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.scenario.model import Limits, OperatingArea

RUNS = int(os.environ.get("GUARD_RUNS", "1000"))
FIRST = int(os.environ.get("GUARD_FIRST", "0"))
"""Seed of the first run."""
TOLD_EVERY = 20
SECONDS = 30.0
JUDGED_HZ = 5.0
FLOWN = ("ardupilot", "px4", "mixed")
WIND_M_S, NOISE_M = (0.0, 0.0, 4.0, 7.0), (0.0, 0.3)


def guard(folder: Path) -> Iterator[Row]:
    """CPU at 8 and 250 vehicles; random runs that ended with something that must not be."""
    for n in (8, 250):
        yield Row(f"guard, {n} vehicles judged at {JUDGED_HZ:.0f} Hz: CPU", 100.0 * _share(n), "%", 8.0)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        bad = 0
        for seed, problems in enumerate(pool.map(_run, range(FIRST, FIRST + RUNS), chunksize=4), FIRST):
            bad += bool(problems)
            for problem in problems:
                print(f"  random run {seed}: {problem}", flush=True)
            if (seed - FIRST) % TOLD_EVERY == TOLD_EVERY - 1:
                print(f"  random runs {FIRST} to {seed}: {bad} with a violation", flush=True)
    yield Row(f"{RUNS} random runs of {SECONDS:.0f} s: with a violation", bad, "", 0.0)


def _share(n: int) -> float:
    """CPU seconds a second, for vehicles all over an area that all have new trajectories."""
    rng = np.random.default_rng(n)
    area = OperatingArea(Rectangle(centre_m=(300.0, 200.0), width_m=600.0, height_m=400.0), 20.0, 90.0)
    judge = Guard(Limits(), area, ())
    t = np.arange(0.0, 3.25, 0.25)[:, None]
    sights, courses = [], []
    for number in range(n):
        place = rng.uniform((40.0, 40.0, 25.0), (560.0, 360.0, 85.0))
        velocity = np.array([*rng.normal(0.0, 4.0, 2), 0.0])
        course = Trajectory(0.0, 0.25, place + t * velocity, np.repeat(velocity[None], len(t), axis=0))
        courses.append(course)
        x, y, z = place.tolist()
        sights.append(VehicleState(number, (x, y, z), tuple(velocity.tolist()), MotionModel.FOLLOWS, course, age_s=0.1))
    began_s, rounds = time.process_time(), 5
    for i in range(rounds):
        now = i / JUDGED_HZ
        judge.judge(sights, courses, sights, now)
    return (time.process_time() - began_s) / rounds * JUDGED_HZ


def _run(seed: int) -> list[str]:
    import tempfile

    from tests.core.rigs.wild import Weather, run_wild

    weather = Weather(WIND_M_S[seed % 4], NOISE_M[seed // 4 % 2])
    with tempfile.TemporaryDirectory(prefix="tg") as folder:
        found = run_wild(Path(folder), seed, SECONDS, FLOWN[seed % 3], weather, trouble=seed % 2 == 1)
    return [f"{FLOWN[seed % 3]}, {weather}: {problem}" for problem in found.problems()]
