"""What an autopilot flies at most by its own parameters, and what is done where a scenario asks for more."""

import math
from collections.abc import Callable

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tui_gcs.core.firmware.own_limits import (
    SIMULATED_PX4,
    AskedMotion,
    OwnLimits,
    limit_problems,
    own_limits,
    shipped_problems,
)
from tui_gcs.core.flight.planner_tasks import crewed, crews, within_own_limits
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.missions.scenario_findings import findings
from tui_gcs.core.scenario.model import Scenario, VehicleClass

MakeRig = Callable[..., Rig]
ASKED = AskedMotion(8.0, 2.5, climb_m_s=0.5, layer_m=120.0)


@pytest.mark.parametrize(
    ("autopilot", "values", "speed_m_s", "accel_m_s2"),
    [
        (AUTOPILOT_ARDUPILOT, {}, 10.0, 2.5),
        (AUTOPILOT_ARDUPILOT, {"WPNAV_SPEED": 500.0, "WPNAV_ACCEL": 100.0}, 5.0, 1.0),
        (AUTOPILOT_ARDUPILOT, {"WP_SPD": 15.0, "WP_ACC": 4.0}, 15.0, 4.0),
        (AUTOPILOT_PX4, {}, 12.0, 9.80665),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": 7.0, "MPC_TILTMAX_AIR": 20.0}, 7.0, 3.5693),
        (AUTOPILOT_PX4, {"MPC_TILTMAX_AIR": 90.0}, 12.0, math.inf),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": 0.0, "MPC_TILTMAX_AIR": -45.0}, 12.0, 9.80665),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": math.nan, "MPC_TILTMAX_AIR": math.nan}, 12.0, 9.80665),
        (AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": -math.inf, "MPC_TILTMAX_AIR": -math.inf}, 12.0, 9.80665),
        (99, {}, math.inf, math.inf),
    ],
)
def test_its_own_parameters_limit_it(
    autopilot: int, values: dict[str, float], speed_m_s: float, accel_m_s2: float
) -> None:
    assert own_limits(autopilot, values) == pytest.approx((speed_m_s, accel_m_s2), rel=1e-4)


def test_the_air_of_its_simulator_limits_a_simulated_px4() -> None:
    assert own_limits(AUTOPILOT_PX4, {}, simulated=True) == SIMULATED_PX4
    assert own_limits(AUTOPILOT_PX4, {"MPC_XY_VEL_MAX": 5.0}, simulated=True) == (5.0, 2.5)
    assert own_limits(AUTOPILOT_ARDUPILOT, {}, simulated=True) == (10.0, 2.5)


@pytest.mark.parametrize(
    ("autopilot", "values", "problems"),
    [
        (AUTOPILOT_ARDUPILOT, {}, []),
        (AUTOPILOT_ARDUPILOT, {"WPNAV_SPEED": 800.0, "WPNAV_ACCEL": 250.0, "WPNAV_SPEED_UP": 50.0}, []),
        (
            AUTOPILOT_ARDUPILOT,
            {"WPNAV_SPEED": 500.0, "WPNAV_ACCEL": 100.0, "WPNAV_SPEED_UP": 10.0},
            [
                "flies 5 m/s at most (WPNAV_SPEED), the scenario asks for 8",
                "accelerates with 1 m/s2 at most (WPNAV_ACCEL), the scenario asks for 2.5",
                "climbs 0.1 m/s at most (WPNAV_SPEED_UP), the scenario asks for 0.5",
            ],
        ),
        (
            AUTOPILOT_ARDUPILOT,
            {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ALT_MAX": 100.0},
            ["its own fence ends at 100 m (FENCE_ALT_MAX), its layer is 120 m"],
        ),
        (AUTOPILOT_ARDUPILOT, {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 6.0, "FENCE_ALT_MAX": 100.0}, []),
        (AUTOPILOT_ARDUPILOT, {"FENCE_ENABLE": 0.0, "FENCE_TYPE": 7.0, "FENCE_ALT_MAX": 100.0}, []),
        (AUTOPILOT_ARDUPILOT, {"FENCE_ENABLE": 1.0, "FENCE_TYPE": math.nan, "FENCE_ALT_MAX": 100.0}, []),
        (
            AUTOPILOT_PX4,
            {"MPC_TKO_SPEED": 0.2, "GF_ACTION": 2.0, "GF_MAX_VER_DIST": 50.0},
            [
                "climbs 0.2 m/s at most (MPC_TKO_SPEED), the scenario asks for 0.5",
                "its own fence ends at 50 m (GF_MAX_VER_DIST), its layer is 120 m",
            ],
        ),
        (AUTOPILOT_PX4, {"GF_ACTION": 2.0, "GF_MAX_VER_DIST": 0.0}, []),
        (AUTOPILOT_PX4, {"GF_ACTION": 0.0, "GF_MAX_VER_DIST": 50.0}, []),
        (99, {"WPNAV_SPEED": 1.0}, []),
    ],
)
def test_limits_below_what_is_asked_are_named(autopilot: int, values: dict[str, float], problems: list[str]) -> None:
    assert limit_problems(autopilot, values, ASKED) == problems


def test_limits_that_vehicles_as_shipped_do_not_fly_are_named() -> None:
    assert shipped_problems(8.0, 2.5) == []
    assert shipped_problems(10.0, 2.5, (AUTOPILOT_ARDUPILOT,)) == []
    assert shipped_problems(12.0, 4.0, (AUTOPILOT_ARDUPILOT,)) == [
        "limits.speed_m_s 12: ArduPilot flies 10 m/s at most unless WPNAV_SPEED is raised",
        "limits.accel_m_s2 4: ArduPilot accelerates with 2.5 m/s2 at most unless WPNAV_ACCEL is raised",
    ]
    air = "simulated PX4s fly 8 m/s and 2.5 m/s2 at most: their air takes the rest of their lean (MPC_TILTMAX_AIR)"
    assert shipped_problems(9.0, 2.5) == [air]
    assert len(shipped_problems(15.0, 10.0, (AUTOPILOT_PX4,))) == 3


def faster(mission: Scenario, speed_m_s: float, accel_m_s2: float = 2.5) -> Scenario:
    limits = msgspec.structs.replace(mission.limits, speed_m_s=speed_m_s, accel_m_s2=accel_m_s2)
    return msgspec.structs.replace(mission, limits=limits)


def test_a_check_names_what_vehicles_as_shipped_do_not_fly() -> None:
    texts = [finding.text for _, finding in findings(faster(scenario(2), 12.0, 3.0))]
    assert "limits.speed_m_s 12: ArduPilot flies 10 m/s at most unless WPNAV_SPEED is raised" in texts
    assert "limits.accel_m_s2 3: ArduPilot accelerates with 2.5 m/s2 at most unless WPNAV_ACCEL is raised" in texts
    assert not [finding for _, finding in findings(scenario(2)) if "at most" in finding.text]


def test_planners_plan_with_what_the_slowest_of_the_team_flies() -> None:
    kind = VehicleClass("fast", (2,), 8.0, 2.5, 15.0)
    mission = msgspec.structs.replace(scenario(2), classes=(kind,))
    team = mission.teams[0]
    task = crewed(mission, mission.rounds[0], team, crews(mission)[team.name])
    slowed = within_own_limits(task, {1: OwnLimits(), 2: OwnLimits(5.0, 1.0)})
    assert (slowed.limits.speed_m_s, slowed.limits.accel_m_s2) == (5.0, 1.0)
    assert [slowed.class_of(vehicle).speed_m_s for vehicle in (1, 2)] == [8.0, 5.0]
    assert [slowed.class_of(vehicle).accel_m_s2 for vehicle in (1, 2)] == [2.5, 1.0]
    assert within_own_limits(task, dict.fromkeys((1, 2), OwnLimits(10.0, 2.5))) == task
    assert within_own_limits(task, {}) == task


@pytest.mark.parametrize(
    ("asked", "planned"), [((12.0, 2.5), (10.0, 2.5)), ((8.0, 4.0), (8.0, 2.5)), ((6.0, 2.0), (6.0, 2.0))]
)
def test_a_station_gives_its_planners_what_its_vehicles_fly(
    rig: MakeRig, asked: tuple[float, float], planned: tuple[float, float]
) -> None:
    ground = rig(2, mission=faster(scenario(2), *asked)).ready()
    (controller,) = ground.station.active.team_controllers.values()
    assert controller.task is not None
    assert (controller.task.limits.speed_m_s, controller.task.limits.accel_m_s2) == planned
