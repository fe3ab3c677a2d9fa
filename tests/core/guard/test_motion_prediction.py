"""What the guard foresees: vehicles that go on, that go on for a moment and brake, that brake now."""

import math

import numpy as np
import pytest

from tests.core.rigs.guard_rig import LIMITS, passing, sight, stand
from tui_gcs.core.guard.motion_prediction import (
    FleetPrediction,
    MotionModel,
    VehicleState,
    predict,
    prediction_times,
    turning_error_m,
)
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.scenario.model import Limits

TIMES = prediction_times(LIMITS)
HERE = (50.0, 50.0, 40.0)
EAST = (8.0, 0.0, 0.0)


def seen(*sights: VehicleState, limits: Limits = LIMITS, now: float = 0.0) -> FleetPrediction:
    return predict(list(sights), limits, prediction_times(limits), now)


def along(prediction: FleetPrediction, future: str, at_s: float, row: int = 0) -> list[float]:
    """How far it has come from (50, 50, 40) by then."""
    place = getattr(prediction, future)[row, round(at_s / 0.25)] - HERE
    return [round(float(x), 3) for x in place]


# ---------------------------------------------------------------- time


def test_five_seconds_are_looked_at_or_as_long_as_braking_takes() -> None:
    assert TIMES.tolist() == [0.25 * i for i in range(21)]
    fast = prediction_times(Limits(speed_m_s=16.0))
    assert fast[-1] == 8.75, "0.5 s on, 0.25 s until it brakes, 16 / (0.8 x 2.5) = 8 s of braking"


def test_the_last_look_is_half_a_step_from_the_end_of_braking() -> None:
    """At 16.3 m/s that is after 8.9 s: nearer to 9.0 than to 8.75."""
    assert prediction_times(Limits(speed_m_s=16.3))[-1] == 9.0
    assert prediction_times(Limits(speed_m_s=16.2))[-1] == 8.75


# ---------------------------------------------------------------- braking


def test_braking_begins_late_and_is_weaker_than_allowed() -> None:
    """0.25 s at 8 m/s, then 2 m/s²: 2 m + 64 / 4 m."""
    prediction = seen(VehicleState(1, HERE, EAST, MotionModel.STOPS))
    assert [along(prediction, "stops_m", t)[0] for t in (0.0, 0.25, 1.25, 4.25, 5.0)] == [0.0, 2.0, 9.0, 18.0, 18.0]
    assert prediction.rests_m[0].tolist() == [[68.0, 50.0, 40.0]] * 2
    for future in (prediction.goes_m, prediction.late_m):
        assert future.tolist() == prediction.stops_m.tolist()


def test_it_may_also_brake_at_once_and_hard() -> None:
    """3.1 m/s² from 8 m/s, and 4 m/s² from 2 m/s upwards."""
    prediction = seen(VehicleState(1, HERE, (8.0, 0.0, 2.0), MotionModel.STOPS))
    assert [along(prediction, "short_m", t)[0] for t in (0.0, 1.0, 5.0)] == [0.0, 6.438, 10.24]
    assert [along(prediction, "short_m", t)[2] for t in (0.25, 0.5, 5.0)] == [0.375, 0.5, 0.5]


def test_until_it_brakes_it_may_speed_up_a_little_in_any_direction() -> None:
    """From 2.5 m/s² to none at 4 m/s³ is 0.78 m/s more, for the 2.25 s of 8 m/s that braking is long."""
    prediction = seen(VehicleState(1, HERE, (8.0, 0.0, 2.0), MotionModel.STOPS))
    assert prediction.slack_m[0, [0, 1, -1], 0] == pytest.approx([0.0, 0.78125 * 0.25, 0.78125 * 2.25])
    assert prediction.slack_m[0, [0, 1, -1], 1] == pytest.approx([0.0, 0.125, 0.5 * 1.5])
    slow = seen(VehicleState(1, HERE, (0.3, 0.0, -0.1), MotionModel.STOPS))
    assert slow.slack_m[0, -1] == pytest.approx([0.3 * 0.325, 0.1 * (0.25 + 0.1 / 1.6)]), "no more than it has"
    assert seen(VehicleState(1, HERE, EAST)).slack_m.max() == 0.0, "who drifts does not brake"


def test_who_is_much_too_fast_comes_to_rest_later_than_is_looked_at() -> None:
    prediction = seen(VehicleState(1, HERE, (16.0, 0.0, 0.0), MotionModel.STOPS))
    assert prediction.rests_m[0, 1, 0] == 50.0 + 4.0 + 64.0
    assert prediction.stops_m[0, -1, 0] < 117.0


def test_it_brakes_along_its_way_and_upright_by_itself() -> None:
    """Of 5 m/s each axis has its share; upwards it is 0.8 m/s² from 1 m/s: 0.25 m + 0.625 m."""
    prediction = seen(VehicleState(1, HERE, (3.0, -4.0, 1.0), MotionModel.STOPS))
    way = 0.25 + 5.0 / 4.0
    assert prediction.rests_m[0, 1] == pytest.approx([50 + 3 * way, 50 - 4 * way, 40.875])
    assert along(prediction, "stops_m", 1.25)[2] == pytest.approx(0.25 + 1.0 - 0.4)


def test_who_stands_stays() -> None:
    prediction = seen(VehicleState(1, HERE, (0.0, 0.0, 0.0), MotionModel.STOPS))
    assert prediction.stops_m[0].tolist() == [list(HERE)] * 21


# ---------------------------------------------------------------- drifting


def test_who_does_what_it_wants_is_thought_to_fly_straight_on() -> None:
    prediction = seen(VehicleState(1, HERE, (8.0, -2.0, 1.0)))
    for future in ("goes_m", "late_m", "stops_m"):
        assert along(prediction, future, 5.0) == [40.0, -10.0, 5.0]
    assert prediction.low_m[0].tolist() == [50.0, 40.0, 40.0] and prediction.high_m[0].tolist() == [90.0, 50.0, 45.0]


@pytest.mark.parametrize("unknown", [math.nan, math.inf, -math.inf])
def test_an_unknown_velocity_is_none(unknown: float) -> None:
    assert seen(VehicleState(1, HERE, (unknown,) * 3)).goes_m[0].tolist() == [list(HERE)] * 21


# ---------------------------------------------------------------- chasing


def test_on_its_course_it_stays_there() -> None:
    prediction = seen(sight(HERE, passing(50.0, 50.0, vx=8.0)))
    assert [along(prediction, "goes_m", t)[0] for t in (0.0, 2.0, 5.0)] == [0.0, 16.0, 40.0]


def test_going_on_for_half_a_second_and_braking_then() -> None:
    prediction = seen(sight(HERE, passing(50.0, 50.0, vx=8.0)))
    assert [along(prediction, "late_m", t)[0] for t in (0.5, 0.75, 1.75)] == [4.0, 6.0, 13.0]
    assert prediction.rests_m[0, 0, 0] == pytest.approx(50 + 4 + 18)
    assert prediction.rests_m[0, 1, 0] == pytest.approx(50 + 18)


def test_to_a_place_it_speeds_up_flies_and_brakes() -> None:
    """2.5 m/s² for 3.2 s, then 8 m/s; from near it does not fly past the place."""
    far = seen(sight(HERE, stand(150.0, 50.0)))
    assert along(far, "goes_m", 3.25)[0] == pytest.approx(13.2, abs=0.3)
    assert along(far, "goes_m", 5.0)[0] == pytest.approx(13.2 + 14.0, abs=0.3)
    near = seen(sight(HERE, stand(60.0, 50.0)), limits=Limits(speed_m_s=16.0))
    assert near.goes_m[0, :, 0].max() <= 60.3
    assert along(near, "goes_m", 8.75)[0] == pytest.approx(10.0, abs=0.1)


def test_a_slow_flight_to_a_place_is_slow() -> None:
    prediction = seen(
        VehicleState(1, HERE, (0.0, 0.0, 0.0), MotionModel.FOLLOWS, PositionTarget((150.0, 50.0, 40.0), 2.0))
    )
    assert along(prediction, "goes_m", 5.0)[0] == pytest.approx(0.8 + 4.2 * 2.0, abs=0.2)
    greedy = seen(VehicleState(1, HERE, EAST, MotionModel.FOLLOWS, PositionTarget((250.0, 50.0, 40.0), 20.0)))
    assert along(greedy, "goes_m", 5.0)[0] == pytest.approx(40.0), "not above the limit"


def test_climbing_and_sinking_have_their_own_limits() -> None:
    """1 m/s² up to 3 m/s up and 1.5 m/s down."""
    up = seen(sight(HERE, stand(50.0, 50.0, 80.0)))
    assert along(up, "goes_m", 5.0)[2] == pytest.approx(4.5 + 2.0 * 3.0, abs=0.1)
    down = seen(sight(HERE, stand(50.0, 50.0, 0.0)))
    assert along(down, "goes_m", 5.0)[2] == pytest.approx(-(1.125 + 3.5 * 1.5), abs=0.1)
    a_little = seen(sight(HERE, stand(50.0, 50.0, 41.0)))
    assert a_little.goes_m[0, :, 2].max() <= 41.2
    assert along(a_little, "goes_m", 5.0)[2] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("up_m", [0.5, 1.2, 10.0])
def test_a_height_is_reached_and_not_passed(up_m: float) -> None:
    """It slows down in time for 0.8 m/s²; of what it asks it is behind by a step."""
    prediction = seen(sight(HERE, stand(50.0, 50.0, 40.0 + up_m)), limits=Limits(speed_m_s=16.0))
    heights = prediction.goes_m[0, :, 2] - 40.0
    assert heights.max() < up_m + 0.1
    assert heights[-1] == pytest.approx(up_m, abs=0.3)


def test_a_height_is_worked_off_whatever_else_it_flies() -> None:
    beside = seen(sight(HERE, stand(250.0, 50.0, 60.0)))
    above = seen(sight(HERE, stand(50.0, 50.0, 60.0)))
    assert beside.goes_m[0, :, 2].tolist() == above.goes_m[0, :, 2].tolist()


def test_an_error_is_worked_off_as_fast_as_it_can_be_braked_for() -> None:
    """2 m beside its course: 1/s, so that e^-4 of it is left after 4 s or so."""
    prediction = seen(sight((50.0, 52.0, 40.0), passing(50.0, 50.0, vx=6.0)))
    assert 0.0 <= prediction.goes_m[0, 16, 1] - 50.0 < 0.3
    assert prediction.goes_m[0, 4, 1] - 50.0 == pytest.approx(1.1, abs=0.3)


def test_a_turn_is_no_sharper_than_it_can_be() -> None:
    """East at 8 m/s, told to go north: 2.5 m/s² make a diagonal change of velocity."""
    prediction = seen(sight(HERE, passing(50.0, 50.0, vx=0.0, vy=8.0), velocity=EAST))
    velocity = np.diff(prediction.goes_m[0], axis=0) / 0.25
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / 0.25
    assert change.max() <= 2.5 + 1e-6 and change[:4].min() > 2.0
    assert prediction.goes_m[0, :, 0].max() > 56.0


def test_no_course_is_a_stop() -> None:
    prediction = seen(VehicleState(1, HERE, EAST, MotionModel.FOLLOWS, None))
    assert prediction.goes_m.tolist() == prediction.stops_m.tolist()


# ---------------------------------------------------------------- age and error


def test_an_old_position_is_somewhere_on_the_way_since() -> None:
    prediction = seen(VehicleState(1, HERE, EAST, age_s=1.0, error_m=3.0))
    assert prediction.here_m.tolist() == [[54.0, 50.0, 40.0]] and prediction.error_m.tolist() == [7.0]
    assert seen(VehicleState(1, HERE, EAST, age_s=-1.0)).error_m.tolist() == [0.0]
    assert seen(VehicleState(1, HERE, (3.0, 4.0, 9.0), age_s=1.0)).error_m.tolist() == [2.5], "sideways"


# ---------------------------------------------------------------- lost


def lost_between(sight_: VehicleState, at_s: float = 0.0) -> tuple[list[float], list[float], float]:
    """From where to where it may be, as metres from (50, 50, 40), and how far beside that."""
    prediction = seen(sight_)
    for future in ("goes_m", "late_m", "stops_m"):
        assert getattr(prediction, future).tolist() == prediction.goes_m.tolist()
    assert prediction.short_m.tolist() == prediction.from_m.tolist() and prediction.slack_m.max() == 0.0
    return along(prediction, "from_m", at_s), along(prediction, "goes_m", at_s), float(prediction.error_m[0])


@pytest.mark.parametrize(("age_s", "far_m", "beside_m"), [(3.0, 40.0, 7.5), (5.0, 56.0, 12.5), (60.0, 56.0, 12.5)])
def test_a_lost_one_is_anywhere_on_a_way_that_grows(age_s: float, far_m: float, beside_m: float) -> None:
    """At 8 m/s straight on for as long, 5 s at most, and 16 m of braking; another velocity than seen by 2.5 m/s."""
    begin, end, beside = lost_between(VehicleState(1, HERE, EAST, age_s=age_s, error_m=1.0))
    assert (begin, end, beside) == ([0.0, 0.0, 0.0], [far_m, 0.0, 0.0], beside_m + 1.0)


def test_a_lost_one_that_stood_is_where_it_was() -> None:
    assert lost_between(VehicleState(1, HERE, (0.0, 0.0, 0.0), age_s=9.0)) == ([0.0] * 3, [0.0] * 3, 0.0)


def test_a_lost_one_goes_on_to_where_it_was_sent() -> None:
    """80 m east and 14 m up, with 8 m/s and 3 m/s at most: after 4 s it may be on any of 32 m, 2 s later of 48 m."""
    sent = VehicleState(1, HERE, EAST, age_s=4.0, goal_m=(130.0, 50.0, 54.0))
    assert lost_between(sent)[1] == [32.0, 0.0, 12.0]
    assert lost_between(sent, 2.0)[1] == [48.0, 0.0, 14.0], "it may climb first"
    there = VehicleState(1, HERE, EAST, age_s=40.0, goal_m=(130.0, 50.0, 44.0))
    assert lost_between(there)[1] == [80.0, 0.0, 4.0]
    assert lost_between(VehicleState(1, HERE, EAST, age_s=9.0, goal_m=HERE))[1] == [0.0, 0.0, 0.0]
    above = VehicleState(1, HERE, (0.0, 0.0, 1.0), age_s=4.0, goal_m=(50.0, 50.0, 64.0))
    assert lost_between(above)[1] == [0.0, 0.0, 12.0], "3 m/s up"


def test_who_is_heard_or_known_to_brake_is_not_lost() -> None:
    for known in (VehicleState(1, HERE, EAST, age_s=2.9), VehicleState(1, HERE, EAST, MotionModel.STOPS, age_s=9.0)):
        assert not known.is_lost and along(seen(known), "from_m", 1.0) == along(seen(known), "goes_m", 1.0)


def test_who_is_blown_along_above_the_limit_still_brakes_at_the_end_of_what_is_foreseen() -> None:
    """From 12 m/s it comes to rest after 6.25 s: the box holds what is foreseen last, and its slack then."""
    prediction = seen(VehicleState(1, HERE, (12.0, 0.0, 0.0), MotionModel.STOPS))
    assert prediction.high_m[0, 0] == prediction.stops_m[0, -1, 0] + prediction.slack_m[0, -1, 0]


# ---------------------------------------------------------------- several, and none


def test_each_is_foreseen_as_if_it_were_alone() -> None:
    sights = [
        VehicleState(1, HERE, EAST, MotionModel.STOPS),
        sight((90.0, 20.0, 30.0), passing(90.0, 20.0, vx=3.0, vy=4.0), id_=2),
        VehicleState(3, (10.0, 10.0, 50.0), (1.0, 1.0, 0.0)),
        sight((20.0, 120.0, 60.0), stand(90.0, 90.0, 50.0), id_=4),
    ]
    prediction = seen(*sights)
    for row, one in enumerate(sights):
        single = seen(one)
        for name in (
            "here_m",
            "error_m",
            "goes_m",
            "late_m",
            "stops_m",
            "short_m",
            "slack_m",
            "rests_m",
            "low_m",
            "high_m",
        ):
            assert np.allclose(getattr(prediction, name)[row], getattr(single, name)[0]), (row, name)
        assert (single.low_m[0] <= single.stops_m[0]).all() and (single.goes_m[0] <= single.high_m[0]).all()


def test_the_box_is_around_all_futures() -> None:
    """It flies back; told to go on it is farthest west, late farthest east, and braking in between."""
    prediction = seen(
        sight(HERE, stand(-100.0, 50.0), velocity=EAST),
        sight(HERE, stand(150.0, 150.0, 80.0)),
        VehicleState(3, HERE, EAST, MotionModel.STOPS),
    )
    every = np.concatenate([prediction.goes_m, prediction.late_m, prediction.stops_m, prediction.short_m], axis=1)
    slack = prediction.slack_m[:, -1][:, [0, 0, 1]]
    assert slack[0, 0] > 1.0 and slack[1].tolist() == [0.0, 0.0, 0.0], "who stands has none"
    assert prediction.low_m.tolist() == (every.min(axis=1) - slack).tolist()
    assert prediction.high_m.tolist() == (every.max(axis=1) + slack).tolist()


def test_two_flocks_of_one() -> None:
    first, others = seen(VehicleState(1, HERE, EAST), VehicleState(2, HERE, EAST), VehicleState(3, HERE, EAST)).split(1)
    assert first.ids.tolist() == [1] and [s.id for s in others.states] == others.ids.tolist() == [2, 3]
    assert first.goes_m.shape == (1, 21, 3) and others.high_m.shape == (2, 3)
    assert first.from_m is first.goes_m and others.from_m is others.goes_m, "as nearly always: nobody is lost"
    _, others = seen(VehicleState(1, HERE, EAST), VehicleState(2, HERE, EAST, age_s=9.0)).split(1)
    assert others.from_m[0, 0].tolist() == list(HERE) != others.goes_m[0, 0].tolist()


def test_nobody_is_no_trouble() -> None:
    assert seen().goes_m.shape == (0, 21, 3)


def test_a_speed_that_is_no_number_is_the_limit() -> None:
    reported = seen(VehicleState(1, HERE, EAST, MotionModel.FOLLOWS, PositionTarget((250.0, 50.0, 40.0), math.nan)))
    assert along(reported, "goes_m", 5.0)[0] == pytest.approx(40.0)


@pytest.mark.parametrize("speed_m_s", [8.0, 16.0, 16.3])
def test_the_box_is_about_all_that_a_vehicle_may_do_and_no_larger(speed_m_s: float) -> None:
    """Those of them that go on, those that brake, and those that turn are each the farthest of somebody's."""
    rng = np.random.default_rng(3)
    sights = []
    for number in range(40):
        velocity = (*rng.uniform(-5.0, 5.0, 2).tolist(), float(rng.uniform(-1.0, 1.0)))
        x, y, z = rng.uniform((40.0, 40.0, 35.0), (60.0, 60.0, 45.0)).tolist()
        sights.append(sight(HERE, stand(x, y, z) if number % 2 else None, velocity))
    prediction = seen(*sights, limits=Limits(speed_m_s=speed_m_s))
    ways = np.concatenate([prediction.goes_m, prediction.late_m, prediction.stops_m, prediction.short_m], axis=1)
    room = prediction.slack_m[:, -1][:, [0, 0, 1]]
    np.testing.assert_array_equal(prediction.low_m, ways.min(axis=1) - room)
    np.testing.assert_array_equal(prediction.high_m, ways.max(axis=1) + room)


# ---------------------------------------------------------------- turned


@pytest.mark.parametrize("velocity", [(2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (-1.2, -1.6, 3.0)])
def test_one_that_is_lost_may_have_turned_wherever_it_flew(velocity: tuple[float, float, float]) -> None:
    """As far as it flew since, 2 m/s in 3 s, whatever it climbed; no faster than a second of acceleration turns it."""
    assert turning_error_m(VehicleState(1, HERE, velocity, MotionModel.STOPS, age_s=3.0), LIMITS) == pytest.approx(6.0)
    assert turning_error_m(VehicleState(1, HERE, EAST, MotionModel.STOPS, age_s=3.0), LIMITS) == pytest.approx(
        LIMITS.accel_m_s2 * 3.0
    )
