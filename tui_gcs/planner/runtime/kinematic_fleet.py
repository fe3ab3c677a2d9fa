"""Vehicles that follow their intents exactly or with a lag, and the frames in which a planner sees them.

Planner checks and forecasts use them instead of a simulator: no dynamics, no links, no station.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Shape, Zone, polygon_of
from tui_gcs.core.protocol.common import (
    FleetFrame,
    Freshness,
    Intent,
    KeepOut,
    Phase,
    PlannerTask,
    PointOfInterest,
    TeamPlan,
    Track,
    Vec3,
)
from tui_gcs.core.scenario.model import Limits, OperatingArea

Floats = NDArray[np.floating[Any]]

TEAM = "check"
FRAME_S = 0.1
"""Period of the station's frames (10 Hz)."""
AREA = OperatingArea(Rectangle((300.0, 200.0), 600.0, 400.0), 20.0, 90.0)
ZONE = Zone("zone", Role.DEFEND, Circle((250.0, 200.0), 60.0))
LOW_M, LAYER_GAP_M, LAYERS = 27.0, 7.0, 9
"""Altitude layers as in the shipped scenario; after nine vehicles they repeat."""


def task_for(
    ids: Iterable[int],
    planner: str,
    *,
    seed: int = 1,
    shape: Shape = ZONE.shape,
    area: OperatingArea = AREA,
    parameters: Mapping[str, float | int | bool | str] | None = None,
) -> PlannerTask:
    """Return a task for a team over one zone; parameters that are not given have their defaults."""
    members = tuple(ids)
    zone = Zone("zone", Role.DEFEND, shape)
    return PlannerTask(
        team=TEAM,
        revision=1,
        t_s=0.0,
        planner=planner,
        zone=zone,
        area=area,
        no_fly=(),
        limits=Limits(),
        footprint_radius_m=15.0,
        parameters=dict(parameters or {}),
        seed=seed,
        members=members,
        layers_m={vehicle: LOW_M + LAYER_GAP_M * (i % LAYERS) for i, vehicle in enumerate(members)},
        zones=(zone,),
    )


@lru_cache(maxsize=8)
def middle_m(shape: Shape) -> tuple[float, float]:
    """Return a place well inside the shape. It is cached, for every target of every step asks for it."""
    x, y = polygon_of(shape).representative_point().coords[0]
    return x, y


def scattered(n: int, seed: int = 7) -> Floats:
    """Return (n, 2) irregular places in the western part of `AREA`: without symmetry nothing is a tie."""
    rng = np.random.default_rng(seed)
    columns = max(1, math.ceil(math.sqrt(n / 2)))
    gap_m = min(15.0, 200.0 / columns, 720.0 * columns / max(n, 1))
    grid = np.array([(20.0 + gap_m * (i % columns), 20.0 + gap_m * (i // columns)) for i in range(n)]).reshape(-1, 2)
    places: Floats = grid + rng.uniform(-0.3, 0.3, (n, 2)) * gap_m
    return places


@dataclass
class KinematicFleet:
    """The vehicles of one team. Tests may change every field between two frames, as happens to real vehicles."""

    task: PlannerTask
    xy_m: Floats
    lag_s: float = 0.0
    """Time constant of the vehicles. With 0 each is where its intent wants it, as far as the speed limit allows."""
    t_s: float = 100.0
    gone: set[int] = field(default_factory=set)
    """Vehicles that are missing in the frame."""
    phase: dict[int, Phase] = field(default_factory=dict)
    freshness: dict[int, Freshness] = field(default_factory=dict)
    age_s: dict[int, float] = field(default_factory=dict)
    blind: set[int] = field(default_factory=set)
    """Vehicles of which every number is NaN."""
    numb: set[int] = field(default_factory=set)
    """Vehicles of which only the position is known."""
    tracks: tuple[Track, ...] = ()
    """Targets that sensors have detected."""
    points: tuple[PointOfInterest, ...] = ()
    """Open tasks from outside."""
    keep_out: tuple[KeepOut, ...] = ()
    """Where lost vehicles may be."""

    def __post_init__(self) -> None:
        """Put all vehicles on their layers, at rest."""
        ids = self.task.members
        height = [self.task.layers_m[vehicle] for vehicle in ids]
        self.position_m: Floats = np.column_stack([self.xy_m, height]) if ids else np.zeros((0, 3))
        self.velocity_m_s: Floats = np.zeros_like(self.position_m)
        self.intents: dict[int, Intent] = {}
        self._plan_s: dict[int, float] = {}
        self._seq = 0

    def frame(self) -> FleetFrame:
        """Return the frame that the station would publish now."""
        self._seq += 1
        ids = [(i, vehicle) for i, vehicle in enumerate(self.task.members) if vehicle not in self.gone]
        n, unknown = len(ids), self.blind | self.numb
        return FleetFrame(
            seq=self._seq,
            t_s=self.t_s,
            wall_s=0.0,
            kind=RunKind.SIM,
            ids=tuple(vehicle for _, vehicle in ids),
            team=(self.task.team,) * n,
            phase=tuple(self.phase.get(vehicle, Phase.FLYING) for _, vehicle in ids),
            freshness=tuple(self.freshness.get(vehicle, Freshness.OK) for _, vehicle in ids),
            position_m=tuple(_vector(self.position_m[i], known=vehicle not in self.blind) for i, vehicle in ids),
            velocity_m_s=tuple(_vector(self.velocity_m_s[i], known=vehicle not in unknown) for i, vehicle in ids),
            heading_deg=tuple(math.nan if vehicle in unknown else 0.0 for _, vehicle in ids),
            battery_pct=tuple(math.nan if vehicle in unknown else 80.0 for _, vehicle in ids),
            age_s=tuple(self.age_s.get(vehicle, 0.05) for _, vehicle in ids),
            tracks=self.tracks,
            points=self.points,
            keep_out=self.keep_out,
        )

    def point(
        self, name: str, xy_m: tuple[float, float], priority: float = 1.0, due_s: float = math.inf
    ) -> PointOfInterest:
        """Return an open task at a place."""
        return PointOfInterest(name, xy_m, priority, "", 0.0, due_s)

    def target(self, number: int, xy_m: tuple[float, float], *, confirmed: bool = True, age_s: float = 0.2) -> Track:
        """Return a target that the first vehicle saw there `age_s` ago, flying to the middle of the zone at 4 m/s."""
        way = np.array(middle_m(self.task.zone.shape)) - xy_m
        east, north = (4.0 * way / max(float(np.hypot(*way)), 1.0)).tolist()
        seen_s = self.t_s - age_s
        return Track(
            id=number,
            position_m=(*xy_m, 0.0),
            velocity_m_s=(east, north, 0.0),
            covariance_m2=(4.0, 1.0, 4.0),
            first_seen_s=seen_s - 2.0,
            seen_s=seen_s,
            seen_by=self.task.members[:1],
            confirmed=confirmed,
        )

    def take(self, plan: TeamPlan) -> None:
        """Follow these intents from now on."""
        for intent in plan.intents:
            self.intents[intent.vehicle], self._plan_s[intent.vehicle] = intent, plan.t_s

    def move(self, dt_s: float = FRAME_S) -> None:
        """Let the vehicles fly for `dt_s`."""
        self.t_s += dt_s
        farthest_m = self.task.limits.speed_m_s * dt_s
        share = dt_s / (self.lag_s + dt_s)
        for i, vehicle in enumerate(self.task.members):
            way = np.zeros(3)
            intent = self.intents.get(vehicle)
            if intent is not None:
                way = (
                    wanted_position(intent, self.t_s, self._plan_s[vehicle], self.position_m[i], dt_s)
                    - self.position_m[i]
                ) * share
            length = float(np.linalg.norm(way))
            if not math.isfinite(length):
                way = np.zeros(3)
            elif length > farthest_m:
                way = way * (farthest_m / length)
            self.position_m[i] += way
            self.velocity_m_s[i] = way / dt_s


def _vector(row: Floats, *, known: bool) -> Vec3:
    x, y, z = row.tolist()
    return (x, y, z) if known else (math.nan, math.nan, math.nan)


def wanted_position(intent: Intent, t_s: float, plan_s: float, here_m: Floats, dt_s: float) -> Floats:
    """Return (3,) where `intent` wants a vehicle at `here_m` to be at `t_s`; `here_m` if it names no place."""
    if intent.kind == "goto" and intent.position_m is not None:
        return np.array(intent.position_m, dtype=float)
    if intent.kind == "velocity" and intent.velocity_m_s is not None and t_s <= plan_s + intent.valid_s:
        return here_m + dt_s * np.array(intent.velocity_m_s, dtype=float)
    if intent.kind == "trajectory" and intent.positions_m and intent.dt_s > 0:
        place = (t_s - intent.t0_s) / intent.dt_s
        samples = np.array(intent.positions_m, dtype=float)
        return np.array([np.interp(place, np.arange(len(samples)), axis) for axis in samples.T])
    if intent.kind == "orbit" and intent.position_m is not None and intent.radius_m > 0:
        centre = np.array(intent.position_m, dtype=float)
        angle = math.atan2(here_m[1] - centre[1], here_m[0] - centre[0])
        turn = dt_s * (intent.speed_m_s or 5.0) / intent.radius_m
        angle += -turn if intent.clockwise else turn
        return centre + intent.radius_m * np.array([math.cos(angle), math.sin(angle), 0.0])
    return here_m
