"""Stored missions, flown by both autopilots."""

import math

import pytest

from sitl.common.missions import FENCE, MISSION
from sitl.px4.modes import MISSION as PX4_MISSION
from sitl.px4.modes import RTL
from tests.sitl.conftest import HOLD, px4_take_off

WAYPOINT, LOITER, RETURN, LAND, TAKEOFF, JUMP, SPEED = 16, 17, 20, 21, 22, 177, 178
AUTO, GUIDED = 3, 4


def legs(ground, *, home):
    """Take-off, three corners, return; with ArduPilot's place holder for home."""
    items = [
        ground.item(TAKEOFF, z=12.0),
        ground.item(WAYPOINT, 30.0, 0.0, 12.0),
        ground.item(WAYPOINT, 30.0, 30.0, 15.0, p1=2.0),
        ground.item(WAYPOINT, 0.0, 30.0, 15.0),
        ground.item(RETURN, frame=2),
    ]
    return [ground.item(WAYPOINT, frame=0), *items] if home else items


def visited(ground, places, seconds, **how):
    """How near it came to each place."""
    nearest = [1e9] * len(places)
    for _ in range(round(seconds)):
        ground.beat(1.0, **how)
        x, y, z = ground.fleet.position_m[0]
        nearest = [min(was, math.dist((x, y, z), place)) for was, place in zip(nearest, places, strict=True)]
    return nearest


def copter_in_auto(ground):
    assert ground.upload(MISSION, legs(ground, home=True)) == 0
    ground.take_off(8.0)
    assert ground.mode(AUTO) == 0
    assert ground.command(300) == 0


def test_copter_flies_its_mission_and_disarms_still_in_auto(booted):
    ground = booted()
    copter_in_auto(ground)
    near = visited(ground, [(30, 0, 12), (30, 30, 15), (0, 30, 15)], 40)
    assert max(near) < 8.0
    ground.run(60.0)
    assert not ground.fleet.armed[0]
    assert ground.fleet.mode[0] == AUTO
    reached = [m["seq"] for m in ground.of("MISSION_ITEM_REACHED")]
    assert reached == [1, 2, 3, 4]
    said = ground.texts()
    order = ["Mission: 1 Takeoff", "Mission: 2 WP", "Mission: 3 WP", "Mission: 4 WP", "Mission: 5 RTL"]
    assert [t for t in said if t.startswith("Mission:")] == order
    assert [t for t in said if t.startswith("Reached")] == ["Reached command #3"], "only delayed and last ones"


def test_copter_counts_without_home_and_says_its_state_only_in_auto(booted):
    ground = booted()
    assert ground.upload(MISSION, legs(ground, home=True)) == 0

    def current():
        ground.command(512, 42)
        return ground.of("MISSION_CURRENT")[-1]

    assert (current()["total"], current()["mission_state"]) == (5, 2)
    ground.take_off(8.0)
    ground.mode(AUTO)
    assert (current()["mission_state"], current()["mission_mode"]) == (3, 1)
    assert ground.command(193, 0) == 0
    assert current()["mission_state"] == 4
    ground.run(6.0)
    stopped = ground.fleet.position_m[0].copy()
    ground.run(2.0)
    assert math.dist(stopped, ground.fleet.position_m[0]) < 0.5
    assert ground.command(193, 1) == 0
    assert current()["mission_state"] == 3
    ground.run(4.0)
    assert math.dist(stopped, ground.fleet.position_m[0]) > 5.0
    ground.mode(GUIDED)
    assert (current()["mission_state"], current()["mission_mode"]) == (2, 0)
    seq = current()["seq"]
    ground.mode(AUTO)
    assert current()["seq"] == seq, "it resumes the same item"


def test_copter_jumps_by_command_and_by_message(booted):
    ground = booted()
    copter_in_auto(ground)
    ground.run(2.0)
    assert ground.command(224, 4) == 0
    assert ground.texts()[-1] == "Mission: 4 WP"
    assert ground.command(224, 99) == 2
    ground.say("MISSION_SET_CURRENT", seq=0)
    ground.listen()
    assert ground.texts()[-1] == "Mission: 1 Takeoff", "0 means 1"
    since = len(ground.heard)
    ground.say("MISSION_SET_CURRENT", seq=99)
    ground.listen()
    assert ground.heard[since:] == []


def test_copter_in_auto_takes_an_upload_live_item_by_item(booted):
    ground = booted()
    copter_in_auto(ground)
    ground.run(5.0)
    moved = legs(ground, home=True)
    moved[2] = ground.item(WAYPOINT, -40.0, 0.0, 12.0)
    assert ground.upload(MISSION, moved) == 0
    assert ground.texts().count("Auto mission changed, restarted command") >= 2
    ground.run(6.0)
    assert ground.fleet.velocity_m_s[0, 0] < -1.0


def test_copter_refuses_auto_without_a_mission_in_the_air_and_arming_in_auto(booted):
    ground = booted()
    assert ground.mode(AUTO) == 0
    assert ground.answers(400, 1) == ["ack 4", "2 Arm: Mode requires mission"]
    assert ground.upload(MISSION, legs(ground, home=True)) == 0
    assert ground.answers(400, 1) == ["ack 4", "2 Arm: AUTO mode not armable"]
    ground.param("AUTO_OPTIONS", 3)
    assert ground.command(400, 1) == 0
    ground.run(2.0)
    assert ground.fleet.alt_rel_m[0] == 0.0, "nothing moves before MISSION_START"
    assert ground.command(300) == 0
    ground.run(5.0)
    assert ground.fleet.alt_rel_m[0] > 2.0


def test_copter_without_a_landing_sequence_says_so_in_chunks(booted):
    ground = booted()
    ground.take_off(8.0)
    since = ground.fleet.now_s
    assert ground.command(189) == 4
    chunks = [(c["id"], c["chunk_seq"]) for c in ground.of("STATUSTEXT", since_s=since)]
    assert chunks == [(0, 0), (1, 0), (1, 1)]
    assert ground.texts(since_s=since)[1:] == ["Mode change to AUTO RTL failed: No landing sequenc", "e found"]


def test_px4_mission_start_arms_flies_and_holds_at_its_end(px4):
    ground = px4()
    items = legs(ground, home=False)[:-1]
    assert ground.upload(MISSION, items) == 0
    assert ground.of("MISSION_CURRENT")[-1]["mission_state"] in (1, 2)
    assert ground.command(300) == 0
    assert ground.fleet.mode[0] == PX4_MISSION
    near = visited(ground, [(30, 0, 12), (30, 30, 15), (0, 30, 15)], 60)
    assert max(near) < 6.0
    assert list(dict.fromkeys(reached(ground))) == [0, 1, 2, 3]
    assert ground.fleet.mode[0] == HOLD
    assert ground.of("MISSION_CURRENT")[-1]["mission_state"] == 5
    for text in ("Executing Mission\t", "Climb to 12.0 meters above home\t", "Mission finished, loitering\t"):
        assert text in ground.texts()


def reached(ground):
    return [m["seq"] for m in ground.of("MISSION_ITEM_REACHED")]


def test_px4_reports_every_completed_item_commands_too_and_ten_times_more(px4):
    """MAVSDK counts a mission as flown when its last item is reported (mission_base.cpp, mavlink_mission.cpp)."""
    ground = px4()
    items = [
        ground.item(TAKEOFF, z=12.0),
        ground.item(SPEED, p1=1.0, p2=4.0, frame=2),
        ground.item(WAYPOINT, 20.0, 0.0, 12.0),
        ground.item(LAND),
    ]
    assert ground.upload(MISSION, items) == 0
    assert ground.command(300) == 0
    ground.beat(60.0)
    assert list(dict.fromkeys(reached(ground))) == [0, 1, 2, 3]
    assert reached(ground).count(1) > 1, "at 1 Hz until the next one is completed"
    assert reached(ground).count(3) == 11
    assert ground.of("MISSION_CURRENT")[-1]["mission_state"] == 5


def test_px4_repeats_nothing_of_a_mission_that_was_replaced(px4):
    """It would be taken for progress of the new one."""
    ground = px4()
    assert ground.upload(MISSION, [ground.item(TAKEOFF, z=8.0), ground.item(WAYPOINT, 10.0, 0.0, 8.0)]) == 0
    assert ground.command(300) == 0
    while 1 not in reached(ground):
        ground.beat(1.0)
    assert ground.upload(MISSION, [ground.item(WAYPOINT, 0.0, 20.0, 9.0), ground.item(LOITER, 5.0, 0.0, 8.0)]) == 0
    before = len(reached(ground))
    ground.beat(15.0)
    assert len(reached(ground)) == before


def test_px4_never_completes_an_item_to_loiter_without_an_end(px4):
    ground = px4()
    items = [ground.item(TAKEOFF, z=8.0), ground.item(LOITER, 10.0, 0.0, 8.0)]
    assert ground.upload(MISSION, items) == 0
    assert ground.command(300) == 0
    ground.beat(30.0)
    assert set(reached(ground)) == {0}
    assert reached(ground).count(0) == 11


def test_px4_pauses_by_hold_and_goes_on_with_the_same_item(px4):
    ground = px4()
    assert ground.upload(MISSION, legs(ground, home=False)) == 0
    px4_take_off(ground, 12.0)
    assert ground.acks(176, 1, 4, 4) == [0, 0]
    ground.beat(4.0)
    assert ground.of("MISSION_CURRENT")[-1]["mission_state"] == 3
    seq = ground.of("MISSION_CURRENT")[-1]["seq"]
    ground.acks(176, 1, 4, 3)
    ground.beat(3.0)
    paused = ground.of("MISSION_CURRENT")[-1]
    assert (paused["mission_state"], paused["mission_mode"], paused["seq"]) == (2, 2, seq)
    ground.acks(176, 1, 4, 4)
    assert ground.command(512, 42) == 0
    assert ground.of("MISSION_CURRENT")[-1]["seq"] == seq
    assert ground.command(224, 1) == 3
    ground.say("MISSION_SET_CURRENT", seq=3)
    ground.beat(2.0)
    assert ground.of("MISSION_CURRENT")[-1]["seq"] == 3


def test_px4_returns_and_lands_by_its_mission(px4):
    ground = px4()
    assert ground.upload(MISSION, legs(ground, home=False)) == 0
    assert ground.command(300) == 0
    ground.beat(110.0, tick_s=0.1)
    assert not ground.fleet.armed[0]
    assert ground.fleet.position_m[0] == pytest.approx([0.0, 0.0, 0.0], abs=1.0)


def test_px4_infeasible_missions_are_accepted_and_not_flown(px4):
    ground = px4()
    items = [ground.item(WAYPOINT, 10.0, 0.0, 10.0), ground.item(TAKEOFF, z=10.0)]
    assert ground.upload(MISSION, items) == 0
    ground.beat(1.0)
    current = ground.of("MISSION_CURRENT")[-1]
    assert (current["mission_state"], current["total"]) == (1, 2)
    assert ground.command(300) == 2


def test_jumps_are_counted(booted):
    ground = booted()
    items = [
        ground.item(WAYPOINT, frame=0),
        ground.item(WAYPOINT, 12.0, 0.0, 8.0),
        ground.item(WAYPOINT, 0.0, 0.0, 8.0),
        ground.item(JUMP, p1=1.0, p2=2.0, frame=2),
    ]
    assert ground.upload(MISSION, items) == 0
    ground.take_off(8.0)
    ground.mode(AUTO)
    ground.run(70.0)
    assert [m["seq"] for m in ground.of("MISSION_ITEM_REACHED")] == [1, 2] * 3


def square(ground, size_m, command=5001):
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    return [ground.item(command, size_m * x, size_m * y, frame=0, p1=4.0) for x, y in corners]


def test_copter_drops_targets_outside_its_fence_without_a_word(booted):
    ground = booted()
    assert ground.upload(FENCE, square(ground, 40.0)) == 0
    ground.take_off(10.0)
    ground.target(60.0, 0.0, 10.0)
    ground.run(3.0)
    assert ground.fleet.position_m[0, 0] > 10.0, "the fence is off"
    assert ground.command(207, 1) == 0
    ground.target(0.0, 0.0, 10.0)
    ground.run(12.0)
    since = ground.fleet.now_s
    ground.target(60.0, 0.0, 10.0)
    ground.run(3.0)
    assert abs(ground.fleet.position_m[0, 0]) < 0.5
    assert ground.texts(since_s=since) == []
    assert ground.fleet._pilots[0].platform.params["FENCE_ENABLE"] == 0, "the parameter does not show it"


def test_copter_outside_its_fence_returns(booted):
    ground = booted()
    assert ground.upload(FENCE, square(ground, 30.0)) == 0
    ground.param("FENCE_RADIUS", 30.0)
    ground.param("FENCE_ENABLE", 1)
    ground.take_off(10.0)
    for _ in range(60):
        ground.target(0.0, 0.0, 10.0, (6.0, 0.0, 0.0), 0xDC7)
        ground.run(0.2)
        if ground.fleet.mode[0] == 6:
            break
    assert ground.fleet.mode[0] == 6
    assert any(text.endswith("fences breached") or text.endswith("fence breached") for text in ground.texts())
    ground.command(512, 162)
    assert ground.of("FENCE_STATUS")[-1]["breach_status"] == 1
    ground.run(20.0)
    assert "Fence breach cleared" in ground.texts()


def test_copter_brakes_before_its_fence_creeps_out_and_returns(booted):
    """As the real one against a circle of 40 m: 0.3 m/s at 38.2 m, then up to 2 m/s, at most 41.1 m."""
    ground = booted()
    for name, value in (("FENCE_RADIUS", 40.0), ("FENCE_TYPE", 2), ("FENCE_ENABLE", 1)):
        ground.param(name, value)
    ground.take_off(10.0)
    seen = []
    for _ in range(100):
        ground.target(0.0, 0.0, 10.0, (5.0, 0.0, 0.0), 0xDC7)
        ground.run(0.2)
        seen.append((float(ground.fleet.position_m[0, 0]), float(ground.fleet._vehicles.velocity_m_s[0, 0])))
        if ground.fleet.mode[0] == 6:
            break
    assert max(v for x, v in seen if x < 30.0) == pytest.approx(5.0, abs=0.1), "far from it nothing is slower"
    assert min(v for x, v in seen if 37.0 < x < 38.5) < 0.6
    assert 1.5 < max(v for x, v in seen if x > 39.0) <= 2.1
    ground.run(10.0)
    assert ground.fleet.mode[0] == 6 and max(x for x, _ in seen) < 41.0 and ground.fleet.position_m[0, 0] < 38.0


def test_px4_accepts_a_reposition_outside_its_fence_and_stays(px4):
    ground = px4()
    assert ground.upload(FENCE, square(ground, 40.0)) == 0
    px4_take_off(ground)
    lat, lon = ground.fleet._pilots[0].platform.body.to_geodetic(60.0, 0.0)
    asked = (round(lat * 1e7), round(lon * 1e7), ground.fleet.specs[0].ground_amsl_m + 15.0)
    assert ground.command(192, -1, 1, 0, math.nan, *asked, form="INT") == 0
    ground.beat(8.0)
    assert abs(ground.fleet.position_m[0, 0]) < 0.5
    assert "Reposition is outside geofence\t" in ground.texts()


def test_px4_outside_its_fence_holds(px4):
    ground = px4()
    assert ground.upload(FENCE, square(ground, 30.0)) == 0
    px4_take_off(ground)

    def fly(seconds):
        for k in range(round(seconds * 10)):
            if k % 10 == 0:
                ground.say("HEARTBEAT", type=6)
            mask = 0b110111000111
            ground.say("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=mask, vy=6.0)
            ground.run(0.1)

    fly(1.5)
    assert ground.acks(176, 1, 6) == [0, 0]
    fly(12.0)
    assert ground.fleet.mode[0] == HOLD
    assert 30.0 < ground.fleet.position_m[0, 0] < 50.0
    assert "Geofence: approaching or outside geofence\t" in ground.texts()
    assert ground.acks(176, 1, 6) == [0, 0], "chosen again while outside, it is taken"
    fly(2.0)
    assert ground.fleet.mode[0] not in (HOLD, RTL)
