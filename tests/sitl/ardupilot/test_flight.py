"""Flying: take-off, targets, time-outs, return, landing, failsafes."""

import math

import numpy as np
import pytest

from sitl.links.wire import Encoder

GUIDED, LOITER, RTL, LAND, BRAKE = 4, 5, 6, 9, 17
POSITION_VELOCITY, VELOCITY_ONLY = 0xDC0, 0xDC7


def speed(ground, index=0):
    return float(np.hypot(*ground.fleet.velocity_m_s[index, :2]))


def test_take_off_passes_the_landed_states(booted):
    ground = booted()
    ground.ask("EXTENDED_SYS_STATE", 20)
    ground.take_off(15.0)
    states = [m["landed_state"] for m in ground.of("EXTENDED_SYS_STATE")]
    assert list(dict.fromkeys(states)) == [1, 3, 2]
    assert ground.of("HEARTBEAT")[-1]["system_status"] == 4


def test_armed_without_take_off_disarms_itself_after_10_s(booted):
    ground = booted()
    ground.mode(GUIDED)
    ground.command(400, 1)
    ground.run(9.8)
    assert ground.fleet.armed[0]
    ground.run(0.5)
    assert not ground.fleet.armed[0]


def test_a_position_target_is_reached_without_overshoot(booted):
    ground = booted()
    ground.take_off()
    ground.target(40.0, 0.0, 15.0)
    east = []
    for _ in range(240):
        ground.run(0.05)
        east.append(ground.fleet.position_m[0, 0])
    assert max(east) < 40.3
    assert abs(east[-1] - 40.0) < 0.1
    reached = next(k for k, x in enumerate(east) if abs(x - 40.0) < 0.5) * 0.05
    assert 6.0 < reached < 11.0
    assert ground.fleet.alt_rel_m[0] == pytest.approx(15.0, abs=0.2)


@pytest.mark.parametrize(("lead_s2", "outside_m"), [(0.0, 2.3), (1.0, 0.2)])
def test_target_with_velocity_is_left_outside_by_its_acceleration_like_the_real_one(booted, lead_s2, outside_m):
    """Set-points at 5 Hz on a circle at 7.6 m/s with 2.2 m/s2, from 33 m away; led: shifted inside by as much."""
    ground = booted()
    ground.take_off(30.0)
    radius = 7.6**2 / 2.2
    rate = 7.6 / radius
    beside, accelerations = [], []
    before = ground.fleet.velocity_m_s[0]
    for k in range(20 * 40):
        t = k * 0.05
        if k % 4 == 0:
            velocity = (-7.6 * math.sin(rate * t), 7.6 * math.cos(rate * t), 0.0)
            inside = radius - 2.2 * lead_s2
            place = (inside * math.cos(rate * t), inside * math.sin(rate * t), 30.0)
            ground.target(*place, velocity, POSITION_VELOCITY)
        ground.run(0.05)
        after = ground.fleet.velocity_m_s[0]
        accelerations.append(np.hypot(*(after - before)[:2]) / 0.05)
        before = after
        beside.append(math.hypot(*ground.fleet.position_m[0, :2]) - radius)
    assert max(accelerations) <= 3.5 + 1e-6
    assert beside[20 * 20 :] == pytest.approx([outside_m] * (20 * 20), abs=0.4)


@pytest.mark.parametrize("mask", [POSITION_VELOCITY, VELOCITY_ONLY])
def test_velocities_are_flown_for_3_s_then_it_brakes_and_hovers_without_a_word(booted, mask):
    ground = booted()
    ground.take_off()
    for k in range(60):
        ground.target(0.8 * k, 0.0, 15.0, (4.0, 0.0, 0.0), mask)
        ground.run(0.2)
    assert speed(ground) == pytest.approx(4.0, abs=0.3)
    since = ground.fleet.now_s
    ground.run(2.5)
    assert speed(ground) == pytest.approx(4.0, abs=0.3)
    ground.run(4.0)
    assert speed(ground) < 0.1
    assert ground.texts(since_s=since) == []
    assert ground.fleet.mode[0] == GUIDED


def test_position_targets_have_no_time_out(booted):
    ground = booted()
    ground.take_off()
    ground.target(150.0, 0.0, 15.0)
    ground.run(30.0)
    assert ground.fleet.position_m[0, 0] == pytest.approx(150.0, abs=0.3)


def test_targets_are_dropped_silently_on_the_ground_and_in_other_modes(booted):
    ground = booted()
    ground.mode(GUIDED)
    ground.target(50.0, 0.0, 15.0)
    ground.run(2.0)
    assert np.allclose(ground.fleet.position_m[0], 0.0)
    ground.take_off()
    ground.mode(BRAKE)
    since = ground.fleet.now_s
    ground.target(50.0, 0.0, 15.0)
    ground.run(3.0)
    assert abs(ground.fleet.position_m[0, 0]) < 0.1
    assert {f.name for t, _, f in ground.heard if t > since} == {"HEARTBEAT"}


@pytest.mark.parametrize(("enforced", "system", "flown"), [(0, 250, True), (1, 250, False), (1, 255, True)])
def test_whose_targets_are_flown_is_a_parameter(booted, enforced, system, flown):
    """By default those of any station are; with bit 0 of MAV_OPTIONS only those of MAV_GCS_SYSID (`accept_packet`)."""
    ground = booted()
    ground.take_off()
    ground.param("MAV_OPTIONS", enforced)
    ground.encoder = Encoder(system, 190)
    ground.target(20.0, 0.0, 10.0)
    ground.run(8.0)
    assert bool(ground.fleet.position_m[0, 0] > 15.0) is flown


@pytest.mark.parametrize("alt_m", [math.nan, math.inf])
def test_impossible_targets_are_dropped(booted, alt_m):
    ground = booted()
    ground.take_off()
    ground.target(50.0, 0.0, alt_m)
    ground.run(3.0)
    assert np.isfinite(ground.fleet.position_m).all()
    assert abs(ground.fleet.position_m[0, 0]) < 0.1


def test_position_target_is_reported_as_amsl(booted):
    ground = booted()
    ground.take_off()
    ground.target(10.0, 0.0, 20.0)
    ground.ask("POSITION_TARGET_GLOBAL_INT", 5)
    ground.run(1.0)
    shown = ground.of("POSITION_TARGET_GLOBAL_INT")[-1]
    assert (shown["coordinate_frame"], shown["alt"]) == (0, 130.0)


def test_reposition_only_as_command_int_and_in_guided(booted):
    ground = booted()
    ground.take_off()
    lat, lon = 520722000, -6280000
    assert ground.command(192, 0, 0, 0, 0, lat, lon, 15.0) == 3
    assert ground.command(192, 0, 0, 0, 0, lat, lon, 15.0, form="INT", frame=1) == 2
    assert ground.command(192, 0, 0, 0, 0, lat, lon, math.nan, form="INT") == 2
    for frame in (0, 3, 5, 10, 11):  # MAVSDK sends frame 5
        assert ground.command(192, 0, 0, 0, 0, lat, lon, 503.0, form="INT", frame=frame) == 0
    assert ground.command(192, 0, 0, 0, 0, lat, lon, 15.0, form="INT") == 0
    ground.run(12.0)
    assert ground.fleet.lat_deg[0] == pytest.approx(52.0722, abs=3e-6)
    ground.mode(BRAKE)
    assert ground.command(192, 0, 0, 0, 0, lat, lon, 15.0, form="INT") == 2
    assert ground.command(192, 0, 1, 0, 0, lat, lon, 15.0, form="INT") == 0
    assert ground.fleet.mode[0] == GUIDED


@pytest.mark.parametrize("name", ["MISSION_ITEM", "MISSION_ITEM_INT"])
def test_a_guided_item_is_flown_to_at_once_as_dronekit_sends_it(booted, name):
    ground = booted()
    ground.take_off()
    scale = 1e7 if name == "MISSION_ITEM_INT" else 1.0
    place = {"x": 52.0722 * scale, "y": -0.628 * scale}
    if name == "MISSION_ITEM_INT":
        place = {axis: round(value) for axis, value in place.items()}
    item = {"seq": 0, "frame": 3, "command": 16, "current": 2, "autocontinue": 0, "z": 15.0, **place}
    ground.say(name, **item)
    ground.run(12.0)
    assert ground.of("MISSION_ACK")[-1]["type"] == 0
    assert ground.fleet.lat_deg[0] == pytest.approx(52.0722, abs=1e-5)
    assert ground.fleet.mode[0] == GUIDED
    ground.mode(BRAKE)
    ground.say(name, **item)
    ground.run(0.2)
    assert ground.of("MISSION_ACK")[-1]["type"] == 1, "only in GUIDED"


def test_the_old_request_for_the_version_is_answered(booted):
    ground = booted()
    before = len(ground.of("AUTOPILOT_VERSION"))
    ground.say("AUTOPILOT_VERSION_REQUEST")
    ground.run(0.2)
    assert len(ground.of("AUTOPILOT_VERSION")) == before + 1


def test_change_speed_holds_at_once(booted):
    ground = booted()
    ground.take_off()
    assert ground.command(178, 1, 5.0) == 0
    ground.target(200.0, 0.0, 15.0)
    ground.run(8.0)
    assert speed(ground) == pytest.approx(5.0, abs=0.01)


def test_brake_stops_within_20_m(booted):
    ground = booted()
    ground.take_off()
    ground.target(300.0, 0.0, 15.0)
    ground.run(8.0)
    start = ground.fleet.position_m[0, 0]
    ground.mode(BRAKE)
    ground.run(8.0)
    assert speed(ground) < 0.05
    assert ground.fleet.position_m[0, 0] - start < 26.0


def test_land_disarms_after_touch_down(booted):
    ground = booted()
    ground.take_off()
    ground.ask("EXTENDED_SYS_STATE", 20)
    assert ground.mode(LAND) == 0
    since = ground.fleet.now_s
    ground.run(24.0)
    assert ground.fleet.armed[0]
    assert ground.of("EXTENDED_SYS_STATE")[-1]["landed_state"] == 4
    ground.run(6.0)
    assert not ground.fleet.armed[0]
    assert ground.texts(since_s=since) == ["Disarming motors"]
    assert ground.fleet.alt_rel_m[0] == 0.0


def test_return_climbs_flies_home_waits_and_lands_there(booted):
    ground = booted()
    ground.take_off(8.0)
    ground.target(60.0, 30.0, 8.0)
    ground.run(15.0)
    ground.mode(RTL)
    highest = 0.0
    for _ in range(80):
        ground.run(1.0)
        highest = max(highest, ground.fleet.alt_rel_m[0])
    assert highest == pytest.approx(15.0, abs=0.5)
    assert not ground.fleet.armed[0]
    assert np.hypot(*ground.fleet.position_m[0, :2]) < 0.5


def test_return_keeps_a_greater_height(booted):
    ground = booted()
    ground.take_off(40.0)
    ground.target(50.0, 0.0, 40.0)
    ground.run(12.0)
    ground.mode(RTL)
    ground.run(8.0)
    assert ground.fleet.alt_rel_m[0] == pytest.approx(40.0, abs=0.5)


def test_loiter_with_the_throttle_stick_down_sinks(booted):
    ground = booted()
    ground.take_off(30.0)
    ground.mode(LOITER)
    ground.run(6.0)
    assert ground.fleet.alt_rel_m[0] < 18.0


def test_flies_again_after_landing(booted):
    ground = booted()
    ground.take_off()
    ground.mode(LAND)
    ground.run(32.0)
    assert not ground.fleet.armed[0]
    ground.take_off(20.0)


def test_gcs_failsafe_returns_and_says_so(booted):
    ground = booted()
    ground.say("PARAM_SET", param_id=b"FS_GCS_ENABLE", param_value=1.0, param_type=2)
    ground.take_off()
    ground.say("HEARTBEAT", type=6)
    ground.run(4.5)
    assert ground.fleet.mode[0] == GUIDED
    ground.encoder.system = 250
    ground.say("HEARTBEAT", type=6)
    ground.run(1.0)
    assert "GCS Failsafe" in ground.texts()
    assert ground.fleet.mode[0] == RTL
    ground.run(1.1)
    assert ground.of("HEARTBEAT")[-1]["system_status"] == 5
    ground.encoder.system = 254
    ground.say("HEARTBEAT", type=6)
    ground.run(1.1)
    assert ground.texts()[-1] == "GCS Failsafe Cleared"
    assert ground.fleet.mode[0] == RTL


def test_gcs_failsafe_is_off_by_default(booted):
    ground = booted()
    ground.say("HEARTBEAT", type=6)
    ground.take_off()
    ground.run(10.0)
    assert ground.fleet.mode[0] == GUIDED


def test_battery_lasts_about_20_minutes(booted):
    ground = booted()
    ground.take_off()
    ground.ask("SYS_STATUS", 1)
    ground.run(120.0, tick_s=0.1)
    status = ground.of("SYS_STATUS")[-1]
    assert 87 <= status["battery_remaining"] <= 91
    assert (status["voltage_battery"], status["current_battery"]) == (12600, 2800)
