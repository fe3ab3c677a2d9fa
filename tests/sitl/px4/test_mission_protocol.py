"""Missions, fences and rally points as real PX4 takes, judges and keeps them."""

import math
from dataclasses import replace

import pytest

from sitl.common.missions import ALL, FENCE, MISSION, RALLY, Item
from sitl.launch.fleet import SimFleet
from tests.sitl.conftest import LAT_DEG, LON_DEG, Ground, specs
from tests.sitl.rigs.store_rig import HOME, Bench

LAT, LON = round(HOME[0] * 1e7), round(HOME[1] * 1e7)
NAN = math.nan
REFUSED, NOT_STARTED = False, True

RECORDED = [
    Item(22, 6, p4=NAN, x=473977433, y=85455942, z=15.0, current=1),
    Item(16, 6, p2=2.0, p4=NAN, x=473980127, y=85455942, z=15.0),
    Item(16, 6, p2=2.0, p4=NAN, x=473980127, y=85459259, z=15.0),
    Item(16, 6, p2=2.0, p4=NAN, x=473977433, y=85459259, z=15.0),
    Item(178, 2, 1.0, 4.0, -1.0),
    Item(20, 2),
]
RECORDED_ID = 4259293514
RECORDED_FENCE = [
    Item(5001, 0, p1=4.0, x=x, y=y)
    for x, y in ((473970246, 85445325), (473995399, 85445325), (473995399, 85482483), (473970246, 85482483))
]
RECORDED_FENCE_ID = 1519157689


def waypoint(north: int = 100, frame: int = 6, command: int = 16, z: float = 15.0, **more: float) -> Item:
    return Item(command, frame, x=LAT + north, y=LON, z=z, **more)


def mission(n: int = 3) -> list[Item]:
    return [waypoint(0, command=22), *(waypoint(100 * k) for k in range(1, n))]


def square(size: int = 20_000, north: int = 0, command: int = 5001) -> list[Item]:
    corners = [(-size, -size), (size, -size), (size, size), (-size, size)]
    return [Item(command, 0, p1=4.0, x=LAT + dx + north, y=LON + dy) for dx, dy in corners]


def circle(command: int = 5003, radius: float = 200.0, north: int = 0) -> Item:
    return Item(command, 0, p1=radius, x=LAT + north, y=LON)


@pytest.fixture
def px4():
    return Bench("px4")


def state(px4: Bench) -> tuple[int, bool]:
    """How many items there are, and whether they may be flown."""
    return len(px4.platform.plans.mission), px4.platform.plans.feasible


def test_it_asks_for_whole_numbers_and_gives_the_opaque_id_of_the_real_one(px4):
    assert px4.upload(MISSION, RECORDED) == 0
    assert [m["seq"] for m in px4.of("MISSION_REQUEST_INT")] == list(range(6))
    assert px4.last("MISSION_ACK")["opaque_id"] == RECORDED_ID
    assert px4.upload(FENCE, RECORDED_FENCE) == 0
    assert px4.last("MISSION_ACK")["opaque_id"] == RECORDED_FENCE_ID
    assert px4.platform.plans.ids == [RECORDED_ID, RECORDED_FENCE_ID, 0]
    back = px4.download(MISSION)
    assert px4.last("MISSION_COUNT")["opaque_id"] == RECORDED_ID
    assert repr(back) == repr(RECORDED)


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        (waypoint(frame=3, p1=1.0, p2=2.0, p3=3.0, p4=-90.0), waypoint(frame=6, p1=1.0, p2=2.0, p4=270.0)),
        (waypoint(frame=0), waypoint(frame=5)),
        (waypoint(frame=5), waypoint(frame=5)),
        (waypoint(command=21, p1=5.0, p2=1.6), waypoint(command=21, p2=1.0)),
        (waypoint(command=201, p1=3.0), waypoint(command=201)),
        (Item(177, 2, 1.7, 2.6, x=-353634427, y=7), Item(177, 2, 1.0, 2.0, x=-353634432, y=7)),
    ],
)
def test_what_comes_back(px4, sent, kept):
    px4.upload(MISSION, [sent])
    (back,) = px4.download(MISSION)
    assert replace(back, p4=round(back.p4, 6)) == kept


def test_it_asks_again_every_quarter_second_and_falls_silent_after_5_s(px4):
    px4.upload(MISSION, mission(), answer=lambda seq: seq < 1)
    px4.run(6.0)
    assert 18 <= len(px4.of("MISSION_REQUEST_INT")) - 1 <= 20
    assert not px4.of("MISSION_ACK")
    px4.forget()
    px4.run(5.0)
    assert not px4.heard
    assert px4.upload(MISSION, mission()) == 0


@pytest.mark.parametrize(
    ("bad", "result"),
    [(waypoint(command=9999), 3), (waypoint(frame=10), 2), (Item(5001, 0, p1=4.0, x=LAT, y=LON), 1)],
)
def test_a_failed_upload_changes_nothing(px4, bad, result):
    px4.upload(MISSION, RECORDED)
    items = mission(4)
    items[2] = bad
    assert px4.upload(MISSION, items) == result
    assert px4.last("MISSION_ACK")["opaque_id"] == 0
    assert len(px4.download(MISSION)) == len(RECORDED)
    assert px4.platform.plans.ids[MISSION] == RECORDED_ID


def test_only_the_item_that_was_asked_for_is_looked_at(px4):
    items = mission(3)
    px4.say("MISSION_COUNT", count=3, mission_type=MISSION)
    px4.forget()
    px4.say("MISSION_ITEM_INT", mission_type=MISSION, **items[2].fields(2))
    assert not px4.heard


def test_a_repeated_last_item_is_acknowledged_again(px4):
    px4.upload(MISSION, RECORDED)
    px4.forget()
    px4.say("MISSION_ITEM_INT", mission_type=MISSION, **RECORDED[5].fields(5))
    assert (px4.last("MISSION_ACK")["type"], px4.last("MISSION_ACK")["opaque_id"]) == (0, RECORDED_ID)
    px4.say("MISSION_ITEM_INT", mission_type=MISSION, **RECORDED[2].fields(2))
    assert px4.last("MISSION_ACK")["type"] == 1


@pytest.mark.parametrize(("kind", "most"), [(MISSION, 10_000), (FENCE, 64), (RALLY, 32)])
def test_too_many_are_no_space(px4, kind, most):
    px4.say("MISSION_COUNT", count=most + 1, mission_type=kind)
    assert px4.last("MISSION_ACK")["type"] == 4
    px4.say("MISSION_COUNT", count=most, mission_type=kind)
    assert px4.last("MISSION_REQUEST_INT")["seq"] == 0


def test_an_unknown_kind_has_no_space(px4):
    px4.say("MISSION_COUNT", count=3, mission_type=7)
    assert px4.last("MISSION_ACK")["type"] == 4


def test_one_transfer_at_a_time(px4):
    px4.upload(MISSION, mission(), answer=lambda seq: seq < 1)
    px4.say("MISSION_COUNT", system=250, count=2, mission_type=MISSION)
    assert px4.last("MISSION_ACK")["type"] == 1
    px4.say("MISSION_CLEAR_ALL", mission_type=MISSION)
    assert len(px4.of("MISSION_ACK")) == 1
    assert "WPM: IGN CLEAR CMD: Busy\t" in px4.texts()
    px4.say("MISSION_ACK", mission_type=MISSION, type=15)  # cancelled by us
    assert px4.upload(MISSION, mission()) == 0


def test_a_count_again_before_the_first_item_only_asks_again(px4):
    px4.say("MISSION_COUNT", count=3, mission_type=MISSION)
    px4.say("MISSION_COUNT", count=3, mission_type=MISSION)
    assert [m["seq"] for m in px4.of("MISSION_REQUEST_INT")] == [0, 0]
    assert not px4.of("MISSION_ACK")


def test_clear_255_clears_all_and_count_0_clears_one(px4):
    for kind, items in ((MISSION, mission()), (FENCE, square()), (RALLY, [waypoint(frame=3, command=5100)])):
        assert px4.upload(kind, items) == 0
    px4.say("MISSION_COUNT", count=0, mission_type=RALLY)
    assert (px4.last("MISSION_ACK")["type"], px4.platform.plans.rally) == (0, [])
    px4.say("MISSION_CLEAR_ALL", mission_type=ALL)
    assert px4.last("MISSION_ACK")["type"] == 0
    assert px4.platform.plans.ids == [0, 0, 0]
    assert state(px4) == (0, REFUSED)


def test_a_download_asks_in_turn_or_ends(px4):
    px4.upload(MISSION, mission(4))
    px4.forget()
    px4.say("MISSION_REQUEST_LIST", mission_type=MISSION)
    for seq in (0, 1, 1, 2):
        px4.say("MISSION_REQUEST_INT", mission_type=MISSION, seq=seq)
    assert [m["seq"] for m in px4.of("MISSION_ITEM_INT")] == [0, 1, 1, 2]
    px4.say("MISSION_REQUEST_INT", mission_type=MISSION, seq=0)
    assert px4.last("MISSION_ACK")["type"] == 1
    px4.forget()
    px4.say("MISSION_REQUEST_INT", mission_type=MISSION, seq=3)  # no transfer: silence
    assert not px4.heard


def test_old_requests_are_answered_with_degrees(px4):
    px4.upload(MISSION, mission())
    px4.say("MISSION_REQUEST_LIST", mission_type=MISSION)
    px4.say("MISSION_REQUEST", mission_type=MISSION, seq=0)
    assert px4.last("MISSION_ITEM")["frame"] == 3
    assert abs(px4.last("MISSION_ITEM")["x"] - HOME[0]) < 1e-5


class TestJudgement:
    def test_a_good_mission_may_be_flown_a_moment_after_the_acknowledgement(self, px4):
        px4.upload(MISSION, mission())
        assert state(px4) == (3, REFUSED)
        px4.run(0.2)
        assert state(px4) == (3, NOT_STARTED)
        assert not px4.of("EVENT")

    @pytest.mark.parametrize(
        ("items", "event"),
        [
            ([waypoint(), waypoint(command=22)], "navigator_mis_takeoff_not_first"),
            ([waypoint(command=21), waypoint()], "navigator_mis_starts_w_landing"),
            ([waypoint(command=22, z=-1.0)], "navigator_mis_takeoff_too_low"),
            ([waypoint(command=22, frame=0, z=400.0)], "navigator_mis_takeoff_too_low"),
            ([waypoint(2_000_000, command=22)], "navigator_mis_first_wp_far"),
        ],
    )
    def test_an_accepted_mission_is_refused_by_an_event_alone(self, px4, items, event):
        assert px4.upload(MISSION, items) == 0
        px4.run(0.2)
        assert state(px4) == (len(items), REFUSED)
        assert px4.events() == [event]
        assert not px4.texts()

    def test_a_waypoint_outside_the_fence_is_the_exception_with_a_text(self, px4):
        px4.upload(FENCE, square())
        px4.run(0.2)
        px4.upload(MISSION, [waypoint(0, command=22), waypoint(50_000)])
        px4.run(0.2)
        assert state(px4) == (2, REFUSED)
        assert px4.texts() == ["Geofence violation for waypoint 2\t"]
        assert px4.events() == ["navigator_mis_geofence_violation"]

    def test_everything_that_is_wrong_is_told(self, px4):
        px4.upload(FENCE, square())
        px4.run(0.2)
        px4.upload(MISSION, [waypoint(2_000_000, command=22)])
        px4.run(0.2)
        assert px4.events() == ["navigator_mis_first_wp_far", "navigator_mis_geofence_violation"]

    def test_a_new_fence_judges_the_mission_again(self, px4):
        px4.upload(MISSION, [waypoint(0, command=22), waypoint(50_000)])
        px4.run(0.2)
        assert state(px4)[1] == NOT_STARTED
        px4.upload(FENCE, square())
        px4.run(0.3)
        assert state(px4)[1] == REFUSED

    def test_the_same_plan_again_changes_nothing(self, px4):
        px4.upload(MISSION, mission())
        px4.run(0.2)
        assert px4.upload(MISSION, mission()) == 0
        assert state(px4)[1] == NOT_STARTED


class TestFence:
    def test_frames_come_back_as_5(self, px4):
        assert px4.upload(FENCE, [*square(), circle()]) == 0
        assert {item.frame for item in px4.download(FENCE)} == {5}

    def test_too_few_vertices_are_an_error(self, px4):
        assert px4.upload(FENCE, [replace(item, p1=2.0) for item in square()]) == 1

    def test_a_fence_that_does_not_contain_home_is_accepted_then_dropped(self, px4):
        assert px4.upload(FENCE, [*square(), *square(north=60_000)]) == 0
        px4.run(0.2)
        assert px4.texts() == ["Geofence invalid, doesn't contain Home position\t"]
        assert px4.events() == ["navigator_geofence_invalid_against_home"]
        assert len(px4.platform.plans.in_force) == 1
        assert len(px4.download(FENCE)) == 8

    def test_an_exclusion_must_not_contain_home(self, px4):
        px4.upload(FENCE, [*square(command=5002), *square(north=60_000, command=5002)])
        px4.run(0.2)
        assert [shape[0].x for shape in px4.platform.plans.in_force] == [square(north=60_000)[0].x]

    def test_polygon_then_circle_is_good(self, px4):
        px4.upload(FENCE, [*square(), circle()])
        px4.run(0.2)
        assert [len(shape) for shape in px4.platform.plans.in_force] == [4, 1]
        assert not px4.texts()

    def test_circle_then_polygon_is_said_to_be_invalid_three_times(self, px4):
        """PX4's bug: after a circle every vertex begins a polygon; those that run over the end contain nothing."""
        px4.upload(FENCE, [circle(), *square()])
        px4.run(0.2)
        assert [len(shape) for shape in px4.platform.plans.in_force] == [1, 4]
        assert px4.texts() == ["Geofence invalid, doesn't contain Home position\t"] * 3

    def test_circle_then_a_polygon_to_stay_out_of_loses_it_with_one_text(self, px4):
        px4.upload(FENCE, [circle(), *square(command=5002)])
        px4.run(0.2)
        assert px4.texts() == ["Geofence invalid, doesn't contain Home position\t"]


class TestRally:
    @pytest.mark.parametrize(("frame", "complaints"), [(0, 0), (3, 0), (5, 2), (6, 2)])
    def test_only_frames_0_and_3_are_good_the_others_are_complained_of_for_ever(self, px4, frame, complaints):
        assert px4.upload(RALLY, [waypoint(command=5100, frame=frame)]) == 0
        px4.run(5.0)
        assert not px4.texts()  # only once it is armed
        px4.platform.state.armed = True
        px4.run(4.5)
        assert px4.texts() == ["RTL: unsupported MAV_FRAME\t"] * complaints
        px4.say("MISSION_CLEAR_ALL", mission_type=RALLY)
        px4.forget()
        px4.run(5.0)
        assert not px4.texts()


def test_set_current(px4):
    px4.upload(MISSION, mission(4))
    px4.say("MISSION_SET_CURRENT", seq=2)
    assert px4.platform.plans.seq == 2
    px4.say("MISSION_SET_CURRENT", seq=4)
    assert px4.platform.plans.seq == 2
    assert px4.texts() == ["WPM: WP CURR CMD: Not in list\t"]


def test_mission_current_of_a_whole_vehicle_tells_refusal_and_ids():
    ground = Ground(SimFleet(specs(1, "px4")))
    ground.beat(4.0)

    def current() -> tuple[int, ...]:
        ground.beat(1.2)
        last = ground.of("MISSION_CURRENT")[-1]
        return last["total"], last["mission_state"], last["mission_id"]

    def put(items: list[Item]) -> int:
        ground.say("MISSION_COUNT", count=len(items), mission_type=MISSION)
        for seq, item in enumerate(items):
            ground.say("MISSION_ITEM_INT", mission_type=MISSION, **item.fields(seq))
        ground.listen()
        return ground.of("MISSION_ACK")[-1]["opaque_id"]

    home = {"x": round(LAT_DEG * 1e7), "y": round(LON_DEG * 1e7), "z": 15.0}
    assert current() == (65535, 1, 0)
    bad_id = put([Item(16, **home), Item(22, **home)])
    assert current() == (2, 1, bad_id)
    assert ground.command(300) == 2
    good_id = put([Item(22, **home), Item(16, **home)])
    assert current() == (2, 2, good_id)
    assert bad_id != good_id
