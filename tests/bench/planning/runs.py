"""Patrols in random runs: separation; and what a step and a loss cost, with few vehicles and with many."""

import copy
import gc
import itertools
import multiprocessing
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import msgspec
import numpy as np

from tests.bench.planning.zones import unseen
from tests.bench.row import Row
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.protocol.common import Freshness, Phase, PlannerTask
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet, scattered, task_for

RUNS, RUN_S, ZONES, ZONES_SEED = 1000, 40.0, 6, 5
FRAME_S, FRAMES_PER_STEP = 0.1, 2
HEIGHT_OFF_M = 0.9
"""Vehicles are above or below their layers by at most this. Layers are 7 m apart, the limit is 5 m: two may be 2 m too
near in all, and noise without bounds is more than that by chance in one run of twenty, whatever a planner does."""
MANY_AREA = OperatingArea(Rectangle((1000.0, 1000.0), 2000.0, 2000.0), 20.0, 90.0)


def planning_runs(_: Path) -> Iterator[Row]:
    """Random zones, numbers, losses, joins, round changes; vehicles follow late and at heights that are a bit off."""
    violations, nearest_m = 0, np.inf
    seeds = sorted(range(RUNS), key=_vehicles)  # so that a worker designs each tour once
    with multiprocessing.get_context("spawn").Pool() as workers:
        for closest_m in workers.imap_unordered(_run, seeds, chunksize=RUNS // 40):
            violations += closest_m <= 0.0
            nearest_m = min(nearest_m, closest_m)
    yield Row(f"separation violated in {RUNS} random runs", violations, "", 0)
    yield Row("least height beyond the limit where two were over one place", nearest_m, "m")
    for count, limit_ms, side_m in ((8, 5.0, 160.0), (250, 20.0, 900.0), (1000, 50.0, 1800.0)):
        yield from _costs(count, limit_ms, side_m)


def _run(seed: int) -> float:
    """Least vertical distance beyond the limit of two vehicles that were horizontally too close, infinite for none."""
    rng = np.random.default_rng([seed, 1])
    zone, n = int(rng.integers(ZONES)), _vehicles(seed)
    host, task = _host(zone, n)
    world = KinematicFleet(task, scattered(n, seed), lag_s=float(rng.uniform(0.0, 0.5)))
    limits, closest_m, (one, other) = task.limits, np.inf, np.triu_indices(n, 1)
    for frame in range(round(RUN_S / FRAME_S)):
        if frame % FRAMES_PER_STEP == 0:
            world.take(host.step(world.frame()))
        if rng.random() < 0.005:
            vehicle = int(rng.integers(1, n + 1))
            world.freshness = {vehicle: Freshness.LOST} if rng.random() < 0.5 else {}
            world.phase = {vehicle: Phase.HOLDING} if rng.random() < 0.3 else {}
        if rng.random() < 0.002:
            host, _ = _host(int(rng.integers(ZONES)), n)
        world.move(FRAME_S)
        at = world.position_m + rng.uniform(-HEIGHT_OFF_M, HEIGHT_OFF_M, (n, 1)) * (0.0, 0.0, 1.0)
        close = np.hypot(*(at[one] - at[other])[:, :2].T) < limits.separation_horizontal_m
        beyond_m = np.abs(at[one] - at[other])[close, 2] - limits.separation_vertical_m
        closest_m = min(closest_m, float(beyond_m.min(initial=np.inf)))
    return closest_m


def _vehicles(seed: int) -> int:
    return 2 + seed % 7


def _host(zone: int, n: int) -> tuple[PlannerHost, PlannerTask]:
    host, task = _configured(zone, n)
    return copy.deepcopy(host), task


@cache
def _configured(number: int, n: int) -> tuple[PlannerHost, PlannerTask]:
    _, zone, area, closed = next(itertools.islice(unseen(number + 1, ZONES_SEED), number, None))
    task = task_for(range(1, n + 1), "patrol", shape=zone.shape, area=area, parameters={"search": 0})
    task = msgspec.structs.replace(task, no_fly=closed)
    host = PlannerHost(TEAM)
    host.set_task(task)
    return host, task


def _costs(count: int, limit_ms: float, side_m: float) -> Iterator[Row]:
    shape = Rectangle((1000.0, 1000.0), side_m, 0.75 * side_m)
    task = task_for(range(1, count + 1), "patrol", shape=shape, area=MANY_AREA, parameters={"search": 0})
    host = PlannerHost(TEAM)
    gc.collect()
    gc.freeze()  # as planner/runtime/worker.py does
    begin_s = time.process_time()
    host.set_task(task)
    yield Row(f"{count} vehicles: planned at once, CPU", time.process_time() - begin_s, "s")
    world = KinematicFleet(task, scattered(count) + np.array([800.0, 700.0]))
    taken, loss_ms = [], 0.0
    for step in range(300):
        if step == 250:
            world.freshness = {1: Freshness.LOST, 5: Freshness.LOST}
        begin_s = time.process_time()
        plan = host.step(world.frame())
        spent_ms = 1e3 * (time.process_time() - begin_s)
        taken.append(spent_ms)
        loss_ms = spent_ms if step == 250 else loss_ms
        world.take(plan)
        for _ in range(FRAMES_PER_STEP):
            world.move(FRAME_S)
    yield Row(f"{count} vehicles: step, p99, CPU", float(np.percentile(taken, 99)), "ms", limit_ms)
    limit = {8: 50.0, 250: 250.0}.get(count)
    yield Row(f"{count} vehicles: new slots after a loss, CPU", loss_ms, "ms", limit)
