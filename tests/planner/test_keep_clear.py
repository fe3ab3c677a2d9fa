"""Planners lead their vehicles round where a lost one may be, without a stop, and back when it cannot be there."""

import math
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest

from tests.planner.rigs.flights import task_of, zone_of
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.protocol.common import Freshness, KeepOut, PlannerTask, PointOfInterest, TeamPlan
from tui_gcs.planner.api import as_no_fly, at_heights
from tui_gcs.planner.keep_clear import WIDER
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet

ZONE = Rectangle((200.0, 150.0), 200.0, 140.0)
COLUMN = KeepOut(2, (180.0, 150.0), (220.0, 150.0), 21.0, -5.3, 50.0)
"""Vehicle 2 may sink from 34 m, where it was lost, or climb a little."""
LOST_S, LEAVE_S, OVER_S = 60.0, 12.0, 160.0
SOON_S = 20.0
"""A survey loses its vehicle then: with four it is over after less than a minute."""
STARTS = np.array([(60.0, 60.0 + 30.0 * i) for i in range(4)])


def team_task(planner: str) -> PlannerTask:
    return task_of(zone_of(ZONE), planner=planner)


def flown(
    task: PlannerTask, until_s: float, column: KeepOut = COLUMN, lost_s: float = LOST_S
) -> Iterator[tuple[KinematicFleet, TeamPlan]]:
    """Fly a team that loses vehicle 2 at `lost_s`; until `OVER_S` it may be in `column`."""
    host = PlannerHost(task.team)
    host.set_task(task)
    world = KinematicFleet(task, STARTS, t_s=0.0)
    while world.t_s < until_s:
        if world.t_s >= lost_s:
            world.freshness = {2: Freshness.LOST}
            world.keep_out = (column,) if world.t_s < OVER_S else ()
        plan = host.step(world.frame())
        assert plan.error == ""
        world.take(plan)
        world.move(0.2)
        yield world, plan


def inside_m(column: KeepOut, place_m: np.ndarray) -> float:
    """How far inside the column a place is; negative outside."""
    (x, y), (x1, _) = column.begin_m, column.end_m
    return column.radius_m - math.hypot(place_m[0] - min(max(place_m[0], x), x1), place_m[1] - y)


@pytest.mark.parametrize(("planner", "lost_s"), [("patrol", LOST_S), ("survey", SOON_S), ("waypoints", LOST_S)])
def test_survivors_fly_on_round_it(planner: str, lost_s: float) -> None:
    """After the time that leaving it takes, no vehicle is in the column, and none has been told to hold."""
    for world, plan in flown(team_task(planner), OVER_S, lost_s=lost_s):
        if world.t_s < lost_s + 0.5:
            continue
        held = [(round(world.t_s, 1), i.vehicle, i.reason) for i in plan.intents if i.kind == "hold"]
        assert not held
        if world.t_s > lost_s + LEAVE_S:
            assert max(inside_m(COLUMN, world.position_m[i]) for i in (0, 2, 3)) <= 0.1, world.t_s


def test_a_patrol_is_on_its_slots_round_the_column_and_back_on_its_own_tour_after_it() -> None:
    periods_s = dict[int, float]()
    for world, plan in flown(team_task("patrol"), OVER_S + 60.0):
        periods_s[round(world.t_s)] = plan.metrics["period_s"]
        if round(world.t_s) in (50, 150):
            assert plan.metrics["joined"] == plan.metrics["slots"], world.t_s
    assert plan.metrics["joined"] == plan.metrics["slots"] == 3
    assert periods_s[50] == periods_s[200] < periods_s[100] < 1.5 * periods_s[50]


def test_a_survey_sees_the_rest_first_and_the_column_when_it_is_over() -> None:
    flights = flown(team_task("survey"), 320.0, lost_s=SOON_S)
    covered = {round(world.t_s): plan.metrics["covered_pct"] for world, plan in flights}
    assert 60.0 < covered[round(OVER_S)] < 100.0 and covered[320] == 100.0


def test_a_search_waits_elsewhere_and_does_a_point_in_the_column_afterwards() -> None:
    """A vehicle that waits without a task where the lost one may come gets out of its way."""
    task = team_task("search")
    host = PlannerHost(task.team)
    host.set_task(task)
    world = KinematicFleet(task, np.array([(200.0, 150.0), *STARTS[1:]]), t_s=0.0)
    world.freshness, world.keep_out = {2: Freshness.LOST}, (COLUMN,)
    world.points = (PointOfInterest("in the column", (200.0, 150.0), 1.0, "", 0.0, math.inf),)
    for _ in range(100):
        plan = host.step(world.frame())
        world.take(plan)
        world.move(0.2)
    assert inside_m(COLUMN, world.position_m[0]) < 0.0 and plan.metrics["assigned"] == 0.0
    world.keep_out = ()
    assert host.step(world.frame()).metrics["assigned"] == 1.0


def test_vehicles_on_layers_above_it_fly_on_as_before() -> None:
    low = msgspec.structs.replace(COLUMN, high_m=25.0)
    plans = [plan for _, plan in flown(team_task("patrol"), LOST_S + 5.0, low)]
    assert plans[0].metrics["period_s"] == plans[-1].metrics["period_s"]
    assert at_heights([COLUMN, low], [27.0, 41.0]) == (COLUMN,) and at_heights([COLUMN], [50.0]) == ()


def test_a_restarted_planner_goes_on_round_it() -> None:
    task = team_task("patrol")
    host, again = PlannerHost(task.team), PlannerHost(task.team)
    host.set_task(task)
    world = KinematicFleet(task, STARTS, t_s=0.0)
    world.keep_out = (COLUMN,)
    for _ in range(150):
        world.take(host.step(world.frame()))
        world.move(0.2)
    again.set_task(task, host.snapshot())
    frame = world.frame()
    assert again.step(frame).intents == host.step(frame).intents


def test_the_outline_is_outside_the_volume() -> None:
    (zone,) = as_no_fly([COLUMN])
    places = np.array(zone.shape.vertices_m)  # type: ignore[union-attr]
    assert all(inside_m(COLUMN, place) < 0.0 for place in places)
    middles = (places + np.roll(places, 1, axis=0)) / 2.0
    assert all(inside_m(COLUMN, place) < 1e-6 for place in middles) and WIDER < 1.05
