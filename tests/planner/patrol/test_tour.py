"""Time laws and the evaluator, against slow and plain calculations."""

import math

import numpy as np
import pytest

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, cell_centres_m
from tui_gcs.core.geometry.zones import Circle
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.planner.patrol.tour import (
    AVERAGING_S,
    MAX_SAMPLES,
    MAX_TURN_JERK_M_S3,
    SENT_STEP_S,
    SPARSE_SENT_STEP_S,
    Tour,
    evaluate,
    resampled,
    timed,
)


def circle(radius_m: float, points: int = 200) -> np.ndarray:
    angles = 2.0 * math.pi * np.arange(points) / points
    return radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def acceleration(tour: Tour) -> float:
    change = np.roll(tour.velocity_m_s, -1, axis=0) - np.roll(tour.velocity_m_s, 1, axis=0)
    return float(np.hypot(*change.T).max() / (2.0 * tour.dt_s))


def test_a_wide_circle_is_flown_at_full_speed() -> None:
    tour = timed(circle(50.0), 8.0, 2.5)
    assert tour.period_s == pytest.approx(2.0 * math.pi * 50.0 / 8.0, rel=1e-3)


def test_a_tight_circle_is_flown_as_fast_as_turning_allows() -> None:
    tour = timed(circle(14.4), 8.0, 2.0)
    speed = math.sqrt(2.0 * 14.4)
    assert tour.period_s == pytest.approx(2.0 * math.pi * 14.4 / speed, rel=0.01)
    assert np.hypot(*tour.velocity_m_s.T).max() == pytest.approx(speed, rel=0.02)  # evened, its radius is 0.1 m less


@pytest.mark.parametrize("width_m", [10.0, 30.0, 200.0])
def test_corners_keep_speed_and_acceleration(width_m: float) -> None:
    box = np.array([(0.0, 0.0), (width_m, 0.0), (width_m, 100.0), (0.0, 100.0)])
    tour = timed(resampled(box, 0.25), 8.0, 2.0)
    assert np.hypot(*tour.velocity_m_s.T).max() <= 8.0 + 1e-6
    assert acceleration(tour) <= 2.5


@pytest.mark.parametrize("sent_step_s", [SENT_STEP_S, SPARSE_SENT_STEP_S])
def test_accelerations_that_are_sent_are_those_of_the_station(sent_step_s: float) -> None:
    """A trajectory that begins now is sent with the acceleration of its second sample, then with nearer ones."""
    box = np.array([(0.0, 0.0), (60.0, 0.0), (60.0, 40.0), (0.0, 40.0)])
    tour = timed(resampled(box, 0.25), 8.0, 2.0)
    for k in range(0, len(tour.xy_m), 7):
        xy_m, velocity_m_s = tour.at(k * tour.dt_s + sent_step_s * np.arange(-1, 5))
        states = [np.pad(rows, ((0, 0), (0, 1))) for rows in (xy_m, velocity_m_s)]
        begun_before = Trajectory(-sent_step_s, sent_step_s, *states)
        begins_now = Trajectory(0.0, sent_step_s, *(rows[1:] for rows in states))
        own, soon = tour.sent_accels_m_s2(sent_step_s)[:, k]
        assert begun_before.acceleration(0.0)[:2] == pytest.approx(own.tolist())
        assert begins_now.acceleration(0.0)[:2] == pytest.approx(soon.tolist())


def change_per_s(samples: np.ndarray, dt_s: float) -> np.ndarray:
    return np.asarray((np.roll(samples, -1, axis=0) - np.roll(samples, 1, axis=0)) / (2.0 * dt_s))


def test_a_path_that_turns_back_between_two_equal_points_stops_there() -> None:
    """Where a way there and back is cut in equal steps, two of its points may lie in one place, and nothing turned."""
    there_and_back = np.array([(0.0, y) for y in (0.0, 10.0, 20.0, 30.0, 40.0, 40.0, 30.0, 20.0, 10.0)])
    tour = timed(there_and_back, 8.0, 2.0)
    assert np.hypot(*tour.velocity_m_s.T).max() > 5.0
    assert acceleration(tour) <= 2.5


@pytest.mark.parametrize("turn_deg", [45.0, 90.0, 135.0, 175.0])
def test_acceleration_changes_no_faster_than_a_vehicle_can_lean(turn_deg: float) -> None:
    """ArduCopter changes it by 5 m/s^3; where it was braked, turned and sped up at once, it was metres outside."""
    turn = math.radians(turn_deg)
    corner = np.array([(-120.0, 0.0), (0.0, 0.0), (120.0 * math.cos(turn), 120.0 * math.sin(turn)), (-60.0, 160.0)])
    path = resampled(corner, 0.25)
    tour = timed(path, 8.0, 2.5)
    jerk = change_per_s(change_per_s(tour.velocity_m_s, tour.dt_s), tour.dt_s)
    assert np.hypot(*jerk.T).max() <= 5.0
    assert acceleration(tour) <= 2.75  # at a sharp corner; where the path bends it is exact
    away = np.hypot(*(tour.xy_m[:, None] - path).transpose(2, 0, 1)).min(axis=1)
    assert away.max() < 0.25  # it is still that path


@pytest.mark.parametrize("radius_m", [3.0, 8.0, 30.0])
def test_tight_bends_are_flown_so_slowly_that_a_vehicle_can_turn_its_lean(radius_m: float) -> None:
    speed = float(np.hypot(*timed(circle(radius_m), 8.0, 2.5).velocity_m_s.T).max())
    assert speed**2 / radius_m <= 2.5 + 1e-6
    assert speed**3 / radius_m**2 <= MAX_TURN_JERK_M_S3 + 0.01
    allowed = min(8.0, math.sqrt(2.5 * radius_m), math.cbrt(MAX_TURN_JERK_M_S3 * radius_m**2))
    half_rad = allowed / radius_m * AVERAGING_S / 2.0
    assert speed == pytest.approx(allowed * math.sin(half_rad) / half_rad, rel=0.01)  # averaged, its circle is smaller


def test_a_cap_is_kept() -> None:
    cap = np.where(np.arange(200) < 50, 2.0, np.inf)
    tour = timed(circle(50.0), 8.0, 2.5, cap)
    quarter = (tour.xy_m > 3.0).all(axis=1)
    assert np.hypot(*tour.velocity_m_s[quarter].T).max() < 2.2


def test_a_tour_is_periodic() -> None:
    tour = timed(circle(50.0), 8.0, 2.5)
    place, velocity = tour.at(np.array([3.0, 3.0 + tour.period_s, 3.0 - 2.0 * tour.period_s]))
    np.testing.assert_allclose(place, place[[0, 0, 0]], atol=1e-6)
    np.testing.assert_allclose(velocity, velocity[[0, 0, 0]], atol=1e-6)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_evaluation_agrees_with_vehicles_that_fly_the_tour(n: int) -> None:
    zone, wobble = Circle((0.0, 0.0), 35.0), 1.0 + 0.3 * np.sin(5.0 * np.linspace(0.0, 2.0 * math.pi, 400, False))
    tour = timed(22.0 * wobble[:, None] * circle(1.0, 400), 8.0, 2.5)
    cells = cell_centres_m(zone, 2.5)
    found, grid = evaluate(tour, cells, 22.0, n), IdlenessGrid(zone, 22.0)
    offsets = tour.period_s / n * np.arange(n)
    for step in range(round(3.0 * tour.period_s / 0.05)):
        grid.update(0.05 * step, tour.at(0.05 * step + offsets)[0])
        if step == round(tour.period_s / 0.05):
            grid.begin_window(0.05 * step)
    assert found.coverage == grid.coverage == 1.0
    assert found.worst_s == pytest.approx(grid.worst_idleness_s, abs=0.35)
    assert found.average_s == pytest.approx(grid.average_idleness_s, abs=0.2)


def test_a_cell_that_is_never_seen_makes_the_worst_infinite() -> None:
    tour = timed(circle(50.0), 8.0, 2.5)
    found = evaluate(tour, np.array([(50.0, 0.0), (0.0, 0.0)]), 10.0, 4)
    assert (found.worst_s, found.coverage) == (math.inf, 0.5)


def test_one_place_is_bit_for_bit_one_of_many() -> None:
    tour = timed(circle(50.0), 8.0, 2.5)
    phases = np.random.default_rng(3).uniform(-200.0, 400.0, 500)
    many = tour.places(phases)
    np.testing.assert_array_equal(many, tour.at(phases)[0])
    np.testing.assert_array_equal(many, [tour.place(phase) for phase in phases.tolist()])


@pytest.mark.parametrize("apart_m", [0.0, 1e-9])
def test_a_path_in_one_place_is_a_tour_that_stands_there(apart_m: float) -> None:
    tour = timed(resampled(np.array([(3.0, 4.0), (3.0 + apart_m, 4.0)])), 8.0, 2.0)
    assert tour.period_s > 0.0
    assert tour.at(np.array([0.0, 0.7, 100.0]))[0] == pytest.approx(np.array([(3.0, 4.0)] * 3))
    assert not tour.velocity_m_s.any()


def test_a_path_that_must_be_crawled_is_a_tour_of_bounded_size() -> None:
    """Beside an obstacle a draft may have places at which no speed at all is allowed."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    path_m = 100.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    stopped = np.zeros(len(path_m))
    stopped[30:] = 8.0
    tour = timed(path_m, 8.0, 2.5, stopped)
    assert math.isfinite(tour.period_s) and tour.period_s > 600.0
    assert len(tour.xy_m) <= MAX_SAMPLES
    assert np.isfinite(tour.xy_m).all() and np.isfinite(tour.velocity_m_s).all()
    slow = timed(1000.0 * path_m, 8.0, 2.5, np.zeros(len(path_m)))
    assert len(slow.xy_m) == MAX_SAMPLES
