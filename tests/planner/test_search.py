"""The search planner: points by priority and nearness, none twice, in time, and around no-fly zones."""

import math

import msgspec
import numpy as np
import pytest

from tests.planner.rigs.flights import task_of, zone_of
from tui_gcs.core.geometry.zones import Rectangle, Role, Zone
from tui_gcs.core.protocol.common import FleetFrame, PlannerTask, PointOfInterest, TeamPlan
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet

AREA = Rectangle((150.0, 150.0), 160.0, 120.0)


def search_task(n: int, no_fly: tuple[Zone, ...] = ()) -> PlannerTask:
    task, ids = task_of(zone_of(AREA), planner="search"), tuple(range(1, n + 1))
    return msgspec.structs.replace(task, members=ids, layers_m={i: 20.0 + 7.0 * i for i in ids}, no_fly=no_fly)


def poi(name: str, x: float, y: float, priority: float = 1.0, due_s: float = math.inf) -> PointOfInterest:
    return PointOfInterest(name, (x, y), priority, "", 0.0, due_s)


def with_points(frame: FleetFrame, *points: PointOfInterest) -> FleetFrame:
    return msgspec.structs.replace(frame, points=points)


def planned(starts: list[tuple[float, float]], *points: PointOfInterest) -> dict[int, str]:
    """What each vehicle flies to in the first step; "" where it holds."""
    task = search_task(len(starts))
    host = PlannerHost(task.team)
    host.set_task(task)
    plan = host.step(with_points(KinematicFleet(task, np.array(starts), t_s=0.0).frame(), *points))
    assert plan.error == ""
    return {intent.vehicle: intent.reason if intent.kind == "goto" else "" for intent in plan.intents}


def test_each_takes_the_point_that_is_near_to_it() -> None:
    assert planned([(80.0, 150.0), (220.0, 150.0)], poi("east", 230.0, 150.0), poi("west", 70.0, 150.0)) == {
        1: "west",
        2: "east",
    }


def test_what_matters_more_comes_first() -> None:
    near, far = poi("near", 90.0, 150.0), poi("far", 200.0, 150.0, priority=10.0)
    assert planned([(80.0, 150.0)], near, far) == {1: "far"}
    assert planned([(80.0, 150.0)], near, msgspec.structs.replace(far, priority=1.0)) == {1: "near"}


def test_what_cannot_be_reached_in_time_is_left_for_what_can() -> None:
    assert planned([(80.0, 150.0)], poi("late", 220.0, 150.0, 10.0, due_s=5.0), poi("near", 90.0, 150.0)) == {1: "near"}


@pytest.mark.parametrize(("left_s", "flies_to"), [(math.nan, "far"), (200.0, "far"), (115.0, "near"), (70.0, "")])
def test_a_vehicle_takes_no_point_from_which_its_battery_does_not_bring_it_home(left_s: float, flies_to: str) -> None:
    """The way home takes 40 s, the reserve is 60 s, the far point is 140 m away, the near one 10 m."""
    task = search_task(1)
    host = PlannerHost(task.team)
    host.set_task(task)
    frame = KinematicFleet(task, np.array([(80.0, 150.0)]), t_s=0.0).frame()
    frame = msgspec.structs.replace(frame, battery_left_s=(left_s,), home_s=(40.0,))
    plan = host.step(with_points(frame, poi("far", 220.0, 150.0, priority=50.0), poi("near", 90.0, 150.0)))
    assert plan.error == ""
    assert [i.reason if i.kind == "goto" else "" for i in plan.intents] == [flies_to]


def test_without_tasks_all_hold() -> None:
    assert planned([(80.0, 150.0), (100.0, 150.0)]) == {1: "", 2: ""}


@pytest.mark.parametrize("seed", [1, 2])
def test_all_points_are_visited_around_a_no_fly_zone(seed: int) -> None:
    hole = Zone("hole", Role.NO_FLY, Rectangle((150.0, 150.0), 40.0, 40.0))
    task, rng = search_task(3, (hole,)), np.random.default_rng(seed)
    left = {
        f"p{k}": (float(x), float(y)) for k, (x, y) in enumerate(rng.uniform((75.0, 95.0), (225.0, 205.0), (12, 2)))
    }
    left = {k: p for k, p in left.items() if max(abs(p[0] - 150.0), abs(p[1] - 150.0)) > 30.0}
    host = PlannerHost(task.team)
    host.set_task(task)
    world = KinematicFleet(task, np.array([(80.0, 100.0), (90.0, 100.0), (100.0, 100.0)]), t_s=0.0)
    while left and world.t_s < 300.0:
        plan: TeamPlan = host.step(with_points(world.frame(), *(poi(name, *place) for name, place in left.items())))
        assert plan.error == ""
        world.take(plan)
        world.move(0.2)
        for x, y in world.position_m[:, :2].tolist():
            assert max(abs(x - 150.0), abs(y - 150.0)) > 20.0, "never over the no-fly zone"
            left = {k: p for k, p in left.items() if math.dist(p, (x, y)) > task.footprint_radius_m}
    assert left == {}
    assert world.t_s < 120.0
