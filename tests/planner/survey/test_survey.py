"""The survey planner: it sees all that can be seen once, shares it evenly, and closes the gap of a lost vehicle."""

import math

import msgspec
import numpy as np
import pytest

from tests.planner.rigs.flights import task_of, zone_of
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone
from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.core.protocol.planning import cells_of
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet
from tui_gcs.planner.survey.lanes import best_passes, path_of, time_s
from tui_gcs.planner.survey.survey import SurveyPlanner

STAR = Polygon(tuple(
    (150.0 + r * math.cos(a), 150.0 + r * math.sin(a))
    for a, r in zip(np.arange(10) * math.pi / 5, (110.0, 45.0) * 5, strict=True)
))  # fmt: skip
SHAPES: tuple[Shape, ...] = (Rectangle((150.0, 150.0), 160.0, 120.0), Circle((150.0, 150.0), 80.0), STAR)


def survey_task(shape: Shape, n: int, no_fly: tuple[Zone, ...] = ()) -> PlannerTask:
    task = task_of(zone_of(shape), planner="survey")
    ids = tuple(range(1, n + 1))
    return msgspec.structs.replace(task, members=ids, layers_m={i: 20.0 + 7.0 * i for i in ids}, no_fly=no_fly)


def flown(task: PlannerTask, lose_s: float = math.inf) -> tuple[IdlenessGrid, float]:
    """Fly until all is seen; from `lose_s` on vehicle 1 is gone. Return the grid and the first prediction."""
    host = PlannerHost(task.team)
    host.set_task(task)
    n = len(task.members)
    world = KinematicFleet(task, np.column_stack([20.0 + 20.0 * np.arange(n), np.full(n, 20.0)]), t_s=0.0)
    cells = cells_of(task)
    grid = IdlenessGrid(cells, task.footprint_radius_m)
    plan = host.step(world.frame())
    predicted_s = plan.metrics["predicted_cover_s"]
    while grid.full_cover_t is None and world.t_s < 900.0:
        assert plan.error == ""
        world.take(plan)
        world.move(0.2)
        gone = world.t_s >= lose_s
        grid.update(world.t_s, world.position_m[1 if gone else 0 :, :2])
        frame = world.frame()
        if gone:
            phases = tuple("GROUND" if i == 1 else phase for i, phase in zip(frame.ids, frame.phase, strict=True))
            frame = msgspec.structs.replace(frame, phase=phases)  # type: ignore[arg-type]  # any other than FLYING
        plan = host.step(frame)
    return grid, predicted_s


@pytest.mark.parametrize("shape", SHAPES)
def test_all_is_seen_when_the_planner_says_so(shape: Shape) -> None:
    grid, predicted_s = flown(survey_task(shape, 3))
    assert grid.full_cover_t == pytest.approx(predicted_s, abs=6.0)


def test_a_small_zone_is_seen_along_a_tour_where_lanes_take_longer() -> None:
    """Three vehicles took 85 s for a circle of 2 ha in lanes, 3.2 times the least possible: turns cost most of it."""
    grid, _ = flown(survey_task(SHAPES[1], 3))
    assert grid.full_cover_t is not None and grid.full_cover_t < 70.0


def test_what_lies_behind_a_no_fly_zone_is_seen_in_a_second_turn() -> None:
    hole = Zone("hole", Role.NO_FLY, Circle((150.0, 150.0), 20.0))
    grid, predicted_s = flown(survey_task(SHAPES[0], 2, (hole,)))
    assert grid.full_cover_t is not None
    assert predicted_s < grid.full_cover_t < 1.5 * predicted_s


def test_the_others_see_what_a_lost_vehicle_has_left() -> None:
    whole, _ = flown(survey_task(SHAPES[0], 3))
    grid, _ = flown(survey_task(SHAPES[0], 3), lose_s=40.0)
    assert whole.full_cover_t is not None and grid.full_cover_t is not None
    assert whole.full_cover_t < grid.full_cover_t < 2.0 * whole.full_cover_t


def test_four_take_little_more_than_a_quarter_of_the_time_of_one() -> None:
    cells = cells_of(survey_task(SHAPES[0], 1)).centres_m()
    (alone,) = best_passes(cells, 2.5, 13.75, 1, 8.0)
    parts = best_passes(cells, 2.5, 13.75, 4, 8.0)
    times_s = [time_s(part, 8.0) for part in parts]
    assert max(times_s) < 0.3 * time_s(alone, 8.0)
    assert max(times_s) - min(times_s) < 5.0, "all end together"


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 4))])
def test_passes_of_any_cells_see_each_of_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = np.unique(np.floor(rng.uniform(0.0, 300.0, size=(400, 2)) / 2.5), axis=0) * 2.5
    for part_count in (1, 5):
        parts = best_passes(cells, 2.5, 12.0, part_count, 8.0)
        unseen = np.ones(len(cells), dtype=bool)
        for path in filter(len, map(path_of, parts)):
            for begin, end in zip(path[::2], path[1::2], strict=True):
                length = max(float(np.hypot(*(end - begin))), 1e-9)
                share = np.clip((cells - begin) @ (end - begin) / length**2, 0.0, 1.0)[:, None]
                unseen &= np.hypot(*(cells - begin - share * (end - begin)).T) > 12.0 + 1e-6
        assert not unseen.any()


def test_cells_that_lanes_miss_behind_a_no_fly_zone_are_flown_to_one_by_one() -> None:
    """A lane from the one to the other leads through the zone, the way round it past both: never seen in 355 s."""
    tree = Zone("tree", Role.NO_FLY, Circle((150.0, 150.0), 12.0))
    task = msgspec.structs.replace(survey_task(SHAPES[1], 2, (tree,)), footprint_radius_m=11.0)
    host = PlannerHost(task.team)
    host.set_task(task)
    world = KinematicFleet(task, np.array([[60.0, 150.0], [60.0, 130.0]]), t_s=0.0)
    host.step(world.frame())
    planner = host._job.planner  # type: ignore[union-attr]  # it is configured
    assert isinstance(planner, SurveyPlanner)
    cells_m = planner._cells_m
    left = [int(np.hypot(*(cells_m - at).T).argmin()) for at in ((157.8, 145.2), (142.8, 145.2))]
    planner._state.seen[:] = 1.0
    planner._state.seen[left] = 0.0
    planner._state.ways.clear()
    plan = host.step(world.frame())
    while plan.metrics["covered_pct"] < 100.0 and world.t_s < 150.0:
        world.take(plan)
        world.move(0.2)
        plan = host.step(world.frame())
    assert plan.metrics["covered_pct"] == 100.0
