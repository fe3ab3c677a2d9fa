"""Flies the planners in `examples/planners` on vehicles without a simulator, and measures from outside what they reach.

`figure` is each planner's own measure, taken from where the vehicles are and not from what they say: lloyd, the mean
distance from a place to the nearest vehicle by density (m, the second minute); cbba, the reward (share of all weights,
faded); pursuit, the share of targets that are met before they reach the zone.
"""

import math
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.loops import Loop
from tui_gcs.core.protocol.common import Track
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Communication, DensityPeak, Instances, Scenario
from tui_gcs.planner.api import cell_centres_m, density_at
from tui_gcs.planner.check.subject import comparable_bytes
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet, task_for
from tui_gcs.planner.runtime.planner_file import PlannerFile

FOLDER = Path(__file__).parents[3] / "examples" / "planners"
NAMES = ("lloyd", "pursuit", "cbba")
SENSOR_M, MET_M, TARGET_M_S, TARGETS, SPAWN_M = 60.0, 8.0, 6.0, 10, 170.0
FLIGHT_S, STEP_S = 120.0, 0.1


def planner_file(name: str) -> PlannerFile:
    """Return an example as the command line would."""
    path = FOLDER / f"{name}.py"
    return PlannerFile(name, path, sha256(path.read_bytes()).hexdigest())


def scenario_of(name: str) -> Scenario:
    """Return the scenario beside an example."""
    return load(FOLDER / f"{name}.toml")


class ExampleFlight:
    """One flight of an example over its scenario's zone; `seed` moves vehicles, points, peaks and targets."""

    def __init__(
        self, name: str, instances: Instances, seed: int, communication: Communication | None = None, count: int = 0
    ) -> None:
        scenario = scenario_of(name)
        round_, n = scenario.rounds[0], count or scenario.vehicle_count
        self.name, self.rng = name, np.random.default_rng(seed)
        zone = round_.zones[0]
        task = task_for(range(1, n + 1), name, seed=seed, shape=zone.shape, area=round_.area)
        self.cells = cell_centres_m(zone.shape, 5.0)
        self.middle = self.cells.mean(axis=0)
        density = tuple(self._elsewhere(peak) for peak in round_.density)
        radio = scenario.communication if communication is None else communication
        self.task = msgspec.structs.replace(task, instances=instances, communication=radio, density=density)
        places = self.middle + self.rng.uniform(-60.0, 60.0, (n, 2))
        self.world = KinematicFleet(self.task, places, lag_s=0.3)
        self.host = PlannerHost(TEAM, {name: planner_file(name)})
        self.host.set_task(self.task)
        assert not self.host.problem, self.host.problem
        self.plans: list[bytes] = []
        self.metrics: dict[str, float] = {}
        self.step_ms: list[float] = []
        bearing, self.begin_s = self.rng.uniform(0, 2 * np.pi, TARGETS), self.rng.uniform(5.0, 60.0, TARGETS)
        self.away = np.stack([np.sin(bearing), np.cos(bearing)], axis=1)
        self.met, self.visited = set[int](), set[int]()
        self.reward, self.costs_m = 0.0, list[float]()

    def fly(self, duration_s: float = FLIGHT_S) -> float:
        """Fly, and return the example's figure."""
        while self.world.t_s < 100.0 + duration_s - 1e-6:
            self._targets()
            frame = self.world.frame()
            if self.host.due(frame.t_s):
                plan = self.host.step(frame)
                assert not plan.error, plan.error
                self.plans.append(comparable_bytes(plan))
                self.metrics = plan.metrics
                self.step_ms.append(plan.step_ms)
                self.world.take(plan)
            self.world.move(STEP_S)
            if len(self.plans) % 4 == 0 or self.name != "lloyd":
                self._measure()
        if self.name == "lloyd":
            return float(np.mean(self.costs_m[len(self.costs_m) // 2 :]))
        if self.name == "pursuit":
            return len(self.met) / TARGETS
        return self.reward / sum(peak.weight for peak in self.task.density)

    def _elsewhere(self, peak: DensityPeak) -> DensityPeak:
        shift_x, shift_y = self.rng.uniform(-15.0, 15.0, 2).tolist()
        points = tuple((x + shift_x, y + shift_y) for x, y in peak.loop.points_m)
        return msgspec.structs.replace(peak, loop=Loop(points, peak.loop.period_s))

    def _places_of_targets(self) -> NDArray[np.float64]:
        flown_s = np.maximum(self.world.t_s - 100.0 - self.begin_s, 0.0)
        places: NDArray[np.float64] = self.middle + self.away * (SPAWN_M - TARGET_M_S * flown_s)[:, None]
        return places

    def _targets(self) -> None:
        if self.name != "pursuit":
            return
        now_s, places = self.world.t_s, self._places_of_targets()
        apart_m = np.hypot(*(places[:, None] - self.world.position_m[:, :2]).T).T
        tracks = []
        for k, place in enumerate(places):
            seen_by = tuple(v for v, m in zip(self.task.members, apart_m[k], strict=True) if m <= SENSOR_M)
            if not seen_by or k in self.met or now_s - 100.0 < self.begin_s[k]:
                continue
            (x, y), (east, north) = place.tolist(), (-TARGET_M_S * self.away[k]).tolist()
            known = (1.0, 0.0, 1.0)
            tracks.append(Track(k, (x, y, 0.0), (east, north, 0.0), known, now_s, now_s, seen_by, confirmed=True))
        self.world.tracks = tuple(tracks)

    def _measure(self) -> None:
        here, t_s = self.world.position_m[:, :2], self.world.t_s
        if self.name == "lloyd":
            weight = density_at(self.task.density, self.cells, t_s)
            nearest_m = np.hypot(*(self.cells[:, None] - here).T).min(axis=0)
            self.costs_m.append(float((weight * nearest_m).sum() / weight.sum()))
        elif self.name == "pursuit":
            for k, place in enumerate(self._places_of_targets()):
                outside = float(np.hypot(*(place - self.middle))) >= 80.0 and t_s - 100.0 >= self.begin_s[k]
                if outside and np.hypot(*(here - place).T).min() <= MET_M:
                    self.met.add(k)
        else:
            for k, peak in enumerate(self.task.density):
                if k not in self.visited and np.hypot(*(here - peak.loop.at(t_s)[0]).T).min() <= 4.0:
                    self.visited.add(k)
                    self.reward += peak.weight * math.exp(-(t_s - 100.0) / 60.0)
