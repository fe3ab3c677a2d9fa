"""Patrols that lose vehicles: how long a place waits meanwhile, and what the others reach afterwards."""

import copy
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np

import tui_gcs
from tests.bench.row import Row
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid
from tui_gcs.core.geometry.zones import Shape
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.scenario.load import load
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet, scattered, task_for

COUNT, RADIUS_M = 4, 15.0
SETTLED_S, HEARD_NO_MORE_S = 150.0, 3.5
FRAME_S, FRAMES_PER_STEP = 0.1, 2


def planning_losses(_: Path) -> Iterator[Row]:
    """The zones of the first round of the shipped scenario; neighbours on the tour are lost, which is worst."""
    scenario = load(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")
    round_ = scenario.rounds[0]
    for zone in round_.zones[:2]:
        task = task_for(range(1, COUNT + 1), "patrol", shape=zone.shape, area=round_.area, parameters={"search": 0})
        host = PlannerHost(TEAM)
        host.set_task(msgspec.structs.replace(task, off_course_m=ArduCopter.off_course_m))
        flight = _Flight(host, KinematicFleet(task, scattered(COUNT) + np.array([60.0, 150.0])), zone.shape)
        flight.fly(SETTLED_S)
        before_s = flight.worst_s(flight.period_s / 2)
        for lost in (1, 2, 3):
            yield from copy.deepcopy(flight).lose(f"{zone.name}: {lost} of {COUNT} lost", lost, COUNT * before_s)


class _Flight:
    """A planner, its vehicles, and what they see."""

    def __init__(self, host: PlannerHost, world: KinematicFleet, shape: Shape) -> None:
        self._host, self._world, self._grid = host, world, IdlenessGrid(shape, RADIUS_M)
        self._blind, self._slots = set[int](), dict[int, str]()
        self.period_s = np.nan

    def fly(self, duration_s: float) -> None:
        world, until_s = self._world, self._world.t_s + duration_s
        frame = 0
        while world.t_s < until_s:
            if frame % FRAMES_PER_STEP == 0:
                plan = self._host.step(world.frame())
                self.period_s = plan.metrics["period_s"]
                self._slots = {intent.vehicle: intent.slot for intent in plan.intents}
                world.take(plan)
            world.move(FRAME_S)
            seeing = [i for i, vehicle in enumerate(world.task.members) if vehicle not in self._blind]
            self._grid.update(world.t_s, world.position_m[seeing, :2])
            frame += 1

    def worst_s(self, duration_s: float) -> float:
        """Worst idleness in the time that comes."""
        self._grid.begin_window(self._world.t_s)
        self.fly(duration_s)
        return self._grid.worst_idleness_s

    def lose(self, name: str, count: int, alone_s: float) -> Iterator[Row]:
        """`alone_s`: worst idleness before, times the vehicles there were."""
        left, period_s = COUNT - count, self.period_s
        lost = sorted(self._slots, key=lambda vehicle: self._slots[vehicle])[:count]
        self._blind = set(lost)
        self._grid.begin_window(self._world.t_s)
        self.fly(HEARD_NO_MORE_S)
        self._world.freshness = dict.fromkeys(lost, Freshness.LOST)
        self.fly(1.5 * period_s)
        share = self._grid.worst_idleness_s / (2.0 * period_s / left)
        yield Row(f"{name}: longest wait meanwhile / (2 T / n)", share, "", 1.0)
        yield Row(f"{name}: later, n x worst idleness / before", left * self.worst_s(period_s) / alone_s, "", 1.05)
