"""Transits end on the slot, within speed and acceleration, inside the region."""

import math

import numpy as np
import pytest

from tests.planner.rigs.flights import AREA, no_fly, region_of, zone_of
from tests.planner.rigs.guarded import refusals
from tui_gcs.core.geometry.zones import Circle, Rectangle
from tui_gcs.core.scenario.model import Limits
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.tour import Tour, resampled, timed
from tui_gcs.planner.patrol.transit import (
    ALLOWANCE_S,
    LOOK_AHEAD_S,
    STEP_S,
    Mobility,
    Transit,
    _longest_wait_s,
    _Rendezvous,
    plan_transit,
)

MOBILITY = Mobility(7.84, 2.25)
ZONE = zone_of(Rectangle((450.0, 200.0), 100.0, 80.0))


def oval() -> Tour:
    angles = np.linspace(0.0, 2.0 * np.pi, 300, endpoint=False)
    path = np.stack([450.0 + 60.0 * np.cos(angles), 200.0 + 30.0 * np.sin(angles) + 8.0 * np.sin(4 * angles)], axis=1)
    return timed(resampled(path, 0.5), 7.6, 2.25)


def assert_good(transit: Transit | None, tour: Tour, phase_s: float, region: FlyableRegion) -> Transit:
    assert transit is not None
    accel = np.diff(transit.velocity_m_s, axis=0) / STEP_S
    assert np.hypot(*accel.T).max() <= MOBILITY.accel_m_s2 + 0.05
    assert np.hypot(*transit.velocity_m_s.T).max() <= MOBILITY.speed_m_s + 0.02
    moved = np.diff(transit.xy_m, axis=0) / STEP_S
    np.testing.assert_allclose(moved, (transit.velocity_m_s[1:] + transit.velocity_m_s[:-1]) / 2.0, atol=0.02)
    place, velocity = tour.at(np.array([phase_s + transit.end_s - transit.t0_s]))
    np.testing.assert_allclose(transit.xy_m[-1], place[0], atol=0.01)
    np.testing.assert_allclose(transit.velocity_m_s[-1], velocity[0], atol=0.01)
    assert region.contains(transit.xy_m).all()
    return transit


@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(4, 16))]
)
def test_any_vehicle_gets_onto_any_slot(seed: int) -> None:
    rng, tour, region = np.random.default_rng(seed), oval(), region_of(ZONE)
    place, heading = rng.uniform((60.0, 60.0), (540.0, 340.0)), rng.uniform(0.0, 2.0 * np.pi)
    velocity = rng.uniform(0.0, 7.6) * np.array([np.cos(heading), np.sin(heading)])
    phase_s = rng.uniform(0.0, tour.period_s)
    transit = plan_transit(100.0, place, velocity, tour, phase_s, MOBILITY, region)
    transit = assert_good(transit, tour, phase_s, region)
    away = float(np.hypot(*(tour.xy_m - place).T).max())
    assert transit.end_s - transit.t0_s <= away / MOBILITY.speed_m_s + tour.period_s + 10.0


def test_a_transit_goes_around_a_no_fly_zone() -> None:
    closed = no_fly(Rectangle((250.0, 200.0), 60.0, 240.0))
    region, tour = region_of(ZONE, AREA, (closed,)), oval()
    transit = plan_transit(0.0, np.array([100.0, 200.0]), np.zeros(2), tour, 0.0, MOBILITY, region)
    assert_good(transit, tour, 0.0, region)


@pytest.mark.parametrize("start", [(180.0, 195.0), (240.0, 140.0), (262.0, 268.0), (150.0, 330.0)])
def test_what_is_sent_of_a_way_beside_a_no_fly_zone_passes_the_guard(start: tuple[float, float]) -> None:
    closed = no_fly(Circle((300.0, 200.0), 40.0))
    region, tour = region_of(ZONE, AREA, (closed,)), oval()
    for phase_s in np.linspace(0.0, tour.period_s, 8):
        transit = plan_transit(0.0, np.array(start), np.zeros(2), tour, float(phase_s), MOBILITY, region)
        assert transit is not None
        assert refusals(transit.xy_m, transit.velocity_m_s, STEP_S, AREA, (closed,)) == []


def test_a_way_through_a_chicane_passes_the_guard_and_arrives() -> None:
    """Two corners close behind each other, taken with the speed of a long straight way before them."""
    closed = (no_fly(Rectangle((200.0, 120.0), 30.0, 240.0)), no_fly(Rectangle((245.0, 300.0), 30.0, 200.0)))
    region, tour = region_of(ZONE, AREA, closed), oval()
    for x, y in [(60.0, 60.0), (60.0, 300.0), (178.0, 120.0), (100.0, 380.0)]:
        for phase_s in np.linspace(0.0, tour.period_s, 6):
            transit = plan_transit(0.0, np.array([x, y]), np.zeros(2), tour, float(phase_s), MOBILITY, region)
            assert transit is not None and transit.end_s < 150.0
            assert refusals(transit.xy_m, transit.velocity_m_s, STEP_S, AREA, closed) == []


def test_a_way_that_knows_nothing_of_a_no_fly_zone_is_refused_before_it_and_not_behind_it() -> None:
    """What the tests here rest on: the guard finds the steps of a way that it would veto, and only those."""
    closed, tour = (no_fly(Rectangle((250.0, 200.0), 30.0, 240.0)),), oval()
    transit = plan_transit(0.0, np.array([100.0, 200.0]), np.zeros(2), tour, 0.0, MOBILITY, region_of(ZONE))
    assert transit is not None and transit.end_s > 30.0
    found = refusals(transit.xy_m, transit.velocity_m_s, STEP_S, AREA, closed)
    times_s = sorted(float(text.split()[0]) for text in found)
    entered_s = STEP_S * int(np.argmax(transit.xy_m[:, 0] > 235.0))
    assert 5.0 < times_s[0] < entered_s - 1.0, "in time to stop before it"
    assert times_s[-1] < transit.end_s - 5.0, "on its other side all is well"


def test_a_fast_vehicle_brakes_for_a_no_fly_zone_as_early_as_the_guard_wants() -> None:
    """At 12 m/s braking takes 33 m with the planner's acceleration, and 39 m as the guard reckons."""
    limits, closed = Limits(speed_m_s=12.0), (no_fly(Rectangle((320.0, 240.0), 30.0, 240.0)),)
    region, tour, fast = FlyableRegion(AREA, closed, limits, ZONE), oval(), Mobility(11.9, 2.2)
    for y in (180.0, 240.0, 330.0):
        for phase_s in np.linspace(0.0, tour.period_s, 4):
            transit = plan_transit(0.0, np.array([40.0, y]), np.zeros(2), tour, float(phase_s), fast, region)
            assert transit is not None
            assert np.hypot(*transit.velocity_m_s.T).max() > 11.5
            assert refusals(transit.xy_m, transit.velocity_m_s, STEP_S, AREA, closed, limits) == []


def test_from_just_outside_the_way_leads_back_and_then_round_the_no_fly_zone() -> None:
    region, there = region_of(ZONE, AREA, (no_fly(Circle((250.0, 200.0), 50.0)),)), np.array([330.0, 200.0])
    for beyond_m in (0.2, 2.0):
        here = np.array([250.0 - 50.0 - 5.5 + beyond_m, 200.0])
        leg, corner = region.next_leg(here, there)
        assert corner, "never straight through it"
        assert region.contains(leg[None])[0]


def test_the_shortest_way_turns_at_corners() -> None:
    region = region_of(ZONE, AREA, (no_fly(Circle((250.0, 200.0), 50.0)),))
    here, there, turns = np.array([100.0, 200.0]), np.array([450.0, 200.0]), 0
    while True:
        leg, corner = region.next_leg(here, there)
        assert region.clear(here, leg)
        if not corner:
            break
        here, turns = leg, turns + 1
    assert 1 <= turns <= 6


@pytest.mark.parametrize("speed_m_s", [7.84, 7.6, 3.0])
def test_a_slot_is_met_where_it_first_can_be(speed_m_s: float) -> None:
    """Wherever it was met last; also by vehicles that are slower than the tour, and those that never can."""
    rng, tour = np.random.default_rng(5), oval()
    for _ in range(20):
        x, y, phase_s = (float(number) for number in rng.uniform((0.0, 0.0, -50.0), (600.0, 400.0, 500.0)))
        meeting = _Rendezvous(np.array([x, y]), tour, phase_s, Mobility(speed_m_s, 2.25))
        lap_s = np.arange(0.0, _longest_wait_s(np.array([x, y]), tour, Mobility(speed_m_s, 2.25)), LOOK_AHEAD_S)
        for now_s in (0.0, 0.5, 1.0, 1.5, 40.0, 20.0):
            x, y = (float(number) for number in rng.normal((x, y), 4.0 if now_s < 2.0 else 150.0))
            path = tour.places(phase_s + now_s + lap_s)
            in_time = [
                k
                for k, (east, north) in enumerate(path.tolist())
                if math.hypot(east - x, north - y) / speed_m_s + ALLOWANCE_S <= lap_s[k]
            ]
            np.testing.assert_array_equal(meeting.point((x, y), now_s), path[in_time[0] if in_time else 0])
