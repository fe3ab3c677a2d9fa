"""What courses ask for, as arrays: samples of many at once, as each would give them alone."""

import math

import numpy as np
import pytest

from tests.core.rigs.guard_rig import LIMITS, stand
from tui_gcs.core.guard.course_samples import FAR_M, course_samples, finite_in, length_of, wanted
from tui_gcs.core.guard.motion_prediction import prediction_times
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.motion.cruise import Cruise

TIMES = prediction_times(LIMITS)
HERE = (50.0, 50.0, 40.0)
PLACES = np.array([[0.0, 0.0, 30.0], [4.0, 1.0, 30.0], [9.0, 1.0, 31.0]])
SPEEDS = np.array([[4.0, 1.0, 0.0], [4.5, 0.5, 0.5], [5.0, 0.0, 1.0]])
TRACK = Trajectory(10.0, 1.0, PLACES, SPEEDS)
LATER = Trajectory(11.0, 0.5, PLACES[:2] + 100.0, SPEEDS[1:])


# ---------------------------------------------------------------- what is wanted


@pytest.mark.parametrize("now", [7.0, 9.875, 10.0, 11.3, 12.0, 50.0])
def test_trajectories_are_sampled_as_they_are_flown(now: float) -> None:
    sampled = wanted([stand(1.0, 2.0), TRACK, LATER], now, TIMES)
    for row, course in ((1, TRACK), (2, LATER)):
        for i, t in enumerate(TIMES.tolist()):
            place, velocity = course.at(now + t)
            assert sampled[row, i] == pytest.approx((*place, *velocity))


def test_other_courses_are_asked_moment_by_moment() -> None:
    cruise = Cruise(0.0, HERE, (0.0, 0.0, 0.0), (8.0, 0.0, 0.0), 3.0, 2.0)
    moves, stands = wanted([cruise, stand(1.0, 2.0)], 1.0, TIMES)
    place, velocity = cruise.at(2.0)
    assert moves[4].tolist() == [*place, *velocity]
    assert stands.tolist() == [[1.0, 2.0, 40.0, 0.0, 0.0, 0.0]] * 21


def test_numbers_that_are_none_do_no_harm() -> None:
    bad = Trajectory(0.0, 9.0, np.array([[math.nan, math.inf, -math.inf]] * 2), np.array([[1e300, 0.0, -1e7]] * 2))
    assert wanted([bad], 1.0, TIMES)[0, 0].tolist() == [0.0, FAR_M, -FAR_M, FAR_M, 0.0, -FAR_M]


# ---------------------------------------------------------------- steps


def test_a_trajectory_gives_its_own_samples_from_the_one_before_now() -> None:
    long = Trajectory(0.0, 1.0, np.outer(np.arange(20.0), np.ones(3)), np.zeros((20, 3)))
    steps = course_samples([long, TRACK, stand(1.0, 2.0)], 3.5, TIMES)
    assert steps.first.tolist() == [0, 7, 10]
    assert steps.places_m[:7, 0].tolist() == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], "5 s, and a sample on either side"
    assert steps.places_m[7:10].tolist() == PLACES.tolist() and len(steps.places_m) == 31
    assert steps.step_s[[0, 9, 10]].tolist() == [1.0, 1.0, 0.25]
    fine = Trajectory(0.0, 0.25, np.zeros((99, 3)), np.zeros((99, 3)))
    assert len(course_samples([fine], 2.0, TIMES).places_m) == 22


def test_changes_are_of_one_course_never_from_one_to_the_next() -> None:
    steps = course_samples([LATER, TRACK], 10.0, TIMES)
    accel = math.hypot(0.5, 0.5, 0.5)
    assert steps.accel_m_s2() == pytest.approx([0.0, accel / 0.5, 0.0, accel, accel])
    assert steps.worst(steps.accel_m_s2()) == pytest.approx([accel / 0.5, accel])
    later = math.hypot(4.0 / 0.5 - 4.75, 1.0 / 0.5 - 0.25, -0.75)
    assert steps.mismatch_m_s() == pytest.approx(
        [0.0, later, 0.0, math.hypot(4.0 - 4.25, 1.0 - 0.75, -0.25), math.hypot(5.0 - 4.75, -0.25, 1.0 - 0.75)]
    )


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("which", ["positions_m", "velocities_m_s"])
def test_what_is_no_number_is_told_and_counts_as_nothing(bad: float, which: str) -> None:
    course = Trajectory(0.0, 1.0, PLACES.copy(), SPEEDS.copy())
    getattr(course, which)[1, 2] = bad
    steps = course_samples([TRACK, course], 0.0, TIMES)
    assert steps.finite.tolist() == [True] * 3 + [True, False, True] and steps.all_finite().tolist() == [True, False]
    assert steps.places_m[4].tolist() == steps.velocities_m_s[4].tolist() == [0.0, 0.0, 0.0]
    assert np.isfinite(getattr(course, which)).sum() == 8, "the course itself is as it was"


def test_lengths() -> None:
    vectors = np.array([[2.0, 3.0, 6.0], [1e200, 0.0, 0.0]])
    assert length_of(vectors).tolist() == [7.0, 1e200]
    assert finite_in(vectors, vectors).tolist() == [True, True]


@pytest.mark.filterwarnings("error")
def test_times_between_samples_beyond_all_measure_are_taken_for_the_most_and_the_least_there_is() -> None:
    steps = course_samples([Trajectory(0.0, dt_s, PLACES, SPEEDS) for dt_s in (1e-300, 1e300)], 0.0, TIMES)
    assert sorted(set(steps.step_s.tolist())) == [1e-100, 1e100]


@pytest.mark.parametrize("dt_s", [1e-300, 1.0, 1e300])
def test_numbers_beyond_all_measure_overflow_nothing_and_are_too_much(dt_s: float) -> None:
    huge = np.array([[1e308, 0.0, 40.0], [-1e308, 0.0, 40.0]])
    steps = course_samples([Trajectory(0.0, dt_s, huge, huge)], 0.0, TIMES)
    assert steps.all_finite().all()
    assert steps.worst(length_of(steps.velocities_m_s))[0] > 1e99
    assert steps.worst(steps.mismatch_m_s())[0] > 1.0
