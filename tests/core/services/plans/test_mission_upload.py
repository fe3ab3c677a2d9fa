"""Uploads: done only when the vehicle holds what was sent, whatever is lost; else what it holds is reported."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.plan_peers import (
    AUTO,
    ArduPilotPeer,
    PlanPeer,
    Px4Peer,
    circle,
    fence,
    mission,
    rally,
    square,
    waypoint,
)
from tests.core.rigs.service_rig import Fields, Peer, ServiceRig
from tui_gcs.core.firmware.plan_dialects import dialect_of
from tui_gcs.core.missions.plan_compare import compare
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.services.plans.mission_service import MissionService
from tui_gcs.core.services.plans.plan_jobs import PlanJob
from tui_gcs.core.services.plans.plan_messages import item_of
from tui_gcs.core.uplink.jobs import JobState

AUTOPILOTS = [ArduPilotPeer, Px4Peer]
Make = Callable[..., tuple[ServiceRig, MissionService]]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def made(peer: PlanPeer, **options: float) -> tuple[ServiceRig, MissionService]:
        loss, options = options.get("loss", 0.0), options | {"loss": 0.0}
        rig = ServiceRig(tmp_path, peer, **options).heard()
        rig.loss = loss
        return rig, rig.station.services.missions

    return made


def run(rig: ServiceRig, job: PlanJob, limit_s: float = 90.0) -> PlanJob:
    rig.until(lambda: job.over, limit_s, job.name)
    rig.run(0.1)
    return job


def on_board(rig: ServiceRig, peer: PlanPeer, kind: PlanKind = PlanKind.MISSION) -> Plan:
    return dialect_of(rig.vehicle(peer.system)).from_wire(kind, tuple(item_of(f) for f in peer.stores[kind]))


def holds(rig: ServiceRig, peer: PlanPeer, plan: Plan) -> bool:
    """Whether the peer itself has it: not what the station believes."""
    return compare(plan, on_board(rig, peer, plan.kind), dialect_of(rig.vehicle(peer.system))).same


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize(
    "plan", [mission(7), fence(*square(), circle(10.0)), rally(20.0, 25.0)], ids=lambda p: p.kind.word
)
def test_a_plan_goes_up_and_is_read_back(make: Make, autopilot: type[PlanPeer], plan: Plan) -> None:
    rig, missions = make(peer := autopilot(1))
    job = run(rig, missions.upload(1, plan))
    assert (job.state, job.error) == (JobState.DONE, "")
    assert holds(rig, peer, plan)
    assert peer.got("MISSION_REQUEST_LIST"), "an ACK is no proof"
    assert missions.holds(1, plan) is True
    held = missions.state(1).held[plan.kind]
    assert held.ours and not held.partial and not held.stale


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_half_of_an_upload_is_the_reading_back(make: Make, autopilot: type[PlanPeer]) -> None:
    rig, missions = make(peer := autopilot(1), delay_s=0.1)
    job = missions.upload(1, mission(40))
    seen = set()
    while not job.over:
        rig.run(0.05)
        if peer.got("MISSION_REQUEST_LIST"):
            seen.add(100 * job.done // job.total)
    assert min(seen) <= 55 and len(seen) > 10, "100 % would be told all the time that it is read back"
    assert job.state is JobState.DONE and job.done == job.total


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_thousand_items(make: Make, autopilot: type[PlanPeer]) -> None:
    peer = autopilot(1)
    if isinstance(peer, ArduPilotPeer):
        peer.most = 1100
    rig, missions = make(peer, delay_s=0.0)
    plan = mission(1000)
    job = missions.upload(1, plan)
    rig.run(1.0)
    assert 0 < job.done < job.total
    assert run(rig, job).state is JobState.DONE and job.done == job.total
    assert holds(rig, peer, plan)


# ---------------------------------------------------------------- ArduPilot


def test_ardupilot_gets_home_as_item_0_and_jumps_that_count_it(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    plan = Plan(PlanKind.MISSION, (*mission(5).items[:4], PlanItem(177, 2, (1.0, 3.0, 0.0, 0.0))))
    assert run(rig, missions.upload(1, plan)).state is JobState.DONE
    sent = {f["seq"]: f for f in peer.got("MISSION_ITEM_INT")}
    assert peer.got("MISSION_COUNT")[0]["count"] == 6
    assert (sent[0]["command"], sent[1]["command"], sent[5]["param1"]) == (16, 22, 2.0)
    assert [item.command for item in on_board(rig, peer).items] == [22, 16, 16, 16, 177]
    assert on_board(rig, peer).items[4].params[0] == 1.0


def test_heights_in_centimetres_and_whole_delays_are_the_same_plan_and_losses_are_noted(make: Make) -> None:
    rig, missions = make(ArduPilotPeer(1))
    plan = Plan(PlanKind.MISSION, (waypoint(0, 20.123456), waypoint(1, params=(2.0, 5.0, 0.0, 90.0))))
    assert run(rig, missions.upload(1, plan)).state is JobState.DONE
    assert any("ArduPilot does not keep param 2 of command 16 (1 x)" in text for text in rig.texts("vehicle 1"))


def test_more_than_it_holds_is_refused_with_its_own_words(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    assert run(rig, missions.upload(1, mission(5))).state is JobState.DONE
    job = run(rig, missions.upload(1, mission(700)))
    assert job.state is JobState.FAILED
    assert "no space" in job.error and "Only 650 items are supported" in job.error
    assert "still holds the mission from before" in job.error
    assert missions.holds(1, mission(5)) is True and holds(rig, peer, mission(5))


def test_a_failed_upload_reports_the_part_on_board_and_the_old_plan_can_be_restored(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    run(rig, missions.upload(1, mission(9)))
    bad = Plan(PlanKind.MISSION, (*mission(4, first=50).items[:3], PlanItem(9999, 2), waypoint(7)))
    job = run(rig, missions.upload(1, bad))
    assert job.state is JobState.FAILED
    assert "item 4 of 5: refused: unsupported command" in job.error, "as the plan counts them: home is none of them"
    assert "holds the first 3 of 5 items, the rest is old: restore the one from before, or clear it" in job.error
    held = missions.state(1).held[PlanKind.MISSION]
    assert held.plan is not None and not held.ours and held.before == mission(9)
    restored = missions.restore(1, PlanKind.MISSION)
    assert restored is not None
    assert run(rig, restored).state is JobState.DONE and holds(rig, peer, mission(9))


def test_a_first_upload_that_fails_leaves_a_part(make: Make) -> None:
    rig, missions = make(ArduPilotPeer(1))
    bad = Plan(PlanKind.MISSION, (*mission(4).items[:3], PlanItem(9999, 2)))
    job = run(rig, missions.upload(1, bad))
    assert "holds the first 3 of 4 items, no more: clear it" in job.error
    assert missions.state(1).held[PlanKind.MISSION].partial
    assert missions.restore(1, PlanKind.MISSION) is None


def test_nothing_is_sent_while_it_flies_its_mission_unless_in_flight_is_given(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1, armed=True, custom_mode=AUTO))
    job = run(rig, missions.upload(1, mission(5)))
    assert (job.state, job.error) == (JobState.FAILED, "it flies its mission: pause first")
    assert not peer.got("MISSION_COUNT")
    assert run(rig, missions.upload(1, mission(5), in_flight=True)).state is JobState.DONE
    assert all(f["current"] == 0 for f in peer.got("MISSION_ITEM_INT"))
    assert run(rig, missions.clear(1, PlanKind.MISSION)).error == "it flies its mission: pause first"
    assert run(rig, missions.upload(1, fence())).state is JobState.DONE, "a fence may change"


def test_a_refused_fence_is_reported_with_the_text_of_the_vehicle(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    run(rig, missions.upload(1, fence()))
    three = [PlanItem(5001, 0, (3.0, 0.0, 0.0, 0.0), i.x, i.y) for i in square()[:3]]
    job = run(rig, missions.upload(1, fence(*three)))
    assert job.state is JobState.FAILED and "Fence validation failed" in job.error
    assert "still holds the fence from before" in job.error
    assert holds(rig, peer, fence())


def test_items_that_get_lost_are_sent_again_long_before_it_asks_again(make: Make) -> None:
    """ArduPilot asks each second; a hundred items at 20 % loss would take a minute."""
    rig, missions = make(ArduPilotPeer(1), loss=0.2, seed=3)
    job = missions.upload(1, mission(100))
    rig.until(lambda: job.over, 60.0)
    assert job.state is JobState.DONE
    assert rig.clock.now() < 50.0


# ---------------------------------------------------------------- PX4


def test_px4s_number_for_a_plan_spares_the_second_reading_only(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    run(rig, missions.upload(1, mission(6)))
    reads = len(peer.got("MISSION_REQUEST_LIST"))
    assert reads == 1
    run(rig, missions.upload(1, mission(9)))
    assert len(peer.got("MISSION_REQUEST_LIST")) == 2
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE
    assert len(peer.got("MISSION_REQUEST_LIST")) == 2, "proven before"


def test_px4_has_second_thoughts(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1, flyable=False))
    peer.text("Mission rejected: that was another one\t", 3)
    rig.run(1.0)
    job = missions.upload(1, mission(6))
    rig.run(0.5)
    peer.text("Mission rejected: takeoff is not the first waypoint item\t", 3)
    run(rig, job)
    assert job.state is JobState.FAILED
    assert job.error.startswith("accepted, but it cannot be flown: Mission rejected: takeoff is not the first")


def test_silence_of_px4_is_no_confirmation(make: Make) -> None:
    rig, missions = make(Px4Peer(1, reports=False))
    job = run(rig, missions.upload(1, mission(6)))
    assert job.error == "accepted, but the vehicle did not report whether it can be flown"


def test_an_older_px4_rejects_only_by_an_event_and_only_once(make: Make) -> None:
    """1.16: no mission_state; the same mission again is not looked at again."""
    rig, missions = make(peer := Px4Peer(1, tells_state=False))
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE
    peer.flyable = False
    for _ in range(2):
        job = run(rig, missions.upload(1, mission(9)))
        assert job.state is JobState.FAILED and job.error.startswith(
            "accepted, but it cannot be flown: event 0x01fe4222"
        )
    peer.flyable = True
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE


def test_polygons_go_before_circles_and_are_compared_in_any_order(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    plan = fence(circle(10.0), *square(), circle(7.0), *square(20_000, 5002, lat=473_990_000))
    assert run(rig, missions.upload(1, plan)).error == ""
    assert [f["command"] for f in peer.got("MISSION_ITEM_INT")] == [5001] * 4 + [5002] * 4 + [5004] * 2
    assert missions.holds(1, plan)


def test_a_fence_without_home_is_not_sent_where_home_is_known(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    away = fence(*square(lat=475_000_000))
    peer.say(
        "HOME_POSITION",
        latitude=473_977_000,
        longitude=85_456_000,
        altitude=488_000,
        x=0,
        y=0,
        z=0,
        q=[1, 0, 0, 0],
        approach_x=0,
        approach_y=0,
        approach_z=0,
    )
    rig.run(1.0)
    job = run(rig, missions.upload(1, away))
    assert "home is outside" in job.error and not peer.got("MISSION_COUNT")


def test_a_fence_that_px4_throws_away_afterwards_is_no_success(make: Make) -> None:
    rig, missions = make(Px4Peer(1))
    job = run(rig, missions.upload(1, fence(*square(lat=475_000_000))))
    assert job.state is JobState.FAILED
    assert "a part was thrown away: Geofence invalid, doesn't contain Home position" in job.error


@pytest.mark.parametrize(
    ("plan", "why"),
    [
        (fence(*square(), *[circle(5.0)] * 61), "65 items, PX4 holds 64"),
        (rally(*range(33)), "33 items, PX4 holds 32"),
        (Plan(PlanKind.MISSION, (waypoint(0, frame=10),)), "PX4 knows no heights above the ground"),
    ],
    ids=["fence", "rally", "terrain"],
)
def test_what_px4_does_not_take_is_not_sent(make: Make, plan: Plan, why: str) -> None:
    rig, missions = make(peer := Px4Peer(1))
    assert run(rig, missions.upload(1, plan)).error == why
    assert not peer.got("MISSION_COUNT")


def test_rally_points_go_in_the_frames_that_px4_understands(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    points = tuple(PlanItem(5100, frame, x=473_977_000, y=85_456_000 + frame, z=30.0) for frame in (6, 5, 3, 0))
    assert run(rig, missions.upload(1, Plan(PlanKind.RALLY, points))).state is JobState.DONE
    assert [f["frame"] for f in peer.got("MISSION_ITEM_INT")] == [3, 0, 3, 0]


def test_a_px4_that_is_busy_is_asked_again(make: Make) -> None:
    """The end of a reading got lost: it is busy for 5 s."""
    rig, missions = make(peer := Px4Peer(1))
    peer.busy_till_s = rig.clock.now() + 5.0
    assert run(rig, missions.upload(1, mission(5))).state is JobState.DONE


def test_a_failed_upload_leaves_px4_with_what_it_had(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    run(rig, missions.upload(1, mission(6)))
    bad = Plan(PlanKind.MISSION, (*mission(4, first=50).items[:3], PlanItem(9999, 2)))
    job = run(rig, missions.upload(1, bad))
    assert "unsupported command" in job.error and "still holds the mission from before" in job.error
    assert missions.holds(1, mission(6)) is True and holds(rig, peer, mission(6))


# ---------------------------------------------------------------- both


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_lost_verdict_is_found_out(make: Make, autopilot: type[PlanPeer]) -> None:
    rig, missions = make(peer := autopilot(1, loses_ack=1))
    assert run(rig, missions.upload(1, mission(5))).state is JobState.DONE
    assert holds(rig, peer, mission(5))


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("after_s", [0.02, 0.1, 0.4])
def test_it_can_be_cancelled_at_any_moment(make: Make, autopilot: type[PlanPeer], after_s: float) -> None:
    rig, missions = make(peer := autopilot(1))
    run(rig, missions.upload(1, mission(8)))
    job = missions.upload(1, mission(60, first=100))
    rig.run(after_s)
    assert rig.station.comms.jobs.cancel(1, "mission upload") == 1
    assert job.state is JobState.CANCELLED
    assert missions.holds(1, mission(60, first=100)) is None, "nobody knows"
    rig.run(9.0)
    assert run(rig, missions.upload(1, mission(8))).state is JobState.DONE
    assert holds(rig, peer, mission(8))


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_new_mission_begins_with_its_first_item(make: Make, autopilot: type[PlanPeer]) -> None:
    rig, missions = make(peer := autopilot(1))
    assert run(rig, missions.upload(1, mission(5))).state is JobState.DONE
    marked = {f["seq"] for f in peer.got("MISSION_ITEM_INT") if f["current"]}
    assert marked == {0}, "no vehicle may begin in the middle"


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_silence_ends_it(make: Make, autopilot: type[PlanPeer]) -> None:
    rig, missions = make(peer := autopilot(1))
    peer.answers = dict.fromkeys(("MISSION_COUNT", "MISSION_REQUEST_LIST"), lambda peer, fields: None)
    job = run(rig, missions.upload(1, mission(5)))
    assert job.state is JobState.FAILED and job.error.startswith("no answer")
    assert len(peer.got("MISSION_COUNT")) == 12, "at 20 % loss each way less would not do"


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_an_item_that_never_arrives_ends_it(make: Make, autopilot: type[PlanPeer]) -> None:
    rig, missions = make(autopilot(1, deaf_to={3}))
    job = run(rig, missions.upload(1, mission(8)))
    assert job.state is JobState.FAILED
    gave_up = autopilot is ArduPilotPeer
    assert job.error.startswith("item 3 of 8: the vehicle gave up" if gave_up else "no answer to item 4 of 8")
    assert missions.state(1).held[PlanKind.MISSION].known, "it was asked what it holds"
    assert not missions.holds(1, mission(8))


@pytest.mark.parametrize(
    ("reports", "error"),
    [
        ([{"spacing": 100, "pending": 0}], ""),
        ([{"spacing": 100, "pending": 4}, {"spacing": 100, "pending": 0}], ""),
        ([{"spacing": 0, "pending": 0}], "it has no terrain data: it would sink into the ground"),
        ([], "it did not say whether it has terrain data"),
    ],
)
def test_heights_above_the_ground_are_sent_only_to_a_vehicle_with_terrain_data(
    make: Make, reports: list[dict[str, int]], error: str
) -> None:
    """A real ArduCopter without terrain data takes them and sinks at 1.5 m/s until it hits the ground."""
    peer = ArduPilotPeer(1)
    left = iter(reports)

    def asked(peer: Peer, fields: Fields) -> None:
        peer.ack(fields["command"])
        reported = next(left, None) if fields["param1"] == 136 else None
        if reported is not None:
            place = {"lat": 0, "lon": 0, "terrain_height": 0.0, "current_height": 0.0, "loaded": 56}
            peer.say("TERRAIN_REPORT", **place, **reported)

    rig, missions = make(peer)
    peer.answers["COMMAND_LONG"] = asked
    job = run(rig, missions.upload(1, Plan(PlanKind.MISSION, (waypoint(0), waypoint(1, frame=10)))))
    assert error in job.error and bool(error) == bool(job.error)
    assert bool(peer.got("MISSION_COUNT")) == (not error)


def test_an_empty_plan_is_not_sent(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    assert run(rig, missions.upload(1, Plan(PlanKind.MISSION))).error == "it has no items: clear it instead"
    assert not peer.got("MISSION_COUNT")


def test_a_reboot_ends_it_and_forgets_what_was_known(make: Make) -> None:
    rig, missions = make(ArduPilotPeer(1))
    run(rig, missions.upload(1, mission(5)))
    job = missions.upload(1, mission(50))
    rig.run(0.1)
    for listener in rig.station.picture.fleet.paths.on_reboot:
        listener(rig.vehicle())
    rig.run(0.1)
    assert job.state is JobState.FAILED and "rebooted" in job.error
    assert "it may hold a part of this mission: look what it holds" in job.error
    assert missions.holds(1, mission(5)) is None
