"""Measures what a planner costs: time per step, and memory per hour."""

import gc
import tracemalloc
from collections.abc import Iterator

import numpy as np

from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.planner.check.subject import CheckedPlanner, Finding, failed, noted, passed
from tui_gcs.planner.runtime.host import DEADLINE_SHARE
from tui_gcs.planner.runtime.kinematic_fleet import FRAME_S, KinematicFleet, scattered, task_for

FEW, MANY = 8, 250
MANY_AREA = OperatingArea(Rectangle((1000.0, 1000.0), 2000.0, 2000.0), 20.0, 90.0)
MANY_ZONE = Rectangle((1000.0, 1000.0), 1100.0, 1090.0)
"""120 ha, so that the share of one vehicle is as in the shipped scenario."""
STEPS, QUICK_STEPS = 2000, 400
"""Steps of a memory check."""
LONGER = 4
"""A planner that keeps memory is flown for so many times the steps: a trail of its last places may still fill."""
LEAK_B, LEAK_B_PER_STEP = 8000.0, 10.0
"""Growth allowed in each of the last two quarters: what Python and numpy allocate and free, and less than a number a
step."""


def step_time(subject: CheckedPlanner) -> Iterator[Finding]:
    """Compare wall times of steps with the deadline. Only a large excess fails: this machine does other things, too."""
    period_ms = 1e3 / subject.planner.rate_hz
    limit_ms = period_ms * DEADLINE_SHARE
    for count, duration_s in ((FEW, 5.0 if subject.quick else 60.0), (MANY, 5.0)):
        if count == MANY and subject.quick:
            return
        half, worst = np.percentile(_times_ms(subject, count, duration_s), (50, 99))
        value = f"{count} vehicles: p50 {half:.2f} ms, p99 {worst:.2f} ms; limit {limit_ms:.0f} ms at this rate"
        # The median decides, because other processes make single steps slow on any machine.
        if half > limit_ms and count == FEW:
            yield failed(value, "3 late in a row and the vehicles hold: do less per step, or declare a lower rate_hz")
        elif half > limit_ms:
            yield noted(value, f"with {count} vehicles most steps are late, which holds them: do less per step")
        elif worst > limit_ms:
            yield noted(value, "a step in a hundred is late, which is no harm; three in a row are")
        else:
            yield passed(value)


def _times_ms(subject: CheckedPlanner, count: int, duration_s: float) -> list[float]:
    """Return the time of every step of a flight in which one vehicle is lost and comes back."""
    ids = range(1, count + 1)
    task = task_for(ids, subject.name, seed=subject.seed)
    if count == MANY:
        task = task_for(ids, subject.name, seed=subject.seed, shape=MANY_ZONE, area=MANY_AREA)
    world, taken = KinematicFleet(task, scattered(count)), list[float]()
    for _, plan in subject.fly(subject.host(task), world, duration_s):
        taken.append(plan.step_ms)
        share = (world.t_s - 100.0) / duration_s
        # A loss is the dearest step of many planners: they plan anew in it.
        world.phase = {1: Phase.TAKEN_OUT} if 0.4 < share < 0.7 else {}
    return taken


def memory(subject: CheckedPlanner) -> Iterator[Finding]:
    """Report memory that steps keep. Where it grows, it is watched for four times as long: a full buffer does not."""
    steps = QUICK_STEPS if subject.quick else STEPS
    rate_hz = min(subject.planner.rate_hz, 1.0 / FRAME_S)  # a planner is not stepped more often than frames come
    task = task_for((1, 2, 3), subject.name, seed=subject.seed)
    host, world = subject.host(task), KinematicFleet(task, scattered(3))
    held_b: list[int] = []
    before, number = None, 0
    tracemalloc.start()
    try:
        for number, _ in enumerate(subject.fly(host, world, LONGER * steps / rate_hz + 1.0), 1):
            if number % (steps // 4) == 0:
                # What only cycles keep alive is not held: it would look like a leak until the next collection.
                gc.collect()
                held_b.append(tracemalloc.get_traced_memory()[0])
                if number in (steps // 2, LONGER * steps // 2):
                    before = tracemalloc.take_snapshot()
                if number == LONGER * steps or (number == steps and not _grows(held_b, steps)):
                    break
        where = _grown_most(before, subject) if before is not None else ""
    finally:
        tracemalloc.stop()
    grown_b = held_b[-1] - held_b[len(held_b) // 2 - 1]
    per_hour_mb = grown_b / (number / 2) * rate_hz * 3600 / 1e6
    value = f"{grown_b / 1000:+.1f} kB from step {number // 2} to {number} ({per_hour_mb:+.1f} MB an hour)"
    if _grows(held_b, number):
        yield failed(value, f"a list or dict grows with every step{where}")
    else:
        yield passed(value)


def _grows(held_b: list[int], steps: int) -> bool:
    """Return whether memory grew in both of the last two quarters of so many steps.

    The first half warms caches up. A leak grows in both later quarters; a cache that fills grows in one.
    """
    half, third, end = (held_b[len(held_b) * quarter // 4 - 1] for quarter in (2, 3, 4))
    return min(third - half, end - third) > LEAK_B + LEAK_B_PER_STEP * steps / 4


def _grown_most(before: tracemalloc.Snapshot, subject: CheckedPlanner) -> str:
    """Return the line of the planner's file that holds most of the memory allocated since `before`."""
    changes = tracemalloc.take_snapshot().compare_to(before, "lineno")
    for change in changes:
        frame = change.traceback[0]
        if change.size_diff > 0 and frame.filename == str(subject.path):
            return f": {subject.path.name}:{frame.lineno} made {change.size_diff / 1000:.1f} kB of it"
    return ""
