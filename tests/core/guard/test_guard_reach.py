"""Which vehicles are left out of the guard's predictions: only those that cannot come near."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.flight.steering import near_to
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState, predict, prediction_times
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.scenario.model import Limits, OperatingArea

LARGE = Rectangle(centre_m=(0.0, 0.0), width_m=9000.0, height_m=9000.0)
NOW_S = 100.0


def vehicle(position_m: tuple[float, float, float], speed_m_s: float = 0.0, age_s: float = 0.0) -> Any:
    telemetry = SimpleNamespace(position_m=position_m, position_s=NOW_S - age_s, ground_speed_m_s=speed_m_s)
    return SimpleNamespace(telemetry=telemetry, integrity=SimpleNamespace(position_error_m=math.nan))


def straight_on(x_m: float, vx: float) -> Trajectory:
    """Along the x axis, from `x_m` now."""
    times_s = np.arange(0.0, 60.0, 0.5)
    places = np.stack([x_m + vx * times_s, 0.0 * times_s, 0.0 * times_s + 40.0], axis=1)
    return Trajectory(NOW_S, 0.5, places, np.full(places.shape, [vx, 0.0, 0.0]))


def guard(limits: Limits) -> Guard:
    return Guard(limits, OperatingArea(LARGE, 20.0, 90.0), ())


@given(
    limit_m_s=st.floats(1.0, 25.0),
    accel_m_s2=st.floats(0.5, 5.0),
    other_m_s=st.floats(0.0, 40.0),
    ages_s=st.tuples(st.floats(0.0, 2.99), st.floats(0.0, 2.99)),
    farther_m=st.floats(0.1, 50.0),
)
def test_what_is_left_out_cannot_come_near_whatever_both_do(
    limit_m_s: float, accel_m_s2: float, other_m_s: float, ages_s: tuple[float, float], farther_m: float
) -> None:
    """They fly at each other: one at the limit, the other as fast as a pilot may."""
    limits = Limits(speed_m_s=limit_m_s, accel_m_s2=accel_m_s2)
    times_s = prediction_times(limits)
    apart_m = (
        2.0 * times_s[-1] * (limit_m_s + max(limit_m_s, other_m_s)) + 2.0 * limits.separation_horizontal_m + farther_m
    )
    there = (apart_m, 0.0, 40.0)
    assert not near_to([(0.0, 0.0, 40.0)], guard(limits), NOW_S)(vehicle(there, other_m_s, ages_s[1]))
    one = VehicleState(
        1, (0.0, 0.0, 40.0), (limit_m_s, 0.0, 0.0), MotionModel.FOLLOWS, straight_on(0.0, limit_m_s), age_s=ages_s[0]
    )
    other = VehicleState(2, there, (-other_m_s, 0.0, 0.0), MotionModel.DRIFTS, age_s=ages_s[1])
    found = predict([one, other], limits, times_s, NOW_S)
    error_m = float(found.error_m.sum())
    assert found.high_m[0, 0] + error_m + limits.separation_horizontal_m < found.low_m[1, 0]


def test_a_neighbour_is_predicted_and_one_across_the_field_is_not() -> None:
    near = near_to([(0.0, 0.0, 40.0), (100.0, 50.0, 40.0)], guard(Limits()), NOW_S)
    assert near(vehicle((-179.0, 20.0, 40.0)))
    assert near(vehicle((200.0, 150.0, 40.0)))
    assert not near(vehicle((-181.0, 20.0, 40.0)))
    assert near(vehicle((-181.0, 20.0, 40.0), speed_m_s=20.0)), "a pilot flies it, faster than the limit"


def test_a_silent_vehicle_and_one_without_a_position_are_never_left_out() -> None:
    near = near_to([(0.0, 0.0, 40.0)], guard(Limits()), NOW_S)
    assert near(vehicle((5000.0, 0.0, 40.0), age_s=3.0))
    assert near(vehicle((math.nan, math.nan, math.nan)))
    assert near_to([(math.nan, 0.0, 40.0)], guard(Limits()), NOW_S)(vehicle((5000.0, 0.0, 40.0)))
