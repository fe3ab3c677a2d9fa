"""Predicts what a plan is worth before it is flown, with simulated vehicles that follow it exactly.

Any planner can be forecast. One that searches in the background may do so first, as it does before take-off: then the
figures are those of the plan that will be flown.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, serving
from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.motion.separation import least_separation
from tui_gcs.core.protocol.common import FleetFrame, FlownWays, Phase, PlannerTask, TeamPlan
from tui_gcs.core.protocol.planning import Annotation, cells_of, sweep_of_task
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet
from tui_gcs.planner.runtime.planner_file import PlannerFile

Floats = NDArray[np.floating[Any]]

STEP_S = 0.2
"""Step of the simulated flight."""
MIN_FLIGHT_S, MAX_FLIGHT_S = 40.0, 120.0
"""Simulated time: the first if the planner predicts its idleness itself, else the second. The flight goes on while a
vehicle is on its way to its place."""
RECORDED_STEPS = 5
"""One of this many steps is recorded, to compare ways of several teams."""
MAX_VEHICLE_STEPS = 40_000
"""Vehicles times steps: about three seconds of a core."""
MAX_VEHICLES = 64
"""The largest team that is tried."""
NO_STARTS: Mapping[int, tuple[float, float]] = {}
MAX_SEARCH_S = 15.0
"""Mission time of a search on the ground; patrol's ends after 10 s."""
MAX_SEARCH_STEPS = round(MAX_SEARCH_S / STEP_S)
SEARCHED = "searched"
"""Name of the metric in which planners tell the share of their search that is done."""
PREDICTED = "predicted_worst_s"
"""Name of the metric in which planners predict their worst idleness."""


@dataclass(frozen=True)
class SearchLimit:
    """How long a planner may search on the ground before its plan is flown; whichever end comes first."""

    steps: int = MAX_SEARCH_STEPS
    """Steps of `STEP_S` of mission time. The same number gives the same plan on a fast and on a slow computer."""
    end_cpu_s: float = math.inf
    """Processor time of this process at which the search ends, for computers that are slower than expected."""


NO_SEARCH = SearchLimit(steps=0)


@dataclass(frozen=True)
class PlanForecast:
    """One plan and the result of flying it."""

    plan: TeamPlan
    """The plan of the first step."""
    worst_s: float = math.nan
    """Worst idleness, as the planner predicts it or as flown; NaN if some cell was not seen in that time."""
    ratio: float = math.nan
    """`worst_s` divided by `ideal_s`."""
    ideal_s: float = math.nan
    """A / (n v 2r) of the area that can be seen."""
    bound_s: float = math.nan
    """Worst idleness that no plan beats."""
    separation: float = math.nan
    """Smallest separation of any two vehicles as a multiple of the limit; NaN for less than two vehicles."""
    ways: FlownWays | None = None
    """The recorded ways of the vehicles, to compare them with other teams' ways."""


def forecast(
    task: PlannerTask,
    frame: FleetFrame,
    files: Mapping[str, PlannerFile],
    starts_m: Mapping[int, tuple[float, float]] = NO_STARTS,
    snapshot: bytes = b"",
    *,
    search: SearchLimit = NO_SEARCH,
) -> PlanForecast:
    """Configure the planner and fly its plan. Vehicles that are not in `frame` begin at `starts_m`.

    A planner that searches in the background first does so within the limit of `search`; without it the figures are
    those of the plan at once. If `snapshot` is of a planner of the same kind that flies now, this one inherits what
    that one has learnt.
    """
    host = PlannerHost(task.team, files)
    host.set_task(task)
    host.inherit(snapshot)
    world = KinematicFleet(task, start_m(task, frame, starts_m), t_s=frame.t_s)
    drawn = _search(host, world, search)
    host.searches = False
    plan = host.step(world.frame())
    if plan.error:
        return PlanForecast(plan)
    if plan.annotations is None:
        plan = replace(plan, annotations=drawn)
    n = serving(len(task.members), sum(intent.kind == "hold" and intent.joined for intent in plan.intents))
    cells, sweep = cells_of(task), sweep_of_task(task, n)
    ideal_s, bound_s = cells.ideal_s(*sweep), cells.bound_s(*sweep)
    predicted_s = plan.metrics.get(PREDICTED, math.nan)
    flown_s, separation, ways = _fly(host, world, plan, MIN_FLIGHT_S if math.isfinite(predicted_s) else MAX_FLIGHT_S)
    worst_s = predicted_s if math.isfinite(predicted_s) else flown_s
    ratio = worst_s / ideal_s if ideal_s > 0.0 else math.nan
    return PlanForecast(plan, worst_s, ratio, ideal_s, bound_s, separation, ways)


def _search(host: PlannerHost, world: KinematicFleet, limit: SearchLimit) -> tuple[Annotation, ...] | None:
    """Let the planner search while all vehicles are on the ground. Return what it drew last."""
    drawn = None
    world.phase = dict.fromkeys(world.task.members, Phase.ARMING)
    for _ in range(min(limit.steps, MAX_SEARCH_STEPS)):
        if time.process_time() >= limit.end_cpu_s:
            break
        plan = host.step(world.frame())
        drawn = drawn if plan.annotations is None else plan.annotations
        if plan.error or plan.metrics.get(SEARCHED, 1.0) >= 1.0:
            break
        world.t_s += STEP_S
    world.phase = {}
    return drawn


def _fly(host: PlannerHost, world: KinematicFleet, plan: TeamPlan, least_s: float) -> tuple[float, float, FlownWays]:
    """Return (worst idleness after full coverage, NaN without; smallest separation; where the vehicles were)."""
    task = world.task
    grid = IdlenessGrid(cells_of(task), task.footprint_radius_m)
    nearest, measuring = math.inf, False
    kept: list[Floats] = []
    loops = tuple(line.points_m for line in plan.annotations or () if line.is_loop and np.isfinite(line.points_m).all())
    for step in range(min(round(MAX_FLIGHT_S / STEP_S), MAX_VEHICLE_STEPS // max(len(task.members), 1))):
        if step * STEP_S >= least_s and all(intent.joined for intent in plan.intents):
            break
        if step % RECORDED_STEPS == 0:
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
    ways = FlownWays(task.members, STEP_S * RECORDED_STEPS, places, loops)
    return grid.worst_idleness_s, nearest if math.isfinite(nearest) else math.nan, ways


def start_m(task: PlannerTask, frame: FleetFrame, starts_m: Mapping[int, tuple[float, float]] = NO_STARTS) -> Floats:
    """Return (n, 2) where the team is or is to start; the middle of the area for unknown places."""
    place = {vehicle: (x, y, 0.0) for vehicle, (x, y) in starts_m.items()}
    place |= {v: at for v, at in zip(frame.ids, frame.position_m, strict=True) if math.isfinite(at[0] + at[1])}
    middle = polygon_of(task.area.shape).representative_point()
    spots = []
    for k, vehicle in enumerate(task.members):
        x, y, _ = place.get(vehicle, (math.nan,) * 3)
        spots.append((x, y) if math.isfinite(x) and math.isfinite(y) else (float(middle.x) + k, float(middle.y)))
    return np.array(spots, dtype=float).reshape(-1, 2)


def vehicles_for(
    idleness_s: float,
    task: PlannerTask,
    frame: FleetFrame,
    files: Mapping[str, PlannerFile],
    starts_m: Mapping[int, tuple[float, float]] = NO_STARTS,
    snapshot: bytes = b"",
) -> tuple[int, PlanForecast]:
    """Return the smallest number of vehicles that sees every place at least that often, and its forecast.

    Idleness falls with every vehicle, so numbers are tried upwards from the bound; hopeless ones are skipped.

    Raises:
        ValueError: not even `MAX_VEHICLES` would do.
    """
    cells, n = cells_of(task), 1
    # The ideal can be beaten in a zone that one footprint nearly covers, the bound never.
    while n < MAX_VEHICLES and cells.bound_s(*sweep_of_task(with_vehicles(task, n), n)) > idleness_s:
        n += 1
    while n <= MAX_VEHICLES:
        found = forecast(with_vehicles(task, n), frame, files, starts_m, snapshot)
        if found.plan.error or found.worst_s <= idleness_s:
            return n, found
        share = found.worst_s / idleness_s if math.isfinite(found.worst_s) else 1.0
        n = max(n + 1, math.floor(n * min(share, 4.0)))
    raise ValueError(f"not with {MAX_VEHICLES} vehicles either")


def with_vehicles(task: PlannerTask, n: int) -> PlannerTask:
    """Return the task for `n` vehicles: its own first, then made-up ones, each on a layer above."""
    members, layers_m = list(task.members[:n]), dict(task.layers_m)
    top_m = max(layers_m.values(), default=task.area.alt_min_m)
    for number in range(n - len(members)):
        vehicle = max((*members, *layers_m, 0)) + 1
        members.append(vehicle)
        layers_m[vehicle] = top_m + (number + 1) * max(task.limits.separation_vertical_m, 1.0)
    return replace(task, members=tuple(members), layers_m=layers_m)
