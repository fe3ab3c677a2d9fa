"""Checks whether the same frames give the same plans: again, in another process, after a restart, and under other ids.

`python -m tui_gcs.planner.check.determinism JOB` makes plans for recorded frames in a process of its own.
"""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile

import msgspec
import numpy as np

from tui_gcs.core.protocol.common import FleetFrame, Freshness, Intent, Phase, PlannerTask, TeamPlan
from tui_gcs.planner.api import Planner
from tui_gcs.planner.check.declarations import suspects
from tui_gcs.planner.check.plan_form import intent_difference, plan_difference
from tui_gcs.planner.check.subject import (
    CheckedPlanner,
    Finding,
    PlannerFailure,
    checked_planner,
    comparable_bytes,
    failed,
    noted,
    passed,
)
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet, scattered, task_for
from tui_gcs.planner.runtime.planner_errors import PlannerError

Log = list[tuple[FleetFrame, TeamPlan]]

FLIGHT_S = 40.0
AFTER_RESTART_STEPS = 25
"""Steps that are compared after a restart."""
PROCESS_LIMIT_S, POLL_S = 300.0, 0.2
"""Time limit of the other process, and the interval at which it is polled."""
ROUNDED = 1e-3
"""A difference smaller than this looks like rounding, which the advice mentions."""
ALIKE = 0.01
"""Tolerance in metres, m/s or seconds: sums over vehicles in another order differ by rounding, not by this."""


def logged(subject: CheckedPlanner, task: PlannerTask) -> Log:
    """Return a flight with a late vehicle, one that is lost and comes back, a held one, and two passing targets."""
    world = KinematicFleet(task, scattered(len(task.members)), lag_s=0.3)
    first, second = task.members[:2]
    log: Log = []
    for frame, plan in subject.fly(subject.host(task), world, FLIGHT_S):
        log.append((frame, plan))
        flown_s = world.t_s - 100.0
        world.freshness = {first: Freshness.LOST} if 10.0 < flown_s < 20.0 else {}
        world.phase = {second: Phase.HOLDING} if 15.0 < flown_s < 25.0 else {}
        near, far = world.target(1, (320.0 - 2 * flown_s, 260.0)), world.target(2, (180.0, 130.0 + flown_s), age_s=1.0)
        world.tracks = (near, far)[: (5.0 < flown_s < 30.0) + (12.0 < flown_s < 30.0)]
        well, gate = world.point("well", (200.0, 180.0), 2.0), world.point("gate", (260.0, 300.0), due_s=130.0)
        world.points = (well, gate)[: (3.0 < flown_s < 25.0) + (8.0 < flown_s < 25.0)]
    return log


def again(subject: CheckedPlanner) -> Iterator[Finding]:
    """Step a second planner in this process, and one in another process with another order of sets of texts."""
    task = task_for(range(1, 6), subject.name, seed=subject.seed)
    log = logged(subject, task)
    where = suspects(subject.path.read_bytes(), subject.path.name)
    ask = "take time from ctx.t_s and chance from ctx.rng, and sort what has no order" + (f": {where}" if where else "")
    host = subject.host(task)
    for number, (frame, plan) in enumerate(log, 1):
        if text := plan_difference(plan, subject.step(host, frame)):
            yield failed(f"step {number} of {len(log)}: {text}", ask)
            return
    yield passed(f"{len(log)} plans from the same frames and seed, bit-identical")
    odd = _elsewhere(subject, task, log)
    if odd:
        yield failed(
            f"step {odd} of {len(log)} differs in another process (PYTHONHASHSEED=1)", ask, check="other process"
        )
    else:
        yield passed(f"{len(log)} plans, bit-identical with another PYTHONHASHSEED", check="other process")


class ReplayJob(msgspec.Struct):
    """The work of the other process."""

    what: str
    seed: int
    task: PlannerTask
    frames: list[FleetFrame]


def _elsewhere(subject: CheckedPlanner, task: PlannerTask, log: Log) -> int:
    """Return the first step whose plan differs in another process, 0 without one. Raises `PlannerFailure`."""
    job = ReplayJob(
        str(subject.path) if subject.files else subject.name,
        subject.seed,
        subject.formed(task),
        [frame for frame, _ in log],
    )
    with TemporaryDirectory() as folder:
        file = Path(folder) / "job"
        file.write_bytes(msgspec.msgpack.encode(job))
        command = [sys.executable, "-m", "tui_gcs.planner.check.determinism", str(file)]
        # Sets and dicts of texts are ordered by their hashes, which this seed changes.
        environment = os.environ | {"PYTHONHASHSEED": "1"}
        done = _ended(subject, command, environment)
        if done.returncode:
            last = done.stderr.strip().rpartition("\n")[2]
            raise PlannerFailure(f"in another process: {last or f'ended with {done.returncode}'}")
        plans = msgspec.msgpack.decode((Path(folder) / "job.plans").read_bytes(), type=list[bytes])
    same = [comparable_bytes(plan) == other for (_, plan), other in zip(log, plans, strict=True)]
    return 0 if all(same) else same.index(False) + 1


def _ended(
    subject: CheckedPlanner, command: list[str], environment: dict[str, str]
) -> "subprocess.CompletedProcess[str]":
    """Wait for the process and report progress meanwhile. Raises `PlannerFailure`."""
    with TemporaryFile("w+", errors="replace") as errors:
        child = subprocess.Popen(command, stdout=errors, stderr=errors, env=environment)
        try:
            for _ in range(round(PROCESS_LIMIT_S / POLL_S)):
                subject.beat()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    code = child.wait(POLL_S)
                    errors.seek(0)
                    return subprocess.CompletedProcess(command, code, "", errors.read())
        finally:
            child.kill()
            child.wait()
    raise PlannerFailure(f"no answer of another process within {PROCESS_LIMIT_S:g} s")


def restart(subject: CheckedPlanner) -> Iterator[Finding]:
    """Check that a planner restored from a snapshot plans as the one that made it would have."""
    task = task_for(range(1, 6), subject.name, seed=subject.seed)
    log = logged(subject, task)
    stops = _stops(len(log), quick=subject.quick)
    host, states = subject.host(task), dict[int, bytes]()
    for number, (frame, _) in enumerate(log, 1):
        subject.step(host, frame)
        if number in stops:
            states[number] = subject.snapshot(host)
    advice = "snapshot() must hold everything that step() changes, and restore() must put it back"
    if subject.planner.snapshot is Planner.snapshot:
        advice = "write snapshot() and restore(), or make step() need nothing of the steps before"
    for stop, state in states.items():
        new = subject.host(task, state)
        for number, (frame, plan) in enumerate(log[stop : stop + AFTER_RESTART_STEPS], 1):
            made = subject.step(new, frame)
            text = next((note for note in made.notes if "restore failed" in note), "") or plan_difference(plan, made)
            if text:
                if subject.planner.snapshot is not Planner.snapshot and not _unlike_at_all(plan, made):
                    advice += "; so small a difference: a number that was rounded, as to np.float32 or in a text"
                yield failed(f"taken over after step {stop}, {number} steps later: {text}", advice)
                return
    most = max(map(len, states.values()))
    what = (
        f"snapshots of at most {most / 1000:.1f} kB" if subject.planner.snapshot is not Planner.snapshot else "no state"
    )
    yield passed(f"taken over after {len(stops)} different steps, bit-identical; {what}")


def _unlike_at_all(plan: TeamPlan, made: TeamPlan) -> bool:
    """Return whether two plans differ by more than rounding."""
    mine, yours = ({i.vehicle: i for i in each.intents} for each in (plan, made))
    return mine.keys() != yours.keys() or any(intent_difference(mine[v], yours[v], ROUNDED) for v in mine)


def _stops(steps: int, *, quick: bool) -> list[int]:
    """Return steps to restart after: the first ones, then spread ones; some follow a loss or a hold."""
    spread = np.linspace(5, steps - AFTER_RESTART_STEPS, 2 if quick else 8).round().astype(int).tolist()
    wanted = {1, 51, *spread} if quick else {1, 2, 3, 51, 52, 77, 101, *spread}
    return sorted(stop for stop in wanted if 0 < stop < steps)


def order(subject: CheckedPlanner) -> Iterator[Finding]:
    """Check that a vehicle's intents depend on where it is, not on its number."""
    count = 6
    if subject.planner.ids_matter:
        yield noted("not looked at: ids_matter is declared", "what a vehicle flies depends on its number")
        return
    duration_s = 10.0 if subject.quick else 30.0
    ids = list(range(1, count + 1))
    # Once in another order, once with gaps and large numbers.
    renamed = [[ids[i] for i in (3, 5, 0, 4, 1, 2)], [40, 3, 1007, 12, 5, 200]]
    plans = _flown(subject, ids, duration_s)
    for names in renamed:
        for number, (mine, yours) in enumerate(zip(plans, _flown(subject, names, duration_s), strict=True), 1):
            for place in range(count):
                one, other = mine.get(ids[place]), yours.get(names[place])
                if (one is None) != (other is None):
                    text = "gets an intent under one number and none under another"
                elif one is None or other is None or not (text := intent_difference(one, other, ALIKE)):
                    continue
                yield failed(
                    f"step {number}: the same vehicle, numbered {ids[place]} and {names[place]}, {text}",
                    "give places by where vehicles are (e.g. sorted by bearing), not by id or row; ctx.rng, too; "
                    "where the order of ids is meant, as for a leader, declare ids_matter = True",
                )
                return
    yield passed(f"{count} vehicles renumbered twice: the same paths, {len(plans)} steps")


def _flown(subject: CheckedPlanner, ids: list[int], duration_s: float) -> list[dict[int, Intent]]:
    task = task_for(ids, subject.name, seed=subject.seed)
    world = KinematicFleet(task, scattered(len(ids)))
    return [{i.vehicle: i for i in plan.intents} for _, plan in subject.fly(subject.host(task), world, duration_s)]


def main(file: Path) -> int:
    """Write `job.plans` beside the job; return 1 with one line on stderr if the planner raised."""
    job = msgspec.msgpack.decode(file.read_bytes(), type=ReplayJob)
    try:
        subject = checked_planner(job.what, job.seed, False, lambda: None, job.task.instances)
        host = subject.host(job.task)
        plans = [comparable_bytes(subject.step(host, frame)) for frame in job.frames]
    except (PlannerFailure, PlannerError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    file.with_name("job.plans").write_bytes(msgspec.msgpack.encode(plans))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
