"""What an autopilot flies at most by its own parameters, and what is done where a scenario asks for more."""

import math

import msgspec
import pytest

from tests.core.rigs.rig import scenario
from tui_gcs.core.firmware.own_speed import own_speed_m_s, shipped_problems, speed_problem
from tui_gcs.core.flight.planner_tasks import crewed, crews, within_own_speeds
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.missions.scenario_findings import findings
from tui_gcs.core.scenario.model import VehicleClass


@pytest.mark.parametrize(
    ("autopilot", "values", "most_m_s"),
    [
        (AUTOPILOT_ARDUPILOT, {}, 10.0),
        (AUTOPILOT_ARDUPILOT, {"WPNAV_SPEED": 500.0}, 5.0),
        (AUTOPILOT_ARDUPILOT, {"WP_SPD": 15.0}, 15.0),
        (AUTOPILOT_PX4, {}, 12.0),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": 7.0}, 7.0),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": 0.0}, 12.0),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": math.nan}, 12.0),
        (99, {}, math.inf),
    ],
)
def test_its_own_parameter_limits_its_speed(autopilot: int, values: dict[str, float], most_m_s: float) -> None:
    assert own_speed_m_s(autopilot, values) == most_m_s


def test_a_limit_below_what_is_asked_is_named() -> None:
    text = "flies 5 m/s at most (WPNAV_SPEED), the scenario asks for 8"
    assert speed_problem(AUTOPILOT_ARDUPILOT, {"WPNAV_SPEED": 500.0}, 8.0) == text
    assert speed_problem(AUTOPILOT_ARDUPILOT, {"WPNAV_SPEED": 800.0}, 8.0) == ""
    assert speed_problem(AUTOPILOT_ARDUPILOT, {}, 8.0) == "", "it was not read"
    assert shipped_problems(10.0) == []
    assert shipped_problems(12.0) == ["ArduPilot flies 10 m/s at most unless WPNAV_SPEED is raised"]
    assert len(shipped_problems(15.0)) == 2


def test_a_check_names_a_speed_that_vehicles_as_shipped_do_not_fly() -> None:
    mission = scenario(2)
    fast = msgspec.structs.replace(mission, limits=msgspec.structs.replace(mission.limits, speed_m_s=12.0))
    text = "limits.speed_m_s 12: ArduPilot flies 10 m/s at most unless WPNAV_SPEED is raised"
    assert text in [finding.text for _, finding in findings(fast)]
    assert not [finding for _, finding in findings(mission) if "at most unless" in finding.text]


def test_planners_plan_with_what_the_slowest_of_the_team_flies() -> None:
    mission = scenario(2)
    kind = VehicleClass("fast", (2,), 8.0, 2.5, 15.0)
    mission = msgspec.structs.replace(mission, classes=(kind,))
    team = mission.teams[0]
    task = crewed(mission, mission.rounds[0], team, crews(mission)[team.name])
    slowed = within_own_speeds(task, {1: math.inf, 2: 5.0})
    assert slowed.limits.speed_m_s == 5.0
    assert [slowed.class_of(vehicle).speed_m_s for vehicle in (1, 2)] == [8.0, 5.0]
    assert within_own_speeds(task, {1: 10.0, 2: 10.0}) == task


@pytest.mark.parametrize(("speed_m_s", "planned_m_s"), [(12.0, 10.0), (8.0, 8.0)])
def test_a_station_gives_its_planners_what_its_vehicles_fly(rig, speed_m_s: float, planned_m_s: float) -> None:
    mission = scenario(2)
    limits = msgspec.structs.replace(mission.limits, speed_m_s=speed_m_s)
    ground = rig(2, mission=msgspec.structs.replace(mission, limits=limits)).ready()
    (controller,) = ground.station.active.team_controllers.values()
    assert controller.task is not None and controller.task.limits.speed_m_s == planned_m_s
