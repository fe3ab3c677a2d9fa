"""Slots and references in a moment, with numbers worked out by hand; flown in test_patrol.py and test_reserve.py."""

import math
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from tests.planner.rigs.flights import region_of, zone_of
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.planner.api import Fleet
from tui_gcs.planner.patrol import formation
from tui_gcs.planner.patrol.formation import (
    ON_COURSE_S,
    Formation,
    TourGuidance,
    VehicleSlot,
    _cross_track_m,
    _lead_s,
    _now,
)
from tui_gcs.planner.patrol.tour import Tour
from tui_gcs.planner.patrol.transit import STEP_S, Mobility, Transit

PERIOD_S, SPEED_M_S, RADIUS_M = 60.0, 4.0, 60.0 * 4.0 / (2 * math.pi)
NOW = 1000.0


def circle(period_s: float = PERIOD_S) -> TourGuidance:
    """A tour at 4 m/s round (400, 200), eastwards first; a minute long."""
    angle = 2 * math.pi * np.arange(600) / 600
    path = np.stack([400.0 + RADIUS_M * np.sin(angle), 200.0 + RADIUS_M * np.cos(angle)], axis=1)
    speed = np.stack([np.cos(angle), -np.sin(angle)], axis=1) * SPEED_M_S * PERIOD_S / period_s
    tour = Tour(period_s / 600, path, speed)
    return TourGuidance(tour, Mobility(7.84, 2.25), region_of(zone_of(Rectangle((400.0, 200.0), 100.0, 100.0))))


def fleet(places: np.ndarray, velocities: np.ndarray | None = None, age_s: float = 0.0) -> Fleet:
    """Vehicles 1, 2, ... at these places on the ground plan."""
    n = len(places)
    velocities = np.zeros((n, 2)) if velocities is None else velocities
    high = np.full((n, 1), 30.0)
    seen = SimpleNamespace(
        id=np.arange(1, n + 1),
        position_m=np.hstack([places, high]),
        velocity_m_s=np.hstack([velocities, high]),
        age_s=np.full(n, age_s),
    )
    return cast(Fleet, seen)


def on_slots(course: TourGuidance, n: int, phase_s: float = 10.0) -> tuple[Formation, Fleet]:
    """n vehicles that are on equally timed slots since long, the first at that phase."""
    berths = {k + 1: VehicleSlot(NOW - phase_s - PERIOD_S / n * k, k, planned_s=0.0, joined=True) for k in range(n)}
    for berth in berths.values():
        berth.settled_s = 0.0
    places, speeds = course.references(list(berths.values()), np.array([NOW]))
    return Formation(berths, slots=n), fleet(places[:, 0], speeds[:, 0])


def phases_s(found: Formation) -> list[float]:
    """Of the slots, in their order, after that of the first."""
    berths = sorted(found.berths.values(), key=lambda berth: berth.slot)
    return [round(berths[0].origin_s - berth.origin_s, 6) % PERIOD_S for berth in berths]


# ---------------------------------------------------------------- where they are


def test_an_old_position_is_carried_forward_for_a_second_at_most() -> None:
    place, speed = np.array([[10.0, 20.0]]), np.array([[3.0, -2.0]])
    for age_s, ahead_s in ((0.0, 0.0), (0.4, 0.4), (5.0, 1.0), (math.nan, 0.0), (-1.0, 0.0)):
        at, velocity = _now(fleet(place, speed, age_s), [0])
        assert at == pytest.approx(place + ahead_s * speed) and (velocity == speed).all()
    at, velocity = _now(fleet(place, np.array([[math.nan, 1.0]]), 0.5), [0])
    assert at == pytest.approx(np.array([[10.0, 20.5]])) and (velocity == [[0.0, 1.0]]).all()


@pytest.mark.parametrize(
    ("error", "beside_m"),
    [
        ((-3.0, 1.0), 1.0),
        ((3.0, -1.0), 1.0),
        ((-4.0, 2.0), 2.0),
        ((-4.1, 2.0), math.hypot(4.1, 2.0)),
        ((4.1, 0.0), 4.1),
        ((0.0, 0.0), 0.0),
    ],
)
def test_a_late_vehicle_is_not_off_course_unless_it_is_very_late(error: tuple[float, float], beside_m: float) -> None:
    assert _cross_track_m(np.array([error]), np.array([[7.0, 0.0]]))[0] == pytest.approx(beside_m)


def test_beside_a_slot_that_stands_is_all_that_it_is_off() -> None:
    assert _cross_track_m(np.array([[3.0, 4.0]]), np.zeros((1, 2)))[0] == pytest.approx(5.0)


# ---------------------------------------------------------------- falling back


def falling(back_s: float, rate: float = 0.0) -> VehicleSlot:
    return VehicleSlot(0.0, 0, joined=True, back_s=back_s, back_rate=rate, back_from_s=NOW)


def test_falling_back_begins_where_the_vehicle_is_and_ends_on_its_slot() -> None:
    berth = falling(6.0)
    assert berth.back_took_s == pytest.approx(math.sqrt(6.0 * 8.0 * 6.0 / 0.5)), "24 s: what the acceleration takes"
    assert falling(60.0).back_took_s == pytest.approx(112.5), "what slowing by 0.8 takes"
    took_s = berth.back_took_s
    ahead, rate = _lead_s([berth], np.array([NOW - 5.0, NOW, NOW + took_s / 2, NOW + took_s, NOW + 2 * took_s]))
    assert ahead[0] == pytest.approx([6.0, 6.0, 3.0, 0.0, 0.0])
    assert rate[0] == pytest.approx([0.0, 0.0, -1.5 * 6.0 / took_s, 0.0, 0.0], abs=1e-9)
    assert berth.falls_back(NOW) and berth.falls_back(NOW + took_s - 0.1)
    assert not berth.falls_back(NOW + took_s + 0.1) and not VehicleSlot(0.0, 0).falls_back(NOW)


@pytest.mark.parametrize(("back_s", "rate"), [(6.0, 0.0), (6.0, -0.3), (60.0, 0.0), (25.0, 0.2)])
def test_falling_back_is_smooth_and_never_slower_than_is_allowed(back_s: float, rate: float) -> None:
    berth = falling(back_s, rate)
    times = NOW + np.linspace(0.0, berth.back_took_s, 5001)
    (ahead,), (change,) = _lead_s([berth], times)
    assert change[0] == pytest.approx(rate)
    assert np.diff(ahead) / np.diff(times) == pytest.approx((change[1:] + change[:-1]) / 2, abs=1e-5)
    if rate == 0.0:
        assert change.min() >= -0.8 - 1e-9
        assert np.abs(np.diff(change) / np.diff(times)).max() * 8.0 <= 0.5 + 1e-3


def test_a_reference_falls_back_with_its_slot_ahead_of_it() -> None:
    course, berth = circle(), falling(6.0)
    behind = VehicleSlot(-6.0, 0)
    xy, velocity = course.reference(berth, np.array([NOW]))
    wanted, speed = course.reference(behind, np.array([NOW]))
    assert xy == pytest.approx(wanted) and velocity == pytest.approx(speed), "6 s farther on than its own slot"
    half = np.array([NOW + berth.back_took_s / 2])
    _, velocity = course.references([berth, behind], half)
    assert np.hypot(*velocity[0, 0]) == pytest.approx(SPEED_M_S * (1.0 - 9.0 / berth.back_took_s), abs=1e-3)
    assert np.hypot(*velocity[1, 0]) == pytest.approx(SPEED_M_S, abs=1e-3), "who does not fall back is not slower"


# ---------------------------------------------------------------- slots


def test_from_the_ground_each_gets_a_slot_of_its_own_equally_apart_in_time() -> None:
    course, found = circle(), Formation()
    places = np.array([(45.0, 170.0), (45.0, 190.0), (45.0, 210.0), (45.0, 230.0)])
    course.respace(found, NOW, fleet(places), [4, 2, 1])
    assert sorted(found.berths) == [1, 2, 4] and found.slots == 3
    assert phases_s(found) == pytest.approx([0.0, 20.0, 40.0])
    for vehicle, berth in found.berths.items():
        assert berth.transit is not None and not berth.settled and not berth.joined
        ends_s = berth.transit.end_s
        xy, _ = course.reference(berth, np.array([NOW, ends_s - 1e-3, ends_s, ends_s + 1e-3]))
        assert xy[0] == pytest.approx(places[vehicle - 1])
        assert np.hypot(*np.diff(xy[1:], axis=0).T).max() < 0.03, "its way ends on the slot"
    course.respace(found, NOW, fleet(places), [])
    assert (found.berths, found.slots) == ({}, 0)


@pytest.mark.parametrize("lost", [1, 2, 3, 4])
def test_when_one_of_four_is_lost_the_others_stay_on_the_tour_and_fall_back(lost: int) -> None:
    course = circle()
    found, seen = on_slots(course, 4)
    left = [vehicle for vehicle in (1, 2, 3, 4) if vehicle != lost]
    before = course.references([found.berths[v] for v in left], np.array([NOW]))
    course.respace(found, NOW, seen, left)
    berths = [found.berths[v] for v in left]
    after = course.references(berths, np.array([NOW]))
    assert after[0] == pytest.approx(before[0]) and after[1] == pytest.approx(before[1]), "nobody jumps"
    assert all(berth.joined and berth.transit is None for berth in berths)
    assert phases_s(found) == pytest.approx([0.0, 20.0, 40.0])
    assert sorted(berth.back_s for berth in berths) == pytest.approx([0.0, 5.0, 10.0]), "15 s apart they were"


def test_a_second_loss_while_vehicles_fall_back_makes_no_reference_jump() -> None:
    course = circle()
    found, seen = on_slots(course, 4)
    course.respace(found, NOW, seen, [1, 2, 3])
    for t_s, left in ((NOW + 8.0, [1, 3]), (NOW + 16.0, [3])):
        now = np.array([t_s])
        before = course.references([found.berths[v] for v in left], now)
        assert found.falls_back(t_s)
        course.respace(found, t_s, fleet(*_everybody(course, found, t_s)), left)
        after = course.references([found.berths[v] for v in left], now)
        assert after[0] == pytest.approx(before[0]) and after[1] == pytest.approx(before[1])
        assert min(berth.back_s for berth in found.berths.values()) > 0.999, "who is slow now cannot be on time"
    assert not found.falls_back(NOW + 500.0)


def _everybody(course: TourGuidance, found: Formation, t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Where vehicles 1 to 3 are; those without a slot are anywhere."""
    places, speeds = np.zeros((3, 2)), np.zeros((3, 2))
    for vehicle, berth in found.berths.items():
        xy, velocity = course.reference(berth, np.array([t_s]))
        places[vehicle - 1], speeds[vehicle - 1] = xy[0], velocity[0]
    return places, speeds


@pytest.mark.parametrize(("on_tour", "more", "phase_s"), [(2, 1, 10.0), (1, 3, 17.0), (3, 2, 4.0)])
def test_a_vehicle_that_joins_gets_a_free_slot(on_tour: int, more: int, phase_s: float) -> None:
    course = circle()
    found, seen = on_slots(course, on_tour, phase_s)
    places = np.vstack([seen.position_m[:, :2], [(45.0, 170.0 + 20.0 * k) for k in range(more)]])
    course.respace(found, NOW, fleet(places), range(1, on_tour + more + 1))
    n = on_tour + more
    assert phases_s(found) == pytest.approx([PERIOD_S / n * k for k in range(n)])
    assert sorted(berth.slot for berth in found.berths.values()) == list(range(n))
    for vehicle, berth in found.berths.items():
        assert berth.joined is (vehicle <= on_tour) is (berth.transit is None)


def test_the_numbers_of_vehicles_do_not_matter() -> None:
    course, places = circle(), np.array([(45.0, 170.0), (45.0, 230.0), (500.0, 300.0)])
    slots = []
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        found, seen = on_slots(course, 2)
        course.respace(found, NOW, fleet(np.vstack([seen.position_m[:, :2], places[order]])), range(1, 6))
        slots.append([found.berths[3 + order.index(k)].slot for k in range(3)])
    assert slots[0] == slots[1] == slots[2]


@pytest.mark.parametrize("vacant", [(2,), (1, 3), (2, 4), (1, 2, 3)])
def test_vacant_slots_are_taken_by_the_nearest_and_the_others_stay_where_they_are(vacant: tuple[int, ...]) -> None:
    course = circle()
    found, seen = on_slots(course, 4)
    was = {vehicle: found.berths.pop(vehicle) for vehicle in vacant}
    others = dict(found.berths)
    course.replace(found, NOW, seen, vacant)
    assert {v: found.berths[v] for v in others} == others
    for vehicle in vacant:
        new = found.berths[vehicle]
        assert new.slot == was[vehicle].slot and new.transit is not None and not new.joined
        assert round(new.origin_s - was[vehicle].origin_s, 6) % PERIOD_S == 0.0


def test_a_relief_with_a_slot_of_its_own_is_no_relief_and_other_reliefs_continue() -> None:
    course = circle()
    found, seen = on_slots(course, 3)
    seen = fleet(np.vstack([seen.position_m[:, :2], [(45.0, 200.0), (45.0, 230.0)]]))
    course.relieve(found, NOW, seen, relief=4, old=1)
    course.relieve(found, NOW, seen, relief=5, old=2)
    del found.berths[3]
    course.replace(found, NOW, seen, [4])
    assert found.reliefs == {5: 2} and found.berths[4].slot == 2


def test_a_relief_has_the_same_slot_until_it_is_there_and_only_one_owns_it() -> None:
    course = circle()
    found, seen = on_slots(course, 2)
    old = found.berths[1]
    seen = fleet(np.vstack([seen.position_m[:, :2], [[45.0, 200.0]]]))
    course.relieve(found, NOW, seen, relief=3, old=1)
    assert (found.berths[3].slot, found.berths[3].origin_s) == (old.slot, old.origin_s)
    assert found.berths[1] is old and found.reliefs == {3: 1} and set(found.owners) == {1, 2}
    assert not found.at_rest
    assert course.reference(found.berths[3], np.array([NOW]))[0][0] == pytest.approx([45.0, 200.0])


def test_flying_slower_makes_no_reference_jump() -> None:
    course, slower = circle(), circle(PERIOD_S / 0.8)
    found, seen = on_slots(course, 3)
    before = course.references(list(found.berths.values()), np.array([NOW]))[0]
    slower.retime(found, course, 0.8, NOW, seen)
    xy, velocity = slower.references(list(found.berths.values()), np.array([NOW]))
    assert xy == pytest.approx(before) and found.at_rest
    assert np.hypot(*velocity[:, 0].T) == pytest.approx(0.8 * SPEED_M_S)


# ---------------------------------------------------------------- many


def quick_ways(monkeypatch: pytest.MonkeyPatch, lasts_s: float) -> list[float]:
    """Ways that take so long; when each was planned."""
    planned: list[float] = []

    def plan_transit(t_s: float, xy: np.ndarray, velocity: np.ndarray, *question: object) -> Transit:
        planned.append(t_s)
        return Transit(t_s, np.stack([xy] * (round(lasts_s / STEP_S) + 1)), np.zeros((round(lasts_s / STEP_S) + 1, 2)))

    monkeypatch.setattr(formation, "plan_transit", plan_transit)
    return planned


@pytest.mark.parametrize(("n", "at_once"), [(24, 24), (25, 3)])
def test_of_many_vehicles_ways_of_a_minute_are_planned_in_each_step(
    monkeypatch: pytest.MonkeyPatch, n: int, at_once: int
) -> None:
    course, found, planned = circle(), Formation(), quick_ways(monkeypatch, 25.0)
    seen = fleet(np.array([(45.0 + 20.0 * (k % 5), 100.0 + 20.0 * (k // 5)) for k in range(n)]))
    course.respace(found, NOW, seen, range(1, n + 1))
    if n > at_once:
        assert planned == [] and all(berth.waiting for berth in found.berths.values())
        course.follow_up(found, NOW, seen)
    assert len(planned) == at_once and sum(berth.waiting for berth in found.berths.values()) == n - at_once
    for step in range(1, 10):
        course.follow_up(found, NOW + 0.2 * step, seen)
    assert len(planned) == n and not any(berth.waiting for berth in found.berths.values())


def test_until_its_way_is_planned_each_of_many_flies_on_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    course, planned = circle(), quick_ways(monkeypatch, 25.0)
    found, seen = on_slots(course, 25)
    for berth in found.berths.values():
        berth.joined = False
    before = course.references(list(found.berths.values()), np.array([NOW, NOW + 1.0]))
    course.respace(found, NOW, seen, range(1, 26))
    berths = [found.berths[v] for v in range(1, 26)]
    assert planned == [] and all(berth.before is not None and berth.flown is berth.before for berth in berths)
    after = course.references(berths, np.array([NOW, NOW + 1.0]))
    assert after[0] == pytest.approx(before[0]) and after[1] == pytest.approx(before[1])
    assert course._start(berths[0], NOW, fleet(before[0][:1, 0] + 3.0), 0)[0] == pytest.approx(before[0][0, 0])
    new = VehicleSlot(NOW, 0)
    assert course._start(new, NOW, fleet(np.array([[401.0, 238.0]])), 0)[0] == pytest.approx([401.0, 238.0])


# ---------------------------------------------------------------- following up


def followed(
    off_m: float, age_s: float = 0.0, joined: bool = True, patience: float = 10.0, since_s: float = 60.0
) -> tuple[VehicleSlot, float]:
    """One whose slot's way it is so far beside, which it was on first so long ago."""
    course, berth = circle(), VehicleSlot(NOW - 10.0, 0, planned_s=NOW - patience, joined=joined)
    berth.settled_s = NOW - since_s
    xy, _ = course.reference(berth, np.array([NOW]))
    outwards = (xy[0] - (400.0, 200.0)) / RADIUS_M
    beside_m = course.follow_up(Formation({1: berth}, slots=1), NOW, fleet(xy + off_m * outwards, age_s=age_s))
    return berth, beside_m


def test_how_far_the_worst_is_beside_its_way_is_told() -> None:
    assert followed(2.0)[1] == pytest.approx(2.0)
    course = circle()
    found, seen = on_slots(course, 3)
    middle = np.array([400.0, 200.0])
    beside = middle + (seen.position_m[:, :2] - middle) * (1.0 + np.array([[1.0], [2.5], [0.0]]) / RADIUS_M)
    assert course.follow_up(found, NOW, fleet(beside)) == pytest.approx(2.5)
    assert math.isnan(followed(2.0, joined=False)[1]), "nobody was on a slot"
    assert math.isnan(followed(2.0, age_s=1.1)[1]), "nobody knows"
    assert followed(2.0, age_s=1.0)[1] == pytest.approx(2.0)
    assert math.isnan(circle().follow_up(Formation(), NOW, fleet(np.zeros((1, 2)))))


def test_one_that_has_just_joined_is_not_counted_as_beside_its_way() -> None:
    """One that came in 3 m beside its way slowed the tour of eight real ArduCopters in still air."""
    assert math.isnan(followed(3.0, since_s=ON_COURSE_S - 0.1)[1])
    assert followed(3.0, since_s=ON_COURSE_S)[1] == pytest.approx(3.0)


@pytest.mark.parametrize(("off_m", "joined"), [(2.9, True), (3.1, False)])
def test_a_vehicle_near_its_slot_has_joined_it(off_m: float, joined: bool) -> None:
    assert followed(off_m, joined=False)[0].joined is joined
    assert not followed(2.0, age_s=5.0, joined=False)[0].joined, "that was a while ago"


@pytest.mark.parametrize(
    ("off_m", "age_s", "patience", "sent"),
    [
        (8.1, 0.0, 10.0, True),
        (7.9, 0.0, 10.0, False),
        (8.1, 1.5, 10.0, False),
        (8.1, 0.0, 1.9, False),
        (8.1, 0.0, 2.0, True),
    ],
)
def test_a_vehicle_off_its_way_gets_a_new_one_but_not_in_every_step(
    off_m: float, age_s: float, patience: float, sent: bool
) -> None:
    berth, _ = followed(off_m, age_s, patience=patience)
    assert (berth.transit is not None) is sent and berth.joined is not sent


def test_a_way_ends_on_the_slot_and_the_next_begins_on_the_last_as_long_as_it_is_followed() -> None:
    course, found = circle(), Formation()
    here = np.array([[200.0, 200.0]])
    course.respace(found, NOW, fleet(here), [1])
    (berth,) = found.berths.values()
    assert berth.transit is not None
    end_s = berth.transit.end_s
    for t_s in (NOW + 5.0, end_s - 0.01, end_s):
        xy, _ = course.reference(berth, np.array([t_s]))
        assert course._start(berth, t_s, fleet(xy + 5.0), 0)[0] == pytest.approx(xy[0])
        assert course._start(berth, t_s, fleet(xy + 6.0), 0)[0] == pytest.approx(xy[0] + 6.0), "8.5 m away"
        course.follow_up(found, t_s, fleet(xy))
        assert (berth.transit is None) is (t_s >= end_s) and berth.joined is (t_s >= end_s)


def test_a_way_that_is_not_found_is_looked_for_half_as_often_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formation, "plan_transit", lambda *question: None)
    course, found, looked = circle(), Formation(slots=1), list[float]()
    found.berths[1] = berth = VehicleSlot(NOW, 0)
    for tenth in range(4000):
        t_s = NOW + tenth / 10
        course.follow_up(found, t_s, fleet(np.array([[45.0, 200.0]])))
        if berth.planned_s == t_s:
            looked.append(tenth / 10)
    assert berth.stuck and not berth.settled
    assert np.diff(looked) == pytest.approx([4.0, 8.0, 16.0, 32.0, 64.0, 64.0, 64.0, 64.0, 64.0], abs=0.11)


def test_a_step_looks_for_a_way_in_vain_once_however_many_vehicles_are_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each such search costs 0.3 s of CPU time: eight of them in one step were longer than a worker may be silent."""
    looked, count = list[float](), 8
    monkeypatch.setattr(formation, "plan_transit", lambda t_s, *question: looked.append(t_s))
    course, found = circle(), Formation()
    here = fleet(np.array([(45.0, 10.0 * k) for k in range(count)]))
    course.respace(found, NOW, here, range(1, count + 1))
    for tenth in range(2 * count):
        course.follow_up(found, NOW + tenth / 10, here)
    assert len(looked) == len(set(looked)), "one in a step"
    assert all(berth.stuck for berth in found.berths.values()), "each had its turn, one step after the other"
    monkeypatch.undo()
    for second in range(100):
        course.follow_up(found, NOW + 10.0 + second, here)
    assert not any(berth.stuck for berth in found.berths.values()), "each is tried again later"
