"""Downloads, deletions, progress, the current item, and what others do to a vehicle's plans."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.plan_peers import AUTO, PX4_MISSION, ArduPilotPeer, PlanPeer, Px4Peer, fence, mission, rally
from tests.core.rigs.service_rig import ServiceRig
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.core.services.plans.mission_service import MissionService
from tui_gcs.core.services.plans.plan_jobs import PlanJob
from tui_gcs.core.services.plans.plan_table import MissionProgress
from tui_gcs.core.uplink.jobs import JobState

AUTOPILOTS = [ArduPilotPeer, Px4Peer]
ANOTHER_STATION = 250
REQUEST_MESSAGE, MISSION_CURRENT = 512, 42
Make = Callable[..., tuple[ServiceRig, MissionService]]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def made(peer: PlanPeer, *more: PlanPeer) -> tuple[ServiceRig, MissionService]:
        rig = ServiceRig(tmp_path, peer, *more).heard()
        return rig, rig.station.services.missions

    return made


def run(rig: ServiceRig, job: PlanJob, limit_s: float = 60.0) -> PlanJob:
    rig.until(lambda: job.over, limit_s, job.name)
    rig.run(0.1)
    return job


def stored(rig: ServiceRig, missions: MissionService, *plans: Plan) -> None:
    for plan in plans:
        assert run(rig, missions.upload(1, plan)).state is JobState.DONE


# ---------------------------------------------------------------- down


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("plan", [mission(7), fence(), rally(20.0)], ids=lambda p: p.kind.word)
def test_what_is_on_board_comes_down(make: Make, autopilot: type[PlanPeer], plan: Plan) -> None:
    rig, missions = make(peer := autopilot(1))
    stored(rig, missions, plan)
    job = run(rig, missions.download(1, plan.kind))
    assert job.state is JobState.DONE and job.plan is not None and job.problems == []
    assert [item.command for item in job.plan.items] == [item.command for item in plan.items]
    assert [(i.x, i.y) for i in job.plan.items] == [(i.x, i.y) for i in plan.items]
    assert missions.holds(1, plan) is True, "it is known to be ours still"
    assert peer.got("MISSION_ACK")[-1]["type"] == 0


def test_nothing_on_board(make: Make) -> None:
    rig, missions = make(Px4Peer(1))
    job = run(rig, missions.download(1, PlanKind.RALLY))
    assert job.state is JobState.DONE and job.plan == Plan(PlanKind.RALLY)


def test_what_another_station_has_put_there_is_read_and_is_not_ours(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    stored(rig, missions, mission(6))
    peer.stores[0][2]["x"] += 500
    job = run(rig, missions.download(1, PlanKind.MISSION))
    assert job.state is JobState.DONE
    assert any("mission on vehicle is not ours" in text for text in rig.texts("vehicle 1"))
    assert missions.holds(1, mission(6)) is False
    assert not missions.state(1).held[PlanKind.MISSION].ours


def test_a_cancelled_download_is_ended_on_the_vehicle(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    stored(rig, missions, mission(200))
    job = missions.download(1, PlanKind.MISSION)
    rig.run(0.3)
    assert rig.station.comms.jobs.cancel(1) == 1 and job.state is JobState.CANCELLED
    rig.run(0.1)
    assert peer.sending == -1, "PX4 is free again at once"


def test_px4_that_ends_a_reading_is_read_anew(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    stored(rig, missions, mission(20))
    job = missions.download(1, PlanKind.MISSION)
    rig.run(0.2)
    peer.on_mission_request_int({"seq": 1})  # an old copy of a question
    assert run(rig, job).state is JobState.DONE
    assert job.plan is not None and len(job.plan.items) == 20


# ---------------------------------------------------------------- clear


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("plan", [mission(7), fence(), rally(20.0)], ids=lambda p: p.kind.word)
def test_a_plan_is_cleared_when_the_count_is_zero(make: Make, autopilot: type[PlanPeer], plan: Plan) -> None:
    rig, missions = make(peer := autopilot(1))
    stored(rig, missions, plan)
    assert run(rig, missions.clear(1, plan.kind)).state is JobState.DONE
    assert peer.stores[plan.kind] == []
    assert missions.holds(1, Plan(plan.kind)) is True
    assert all(fields["mission_type"] < 255 for fields in peer.got("MISSION_CLEAR_ALL"))


def test_a_refused_deletion_has_a_reason(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    stored(rig, missions, mission(5))
    peer.answers["MISSION_CLEAR_ALL"] = lambda peer, fields: peer.verdict(0, 1)
    job = run(rig, missions.clear(1, PlanKind.MISSION))
    assert job.error == "refused: error"
    assert missions.holds(1, mission(5)) is None, "it has to be asked"


def test_an_acknowledged_deletion_without_effect_is_a_failure(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    stored(rig, missions, mission(5))
    peer.answers["MISSION_CLEAR_ALL"] = lambda peer, fields: peer.verdict(0, 0)
    assert run(rig, missions.clear(1, PlanKind.MISSION)).error == "accepted, but 5 items are left"


# ---------------------------------------------------------------- progress


def test_progress_counts_the_plans_own_items(make: Make) -> None:
    """ArduPilot counts home: seq 2 of total 5 is the second item."""
    rig, missions = make(peer := ArduPilotPeer(1))
    stored(rig, missions, mission(5))
    peer.current, peer.armed, peer.custom_mode = 2, True, AUTO
    peer.say("MISSION_ITEM_REACHED", seq=1)
    rig.run(1.5)
    state = missions.state(1)
    assert (state.current, state.reached, state.total, state.progress) == (1, 0, 5, MissionProgress.ACTIVE)


def test_px4_counts_from_zero_and_reports_65535_for_none(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    rig.run(1.1)
    assert (missions.state(1).total, missions.state(1).current) == (0, None)
    stored(rig, missions, mission(5))
    peer.current = 2
    rig.run(1.1)
    state = missions.state(1)
    assert (state.current, state.total, state.progress) == (2, 5, MissionProgress.NOT_STARTED)
    assert state.ids[PlanKind.MISSION] == peer.ids[0]


def test_a_vehicle_that_does_not_tell_is_asked(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1, reports=False))

    def tells(peer: PlanPeer, fields: dict[str, float]) -> None:
        if fields["command"] == REQUEST_MESSAGE and fields["param1"] == MISSION_CURRENT:
            asked.append(rig.clock.now())
            peer.report()

    asked: list[float] = []
    peer.answers["COMMAND_LONG"] = tells
    rig.run(6.0)
    assert not asked, "nothing on board, nothing to ask"
    stored(rig, missions, mission(5))
    rig.run(20.0)
    assert 2 <= len(asked) <= 5
    assert missions.state(1).progress is MissionProgress.NOT_STARTED


# ---------------------------------------------------------------- the current item


@pytest.mark.parametrize(
    ("autopilot", "message", "seq"), [(ArduPilotPeer, "COMMAND_LONG", 4), (Px4Peer, "MISSION_SET_CURRENT", 3)]
)
def test_going_on_with_an_item(make: Make, autopilot: type[PlanPeer], message: str, seq: int) -> None:
    """PX4 does not know DO_SET_MISSION_CURRENT; ArduPilot counts home."""
    rig, missions = make(peer := autopilot(1))
    stored(rig, missions, mission(6))
    ended: list[str] = []
    assert missions.set_current(1, 3, lambda action, outcome, why: ended.append(outcome.value)) == ""
    rig.until(lambda: bool(ended), 5.0)
    assert ended == ["confirmed"] and peer.current == seq and missions.state(1).current == 3
    assert [f for f in peer.got(message) if f.get("command", 224) == 224]


def test_an_item_that_is_not_there_is_not_asked_for(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    stored(rig, missions, mission(6))
    assert missions.set_current(1, 6) == "item 7 of 6 does not exist"
    assert missions.set_current(1, -1) == "item 0 of 6 does not exist"
    assert missions.set_current(99, 0) == "unknown vehicle"
    assert not [f for f in peer.got("COMMAND_LONG") if f["command"] == 224]


# ---------------------------------------------------------------- others


def test_another_number_means_another_plan(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    stored(rig, missions, mission(6), fence())
    rig.run(6.0)
    assert missions.holds(1, mission(6)) is True, "reports that fit change nothing"
    peer.ids[0] += 1
    rig.run(6.0)
    assert any("mission on vehicle is not ours: its number is another one" in text for text in rig.texts("vehicle 1"))
    assert missions.holds(1, mission(6)) is None
    assert missions.holds(1, fence()) is True
    assert rig.texts().count("mission on vehicle is not ours: its number is another one") == 1


def test_another_count_means_another_mission(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    stored(rig, missions, mission(6))
    rig.run(5.0)
    del peer.stores[0][4:]
    rig.run(6.0)
    assert any("not ours: it has 3 items instead of 6" in text for text in rig.texts("vehicle 1"))


def test_an_ack_to_another_station_means_that_it_changed_something(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    stored(rig, missions, mission(6))
    peer.say("MISSION_ACK", target_system=ANOTHER_STATION, target_component=190, type=0, mission_type=0)
    rig.run(0.1)
    assert missions.holds(1, mission(6)) is None
    assert any("not ours: station 250 changed it" in text for text in rig.texts("vehicle 1"))


def test_one_old_report_is_no_alarm(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    stored(rig, missions, mission(6))
    rig.run(6.0)
    peer.say("MISSION_CURRENT", seq=0, total=4, mission_state=2, mission_mode=2, mission_id=5)
    rig.run(3.0)
    assert missions.holds(1, mission(6)) is True


def test_a_px4_that_flies_its_mission_is_not_disturbed(make: Make) -> None:
    rig, missions = make(Px4Peer(1, armed=True, custom_mode=PX4_MISSION))
    assert run(rig, missions.upload(1, mission(5))).error == "it flies its mission: pause first"
    assert run(rig, missions.clear(1, PlanKind.MISSION)).error == "it flies its mission: pause first"


def test_two_vehicles_at_once_do_not_mix(make: Make) -> None:
    rig, missions = make(one := ArduPilotPeer(1), two := Px4Peer(2))
    jobs = [missions.upload(1, mission(30)), missions.upload(2, mission(40, first=500))]
    rig.until(lambda: all(job.over for job in jobs), 30.0)
    assert [job.state for job in jobs] == [JobState.DONE] * 2
    assert len(one.stores[0]) == 31 and len(two.stores[0]) == 40
    assert missions.holds(2, mission(30)) is False
