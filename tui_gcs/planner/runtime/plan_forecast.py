"""What a plan is worth before it is flown: by vehicles that follow it perfectly, on a clock of ours.

Any planner can be foretold so. Background search is left out: what is told can be had at once; flown, it gets better.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, serving, sweep_bound_s
from tui_gcs.core.geometry.zones import area_m2, polygon_of
from tui_gcs.core.motion.separation import least_separation
from tui_gcs.core.protocol.common import FleetFrame, FlownWays, Plan, PlannerTask
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import World
from tui_gcs.planner.runtime.planner_file import PlannerFile

Floats = NDArray[np.floating[Any]]

STEP_S = 0.2
LEAST_S, MOST_S = 40.0, 120.0
"""So long it is flown; longer while somebody is on its way to its place, or if the planner does not say itself how
often it will see every place."""
KEPT_STEPS = 5
"""Of so many steps one is told, for others to compare their ways with."""
MOST_MOVES = 40_000
"""Vehicles times steps: about three seconds of a core."""
MAX_VEHICLES = 64
"""Nobody asks for more of one team."""
NOWHERE_ELSE: Mapping[int, tuple[float, float]] = {}
PREDICTED = "predicted_worst_s"
"""What planners call it in their metrics."""


@dataclass(frozen=True)
class Foresight:
    """One plan, and what came of flying it."""

    plan: Plan
    """The first one."""
    worst_s: float = math.nan
    """Worst idleness, as the planner says or as flown; NaN: not all was seen in that time."""
    ratio: float = math.nan
    """To the sweep bound."""
    separation: float = math.nan
    """The least of any two, as a multiple of the allowed one; NaN for less than two vehicles."""
    ways: FlownWays | None = None
    """Where everybody was."""


def foresee(
    task: PlannerTask,
    frame: FleetFrame,
    files: Mapping[str, PlannerFile],
    starts_m: Mapping[int, tuple[float, float]] = NOWHERE_ELSE,
    snapshot: bytes = b"",
) -> Foresight:
    """Configure the planner, and fly what it plans; who is not in `frame` begins where `starts_m` says.

    `snapshot`: of the planner that flies; if it is of the same kind, what it learnt is known to this one.
    """
    host = PlannerHost(task.team, files)
    host.searches = False
    host.set_task(task)
    host.inherit(snapshot)
    world = World(task, start_m(task, frame, starts_m), t_s=frame.t_s)
    plan = host.step(world.frame())
    if plan.error:
        return Foresight(plan)
    n = serving(len(task.members), sum(intent.kind == "hold" and intent.joined for intent in plan.intents))
    bound_s = sweep_bound_s(area_m2(task.zone.shape), n, task.limits.speed_m_s, task.footprint_radius_m)
    told_s = plan.metrics.get(PREDICTED, math.nan)
    flown_s, separation, ways = _fly(host, world, plan, LEAST_S if math.isfinite(told_s) else MOST_S)
    worst_s = told_s if math.isfinite(told_s) else flown_s
    return Foresight(plan, worst_s, worst_s / bound_s if bound_s > 0.0 else math.nan, separation, ways)


def _fly(host: PlannerHost, world: World, plan: Plan, least_s: float) -> tuple[float, float, FlownWays]:
    """(worst idleness once all was seen, NaN if it never was; least separation; where everybody was)."""
    task = world.task
    grid = IdlenessGrid(task.zone.shape, task.footprint_radius_m)
    nearest, measuring = math.inf, False
    kept: list[Floats] = []
    loops = tuple(line.points_m for line in plan.annotations or () if line.is_loop and np.isfinite(line.points_m).all())
    for step in range(min(round(MOST_S / STEP_S), MOST_MOVES // max(len(task.members), 1))):
        if step * STEP_S >= least_s and all(intent.joined for intent in plan.intents):
            break
        if step % KEPT_STEPS == 0:
            kept.append(world.position_m.round(2))
        world.take(plan)
        world.move(STEP_S)
        grid.update(world.t_s, world.position_m[:, :2])
        if grid.full_cover_t is not None and not measuring:
            grid.begin_window(world.t_s)
            measuring = True
        nearest = min(nearest, least_separation(world.position_m, task.limits))
        plan = host.step(world.frame())
    by_vehicle = np.stack(kept, axis=1).tolist()
    places = tuple(tuple((x, y, z) for x, y, z in moments) for moments in by_vehicle)
    ways = FlownWays(task.members, STEP_S * KEPT_STEPS, places, loops)
    return grid.worst_idleness_s, nearest if math.isfinite(nearest) else math.nan, ways


def start_m(task: PlannerTask, frame: FleetFrame, starts_m: Mapping[int, tuple[float, float]] = NOWHERE_ELSE) -> Floats:
    """(n, 2) where the team is, or is to start; in the middle of the area where nobody knows."""
    place = {vehicle: (x, y, 0.0) for vehicle, (x, y) in starts_m.items()}
    place |= {v: at for v, at in zip(frame.ids, frame.position_m, strict=True) if math.isfinite(at[0] + at[1])}
    middle = polygon_of(task.area.shape).representative_point()
    spots = []
    for k, vehicle in enumerate(task.members):
        x, y, _ = place.get(vehicle, (math.nan,) * 3)
        spots.append((x, y) if math.isfinite(x) and math.isfinite(y) else (float(middle.x) + k, float(middle.y)))
    return np.array(spots, dtype=float).reshape(-1, 2)


# ---------------------------------------------------------------- how many vehicles


def vehicles_for(
    idleness_s: float,
    task: PlannerTask,
    frame: FleetFrame,
    files: Mapping[str, PlannerFile],
    starts_m: Mapping[int, tuple[float, float]] = NOWHERE_ELSE,
    snapshot: bytes = b"",
) -> tuple[int, Foresight]:
    """The fewest vehicles with which every place is seen that often, and what they make of it.

    Planners get better with every vehicle: from the bound on they are tried one by one, the hopeless left out.

    Raises:
        ValueError: not even `MAX_VEHICLES` would do.
    """
    alone_s = sweep_bound_s(area_m2(task.zone.shape), 1, task.limits.speed_m_s, task.footprint_radius_m)
    n = max(1, math.ceil(alone_s / idleness_s))
    while n <= MAX_VEHICLES:
        found = foresee(with_vehicles(task, n), frame, files, starts_m, snapshot)
        if found.plan.error:
            return n, found
        if found.worst_s <= idleness_s:
            return n, found
        share = found.worst_s / idleness_s if math.isfinite(found.worst_s) else 1.0
        n = max(n + 1, math.floor(n * min(share, 4.0)))
    raise ValueError(f"not with {MAX_VEHICLES} vehicles either")


def with_vehicles(task: PlannerTask, n: int) -> PlannerTask:
    """The same for so many: its own first, then others that do not exist, each on a layer above."""
    members, layers_m = list(task.members[:n]), dict(task.layers_m)
    top_m = max(layers_m.values(), default=task.area.alt_min_m)
    for number in range(n - len(members)):
        vehicle = max((*members, *layers_m, 0)) + 1
        members.append(vehicle)
        layers_m[vehicle] = top_m + (number + 1) * max(task.limits.separation_vertical_m, 1.0)
    return replace(task, members=tuple(members), layers_m=layers_m)
