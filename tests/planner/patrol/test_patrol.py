"""Patrol in closed loop: joining, spacing, losses, limits and determinism."""

import math

import msgspec
import numpy as np
import pytest

from tests.planner.rigs.flights import (
    AREA,
    SMALL,
    Fleet,
    are_sendable,
    fleet,
    fly,
    host_of,
    no_fly,
    region_of,
    task_of,
    zone_of,
)
from tests.planner.rigs.guarded import refusals
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid
from tui_gcs.core.geometry.zones import Circle, Rectangle
from tui_gcs.core.protocol.common import Freshness, Phase, TeamPlan
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.planner.patrol.patrol import Patrol
from tui_gcs.planner.runtime.host import PlannerHost


def small_patrol(members: tuple[int, ...] = (1, 2, 3, 4), **parameters: float | str) -> PlannerHost:
    return host_of(task_of(zone_of(SMALL), members, **parameters))


def limits_kept(plan: TeamPlan) -> None:
    """What the guard would look at, for every sample of every track."""
    for intent in plan.intents:
        assert intent.kind == "trajectory"
        assert intent.t0_s == plan.t_s
        places, speeds = np.array(intent.positions_m), np.array(intent.velocities_m_s)
        assert np.hypot(speeds[:, 0], speeds[:, 1]).max() <= 8.0
        assert np.hypot(*(np.diff(speeds, axis=0)[:, :2] / intent.dt_s).T).max() <= 2.5
        moved = np.diff(places, axis=0) / intent.dt_s
        assert np.abs(moved - (speeds[1:] + speeds[:-1]) / 2.0).max() <= 0.3
        assert (places[:, 2] == 20.0 + 7.0 * intent.vehicle).all()
        assert intent.dt_s * (len(places) - 1) == pytest.approx(3.0)
        region = region_of(zone_of(SMALL))
        assert are_sendable(region, places, speeds, intent.dt_s)


def slots_of(plan: TeamPlan) -> list[str]:
    return sorted(intent.slot for intent in plan.intents)


@pytest.mark.long
@pytest.mark.parametrize("lag_s", [0.0, 0.3])
@pytest.mark.parametrize(("zone_index", "x_m", "joined_s"), [(0, 45.0, 40.0), (1, 25.0, 90.0)])
def test_a_team_joins_its_slots_from_the_ground(
    swarm: Scenario, zone_index: int, x_m: float, joined_s: float, lag_s: float
) -> None:
    round_ = swarm.rounds[0]
    vehicles = fleet(4, lag_s, tuple((x_m, y) for y in (170.0, 190.0, 210.0, 230.0)))
    plan = fly(host_of(task_of(round_.zones[zone_index], area=round_.area)), vehicles, joined_s)
    assert all(intent.joined for intent in plan.intents)
    assert plan.metrics["joined"] == plan.metrics["slots"] == 4


@pytest.mark.long
def test_what_was_predicted_is_flown() -> None:
    host, vehicles, grid = small_patrol(), fleet(4), IdlenessGrid(SMALL, 15.0)
    plan = fly(host, vehicles, 60.0)
    grid.begin_window(vehicles.t_s)

    def watch(_: TeamPlan) -> None:
        grid.update(vehicles.t_s, vehicles.position_m[:, :2])

    fly(host, vehicles, 100.0, watch)
    grid.begin_window(vehicles.t_s)
    fly(host, vehicles, 180.0, watch)
    assert grid.coverage == 1.0
    assert grid.worst_idleness_s == pytest.approx(plan.metrics["predicted_worst_s"], abs=0.8)


def test_slots_are_equally_spaced_in_time() -> None:
    host, vehicles = small_patrol(), fleet(4)
    plan = fly(host, vehicles, 60.0)
    places = {intent.slot: np.array(intent.positions_m[0][:2]) for intent in plan.intents}
    later = fly(host, vehicles, 60.0 + plan.metrics["period_s"] / 4.0)
    then = {intent.slot: np.array(intent.positions_m[0][:2]) for intent in later.intents}
    late_m = 8.0 * 0.3  # the last plan is a little older than a quarter of the period
    for k in range(4):
        assert math.dist(then[f"{k + 1}/4"], places[f"{(k + 1) % 4 + 1}/4"]) <= late_m


@pytest.mark.long
def test_all_limits_are_kept_through_losses_and_joins() -> None:
    host, vehicles = small_patrol(tuple(range(1, 7))), fleet(6)
    vehicles.phase = {5: Phase.GROUND, 6: Phase.GROUND}
    fly(host, vehicles, 50.0, limits_kept)
    vehicles.freshness = {2: Freshness.LOST}
    fly(host, vehicles, 62.0, limits_kept)
    vehicles.phase = {}
    fly(host, vehicles, 75.0, limits_kept)
    vehicles.freshness = {2: Freshness.LOST, 3: Freshness.LOST, 4: Freshness.LOST}
    plan = fly(host, vehicles, 110.0, limits_kept)
    assert slots_of(plan) == ["1/3", "2/3", "3/3"]
    assert all(intent.joined for intent in plan.intents)


@pytest.mark.parametrize("lost", [(2,), (1, 3), (2, 3, 4)])
def test_a_loss_respaces_the_others_in_the_next_step(lost: tuple[int, ...]) -> None:
    host, vehicles = small_patrol(), fleet(4)
    fly(host, vehicles, 60.0)
    vehicles.freshness = dict.fromkeys(lost, Freshness.LOST)
    plan = host.step(vehicles.frame())
    left = 4 - len(lost)
    assert slots_of(plan) == [f"{k + 1}/{left}" for k in range(left)]
    assert not {intent.vehicle for intent in plan.intents} & set(lost)
    assert not any("way" in intent.reason for intent in plan.intents), "nobody leaves the tour"


@pytest.mark.parametrize("lost", [(2,), (2, 3)])
def test_after_a_loss_no_place_waits_longer_than_two_new_slot_periods(lost: tuple[int, ...]) -> None:
    host, vehicles = small_patrol(), fleet(4)
    grid = IdlenessGrid(SMALL, 15.0)

    def watch(plan: TeamPlan) -> None:
        seeing = [i for i, v in enumerate(vehicles.ids) if v not in vehicles.freshness]
        grid.update(plan.t_s, vehicles.position_m[seeing, :2])

    fly(host, vehicles, 60.0, watch)
    vehicles.freshness = dict.fromkeys(lost, Freshness.LOST)
    grid.begin_window(vehicles.t_s)
    plan = fly(host, vehicles, 90.0, watch)
    left = 4 - len(lost)
    assert grid.worst_idleness_s <= 2.0 * plan.metrics["period_s"] / left
    assert all(intent.joined for intent in fly(host, vehicles, 150.0, watch).intents)
    grid.begin_window(vehicles.t_s)
    fly(host, vehicles, 200.0, watch)
    assert grid.worst_idleness_s == pytest.approx(plan.metrics["predicted_worst_s"], abs=0.8), (
        "the same ratio as before"
    )


def test_the_last_one_goes_on_where_it_is() -> None:
    host, vehicles = small_patrol(), fleet(4)
    fly(host, vehicles, 60.0)
    vehicles.phase = {2: Phase.LANDING, 3: Phase.LANDING, 4: Phase.TAKEN_OUT}
    (intent,) = host.step(vehicles.frame()).intents
    assert (intent.vehicle, intent.slot, intent.joined) == (1, "1/1", True)


def test_after_a_hold_a_vehicle_is_sent_anew_from_where_it_stands() -> None:
    host, vehicles = small_patrol(), fleet(4)
    fly(host, vehicles, 60.0)
    vehicles.phase = dict.fromkeys((1, 2, 3, 4), Phase.HOLDING)
    vehicles.velocity_m_s[:] = 0.0
    assert host.step(vehicles.frame()).intents == ()
    vehicles.t_s += 30.0
    vehicles.phase = {}
    plan = host.step(vehicles.frame())
    for i, intent in enumerate(plan.intents):
        np.testing.assert_allclose(intent.positions_m[0], vehicles.position_m[i], atol=1e-6)
        assert not intent.joined
    assert all(intent.joined for intent in fly(host, vehicles, 130.0).intents)


def test_a_vehicle_blown_off_its_slot_is_led_back() -> None:
    host, vehicles = small_patrol(), fleet(4)
    fly(host, vehicles, 60.0)
    vehicles.position_m[0] += (25.0, 0.0, 0.0)
    led = host.step(vehicles.frame()).intents[0]
    assert not led.joined
    assert math.dist(led.positions_m[0][:2], vehicles.position_m[0, :2]) < 0.01
    assert all(intent.joined for intent in fly(host, vehicles, 85.0).intents)


def test_old_positions_are_no_reason_to_move() -> None:
    host, vehicles = small_patrol(), fleet(4)
    fly(host, vehicles, 60.0)
    frame = msgspec.structs.replace(vehicles.frame(), t_s=vehicles.t_s + 2.5, age_s=(2.5,) * 4)
    assert all(intent.joined for intent in host.step(frame).intents)


def test_numbers_of_vehicles_do_not_matter() -> None:
    def flown(order: tuple[int, ...]) -> dict[tuple[float, float], TeamPlan]:
        vehicles = fleet(4)
        start = vehicles.position_m[:, :2].copy()
        vehicles.position_m[:, :2] = start[list(order)]
        plan = host_of(task_of(zone_of(SMALL))).step(vehicles.frame())
        return {tuple(start[order[i.vehicle - 1]]): (i.positions_m, i.slot) for i in plan.intents}  # type: ignore[misc]

    def level(found: dict) -> dict:
        return {k: ([p[:2] for p in places], slot) for k, (places, slot) in found.items()}

    assert level(flown((0, 1, 2, 3))) == level(flown((2, 0, 3, 1)))


def test_the_same_flight_gives_the_same_plans() -> None:
    def plans() -> list[tuple]:
        seen: list[tuple] = []
        fly(small_patrol(), fleet(4), 30.0, lambda plan: seen.append((plan.intents, plan.metrics)))
        return seen

    assert plans() == plans()


@pytest.mark.parametrize(("direction", "sign"), [("cw", -1.0), ("ccw", 1.0)])
def test_direction_is_the_operators_choice(direction: str, sign: float) -> None:
    plan = small_patrol(direction=direction).step(fleet(4).frame())
    assert plan.annotations is not None
    x, y = np.array(plan.annotations[0].points_m[:-1]).T
    assert np.sign(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) == sign


def test_a_tour_in_the_other_direction_passes_the_guard_too() -> None:
    """Whoever flies lanes the other way round brakes where it sped up before: in front of the wall."""
    mast, tours = no_fly(Circle((185.0, 200.0), 15.0)), []
    for direction in ("cw", "ccw"):
        planner = host_of(task_of(zone_of(SMALL), closed=(mast,), direction=direction))._present().planner
        assert isinstance(planner, Patrol)
        tour = planner._guidance.tour
        tours.append(tour)
        twice = np.tile(tour.xy_m, (2, 1)), np.tile(tour.velocity_m_s, (2, 1))
        assert refusals(*twice, tour.dt_s, AREA, (mast,)) == []
    assert tours[0].period_s != tours[1].period_s


def test_the_tour_is_drawn_at_first_and_now_and_then() -> None:
    drawn: list[float] = []

    def note(plan: TeamPlan) -> None:
        if plan.annotations is not None:
            drawn.append(plan.t_s)
            assert len(plan.annotations[0].points_m) <= 121

    fly(small_patrol(), fleet(4), 11.0, note)
    assert drawn == pytest.approx([0.0, 5.0, 10.0], abs=0.5)


def test_a_vehicle_with_no_way_to_its_slot_holds() -> None:
    wall = no_fly(Rectangle((80.0, 200.0), 20.0, 400.0))
    host = host_of(task_of(zone_of(SMALL), area=AREA, closed=(wall,)))
    vehicles: Fleet = fleet(1)
    vehicles.position_m[0, :2] = (45.0, 200.0)
    (intent,) = host.step(vehicles.frame()).intents
    assert intent.kind == "hold"
    assert "no way" in intent.reason


def test_a_team_on_the_ground_is_no_error() -> None:
    vehicles = fleet(2)
    vehicles.phase = {1: Phase.GROUND, 2: Phase.GROUND}
    plan = small_patrol((1, 2)).step(vehicles.frame())
    assert (plan.intents, plan.error, plan.metrics["slots"]) == ((), "", 0.0)
