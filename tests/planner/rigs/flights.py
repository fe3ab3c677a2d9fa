"""The shipped scenario's six zones, planner tasks for them, and vehicles that follow their plans."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest

import tui_gcs
from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Shape, Zone
from tui_gcs.core.protocol.common import FleetFrame, Freshness, Phase, PlannerTask, RunKind, TeamPlan
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Limits, OperatingArea, Scenario
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.tour_search import begin_search
from tui_gcs.planner.patrol.tour_site import TourDesign, site_of
from tui_gcs.planner.patrol.tour_smoothing import TourLimits
from tui_gcs.planner.runtime.host import PlannerHost

AREA = OperatingArea(Rectangle((300.0, 200.0), 600.0, 400.0), 20.0, 90.0)
SMALL = Circle((150.0, 200.0), 40.0)
"""A zone whose tour is designed quickly."""
TAKE_OFF = ((45.0, 170.0), (45.0, 190.0), (45.0, 210.0), (45.0, 230.0))


def zone_of(shape: Shape) -> Zone:
    return Zone("zone", Role.DEFEND, shape)


def are_sendable(region: FlyableRegion, places: np.ndarray, speeds: np.ndarray, dt_s: float) -> bool:
    """Return whether all samples (k, 2 or 3) of a way stop inside, with the guard's brakes and lead compensation."""
    xy_m, velocity_m_s = places[:, :2], speeds[:, :2]
    return bool(region.are_sendable(xy_m, velocity_m_s, np.gradient(velocity_m_s, dt_s, axis=0), 2.5).all())


def no_fly(shape: Shape) -> Zone:
    return Zone("closed", Role.NO_FLY, shape)


@dataclass
class Fleet:
    """Vehicles that are where their intents want them, `lag_s` late."""

    ids: tuple[int, ...]
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    t_s: float = 0.0
    lag_s: float = 0.0
    phase: dict[int, Phase] = field(default_factory=dict)
    freshness: dict[int, Freshness] = field(default_factory=dict)
    battery_pct: dict[int, float] = field(default_factory=dict)
    plan: TeamPlan | None = None
    """The newest."""

    def frame(self) -> FleetFrame:
        n = len(self.ids)
        return FleetFrame(
            seq=0,
            t_s=self.t_s,
            wall_s=0.0,
            kind=RunKind.SIM,
            ids=self.ids,
            team=("red",) * n,
            phase=tuple(self.phase.get(i, Phase.FLYING) for i in self.ids),
            freshness=tuple(self.freshness.get(i, Freshness.OK) for i in self.ids),
            position_m=tuple((float(x), float(y), float(z)) for x, y, z in self.position_m),
            velocity_m_s=tuple((float(x), float(y), float(z)) for x, y, z in self.velocity_m_s),
            heading_deg=(0.0,) * n,
            battery_pct=tuple(self.battery_pct.get(i, 90.0) for i in self.ids),
            age_s=(0.0,) * n,
        )

    def follow(self, plan: TeamPlan, dt_s: float) -> None:
        self.t_s += dt_s
        for intent in plan.intents:
            i = self.ids.index(intent.vehicle)
            if not intent.positions_m:
                self.velocity_m_s[i] = 0.0
                continue
            times = intent.t0_s + intent.dt_s * np.arange(len(intent.positions_m))
            wanted = [np.interp(self.t_s, times, axis) for axis in np.array(intent.positions_m).T]
            share = 1.0 if self.lag_s == 0.0 else dt_s / (self.lag_s + dt_s)
            before = self.position_m[i].copy()
            self.position_m[i] += share * (np.array(wanted) - before)
            self.velocity_m_s[i] = (self.position_m[i] - before) / dt_s


def fleet(count: int, lag_s: float = 0.0, places: tuple[tuple[float, float], ...] = TAKE_OFF) -> Fleet:
    position = [(*places[i % len(places)], 27.0 + 7.0 * i) for i in range(count)]
    return Fleet(tuple(range(1, count + 1)), np.array(position), np.zeros((count, 3)), lag_s=lag_s)


def task_of(
    zone: Zone,
    members: tuple[int, ...] = (1, 2, 3, 4),
    area: OperatingArea = AREA,
    closed: tuple[Zone, ...] = (),
    planner: str = "patrol",
    **parameters: float | str,
) -> PlannerTask:
    return PlannerTask(
        team="red",
        revision=7,
        t_s=0.0,
        planner=planner,
        zone=zone,
        area=area,
        no_fly=closed,
        limits=Limits(),
        footprint_radius_m=15.0,
        parameters={"search": 0, **parameters} if planner == "patrol" else parameters,
        seed=42,
        members=members,
        layers_m={i: 20.0 + 7.0 * i for i in members},
    )


def host_of(task: PlannerTask) -> PlannerHost:
    """A host with this task; designing a tour takes a second, so the same task is configured once."""
    return copy.deepcopy(_configured(msgspec.msgpack.encode(task)))


@cache
def _configured(task: bytes) -> PlannerHost:
    host = PlannerHost("red")
    host.set_task(msgspec.msgpack.decode(task, type=PlannerTask))
    return host


def fly(host: PlannerHost, vehicles: Fleet, until_s: float, each: Callable[[TeamPlan], None] | None = None) -> TeamPlan:
    """Step the planner and its vehicles; `each` sees every plan. Returns the last plan."""
    while vehicles.t_s < until_s:
        frame = vehicles.frame()
        if host.due(frame.t_s):
            vehicles.plan = host.step(frame)
            assert vehicles.plan.error == ""
            if each is not None:
                each(vehicles.plan)
        assert vehicles.plan is not None
        vehicles.follow(vehicles.plan, 0.1)
    assert vehicles.plan is not None
    return vehicles.plan


@pytest.fixture(scope="session")
def swarm() -> Scenario:
    return load(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")


@cache
def region_of(zone: Zone, area: OperatingArea = AREA, closed: tuple[Zone, ...] = ()) -> FlyableRegion:
    """Nobody changes a region, and every plan of a flight is looked at against the same one."""
    return FlyableRegion(area, closed, Limits(), zone)


def designed(zone: Zone, area: OperatingArea = AREA, closed: tuple[Zone, ...] = (), n: int = 4) -> TourDesign:
    """A tour as it is designed at once, for vehicles that follow a course to half a metre."""
    site = site_of(zone.shape, region_of(zone, area, closed), TourLimits(7.76, 2.375, 14.3), 15.0)
    found = begin_search(site, 0, n).best
    assert found is not None
    return found
