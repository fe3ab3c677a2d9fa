"""Vehicles in reserve, reliefs with overlap, tours that change in flight, and many vehicles."""

import numpy as np
import pytest

from tests.planner.rigs.flights import SMALL, Fleet, fleet, fly, host_of, task_of, zone_of
from tui_gcs.core.protocol.common import Freshness, Intent, Phase, TeamPlan
from tui_gcs.planner.patrol.formation import MAX_SMALL_TEAM
from tui_gcs.planner.patrol.slots import delayed
from tui_gcs.planner.runtime.host import PlannerHost


def patrol(members: int, **parameters: float | str) -> PlannerHost:
    return host_of(task_of(zone_of(SMALL), tuple(range(1, members + 1)), **parameters))


def of(plan: TeamPlan, vehicle: int) -> Intent:
    return next(intent for intent in plan.intents if intent.vehicle == vehicle)


def slots(plan: TeamPlan) -> list[str]:
    return sorted(intent.slot for intent in plan.intents)


def test_one_stays_in_reserve_and_takes_the_place_of_one_that_is_lost() -> None:
    host, vehicles = patrol(4, reserve=1), fleet(4)
    plan = fly(host, vehicles, 40.0)
    assert slots(plan) == ["1/3", "2/3", "3/3", "reserve"]
    spare = next(intent.vehicle for intent in plan.intents if intent.slot == "reserve")
    assert of(plan, spare).kind == "hold"
    lost = next(intent for intent in plan.intents if intent.slot == "2/3").vehicle
    vehicles.freshness = {lost: Freshness.LOST}
    after = host.step(vehicles.frame())
    assert of(after, spare).slot == "2/3"
    others = [intent for intent in after.intents if intent.vehicle != spare]
    assert all(intent.joined for intent in others), "nobody else moves"
    assert all(intent.joined for intent in fly(host, vehicles, 70.0).intents)


def test_a_relief_is_on_the_slot_before_the_old_one_leaves() -> None:
    host, vehicles = patrol(4, reserve=1), fleet(4)
    plan = fly(host, vehicles, 40.0)
    spare = next(intent.vehicle for intent in plan.intents if intent.slot == "reserve")
    tired = next(intent.vehicle for intent in plan.intents if intent.slot == "1/3")
    vehicles.battery_pct = {tired: 20.0}
    seen: list[tuple[str, bool]] = []

    def watch(plan: TeamPlan) -> None:
        old, new = of(plan, tired), of(plan, spare)
        if old.kind == "return":
            seen.append((new.slot, new.joined))
            apart = np.subtract(new.positions_m[0][:2], vehicles.position_m[vehicles.ids.index(spare), :2])
            assert np.hypot(*apart) < 3.0
        else:
            assert old.slot == "1/3"
            assert plan.metrics["slots"] == 3

    fly(host, vehicles, 75.0, watch)
    assert seen
    assert set(seen) == {("1/3", True)}


def test_without_a_reserve_a_low_battery_changes_nothing() -> None:
    host, vehicles = patrol(3), fleet(3)
    fly(host, vehicles, 40.0)
    vehicles.battery_pct = {1: 10.0}
    assert all(intent.joined for intent in host.step(vehicles.frame()).intents)


def test_a_better_tour_is_taken_without_a_jump() -> None:
    """The tour found at once is made to look bad; the one it goes over to is as it was."""
    host, vehicles = patrol(3, search=1), fleet(3)
    fly(host, vehicles, 40.0)
    planner = host._job.planner  # type: ignore[union-attr]
    state = planner._state  # type: ignore[union-attr]
    better = planner._site.judged(state.design.draft, 3)  # type: ignore[union-attr]
    better.tour = type(better.tour)(better.tour.dt_s, better.tour.xy_m[::-1].copy(), -better.tour.velocity_m_s[::-1])
    better.real = type(better.real)(0.9 * better.real.worst_s, better.real.average_s, 1.0)
    state.search.best = better
    before = host.step(vehicles.frame())
    places: dict[int, np.ndarray] = {}

    def steady(plan: TeamPlan) -> None:
        for intent in plan.intents:
            place = np.array(intent.positions_m[0])
            if intent.vehicle in places:
                assert np.hypot(*(place - places[intent.vehicle])[:2]) <= 8.0 * 0.2 + 0.1
            places[intent.vehicle] = place

    steady(before)
    assert not all(intent.joined for intent in before.intents), "they are on their way to the other tour"
    after = fly(host, vehicles, 80.0, steady)
    assert all(intent.joined for intent in after.intents)


def test_a_restarted_planner_goes_on_where_it_was() -> None:
    first, vehicles = patrol(4), fleet(4)
    fly(first, vehicles, 20.0)
    second = PlannerHost("red")
    second.set_task(task_of(zone_of(SMALL)), first.snapshot())
    for _ in range(10):
        frame = vehicles.frame()
        one, two = first.step(frame), second.step(frame)
        assert one.intents == two.intents
        assert one.metrics == two.metrics
        vehicles.follow(one, 0.2)


def many(count: int) -> Fleet:
    places = tuple((60.0 + 8.0 * (i % 7), 150.0 + 8.0 * (i // 7)) for i in range(count))
    return fleet(count, places=places)


@pytest.mark.long
def test_many_vehicles_fall_back_smoothly_after_losses() -> None:
    count = MAX_SMALL_TEAM + 4
    host, vehicles = patrol(count), many(count)
    fly(host, vehicles, 60.0)
    vehicles.freshness = {3: Freshness.LOST, 9: Freshness.LOST}
    speeds: list[float] = []

    def watch(plan: TeamPlan) -> None:
        speeds.extend(float(np.hypot(*np.array(i.velocities_m_s)[:, :2].T).max()) for i in plan.intents)

    plan = host.step(vehicles.frame())
    assert slots(plan) == sorted(f"{k + 1}/{count - 2}" for k in range(count - 2))
    assert not any("on its way" in intent.reason for intent in plan.intents), "nobody leaves the tour"
    fly(host, vehicles, 66.0, watch)
    vehicles.phase = {5: Phase.HOLDING}
    assert len(fly(host, vehicles, 70.0, watch).intents) == count - 3
    assert max(speeds) <= 8.0


def test_vehicles_that_fall_back_keep_order_and_distance() -> None:
    phase = np.array([3.0, 95.0, 50.0, 47.0])
    phases, numbers = delayed(phase, 4, 100.0, 0.0)
    back = (phase - phases) % 100.0
    assert back.min() < 1e-9
    assert back.max() < 60.0
    assert sorted(numbers.tolist()) == [0, 1, 2, 3]
    np.testing.assert_allclose(np.sort((phases - phases[0]) % 100.0), [0.0, 25.0, 50.0, 75.0])
    np.testing.assert_allclose((phases - 25.0 * numbers) % 100.0, (phases - 25.0 * numbers)[0] % 100.0)


def test_a_few_of_many_that_are_on_the_tour_already_stay_together() -> None:
    """Six of eleven had joined when one that had not was lost: spread over all ten slots one fell back by 190 s."""
    phase = 540.0 - 540.0 / 11 * np.arange(6.0)
    phases, numbers = delayed(phase, 10, 540.0, 0.0)
    back = (phase - phases) % 540.0
    assert back == pytest.approx(np.arange(6.0) * (54.0 - 540.0 / 11)), "4.9 s for each that is ahead"
    assert (-numbers % 10).tolist() == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("seed", range(40))
def test_however_they_are_placed_each_has_a_slot_of_its_own_and_none_is_moved_forward(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 12))
    phase = rng.uniform(0.0, 300.0, int(rng.integers(1, n + 1)))
    phases, numbers = delayed(phase, n, 300.0, 2.0)
    back = phase - phases
    assert len(set(numbers.tolist())) == len(phase) and back.min() == pytest.approx(2.0) and back.max() < 302.0
    np.testing.assert_allclose((phases - 300.0 / n * numbers - phases[0] + 300.0 / n * numbers[0] + 1.0) % 300.0, 1.0)
