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

from tui_gcs.core.idleness import IdlenessGrid, sweep_bound_s
from tui_gcs.core.messages import FleetFrame, Plan, PlannerTask
from tui_gcs.core.separation import least_separation
from tui_gcs.core.zones import area_m2, polygon_of
from tui_gcs.planner.check.world import World
from tui_gcs.planner.host import PlannerHost
from tui_gcs.planner.registry import PlannerFile

Floats = NDArray[np.floating[Any]]

STEP_S = 0.2
LEAST_S, MOST_S = 40.0, 120.0
"""So long it is flown; longer only for a planner that does not say itself how often it will see every place."""
MOST_MOVES = 40_000
"""Vehicles times steps: about three seconds of a core."""
MOST_VEHICLES = 64
"""Nobody asks for more of one team."""
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


def foresee(task: PlannerTask, frame: FleetFrame, files: Mapping[str, PlannerFile]) -> Foresight:
    """Configure the planner, and fly what it plans."""
    host = PlannerHost(task.team, files)
    host.searches = False
    host.set_task(task)
    world = World(task, start_m(task, frame), t_s=frame.t_s)
    plan = host.step(world.frame())
    if plan.error:
        return Foresight(plan)
    n = len(task.members)
    bound_s = sweep_bound_s(area_m2(task.zone.shape), n, task.limits.speed_m_s, task.footprint_radius_m)
    told_s = plan.metrics.get(PREDICTED, math.nan)
    flown_s, separation = _fly(host, world, plan, LEAST_S if math.isfinite(told_s) else MOST_S)
    worst_s = told_s if math.isfinite(told_s) else flown_s
    return Foresight(plan, worst_s, worst_s / bound_s if bound_s > 0.0 else math.nan, separation)


def _fly(host: PlannerHost, world: World, plan: Plan, duration_s: float) -> tuple[float, float]:
    """(worst idleness once all was seen, NaN if it never was; least separation)."""
    task = world.task
    grid = IdlenessGrid(task.zone.shape, task.footprint_radius_m)
    nearest, measuring = math.inf, False
    for _ in range(min(round(duration_s / STEP_S), MOST_MOVES // max(len(task.members), 1))):
        world.take(plan)
        world.move(STEP_S)
        grid.update(world.t_s, world.position_m[:, :2])
        if grid.full_cover_t is not None and not measuring:
            grid.begin_window(world.t_s)
            measuring = True
        nearest = min(nearest, least_separation(world.position_m, task.limits))
        plan = host.step(world.frame())
    return grid.worst_idleness_s, nearest if math.isfinite(nearest) else math.nan


def start_m(task: PlannerTask, frame: FleetFrame) -> Floats:
    """(n, 2) where the team is; in the middle of the area where nobody knows."""
    place = dict(zip(frame.ids, frame.position_m, strict=True))
    middle = polygon_of(task.area.shape).representative_point()
    spots = []
    for k, vehicle in enumerate(task.members):
        x, y, _ = place.get(vehicle, (math.nan,) * 3)
        spots.append((x, y) if math.isfinite(x) and math.isfinite(y) else (float(middle.x) + k, float(middle.y)))
    return np.array(spots, dtype=float).reshape(-1, 2)


# ---------------------------------------------------------------- how many vehicles


def vehicles_for(
    idleness_s: float, task: PlannerTask, frame: FleetFrame, files: Mapping[str, PlannerFile]
) -> tuple[int, Foresight]:
    """The fewest vehicles with which every place is seen that often, and what they make of it.

    Planners get better with every vehicle: from the bound on they are tried one by one, the hopeless left out.

    Raises:
        ValueError: not even `MOST_VEHICLES` would do.
    """
    alone_s = sweep_bound_s(area_m2(task.zone.shape), 1, task.limits.speed_m_s, task.footprint_radius_m)
    n = max(1, math.ceil(alone_s / idleness_s))
    while n <= MOST_VEHICLES:
        found = foresee(with_vehicles(task, n), frame, files)
        if found.plan.error:
            return n, found
        if found.worst_s <= idleness_s:
            return n, found
        share = found.worst_s / idleness_s if math.isfinite(found.worst_s) else 1.0
        n = max(n + 1, math.floor(n * min(share, 4.0)))
    raise ValueError(f"not with {MOST_VEHICLES} vehicles either")


def with_vehicles(task: PlannerTask, n: int) -> PlannerTask:
    """The same for so many: its own first, then others that do not exist, each on a layer above."""
    members, layers_m = list(task.members[:n]), dict(task.layers_m)
    top_m = max(layers_m.values(), default=task.area.alt_min_m)
    for number in range(n - len(members)):
        vehicle = max((*members, *layers_m, 0)) + 1
        members.append(vehicle)
        layers_m[vehicle] = top_m + (number + 1) * max(task.limits.separation_vertical_m, 1.0)
    return replace(task, members=tuple(members), layers_m=layers_m)
