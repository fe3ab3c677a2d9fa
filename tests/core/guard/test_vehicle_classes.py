"""Vehicle classes in the guard: they tighten the limits of their vehicles and loosen nothing."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.core.rigs.guard_rig import LIMITS, SQUARE, judge, passing, sight
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import VehicleState, prediction_times
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.motion.cruise import Cruise
from tui_gcs.core.scenario.model import OperatingArea, VehicleClass

SLOW = VehicleClass("slow", (2,), 4.0, 1.0, 15.0)


def guards(*classes: VehicleClass) -> Guard:
    return Guard(LIMITS, OperatingArea(SQUARE, 20.0, 90.0), (), classes)


def flies(speed_m_s: float, vehicle: int) -> VehicleState:
    return sight((50.0, 50.0, 40.0), passing(50.0, 50.0, vx=speed_m_s), id_=vehicle)


@pytest.mark.parametrize(("speed_m_s", "vehicle", "code"), [(6.0, 1, ""), (6.0, 2, "speed"), (4.1, 2, "")])
def test_each_vehicle_has_the_speed_limit_of_its_class(speed_m_s: float, vehicle: int, code: str) -> None:
    assert judge(guards(SLOW), flies(speed_m_s, vehicle)).code == code


def test_a_place_is_flown_to_no_faster_than_the_class_allows_and_the_text_says_so() -> None:
    target = PositionTarget((60.0, 50.0, 40.0), 8.0)
    verdict = judge(guards(SLOW), sight((50.0, 50.0, 40.0), target, (0.0, 0.0, 0.0), id_=2))

    assert verdict.text == "8.0 m/s asked, 4.0 allowed"
    assert judge(guards(SLOW), sight((50.0, 50.0, 40.0), target, (0.0, 0.0, 0.0), id_=1)).code == ""


def test_each_vehicle_has_the_acceleration_limit_of_its_class() -> None:
    course = Cruise(0.0, (50.0, 50.0, 40.0), (0.0, 0.0, 0.0), (3.5, 0.0, 0.0), 5.0, 2.2)

    assert judge(guards(SLOW), sight((50.0, 50.0, 40.0), course, id_=1)).code == ""
    assert judge(guards(SLOW), sight((50.0, 50.0, 40.0), course, id_=2)).code == "acceleration"


def test_a_class_above_the_limits_of_the_scenario_is_cut_to_them() -> None:
    own = guards(VehicleClass("fast", (2,), 50.0, 9.0, 15.0)).limits_of(2)

    assert (own.speed_m_s, own.accel_m_s2) == (LIMITS.speed_m_s, LIMITS.accel_m_s2)


def test_all_are_predicted_to_brake_as_weakly_as_the_weakest() -> None:
    guard = guards(SLOW)

    assert len(guard._times_s) > len(prediction_times(LIMITS))
    towards_wall = sight((189.0, 100.0, 40.0), passing(189.0, 100.0, vx=4.0), id_=2)
    assert judge(guards(), towards_wall).code == ""
    assert judge(guard, towards_wall).code == "area"


@given(
    st.floats(5.0, 195.0),
    st.floats(5.0, 195.0),
    st.floats(-math.pi, math.pi),
    st.floats(0.0, 9.0),
    st.floats(0.5, 8.0),
    st.floats(0.3, 2.5),
)
def test_what_a_class_lets_pass_would_pass_without_it(
    x: float, y: float, bearing: float, speed: float, most_m_s: float, accel_m_s2: float
) -> None:
    course = passing(x, y, speed * math.sin(bearing), speed * math.cos(bearing))
    me = sight((x, y, 40.0), course, id_=2)
    tight = guards(VehicleClass("tight", (2,), most_m_s, accel_m_s2, 15.0))

    if judge(tight, me).code == "":
        assert judge(guards(), me).code == ""
