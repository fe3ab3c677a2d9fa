"""PX4: double acknowledgements, arming, take-off, reposition, return, landing."""

import math

import pytest

from sitl.px4.modes import LAND, MISSION, OFFBOARD, ORBIT, RTL, TAKEOFF
from tests.sitl.conftest import HOLD, px4_take_off

AUTO, OFFBOARD_MAIN = 4, 6
INT_MAX = 2**31 - 1


def amsl(ground, alt_m, index=0):
    return ground.fleet.specs[index].ground_amsl_m + alt_m


def reposition(ground, east_m, north_m, alt_m, *, flags=1, speed=-1.0, yaw=math.nan, frame=0):
    lat, lon = ground.fleet._pilots[0].platform.body.to_geodetic(east_m, north_m)
    return ground.command(
        192, speed, flags, 0, yaw, round(lat * 1e7), round(lon * 1e7), amsl(ground, alt_m), form="INT", frame=frame
    )


def test_do_set_mode_is_acknowledged_twice_the_first_time_always_accepted(px4):
    ground = px4()
    assert ground.acks(176, 1, OFFBOARD_MAIN) == [0, 0]
    assert ground.acks(176, 1, AUTO, 3) == [0, 0]
    px4_take_off(ground)
    assert ground.acks(176, 1, OFFBOARD_MAIN) == [0, 1], "no stream"
    assert ground.fleet.mode[0] == HOLD
    assert "Switching to Offboard is currently not available\t" in ground.texts()
    assert ground.acks(176, 1, 77) == [0, 1]
    assert "Unsupported main mode\t" in ground.texts()


def test_the_second_answer_comes_later_than_the_first(px4):
    ground = px4()
    since = len(ground.heard)
    ground.command(176, 1, OFFBOARD_MAIN)
    assert [f.name for _, _, f in ground.heard[since:]] == ["COMMAND_ACK"]
    ground.run(0.05)
    assert [f.name for _, _, f in ground.heard[since:]].count("COMMAND_ACK") == 2


def test_legacy_set_mode_has_one_true_answer(px4):
    ground = px4()
    px4_take_off(ground)
    since = ground.fleet.now_s
    ground.say("SET_MODE", base_mode=1, custom_mode=OFFBOARD)
    ground.run(0.2)
    acks = [(a["command"], a["result"]) for a in ground.of("COMMAND_ACK", since_s=since)]
    assert acks == [(176, 1)]


@pytest.mark.parametrize(("main", "sub", "mode"), [(6, 0, OFFBOARD), (4, 4, MISSION), (3, 0, 3 << 16), (4, 5, RTL)])
def test_on_the_ground_every_mode_is_taken_and_arming_refused_where_it_cannot_be_flown(px4, main, sub, mode):
    ground = px4()
    assert ground.acks(176, 1, main, sub) == [0, 0]
    assert ground.fleet.mode[0] == mode
    ground.beat(1.0)
    assert ground.of("HEARTBEAT")[-1]["system_status"] == (3 if mode == RTL else 0)
    assert ground.command(400, 1) == (0 if mode == RTL else 1)


def test_force_skips_no_check(px4):
    ground = px4()
    ground.acks(176, 1, OFFBOARD_MAIN)
    assert ground.command(400, 1, 21196) == 1
    assert not ground.fleet.armed[0]


def test_take_off_is_amsl_climbs_1_5_m_s_and_ends_in_hold(px4):
    ground = px4()
    assert ground.command(400, 1) == 0
    assert ground.command(22, 0, 0, 0, math.nan, math.nan, math.nan, amsl(ground, 20.0)) == 0
    assert ground.fleet.mode[0] == TAKEOFF
    ground.beat(6.0)
    assert ground.fleet.velocity_m_s[0, 2] == pytest.approx(1.5, abs=0.05)
    assert ground.of("EXTENDED_SYS_STATE")[-1]["landed_state"] == 3
    ground.beat(11.0)
    assert ground.fleet.mode[0] == HOLD
    assert ground.fleet.alt_rel_m[0] == pytest.approx(20.0, abs=0.5)
    assert "Takeoff detected\t" in ground.texts()
    assert ground.of("EXTENDED_SYS_STATE")[-1]["landed_state"] == 2


def test_take_off_without_an_altitude_is_2_5_m(px4):
    ground = px4()
    ground.command(400, 1)
    ground.command(22, 0, 0, 0, math.nan, math.nan, math.nan, math.nan)
    ground.beat(8.0)
    assert ground.fleet.alt_rel_m[0] == pytest.approx(2.5, abs=0.3)
    assert "Using default takeoff altitude: 2.5 m\t" in ground.texts()


def test_take_off_first_then_arm_works_too(px4):
    ground = px4()
    assert ground.command(22, 0, 0, 0, math.nan, math.nan, math.nan, amsl(ground, 5.0)) == 0
    assert ground.command(400, 1) == 0
    ground.beat(8.0)
    assert ground.fleet.alt_rel_m[0] == pytest.approx(5.0, abs=0.5)


def test_armed_and_left_alone_it_disarms_after_10_s(px4):
    ground = px4()
    ground.command(400, 1)
    ground.beat(9.0)
    assert ground.fleet.armed[0]
    ground.beat(2.0)
    assert not ground.fleet.armed[0]
    assert "Disarmed by auto preflight disarming\t" in ground.texts()


def test_disarming_in_the_air_needs_force(px4):
    ground = px4()
    px4_take_off(ground)
    assert ground.command(400, 0) == 1
    assert ground.fleet.armed[0]
    assert ground.command(400, 0, 21196) == 0
    assert not ground.fleet.armed[0]


@pytest.mark.parametrize(("flags", "result"), [(0, 3), (1, 0), (2, 3), (3, 3)])
def test_reposition_wants_flags_of_exactly_1(px4, flags, result):
    ground = px4()
    px4_take_off(ground)
    assert reposition(ground, 20, 0, 15, flags=flags) == result


def test_reposition_ignores_the_frame(px4):
    """Relative 12 m is flown as 12 m above the sea: down into the ground."""
    ground = px4()
    px4_take_off(ground)
    lat, lon = ground.fleet._pilots[0].platform.body.to_geodetic(0.0, 0.0)
    assert ground.command(192, -1, 1, 0, math.nan, round(lat * 1e7), round(lon * 1e7), 12.0, form="INT", frame=6) == 0
    ground.beat(6.0)
    assert 5.0 < ground.fleet.alt_rel_m[0] < 10.0
    assert ground.fleet.velocity_m_s[0, 2] < -1.0


def test_reposition_flies_there_at_the_speed_asked_for_and_stops(px4):
    ground = px4()
    px4_take_off(ground)
    assert reposition(ground, 80.0, 0.0, 18.0, speed=8.0) == 0
    ground.beat(7.0)
    assert 6.0 < ground.fleet.velocity_m_s[0, 0] < 8.5
    ground.beat(20.0)
    assert ground.fleet.position_m[0] == pytest.approx([80.0, 0.0, 18.0], abs=0.5)
    assert ground.fleet.mode[0] == HOLD


def test_the_mode_it_has_already_does_not_stop_a_reposition(px4):
    """Seen on 1.16.1: told to hold at 8 m/s it flew the remaining 77 m."""
    ground = px4()
    px4_take_off(ground)
    reposition(ground, 80.0, 0.0, 15.0, speed=8.0)
    ground.run(4.0)
    assert ground.acks(176, 1, AUTO, 3) == [0, 0]
    ground.run(20.0)
    assert abs(ground.fleet.position_m[0, 0] - 80.0) < 1.0


def test_reposition_without_a_place_changes_the_height_only(px4):
    ground = px4()
    px4_take_off(ground)
    assert ground.command(192, -1, 1, 0, 0, INT_MAX, INT_MAX, amsl(ground, 20), form="INT") == 0
    ground.beat(8.0)
    assert ground.fleet.position_m[0] == pytest.approx([0.0, 0.0, 20.0], abs=0.4)


def test_reposition_of_a_disarmed_vehicle_is_accepted_and_nothing_happens(px4):
    ground = px4()
    assert reposition(ground, 20, 0, 15) == 0
    ground.beat(5.0)
    assert not ground.fleet.armed[0] and abs(ground.fleet.position_m[0]).max() == 0.0


def test_return_climbs_flies_home_lands_and_disarms_and_the_mode_before_is_back(px4):
    ground = px4()
    px4_take_off(ground)
    reposition(ground, 50.0, 20.0, 15.0)
    ground.beat(20.0)
    assert ground.command(20) == 0
    assert ground.fleet.mode[0] == RTL
    highest = 0.0
    for _ in range(80):
        ground.beat(1.0, tick_s=0.1)
        highest = max(highest, ground.fleet.alt_rel_m[0])
    assert highest == pytest.approx(30.0, abs=0.6)
    assert not ground.fleet.armed[0]
    assert ground.fleet.position_m[0] == pytest.approx([0.0, 0.0, 0.0], abs=0.5)
    assert ground.fleet.mode[0] == HOLD
    said = "".join(ground.texts())
    for text in ("Returning to launch\t", "30 m above destination)\t", "RTL: land at destination\t"):
        assert text in said


def test_return_by_mode_is_done_without_a_word(px4):
    ground = px4()
    px4_take_off(ground)
    since = ground.fleet.now_s
    assert ground.acks(176, 1, AUTO, 5) == [0, 0]
    assert ground.fleet.mode[0] == RTL
    assert "Returning to launch\t" not in ground.texts(since_s=since)
    assert ground.acks(176, 0, AUTO, 3) == [0, 0], "without the custom bit it is accepted, and nothing happens"
    assert ground.fleet.mode[0] == RTL


def test_disarms_2_s_after_landing_is_detected(px4):
    ground = px4()
    px4_take_off(ground, 6.0)
    assert ground.command(21) == 0
    assert ground.fleet.mode[0] == LAND
    ground.beat(20.0)
    at = {text: t for t, _, f in ground.heard if f.name == "STATUSTEXT" for text in [f.fields["text"].rstrip(b"\0")]}
    assert at[b"Disarmed by landing\t"] - at[b"Landing detected\t"] == pytest.approx(2.0, abs=0.1)


def test_orbit_is_flown_slower_and_wider_than_asked_for(px4):
    """Measured: radius 60 m at 8 m/s is flown at 7.05 m/s, 1.6 m outside."""
    ground = px4()
    px4_take_off(ground)
    reposition(ground, 60.0, 0.0, 15.0, speed=8.0)
    ground.beat(20.0)
    lat, lon = ground.fleet._pilots[0].platform.body.to_geodetic(0.0, 0.0)
    asked = (round(lat * 1e7), round(lon * 1e7), amsl(ground, 15.0))
    assert ground.command(34, 60.0, 8.0, 0, math.nan, *asked, form="INT") == 0
    assert ground.fleet.mode[0] == ORBIT
    ground.beat(30.0)
    x, y, _ = ground.fleet.position_m[0]
    assert math.hypot(x, y) - 60.0 == pytest.approx(1.7, abs=0.5)
    assert math.hypot(*ground.fleet.velocity_m_s[0, :2]) == pytest.approx(7.2, abs=0.3)
    assert ground.of("ORBIT_EXECUTION_STATUS")[-1]["radius"] == 60.0
    assert ground.of("HEARTBEAT")[-1]["base_mode"] == 0x91
    ground.acks(176, 1, AUTO, 3)
    assert ground.fleet.mode[0] == HOLD


@pytest.mark.parametrize(("command", "result"), [(115, 3), (193, 3), (224, 3), (178, 0), (246, 2), (9999, 3)])
def test_what_it_does_not_know(px4, command, result):
    ground = px4()
    px4_take_off(ground, 5.0)
    assert ground.command(command, 1.0) == result


@pytest.mark.parametrize("command", [195, 196, 197, 201])
def test_a_region_of_interest_is_accepted_everywhere_and_turns_nothing(px4, command):
    ground = px4()
    assert ground.command(command, 0, 0, 0, 0, 52.08, -0.628, 100.0) == 0
    px4_take_off(ground, 5.0)
    yaw = float(ground.fleet._vehicles.yaw_rad[0])
    assert ground.command(command, 0, 0, 0, 0, 520_800_000, -6_280_000, 100.0, form="INT", frame=0) == 0
    ground.beat(5.0)
    assert float(ground.fleet._vehicles.yaw_rad[0]) == pytest.approx(yaw)


def test_arming_and_disarming_are_told_with_the_log_and_the_checks_that_change(px4):
    """As on the real 1.16.1; the first arming after a boot finds a log open (recorded: one EVENT)."""
    checks = ["commander_arming_check_summary", "check_modes_mission", "check_modes_offboard_signal"]
    checks += ["check_modes_manual_control", "commander_health_summary"]
    ground = px4()
    ground.beat(3.0)
    said = []
    for arm, wait_s in ((1, 3.0), (0, 6.0), (1, 3.0), (0, 6.0)):
        since_s = ground.fleet.now_s
        assert ground.acks(400, arm) == [0]
        ground.beat(wait_s)
        said.append(ground.events(since_s=since_s))
    assert said[0] == ["commander_armed_by"]
    assert said[1] == said[3] == ["commander_disarmed_by", *checks]
    assert said[2] == ["commander_armed_by", "logger_open_file_time", *checks]


def test_mission_start_without_a_mission_is_denied(px4):
    ground = px4()
    assert ground.command(300) == 2


def test_without_position_it_is_not_ready(px4):
    ground = px4()
    ground.fleet.break_gps(0)
    ground.beat(8.0)
    assert ground.command(400, 1) == 1
    assert ground.of("GPS_RAW_INT")[-1]["fix_type"] == 0
    assert "check_estimator_gps_fix_too_low" in ground.events()
    ground.fleet.mend_gps(0)
    ground.beat(3.0)
    assert ground.command(400, 1) == 0
