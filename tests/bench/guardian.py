"""How many intruders are met before they are in the zone: the model of docs/planning.md C3.

Intruders begin 250 m from the middle of a zone of 80 m radius within 10 s, at any bearing, and fly to the middle at
5 m/s. They are known from when a defender is within 60 m; they count as met when one is within 20 m before they are in
the zone, and are gone then. Points of 8 m/s and 2.5 m/s2, level; no noise.
"""

import math
import os
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Zone
from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.core.scenario.model import Limits, OperatingArea
from tui_gcs.planner.api import Context, Fleet, Output, Planner, Tracks
from tui_gcs.planner.guardian.intercept import intercept
from tui_gcs.planner.guardian.path_steering import SAMPLE_S, SAMPLES, SteeringTargets, paths
from tui_gcs.planner.guardian.ring import ring
from tui_gcs.planner.lazy_scipy import min_cost_pairs
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.tour import Tour
from tui_gcs.planner.patrol.tour_search import design_tour
from tui_gcs.planner.patrol.tour_smoothing import TourLimits
from tui_gcs.planner.patrol.transit import Mobility
from tui_gcs.planner.runtime.registry import complete, load

Floats = NDArray[np.floating[Any]]

MIDDLE = np.array([150.0, 200.0])
ZONE = Zone("zone", Role.DEFEND, Circle((150.0, 200.0), 80.0))
AREA = OperatingArea(Rectangle((300.0, 200.0), 1200.0, 1000.0), 20.0, 90.0)
ZONE_M, FAR_M, WITHIN_S, INTRUDER_M_S, SEEN_M, MET_M = 80.0, 250.0, 10.0, 5.0, 60.0, 20.0
EPISODES = int(os.environ.get("TUI_GCS_BENCH_EPISODES", "300"))
BEGIN_S = 14.0
"""Until then the nearest possible intruder is more than 80 m from everybody."""
STEP_S = 0.2
GOALS = {(4, 4): 95.0, (4, 8): 90.0}
AGREED_M_S2 = 2.5


class Stepped(Protocol):
    """What a planner has that flies here."""

    def step(self, ctx: Context) -> Output:
        """One step."""
        ...


@dataclass
class Waves:
    """What many episodes gave."""

    seen: float
    met: Floats
    """Share by episode."""
    hardest_m_s2: float
    margins_s: list[float]

    @property
    def percent(self) -> float:
        """Met before they were in the zone."""
        return 100.0 * float(self.met.mean())

    @property
    def doubt(self) -> float:
        """Half the 95 % interval, in percent."""
        return 196.0 * float(self.met.std()) / math.sqrt(len(self.met))


def make(name: str, n: int, **parameters: float) -> Planner:
    """A configured planner for n vehicles."""
    task = task_of(n, name)
    planner = load(name)()
    planner.configure(task, complete(name, parameters), np.random.default_rng(1))
    return planner


def task_of(n: int, name: str) -> PlannerTask:
    """The team in its area."""
    ids = tuple(range(1, n + 1))
    return PlannerTask(
        "red", 1, 0.0, name, ZONE, AREA, (), Limits(), 15.0, {}, 1, ids, {i: 20.0 + 7.0 * i for i in ids}
    )


def waves(new: Any, n: int, k: int, episodes: int, seen_m: float = SEEN_M, seed: int = 0) -> Waves:
    """`episodes` waves of k intruders against n vehicles of a planner; the same seed gives the same waves."""
    planner, rng = new(), np.random.default_rng((seed, n, k))
    blank = planner.snapshot()
    met, seen, hardest, margins = [], 0, 0.0, []
    for _ in range(episodes):
        planner.restore(blank)
        one = Episode(planner, n, k, rng, seen_m)
        one.fly()
        met.append(one.met.mean())
        seen += int(one.seen.sum())
        hardest = max(hardest, one.hardest)
        margins += one.margins
    return Waves(seen / episodes / k, np.array(met), hardest, margins)


class Episode:
    """One wave."""

    def __init__(self, planner: Stepped, n: int, k: int, rng: np.random.Generator, seen_m: float = SEEN_M) -> None:
        """Its bearings and times are the next of `rng`."""
        self._planner, self._seen_m = planner, seen_m
        self._bearing = rng.random(k) * 2.0 * math.pi
        self._begin_s = rng.random(k) * WITHIN_S
        start = rng.random() * 2.0 * math.pi + 2.0 * math.pi * np.arange(n) / n
        self.xy = MIDDLE + 95.0 * np.stack([np.cos(start), np.sin(start)], axis=1)
        self._velocity = 7.2 * np.stack([-np.sin(start), np.cos(start)], axis=1)
        self.met, self.seen, self._over = (np.zeros(k, dtype=bool) for _ in range(3))
        self.hardest = 0.0
        self.margins: list[float] = []

    def fly(self) -> None:
        """From when the first intruder might be seen until the last is met or in the zone."""
        t_s, n = BEGIN_S, len(self.xy)
        while not self._over.all():
            out = self._planner.step(self._context(t_s, n))
            t_s += STEP_S
            for row, intent in enumerate(out.intents):
                times = intent.t0_s + intent.dt_s * np.arange(len(intent.positions_m))
                places, speeds = np.array(intent.positions_m), np.array(intent.velocities_m_s)
                new = np.array([np.interp(t_s, times, speeds[:, axis]) for axis in (0, 1)])
                self.hardest = max(self.hardest, float(np.hypot(*(new - self._velocity[row]))) / STEP_S)
                self._velocity[row] = new
                self.xy[row] = [np.interp(t_s, times, places[:, axis]) for axis in (0, 1)]
            self.judge(t_s)

    def targets(self, t_s: float) -> tuple[Floats, Floats, Floats]:
        """Radius, places and velocities of all intruders."""
        radius = FAR_M - INTRUDER_M_S * (t_s - self._begin_s)
        outward = np.stack([np.sin(self._bearing), np.cos(self._bearing)], axis=1)
        return radius, MIDDLE + radius[:, None] * outward, -INTRUDER_M_S * outward

    def judge(self, t_s: float) -> None:
        """Who is in sight, met, or in the zone by now."""
        radius, places, _ = self.targets(t_s)
        present = (t_s >= self._begin_s) & ~self._over
        away = np.hypot(*(places[:, None] - self.xy[None]).transpose(2, 0, 1)).min(axis=1)
        self.seen |= present & (away <= self._seen_m)
        now = present & (away <= MET_M) & (radius > ZONE_M)
        self.margins += ((radius[now] - ZONE_M) / INTRUDER_M_S).tolist()
        self.met |= now
        self._over |= now | (present & (radius <= ZONE_M))

    def _context(self, t_s: float, n: int) -> Context:
        up: NDArray[np.float64] = 20.0 + 7.0 * np.arange(1, n + 1)
        zero = np.zeros(n)
        fleet = Fleet(
            np.arange(1, n + 1),
            np.ones(n, dtype=bool),
            np.column_stack([self.xy, up]),
            np.column_stack([self._velocity, zero]),
            zero,
            zero,
            up,
            zero + 90.0,
            np.zeros(n, dtype=bool),
        )
        known = np.flatnonzero(self.seen & ~self._over)
        _, places, velocities = self.targets(t_s)
        none = np.zeros(len(known))
        tracks = Tracks(
            known + 1,
            np.column_stack([places[known], none]),
            np.column_stack([velocities[known], none]),
            none,
            none,
            np.ones(len(known), dtype=bool),
            ((),) * len(known),
        )
        return Context(t_s, fleet, np.random.default_rng(0), 0, 0.1, tracks)


class Simple:
    """Vehicles on equally timed slots of a tour; each target is given to one by least time, which flies to meet it."""

    def __init__(self, tour: Tour, chases: bool) -> None:
        """`chases`: False for those that only fly round."""
        self._tour, self._chases = tour, chases
        self._mobility = Mobility(8.0, AGREED_M_S2)
        self._region = FlyableRegion(AREA, (), Limits(), ZONE)

    def snapshot(self) -> bytes:
        """Nothing is remembered."""
        return b""

    def restore(self, _: bytes) -> None:
        """Nothing was remembered."""

    def step(self, ctx: Context) -> Output:
        """Tracks by intents of a trajectory each."""
        from tui_gcs.planner.api import Intent

        n = len(ctx.fleet.id)
        xy, velocity = ctx.fleet.position_m[:, :2], ctx.fleet.velocity_m_s[:, :2]
        times = ctx.t_s + SAMPLE_S * np.arange(SAMPLES)
        slots = self._tour.period_s * np.arange(n) / n
        place, speed = self._tour.at(times[None, :] + slots[:, None])
        through = np.zeros(n, dtype=bool)
        if self._chases and len(ctx.tracks.id):
            targets, target_m_s = ctx.tracks.position_m[:, :2], ctx.tracks.velocity_m_s[:, :2]
            found = intercept(xy[:, None], velocity[:, None], targets, target_m_s, self._mobility, 0.5)
            for row, column in min_cost_pairs(found.after_s):
                speed[row], through[row] = found.velocity_m_s[row, column], True
        places, speeds = paths(xy, velocity, SteeringTargets(place, speed, through), self._mobility, self._region)
        return Output(
            [
                Intent(
                    int(vehicle),
                    "trajectory",
                    t0_s=ctx.t_s,
                    dt_s=SAMPLE_S,
                    positions_m=tuple((x, y, 30.0) for x, y in places[i].tolist()),
                    velocities_m_s=tuple((x, y, 0.0) for x, y in speeds[i].tolist()),
                )
                for i, vehicle in enumerate(ctx.fleet.id)
            ]
        )


def ring_tour() -> Tour:
    """15 m outside the zone, at nearly full speed."""
    from tui_gcs.core.geometry.zones import polygon_of

    return ring(polygon_of(ZONE.shape), 15.0, FlyableRegion(AREA, (), Limits(), ZONE), 7.6, AGREED_M_S2)


def patrol_tour() -> Tour:
    """The area's own, as it is designed at once."""
    region, motion = FlyableRegion(AREA, (), Limits(), ZONE), TourLimits(7.6, AGREED_M_S2, 13.8)
    return design_tour(ZONE.shape, region, motion, 15.0, 4, np.random.default_rng(1)).tour
