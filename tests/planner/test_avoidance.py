"""Velocities that keep vehicles apart: random swarms that meet head on, cross, and end in one place."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.physics.weather import Weather, WeatherSpec
from tui_gcs.planner.api import Limits
from tui_gcs.planner.avoidance import ACCEL_Z_M_S2, CLIMB_M_S, DESCENT_M_S, avoid

LIMITS = Limits()
STEP_S = 0.2
LAG_S = 0.3
"""How late a vehicle's velocity follows the wanted one, besides its acceleration."""


def separation(places: np.ndarray) -> float:
    """The smallest of all pairs, as the larger share of its two limits."""
    gap = places[:, None] - places[None]
    level = np.hypot(gap[..., 0], gap[..., 1]) / LIMITS.separation_horizontal_m
    upright = np.abs(gap[..., 2]) / LIMITS.separation_vertical_m
    return float((np.maximum(level, upright) + np.eye(len(places)) * 1e9).min())


def fly(
    places: np.ndarray, goals: np.ndarray, seconds: float, gps_noise_m: float = 0.0, seed: int = 1
) -> tuple[float, np.ndarray]:
    """The smallest separation on the way to the goals, by GPS, and the last positions."""
    places, velocity, worst = places.astype(float), np.zeros(places.shape), np.inf
    sky = Weather(WeatherSpec(gps_noise_m=gps_noise_m), len(places), seed)
    for _ in range(round(seconds / STEP_S)):
        sky.step(STEP_S)
        told_m = places + sky.gps_error_m
        wanted = 0.5 * (goals - told_m)
        told = avoid(told_m, velocity, wanted, LIMITS)
        for _ in range(4):
            dt = STEP_S / 4
            change = (told - velocity) * (dt / LAG_S)
            size = np.hypot(change[:, 0], change[:, 1])
            change[:, :2] *= np.minimum(1.0, LIMITS.accel_m_s2 * dt / np.maximum(size, 1e-9))[:, None]
            velocity = velocity + change
            places = places + velocity * dt
            worst = min(worst, separation(places + sky.gps_error_m))
    return worst, places


def swarm(rng: np.random.Generator, n: int, size_m: float, heights_m: tuple[float, float]) -> np.ndarray:
    """Random places, apart."""
    places: list[np.ndarray] = []
    while len(places) < n:
        place = np.array([*rng.uniform(-size_m, size_m, 2), rng.uniform(*heights_m)])
        if separation(np.array([*places, place])) > 1.3:
            places.append(place)
    return np.array(places)


def test_alone_one_gets_what_it_wants_within_its_limits() -> None:
    wanted = np.array([[30.0, 0.0, -9.0]])
    velocity = np.zeros((1, 3))
    for _ in range(50):
        before, velocity = velocity, avoid(np.zeros((1, 3)), velocity, wanted, LIMITS, STEP_S)
        change = velocity - before
        assert np.hypot(*change[0, :2]) <= LIMITS.accel_m_s2 * STEP_S + 1e-9
        assert abs(change[0, 2]) <= ACCEL_Z_M_S2 * STEP_S + 1e-9
    assert velocity[0] == pytest.approx([np.sqrt(8.0**2 - DESCENT_M_S**2), 0.0, -DESCENT_M_S])
    assert avoid(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), LIMITS).shape == (0, 3)


def test_a_vehicle_blown_too_fast_gets_no_more_than_the_limit() -> None:
    velocity = np.array([[100.0, 0.0, 0.0], [0.0, -9.0, -6.0]])
    asked = avoid(np.array([[0.0, 0.0, 40.0], [90.0, 0.0, 40.0]]), velocity, np.zeros((2, 3)), LIMITS)
    assert np.hypot(asked[:, 0], asked[:, 1]).max() <= LIMITS.speed_m_s + 1e-9
    assert asked[1, 2] >= -DESCENT_M_S


def test_a_vehicle_that_climbs_at_full_speed_gets_what_the_station_accepts() -> None:
    """It counts the speed upwards, too: 8 m/s along and 3 m/s up would be 8.5 m/s."""
    wanted, velocity = np.array([[8.0, 0.0, 3.0]]), np.zeros((1, 3))
    for _ in range(50):
        velocity = avoid(np.zeros((1, 3)), velocity, wanted, LIMITS, STEP_S)
    assert np.linalg.norm(velocity) <= LIMITS.speed_m_s + 1e-9
    assert velocity[0, 2] == pytest.approx(3.0)


def test_far_apart_or_above_each_other_vehicles_do_not_avoid() -> None:
    wanted = np.array([[8.0, 0.0, 0.0], [-8.0, 0.0, 0.0]])
    for other in ((200.0, 0.0, 40.0), (12.0, 0.0, 52.0)):
        places = np.array([[0.0, 0.0, 40.0], other])
        assert avoid(places, wanted, wanted, LIMITS) == pytest.approx(wanted)


def test_two_right_above_each_other_with_little_to_spare_are_not_sent_closer_by_height() -> None:
    """5.1 m apart in height, where 5 m must be: not enough to spare, but all that keeps them apart."""
    places = np.array([[0.0, 0.0, 36.8], [1.0, 2.8, 41.9]])
    wanted = np.array([[1.3, 1.3, 0.5], [1.4, 1.0, -1.0]])
    asked = avoid(places, np.zeros((2, 3)), wanted, LIMITS)
    assert asked[1, 2] - asked[0, 2] >= 0.0


def test_two_that_meet_head_on_pass_each_other() -> None:
    places = np.array([[0.0, 0.0, 40.0], [150.0, 0.0, 40.0]])
    worst, end = fly(places, places[::-1], 60.0)
    assert worst >= 1.0
    assert end == pytest.approx(places[::-1], abs=2.0)


def test_all_to_one_place_end_around_it() -> None:
    places = swarm(np.random.default_rng(3), 8, 80.0, (40.0, 40.0))
    worst, _ = fly(places, np.full_like(places, 40.0), 40.0)
    assert worst >= 1.0


@settings(max_examples=8, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**31), n=st.integers(2, 12), heights=st.sampled_from([(40.0, 40.0), (25.0, 60.0)]))
def test_random_swarms_keep_apart(seed: int, n: int, heights: tuple[float, float]) -> None:
    rng = np.random.default_rng(seed)
    size_m = 20.0 * np.sqrt(n)
    worst, _ = fly(swarm(rng, n, size_m, heights), swarm(rng, n, size_m, heights), 25.0)
    assert worst >= 1.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_gps_wanders_they_keep_apart_as_it_tells(seed: int) -> None:
    """The limits hold for reported positions: errors of two receivers come on top, half a metre each here."""
    rng = np.random.default_rng(seed)
    worst, _ = fly(swarm(rng, 6, 50.0, (25.0, 60.0)), swarm(rng, 6, 50.0, (25.0, 60.0)), 25.0, 0.5, seed)
    assert worst >= 1.0


def test_a_ring_through_its_middle() -> None:
    angle = 2 * np.pi * np.arange(8) / 8
    ring = np.stack([70 * np.cos(angle), 70 * np.sin(angle), np.full(8, 40.0)], axis=1)
    worst, _ = fly(ring, ring * (-1.0, -1.0, 1.0), 30.0)
    assert worst >= 1.0


def test_the_order_of_vehicles_does_not_matter_and_the_same_gives_the_same() -> None:
    rng = np.random.default_rng(5)
    places, velocity, wanted = swarm(rng, 20, 60.0, (30.0, 60.0)), rng.normal(0, 3, (20, 3)), rng.normal(0, 6, (20, 3))
    told = avoid(places, velocity, wanted, LIMITS)
    assert (avoid(places, velocity, wanted, LIMITS) == told).all()
    order = rng.permutation(20)
    assert avoid(places[order], velocity[order], wanted[order], LIMITS) == pytest.approx(told[order], abs=1e-9)


def test_250_take_a_few_milliseconds() -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform((0.0, 0.0, 20.0), (600.0, 400.0, 90.0), (250, 3))
    velocity = rng.normal(0.0, 4.0, (250, 3))
    avoid(places, velocity, velocity, LIMITS)
    took = []
    for _ in range(5):
        begin_s = time.process_time()
        avoid(places, velocity, velocity, LIMITS)
        took.append(time.process_time() - begin_s)
    assert min(took) < 0.05
    assert np.abs(velocity[:, 2]).max() > CLIMB_M_S
