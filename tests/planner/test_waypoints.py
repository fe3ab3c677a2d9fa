"""Paths that an operator draws, and strips where he draws none."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
import shapely

import tui_gcs
from tests.planner.rigs.flights import AREA, SMALL, fleet, host_of, no_fly, task_of, zone_of
from tui_gcs.core.geometry.zones import Circle, Rectangle, polygon_of
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Round
from tui_gcs.planner.patrol.tour import resampled, timed
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.waypoints import Waypoints, parse_paths, strips

SHIPPED = Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml"
SQUARE = "1: 100,100 200,100 200,200 100,200; 2: 300,100 400,100"


def hosted(paths: str = SQUARE, **parameters: float | str) -> PlannerHost:
    return host_of(task_of(zone_of(SMALL), (1, 2), planner="waypoints", paths=paths, **parameters))


def test_a_path_is_a_vehicle_and_points() -> None:
    paths = parse_paths(SQUARE)
    assert sorted(paths) == [1, 2]
    assert paths[2].tolist() == [[300.0, 100.0], [400.0, 100.0]]
    assert parse_paths(" ; ") == {}


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ("100,100 200,200", "must be VEHICLE: EAST,NORTH"),
        ("1: 100,100", "1 points, and needs 2"),
        ("1: 100,100 200", "'200' is not EAST,NORTH"),
        ("1: 100,nan 200,1", "'100,nan' is not finite"),
        ("1: 1,1 2,2; 1: 3,3 4,4", "two paths"),
        ("2: 5,5 5,5 5,5", "all points of vehicle 2 are in one place"),
    ],
)
def test_a_mistake_is_one_line(wrong: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        parse_paths(wrong)


def test_every_vehicle_flies_its_own_path_round_after_round() -> None:
    host, team = hosted(), fleet(2)
    seen: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    for _ in range(700):
        plan = host.step(team.frame())
        assert not plan.error, plan.error
        team.follow(plan, 0.2)
        if plan.metrics["joined"] == 2:
            for intent in plan.intents:
                seen[intent.vehicle].append(intent.positions_m[0][:2])
    for vehicle, ring in (
        (1, shapely.box(100, 100, 200, 200).exterior),
        (2, shapely.LineString([(300, 100), (400, 100)])),
    ):
        places = shapely.points(np.array(seen[vehicle]))
        assert shapely.distance(places, ring).max() < 2.0, "corners are rounded a little"
        assert shapely.distance(shapely.points(np.array(ring.coords)), shapely.union_all(places)).max() < 4.0, (
            "all of it"
        )


def test_the_way_back_is_the_way_it_came_if_it_is_no_loop() -> None:
    host = host_of(task_of(zone_of(SMALL), (1,), planner="waypoints", paths="1: 100,100 200,100 200,200", loop=False))
    team, least = fleet(1), 1e9
    for _ in range(500):
        plan = host.step(team.frame())
        team.follow(plan, 0.2)
        if plan.metrics["joined"]:
            least = min(least, float(np.hypot(*(team.position_m[0, :2] - (150.0, 150.0)))))
    assert least > 45.0, "the short cut from the last point to the first would come through the middle"


def test_a_vehicle_without_a_path_holds_and_gives_the_reason() -> None:
    host, team = hosted("1: 100,100 200,100"), fleet(2)
    first, second = host.step(team.frame()).intents
    assert first.kind == "trajectory"
    assert (second.kind, second.reason) == ("hold", "no path was drawn for it")


def test_a_vehicle_whose_points_are_nearly_one_flies_there_and_stays() -> None:
    host, team = hosted("1: 100,100 100.000001,100"), fleet(1)
    for _ in range(200):
        plan = host.step(team.frame())
        assert not plan.error, plan.error
        team.follow(plan, 0.2)
    assert np.hypot(*(team.position_m[0, :2] - (100.0, 100.0))) < 1.0
    assert plan.metrics["joined"] == 1


@pytest.mark.parametrize(
    ("paths", "why"),
    [
        ("7: 1,1 2,2", "vehicle 7 is not in team red"),
        ("1: 100,100 900,100", r"\(900, 100\) is outside of where it may"),
    ],
)
def test_paths_that_cannot_be_flown_are_refused_before_anything_moves(paths: str, why: str) -> None:
    import re

    plan = hosted(paths).step(fleet(2).frame())
    assert re.search(why, plan.error)
    assert plan.intents == ()


def test_without_paths_the_zone_is_cut_into_strips_that_cover_it() -> None:
    zone = shapely.box(370, 140, 530, 260)
    found = strips(zone, 4, 15.0)
    seen = shapely.union_all([shapely.LineString(path).buffer(15.0) for path in found])
    assert shapely.intersection(seen, zone).area / zone.area > 0.97
    middles = [float(path[:, 0].mean()) for path in found]
    assert middles == sorted(middles)
    for path, others in ((found[0], found[1]),):
        assert shapely.LineString(path).distance(shapely.LineString(others)) > 15.0


@pytest.mark.parametrize("count", [1, 3, 8])
def test_strips_of_round_and_small_zones_are_flown_too(count: int) -> None:
    members = tuple(range(1, count + 1))
    host = host_of(task_of(zone_of(Circle((300.0, 200.0), 25.0)), members, planner="waypoints"))
    plan = host.step(fleet(count).frame())
    assert not plan.error
    assert len(plan.intents) == count


@pytest.mark.parametrize("round_", load(SHIPPED).rounds, ids=lambda round_: str(round_.name))
def test_strips_of_the_shipped_zones_keep_the_allowed_acceleration(round_: Round) -> None:
    """Also where a lane's end lies half way between two points of the path."""
    for zone in round_.zones[:2]:
        for path in strips(polygon_of(zone.shape), 4, 15.0):
            tour = timed(resampled(path), 7.6, 2.25)
            change = np.diff(tour.velocity_m_s, axis=0, append=tour.velocity_m_s[:1])
            assert np.hypot(*change.T).max() <= 2.5 * tour.dt_s


def test_a_path_through_a_no_fly_zone_is_refused() -> None:
    closed = (no_fly(Rectangle((150.0, 100.0), 40.0, 40.0)),)
    task = task_of(zone_of(SMALL), (1,), AREA, closed, planner="waypoints", paths="1: 100,100 200,100 150,102")
    assert "is outside of where it may fly" in host_of(task).step(fleet(1).frame()).error


def test_strips_lead_round_a_no_fly_zone() -> None:
    """They cut straight through it: 110 vetoes in a rehearsal, vehicles that braked at it in each round."""
    tree = no_fly(Circle((150.0, 150.0), 12.0))
    task = task_of(zone_of(Rectangle((150.0, 150.0), 120.0, 100.0)), (1, 2), planner="waypoints")
    task = msgspec.structs.replace(task, no_fly=(tree,))
    host = host_of(task)
    planner = host._job.planner  # type: ignore[union-attr]  # it is configured
    assert isinstance(planner, Waypoints) and len(planner._tours) == 2
    wall = polygon_of(tree.shape).buffer(task.limits.geofence_margin_m)
    for tour in planner._tours.values():
        assert not shapely.LinearRing(tour.xy_m).intersects(wall)


@pytest.mark.parametrize(("far_m", "is_refused"), [(200.0, True), (110.0, False)])
def test_a_drawn_leg_through_a_no_fly_zone_is_refused(far_m: float, is_refused: bool) -> None:
    """Both of its ends are where vehicles may fly."""
    tree = no_fly(Circle((150.0, 150.0), 12.0))
    task = task_of(zone_of(SMALL), (1,), planner="waypoints", paths=f"1: 100,150 {far_m:g},150 {far_m:g},100")
    plan = host_of(msgspec.structs.replace(task, no_fly=(tree,))).step(fleet(1).frame())
    assert ("the way from (100, 150) to (200, 150) leaves where it may fly" in plan.error) is is_refused
