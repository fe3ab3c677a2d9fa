"""Vehicle classes, density maps, moving obstacles and communication in scenario files."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.flight.planner_tasks import crewed, crews
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.geometry.loops import Loop
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import PowerModel
from tui_gcs.core.scenario.template import new_scenario

BASE = new_scenario("test", Origin(47.0, 8.0, 400.0), 2)
INPUTS = """
[communication]
range_m = 120.0
loss = 0.1
delay_s = 0.2
rate_hz = 5.0
message_bytes = 256

[[class]]
name = "slow"
vehicles = [2]
speed_m_s = 4.0
footprint_radius_m = 8.0
capacity_wh = 71.0
hover_w = 210.0
cruise_w = 190.0
"""
IN_ROUND = """
[[round.density]]
path_m = [[0.0, 150.0], [0.0, 250.0]]
period_s = 100.0
sigma_m = 30.0
weight = 2.0

[[round.obstacle]]
name = "crane"
place_m = [10.0, 180.0]
radius_m = 12.0

[[team]]"""


def test_a_scenario_without_them_is_as_before() -> None:
    scenario = parse(BASE)

    assert scenario.communication.loss == 0.0
    assert scenario.class_of(1).speed_m_s == scenario.limits.speed_m_s
    assert scenario.rounds[0].density == scenario.rounds[0].obstacles == ()


def test_all_of_them_are_read() -> None:
    scenario = parse(BASE.replace("\n[[team]]", IN_ROUND, 1) + INPUTS)

    assert scenario.communication.range_m == 120.0
    assert scenario.class_of(2).name == "slow"
    assert scenario.class_of(2).accel_m_s2 == scenario.limits.accel_m_s2
    assert scenario.class_of(2).speed_m_s == 4.0
    assert scenario.class_of(2).power == PowerModel(71.0, 210.0, 190.0)
    assert scenario.class_of(1).power is None
    assert scenario.rounds[0].density[0].loop.at(25.0) == ((0.0, 200.0), (0.0, 2.0))
    assert scenario.rounds[0].obstacles[0].loop.at(77.0) == ((10.0, 180.0), (0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[communication]\nloss = 1.5", "communication.loss .*must be a number from 0 to 1"),
        ("[communication]\nrange = 3", "unknown key"),
        ('[[class]]\nname = "a"\nvehicles = [1]\nspeed_m_s = 9.0', "speed_m_s .*to 8"),
        ('[[class]]\nname = "a"\nvehicles = [1]\nhover_w = 200.0', "capacity_wh"),
        ('[[class]]\nname = "a"\nvehicles = [1]\ncapacity_wh = 0\nhover_w = 2.0\ncruise_w = 1.0', "more than 0"),
        ('[[class]]\nname = "a"\nvehicles = []', "must be a list of vehicle numbers"),
        ('[[class]]\nname = "a"\nvehicles = [1]\n[[class]]\nname = "b"\nvehicles = [1]', "a second class of vehicle"),
        ('instances = "each"', "must be per_team, per_vehicle"),
    ],
)
def test_mistakes_are_one_line(text: str, problem: str) -> None:
    place = BASE.index("\n[[place]]")
    with pytest.raises(ScenarioError) as error:
        parse(f"{BASE[:place]}{text}\n{BASE[place:]}")
    assert re.search(problem, str(error.value))


@given(
    st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)), min_size=1, max_size=8),
    st.floats(0.0, 1e4),
    st.floats(0.0, 1e6),
)
def test_a_place_on_a_loop_is_always_on_its_way(points: list[tuple[float, float]], period_s: float, t_s: float) -> None:
    (x, y), velocity = Loop(tuple(points), period_s).at(t_s)
    corners = np.array(points)

    assert (corners.min(axis=0) - 1e-6 <= (x, y)).all()
    assert ((x, y) <= corners.max(axis=0) + 1e-6).all()
    assert np.isfinite(velocity).all()


def test_a_task_has_the_least_of_its_team_and_each_vehicle_its_own() -> None:
    scenario = parse(BASE.replace("\n[[team]]", IN_ROUND, 1) + INPUTS)
    task = crewed(scenario, scenario.rounds[0], scenario.teams[0], crews(scenario)["team-1"])

    assert (task.limits.speed_m_s, task.footprint_radius_m) == (4.0, 8.0)
    assert (task.class_of(1).speed_m_s, task.class_of(2).speed_m_s) == (8.0, 4.0)
    assert scenario.limits.speed_m_s == 8.0
