"""PX4 takes over: ground station lost, battery, GPS."""

import pytest

from sitl.launch.fleet import SimFleet
from sitl.px4.modes import LAND, RTL
from tests.sitl.conftest import HOLD, Ground, px4_take_off, specs


def test_without_a_ground_station_nothing_happens_by_default(px4):
    ground = px4()
    px4_take_off(ground)
    ground.run(30.0)
    assert ground.fleet.mode[0] == HOLD


def test_a_lost_ground_station_means_hold_and_then_return(px4):
    ground = px4()
    ground.param("NAV_DLL_ACT", 2)
    px4_take_off(ground)
    lost = ground.fleet.now_s - 1.0
    while ground.fleet.mode[0] != RTL and ground.fleet.now_s < lost + 30.0:
        ground.run(0.1)
    assert ground.fleet.now_s - lost == pytest.approx(17.7, abs=0.7)
    ground.beat(2.0)
    assert "GCS connection regained\t" in ground.texts()
    assert ground.fleet.mode[0] == RTL, "it stays in the return"
    assert ground.of("HEARTBEAT")[-1]["system_status"] == 5
    assert ground.acks(176, 1, 4, 3) == [0, 0]
    ground.beat(1.0)
    assert ground.fleet.mode[0] == HOLD
    assert ground.of("HEARTBEAT")[-1]["system_status"] == 4


def test_arming_without_a_ground_station_is_refused_once_its_loss_matters():
    ground = Ground(SimFleet(specs(1, "px4")))
    ground.run(4.0)
    assert ground.command(400, 1) == 0
    assert ground.command(400, 0) == 0
    ground.param("NAV_DLL_ACT", 2)
    assert ground.command(400, 1) == 1


def test_the_battery_drains_to_half_in_a_minute_and_is_full_again_on_the_ground(px4):
    ground = px4()
    px4_take_off(ground)
    ground.beat(40.0)
    assert 50 <= ground.of("SYS_STATUS")[-1]["battery_remaining"] < 65
    ground.beat(60.0)
    status = ground.of("SYS_STATUS")[-1]
    assert (status["battery_remaining"], status["current_battery"]) == (50, -100)
    assert ground.of("BATTERY_STATUS")[-1]["voltages"][0] == status["voltage_battery"] < 16200
    ground.command(21)
    ground.beat(30.0)
    assert ground.of("SYS_STATUS")[-1]["battery_remaining"] == 100


def test_an_empty_battery_lands_it(px4):
    ground = px4()
    ground.param("SIM_BAT_MIN_PCT", 2.0)
    ground.param("SIM_BAT_DRAIN", 20.0)
    px4_take_off(ground, 10.0)
    ground.beat(30.0)
    said = ground.texts()
    assert [t for t in said if "attery" in t] == ["Low battery\t", "Critical battery\t", "Emergency battery level\t"]
    assert "Failsafe activated: entering Hold for 5 seconds\t" in said
    assert ground.fleet.mode[0] == LAND
    assert ground.of("BATTERY_STATUS")[-1]["charge_state"] == 4
    assert {"commander_failsafe_enter_low_bat", "commander_failsafe_enter_hold"} <= set(ground.events())


def test_lost_gps_means_descent_after_5_s_shown_as_land(px4):
    ground = px4()
    px4_take_off(ground)
    ground.fleet.break_gps(0)
    lost = ground.fleet.now_s
    while ground.fleet.mode[0] == HOLD:
        ground.run(0.05)
    assert ground.fleet.now_s - lost == pytest.approx(5.1, abs=0.2)
    assert ground.fleet.mode[0] == LAND
    ground.beat(4.0)
    assert ground.of("HEARTBEAT")[-1]["system_status"] == 5
    assert {"commander_failsafe_enter_autopilot_disengaged", "check_estimator_gnss_fusion_stopped"} <= set(
        ground.events()
    )
    assert ground.acks(176, 1, 4, 3) == [0, 1], "Hold needs a position"
    ground.beat(20.0)
    assert not ground.fleet.armed[0]


def test_the_worse_failsafe_wins(px4):
    ground = px4()
    ground.param("NAV_DLL_ACT", 2)
    px4_take_off(ground)
    ground.run(20.0)
    assert ground.fleet.mode[0] == RTL
    ground.fleet.break_gps(0)
    ground.run(6.0)
    assert ground.fleet.mode[0] == LAND
