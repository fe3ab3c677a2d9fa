"""Missions, fences and rally points as real ArduCopter takes and keeps them."""

import math
from dataclasses import replace

import pytest

from sitl.common.missions import ALL, FENCE, MISSION, RALLY, Item
from tests.sitl.rigs.store_rig import HOME, Bench

LAT, LON = round(HOME[0] * 1e7), round(HOME[1] * 1e7)
OPERATION_CANCELLED = 15


def waypoint(north: int = 0, z: float = 15.0, frame: int = 6, command: int = 16, **more: float) -> Item:
    return Item(command, frame, x=LAT + north, y=LON, z=z, **more)


def mission(n: int) -> list[Item]:
    """Home and n - 1 waypoints."""
    return [waypoint(frame=0, z=0.0), *(waypoint(100 * k) for k in range(1, n))]


def square(frame: int = 0, size: int = 20_000, command: int = 5001, vertices: int = 4) -> list[Item]:
    corners = [(-size, -size), (size, -size), (size, size), (-size, size)]
    return [Item(command, frame, p1=vertices, x=LAT + dx, y=LON + dy) for dx, dy in corners]


@pytest.fixture
def copter():
    return Bench("ardupilot")


def test_it_asks_with_the_old_request_and_acknowledges_without_opaque_id(copter):
    assert copter.upload(MISSION, mission(7)) == 0
    assert [m["seq"] for m in copter.of("MISSION_REQUEST")] == list(range(7))
    assert not copter.of("MISSION_REQUEST_INT")
    assert copter.last("MISSION_ACK")["opaque_id"] == 0
    assert copter.texts() == ["Flight plan received"]
    assert copter.platform.params["MIS_TOTAL"] == 7


def test_item_0_is_the_real_home_whatever_was_sent(copter):
    items = mission(3)
    items[0] = replace(items[0], x=1, y=2, z=3.0, frame=6)
    assert copter.upload(MISSION, items) == 0
    home = copter.download(MISSION)[0]
    assert (home.frame, home.x, home.y, home.z) == (0, LAT, LON, HOME[2])


@pytest.mark.parametrize(("sent", "kept"), [(6, 3), (3, 3), (2, 0), (0, 0), (5, 0), (11, 10)])
def test_frames_come_back_without_int(copter, sent, kept):
    assert copter.upload(MISSION, [*mission(1), waypoint(frame=sent)]) == 0
    assert copter.download(MISSION)[1].frame == kept


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        (waypoint(p1=2.7, p2=3.0, p3=4.0, p4=90.0, z=15.004), waypoint(frame=3, p1=2.0, z=15.0)),
        (waypoint(command=22, p4=math.nan), waypoint(frame=3, command=22)),
        (waypoint(command=21, p4=math.nan), waypoint(frame=3, command=21, p4=1.0)),
        (Item(178, 2, 1.0, 6.0, -1.0, x=5, y=6, z=7.0), Item(178, 0, 1.0, 6.0, -1.0)),
        (Item(20, 2), Item(20, 0)),
        (waypoint(command=201, p1=1.7, p2=2.6), waypoint(frame=3, command=201, p1=1.0)),
        (Item(183, 2, 9.0, 1500.6, 3.0, 4.0), Item(183, 0, 9.0, 1500.0)),
        (Item(115, 3, 90.5, 10.5, -1.0, 1.0), Item(115, 0, 90.5, 10.5, -1.0, 1.0)),
        (Item(177, 2, 1.0, 3.0), Item(177, 0, 1.0, 3.0)),
    ],
)
def test_only_what_fits_comes_back(copter, sent, kept):
    assert copter.upload(MISSION, [*mission(1), sent]) == 0
    assert copter.download(MISSION)[1] == kept


def test_current_is_0_for_all(copter):
    copter.upload(MISSION, [replace(item, current=1) for item in mission(3)])
    assert [item.current for item in copter.download(MISSION)] == [0, 0, 0]


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        (waypoint(command=9999), 3),
        (replace(waypoint(), x=950_000_000), 10),
        (replace(waypoint(), y=-1_900_000_000), 11),
        (waypoint(z=math.nan), 12),
        (waypoint(frame=8), 2),
        (waypoint(p2=math.nan), 7),
        (Item(177, 2, 9.0, 1.0), 1),
    ],
)
def test_a_bad_item_is_refused_and_the_part_before_it_is_kept(copter, bad, result):
    items = mission(5)
    items[2] = bad
    assert copter.upload(MISSION, items) == result
    assert len(copter.download(MISSION)) == 2


def test_a_failed_upload_leaves_a_mixture_of_old_and_new(copter):
    copter.upload(MISSION, [waypoint(z=50.0) for _ in range(6)])
    items = [waypoint(z=20.0) for _ in range(4)]
    items[2] = waypoint(command=9999)
    assert copter.upload(MISSION, items) == 3
    assert [item.z for item in copter.download(MISSION)[1:]] == [20.0, 50.0, 50.0]


@pytest.mark.parametrize(("kind", "most"), [(MISSION, 650), (FENCE, 70), (RALLY, 46)])
def test_too_many_are_no_space(copter, kind, most):
    copter.say("MISSION_COUNT", count=most + 1, mission_type=kind)
    assert copter.last("MISSION_ACK")["type"] == 4
    assert copter.texts() == [f"Only {most} items are supported"]


def test_it_asks_again_each_second_and_gives_up_after_8_s(copter):
    copter.upload(MISSION, mission(5), answer=lambda seq: seq < 2)
    assert len(copter.platform.plans.mission) == 2
    copter.run(7.9)
    assert len(copter.of("MISSION_REQUEST")) == 3 + 7
    assert not copter.of("MISSION_ACK")
    copter.run(0.2)
    assert copter.last("MISSION_ACK")["type"] == OPERATION_CANCELLED
    assert copter.texts() == ["Mission upload timeout"]
    assert copter.download(MISSION)[1:] == [waypoint(100, frame=3)]


def test_a_count_then_silence_has_cut_the_old_mission(copter):
    copter.upload(MISSION, mission(7))
    copter.say("MISSION_COUNT", count=4, mission_type=MISSION)
    assert len(copter.platform.plans.mission) == 4


def test_a_wrong_item_is_refused_but_the_transfer_goes_on(copter):
    items = mission(3)
    copter.say("MISSION_COUNT", count=3, mission_type=MISSION)
    copter.say("MISSION_ITEM_INT", mission_type=MISSION, **items[2].fields(2))
    assert copter.last("MISSION_ACK")["type"] == 13
    for seq in range(3):
        copter.say("MISSION_ITEM_INT", mission_type=MISSION, **items[seq].fields(seq))
    assert copter.last("MISSION_ACK")["type"] == 0


def test_an_item_without_an_upload_and_a_stranger_are_refused(copter):
    copter.say("MISSION_ITEM_INT", mission_type=MISSION, **waypoint().fields(0))
    assert copter.last("MISSION_ACK")["type"] == 1
    copter.say("MISSION_COUNT", count=3, mission_type=MISSION)
    copter.say("MISSION_COUNT", system=250, count=2, mission_type=MISSION)
    assert copter.last("MISSION_ACK")["type"] == 14
    copter.say("MISSION_REQUEST_LIST", mission_type=MISSION)
    assert copter.last("MISSION_ACK")["type"] == 14
    copter.say("MISSION_COUNT", count=2, mission_type=MISSION)  # its own may begin again
    assert copter.last("MISSION_REQUEST")["seq"] == 0


def test_clear_takes_one_kind_at_a_time(copter):
    copter.upload(MISSION, mission(3))
    for kind, result in ((ALL, 3), (MISSION, 0), (FENCE, 0), (RALLY, 0)):
        copter.say("MISSION_CLEAR_ALL", mission_type=kind)
        assert copter.last("MISSION_ACK")["type"] == result
    assert copter.download(MISSION) == []


def test_the_mission_that_is_flown_cannot_be_cleared(copter):
    copter.upload(MISSION, mission(3))
    copter.platform.plans.flying = True
    copter.say("MISSION_CLEAR_ALL", mission_type=MISSION)
    assert copter.last("MISSION_ACK")["type"] == 1
    assert len(copter.platform.plans.mission) == 3


def test_an_upload_is_live_item_by_item(copter):
    copter.upload(MISSION, mission(4))
    seen = []
    copter.platform.plans.changed = lambda kind: seen.append((kind, len(copter.platform.plans.mission)))
    copter.upload(MISSION, mission(3), answer=lambda seq: seq < 2)
    assert seen == [(MISSION, 3)] * 3


def test_empty_list_is_accepted(copter):
    copter.upload(MISSION, mission(4))
    copter.say("MISSION_COUNT", count=0, mission_type=MISSION)
    assert copter.last("MISSION_ACK")["type"] == 0
    assert copter.download(MISSION) == []


def test_partial_list_is_written(copter):
    copter.upload(MISSION, mission(5))
    copter.forget()
    copter.say("MISSION_WRITE_PARTIAL_LIST", start_index=2, end_index=3, mission_type=MISSION)
    for seq in (2, 3):
        assert copter.last("MISSION_REQUEST")["seq"] == seq
        copter.say("MISSION_ITEM_INT", mission_type=MISSION, **waypoint(z=99.0).fields(seq))
    assert copter.texts() == ["Flight plan received"]
    assert [item.z for item in copter.download(MISSION)[1:]] == [15.0, 99.0, 99.0, 15.0]


def test_old_messages_are_taken_and_complained_of_once(copter):
    copter.say("MISSION_COUNT", count=2, mission_type=MISSION)
    for seq in range(2):
        fields = {**waypoint().fields(seq), "x": HOME[0], "y": HOME[1]}
        copter.say("MISSION_ITEM", mission_type=MISSION, **fields)
    assert copter.last("MISSION_ACK")["type"] == 0
    assert abs(copter.download(MISSION)[1].x - LAT) < 100
    copter.forget()
    for seq in range(2):
        copter.say("MISSION_REQUEST", mission_type=MISSION, seq=seq)
    assert abs(copter.last("MISSION_ITEM")["x"] - HOME[0]) < 1e-5
    assert copter.texts() == ["got MISSION_REQUEST; use MISSION_REQUEST_INT!"]


def test_asking_beyond_the_end_tells_the_count(copter):
    copter.upload(MISSION, mission(3))
    copter.forget()
    copter.say("MISSION_REQUEST_INT", mission_type=MISSION, seq=3)
    assert copter.last("MISSION_COUNT")["count"] == 3
    assert copter.last("MISSION_ACK")["type"] == 1
    copter.say("MISSION_REQUEST_INT", mission_type=FENCE, seq=3)
    assert copter.last("MISSION_ACK")["type"] == 13


class TestFence:
    def test_round_trip(self, copter):
        items = [*square(frame=6), Item(5004, 0, p1=30.0, x=LAT, y=LON), Item(5000, 0, x=LAT, y=LON)]
        assert copter.upload(FENCE, items) == 0
        assert copter.texts() == ["Fence Indexed OK"]
        back = copter.download(FENCE)
        assert [(item.command, item.frame, item.p1, item.x, item.y) for item in back] == [
            (item.command, 0, item.p1, item.x, item.y) for item in items
        ]
        assert {item.autocontinue for item in back} == {0}

    def test_total_is_not_the_number_of_items(self, copter):
        copter.upload(FENCE, square())
        assert copter.platform.params["FENCE_TOTAL"] == 6

    @pytest.mark.parametrize(
        ("items", "text"),
        [
            ([*square()[:3], replace(square()[3], p1=7.0)], "Unexpected vertex count want=4 got=7\n"),
            (square(vertices=2), "Invalid vertex count (2)"),
            ([*square()[:2], *square(command=5002)[:2]], "Received incorrect vertex type (want=98 got=97)"),
            ([*square()[:2], Item(5003, 0, p1=9.0)], "Received incorrect type (want=98 got=92)"),
            ([Item(5003, 0, p1=0.0)], "Non-positive circle radius"),
            ([Item(5000, 0), Item(5000, 0)], "Multiple return points"),
            (square()[:3], "Incorrect item count"),
            ([Item(5003, 0, p1=9.0, x=910_000_000)], "Bad lat or lon"),
        ],
    )
    def test_a_bad_fence_is_refused_as_a_whole_and_the_old_one_stays(self, copter, items, text):
        copter.upload(FENCE, square())
        assert copter.upload(FENCE, items) == 1
        assert copter.texts() == [text, "Fence validation failed"]
        assert len(copter.download(FENCE)) == 4

    @pytest.mark.parametrize(("item", "result"), [(waypoint(), 3), (replace(square()[0], frame=8), 2)])
    def test_a_bad_item_ends_the_upload(self, copter, item, result):
        assert copter.upload(FENCE, [item, *square()]) == result

    def test_silence_is_told(self, copter):
        copter.upload(FENCE, square(), answer=lambda seq: seq < 2)
        copter.run(8.1)
        assert copter.texts() == ["Fence upload timeout"]
        assert copter.download(FENCE) == []


class TestRally:
    @pytest.mark.parametrize(("sent", "kept"), [(3, 3), (6, 3), (0, 0), (10, 10)])
    def test_frames(self, copter, sent, kept):
        assert copter.upload(RALLY, [waypoint(command=5100, frame=sent, z=30.9)]) == 0
        (point,) = copter.download(RALLY)
        assert (point.frame, point.z) == (kept, 30.0)

    @pytest.mark.parametrize(
        ("bad", "result"), [(waypoint(), 3), (waypoint(command=5100, frame=2), 2), (waypoint(command=5100, z=4e4), 12)]
    )
    def test_bad_points(self, copter, bad, result):
        assert copter.upload(RALLY, [bad]) == result
