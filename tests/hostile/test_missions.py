"""Bad input B.6-52…65: missions, fences, rally points. One test per case of the catalogue.

Where the case is a vehicle that plays a part in a transfer, it is a scripted one; where it speaks unasked, the oracle
watches.
"""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.plan_peers import ArduPilotPeer, PlanPeer, Px4Peer, fence, mission, square, waypoint
from tests.core.rigs.service_rig import Fields, Peer, ServiceRig
from tests.hostile.oracle import Oracle
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.plans.check import MAX_ITEMS, check
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.services.plans.mission_service import MissionService
from tui_gcs.core.services.plans.plan_jobs import PlanJob
from tui_gcs.core.uplink.jobs import JobState

Attack = Callable[..., Oracle]
Make = Callable[..., tuple[ServiceRig, MissionService]]
TURNS = ("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_REQUEST_LIST", "MISSION_REQUEST_INT")


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Make]:
    """A rig whose second vehicle must not notice anything."""
    made: list[ServiceRig] = []

    def rig(peer: PlanPeer) -> tuple[ServiceRig, MissionService]:
        made.append(ServiceRig(tmp_path, peer, Peer(9)).heard())
        return made[-1], made[-1].station.services.missions

    yield rig
    for one in made:
        bystander = one.vehicle(9)
        assert bystander.freshness(one.clock.now()) is Freshness.OK
        assert {name for _, name, _ in one.peers[9].heard} <= {"COMMAND_LONG", "TIMESYNC", "SYSTEM_TIME"}
        texts = one.texts()
        assert max(texts.count(text) for text in texts) <= one.clock.now() + 1


def run(rig: ServiceRig, job: PlanJob, limit_s: float = 120.0) -> PlanJob:
    rig.until(lambda: job.over, limit_s, job.name)
    rig.run(0.2)
    return job


def counts(peer: PlanPeer, *numbers: int) -> None:
    """The vehicle answers with these counts, one after the other, then with the last for ever."""
    left = list(numbers)

    def answer(peer: Peer, fields: Fields) -> None:
        peer.say_to_us("MISSION_COUNT", count=left.pop(0) if len(left) > 1 else left[0], mission_type=0)

    peer.answers["MISSION_REQUEST_LIST"] = answer


# ---------------------------------------------------------------- 52, 53, 54: downloads


def test_b6_52_a_count_of_65535(make: Make) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    counts(peer, 65535)
    job = run(rig, missions.download(1, PlanKind.MISSION))
    assert job.state is JobState.FAILED and "65535 items; at most 2000" in job.error
    assert not peer.got("MISSION_REQUEST_INT")


def test_b6_53_a_count_that_changes(make: Make) -> None:
    """Once: it is begun anew. For ever: an error."""
    rig, missions = make(peer := ArduPilotPeer(1))
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE
    once = []

    def changes(peer: Peer, fields: Fields) -> None:
        if fields["seq"] == 3 and not once:
            once.append(True)
            peer.say_to_us("MISSION_COUNT", count=7, mission_type=0)
            return
        peer.on_mission_request_int(fields)  # type: ignore[attr-defined]

    peer.answers["MISSION_REQUEST_INT"] = changes
    asked = len(peer.got("MISSION_REQUEST_INT"))
    counts(peer, 9, 7)
    job = run(rig, missions.download(1, PlanKind.MISSION))
    assert job.state is JobState.DONE and len(peer.got("MISSION_REQUEST_INT")) == asked + 4 + 7
    peer.answers["MISSION_REQUEST_INT"] = lambda peer, fields: [
        peer.say_to_us("MISSION_COUNT", count=7 + fields["seq"] + n, mission_type=0) for n in (1, 2, 3)
    ]
    job = run(rig, missions.download(1, PlanKind.MISSION))
    assert job.state is JobState.FAILED and "the number of its items changes" in job.error


def test_b6_54_items_out_of_order_twice_and_missing(make: Make) -> None:
    """Only what is missing is asked for again, and the plan is right."""
    rig, missions = make(peer := ArduPilotPeer(1))
    assert run(rig, missions.upload(1, mission(12))).state is JobState.DONE
    refuses = {5: 2}

    def messy(peer: Peer, fields: Fields) -> None:
        assert isinstance(peer, ArduPilotPeer)
        seq = fields["seq"]
        if refuses.get(seq):
            refuses[seq] -= 1
            for other in (9, 7, 7, 2, 0, 12, 60000):  # what nobody asked for, twice, and what does not exist
                if other < len(peer.stores[0]):
                    peer.on_mission_request_int(fields | {"seq": other})
                else:
                    item = peer.stores[0][1]
                    peer.say_to_us("MISSION_ITEM_INT", **item, seq=other, current=0, mission_type=0)
            return
        peer.on_mission_request_int(fields)
        peer.on_mission_request_int(fields)

    peer.answers["MISSION_REQUEST_INT"] = messy
    before = len(peer.got("MISSION_REQUEST_INT"))
    job = run(rig, missions.download(1, PlanKind.MISSION))
    assert job.state is JobState.DONE and missions.holds(1, mission(12)) is True
    asked = [fields["seq"] for fields in peer.got("MISSION_REQUEST_INT")[before:]]
    assert asked == [0, 1, 2, 3, 4, 5, 5, 5, 6, 8, 10, 11]


# ---------------------------------------------------------------- 55 … 58: uploads


@pytest.mark.parametrize("seq", [6, 7, 65535])
def test_b6_55_a_request_beyond_the_end(make: Make, seq: int) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    peer.answers["MISSION_ITEM_INT"] = lambda peer, fields: peer.say_to_us(
        "MISSION_REQUEST_INT", seq=seq, mission_type=0
    )
    job = run(rig, missions.upload(1, mission(5)))
    assert job.state is JobState.FAILED and f"asks for item {seq} of 5 after 0" in job.error
    assert {"type": 15, "mission_type": 0}.items() <= peer.got("MISSION_ACK")[0].items(), "the vehicle is told"
    assert len(peer.got("MISSION_ITEM_INT")) == 1


def test_b6_56_requests_when_nothing_is_under_way(attack: Attack) -> None:
    oracle = attack()
    to_us = {"target_system": 254, "target_component": 190, "mission_type": 0}
    for seq in (0, 1, 65535):
        oracle.say("MISSION_REQUEST", 1, seq=seq, **to_us)
        oracle.say("MISSION_REQUEST_INT", 1, seq=seq, **to_us)
        oracle.say("MISSION_ACK", 1, type=0, **to_us)
        oracle.say("MISSION_COUNT", 1, count=seq, **to_us)
        oracle.run(0.1)
    oracle.holds(
        counted="MISSION_REQUEST outside of a transfer", told="frames not taken: MISSION_REQUEST outside of a transfer"
    )


@pytest.mark.parametrize("autopilot", [ArduPilotPeer, Px4Peer])
@pytest.mark.parametrize("after", [0, 1, 3])
def test_b6_57_accepted_before_all_items_were_asked_for(make: Make, autopilot: type[PlanPeer], after: int) -> None:
    rig, missions = make(peer := autopilot(1))

    def hasty(peer: Peer, fields: Fields) -> None:
        if fields.get("seq", -1) + 1 >= after:
            peer.verdict(0, 0, 7)  # type: ignore[attr-defined]
        else:
            peer.say_to_us("MISSION_REQUEST_INT", seq=fields.get("seq", -1) + 1, mission_type=0)

    peer.answers |= {"MISSION_COUNT": hasty, "MISSION_ITEM_INT": hasty}
    job = run(rig, missions.upload(1, mission(6)))
    assert job.state is JobState.FAILED
    own = after if autopilot is Px4Peer else max(0, after - 1)  # home is no item of the plan
    assert f"accepted it after {own} of 6 items" in job.error and "holds no mission" in job.error
    assert missions.holds(1, mission(6)) is False


def test_b6_58_no_final_ack(make: Make) -> None:
    """Read back and compared: held, so done; not held, so not."""
    rig, missions = make(peer := ArduPilotPeer(1, loses_ack=1000))
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE
    assert len(peer.stores[0]) == 7
    rig, missions = make(peer := ArduPilotPeer(1, loses_ack=1000))
    peer.take = lambda kind, seq, fields: peer.request() if seq < 6 and advance(peer) else None  # type: ignore[method-assign, assignment, return-value]
    job = run(rig, missions.upload(1, mission(6)))
    assert job.state is JobState.FAILED and missions.holds(1, mission(6)) is not True


def advance(peer: ArduPilotPeer) -> bool:
    """It goes on, and forgets the item."""
    peer.wanted += 1
    peer.got_s = peer.now
    return peer.wanted < peer.receiving


# ---------------------------------------------------------------- 59: values

BAD = {
    "nan height": {"z": math.nan},
    "inf height": {"z": math.inf},
    "height 1e30": {"z": 1e30},
    "inf param": {"param2": math.inf},
    "lat 91": {"x": 910_000_000},
    "lon 181": {"y": 1_810_000_000},
    "x INT32_MIN": {"x": -(2**31)},
    "y INT32_MIN": {"y": -(2**31)},
    "frame 99": {"frame": 99},
    "command 0": {"command": 0},
    "fence in a mission": {"command": 5001},
}


@pytest.mark.parametrize("name", BAD)
def test_b6_59_impossible_items(make: Make, name: str) -> None:
    """Read: shown as what they are, no alarm but one line. Sent: not at all."""
    rig, missions = make(peer := ArduPilotPeer(1))
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE
    peer.stores[0][3] |= BAD[name]
    job = run(rig, missions.download(1, PlanKind.MISSION))
    assert job.state is JobState.DONE and job.plan is not None
    assert job.problems and job.problems[0].startswith("item 3: ")
    sent = len(peer.got("MISSION_COUNT"))
    again = run(rig, missions.upload(1, job.plan))
    assert again.error.startswith(job.problems[0]) and len(peer.got("MISSION_COUNT")) == sent


# ---------------------------------------------------------------- 60, 62: third parties


def test_b6_60_an_item_of_another_station(make: Make) -> None:
    """What another system sends us is no part of the transfer; what it did to the vehicle is found out."""
    rig, missions = make(peer := ArduPilotPeer(1))
    stranger, other = Encoder(77, 1), Encoder(1, 42)
    injected = {"target_system": 255, "target_component": 190, "mission_type": 0, "current": 0, "seq": 3}
    foreign = {"frame": 3, "command": 16, "autocontinue": 1, "x": 1, "y": 1, "z": 99.0}
    foreign |= {f"param{n}": 0.0 for n in (1, 2, 3, 4)}
    job = missions.upload(1, mission(30))
    while not job.over:
        rig.link.inject(stranger.encode("MISSION_ITEM_INT", **injected, **foreign), ("peer", 77))
        rig.link.inject(other.encode("MISSION_ACK", type=0, **_to_us()), ("peer", 1))
        if peer.wanted == 20:
            peer.stores[0][3] |= {"x": 1, "y": 1}  # it got an item from somebody else
        rig.step()
    assert job.state is JobState.FAILED and "the vehicle holds something else: item 3: is at" in job.error
    assert any("mission on vehicle is not ours" in text for text in rig.texts("vehicle 1"))


def _to_us() -> dict[str, int]:
    return {"target_system": 255, "target_component": 190, "mission_type": 0}


def test_b6_62_another_station_changes_the_mission_in_flight(make: Make) -> None:
    rig, missions = make(peer := Px4Peer(1))
    assert run(rig, missions.upload(1, mission(6))).state is JobState.DONE
    peer.armed = True
    rig.run(6.0)
    peer.stores[0].append(peer.stores[0][2])
    peer.ids[0] ^= 0xFFFF
    rig.run(4.0)
    texts = [text for text in rig.texts("vehicle 1") if text.startswith("mission on vehicle is not ours")]
    assert len(texts) == 1 and missions.state(1).held[PlanKind.MISSION].stale


# ---------------------------------------------------------------- 61, 63: plans that nobody may send


def jump(target: float, times: float = -1.0) -> PlanItem:
    return PlanItem(177, 2, (target, times, 0.0, 0.0))


@pytest.mark.parametrize(
    ("items", "why"),
    [
        ([waypoint(0), jump(1)], "item 2: jumps to itself"),
        ([waypoint(0), jump(7)], "item 2: jumps to item 8 of 2"),
        ([waypoint(0), jump(-1)], "item 2: jumps to item 0 of 2"),
        ([waypoint(0), jump(0.5)], "item 2: jumps to item 1.5 of 2"),
        ([waypoint(0), jump(math.nan)], "item 2: param 1 is no number"),
        ([waypoint(0), jump(0, -2)], "item 2: jumps -2 times"),
        ([waypoint(0), jump(2), jump(1)], "item 2: jumps in a circle without flying anywhere"),
        ([waypoint(0), PlanItem(178, 2), jump(1, 5)], "item 3: jumps in a circle without flying anywhere"),
    ],
)
def test_b6_61_jumps(make: Make, items: list[PlanItem], why: str) -> None:
    rig, missions = make(peer := ArduPilotPeer(1))
    plan = Plan(PlanKind.MISSION, tuple(items))
    assert str(check(plan)[0]) == why
    assert run(rig, missions.upload(1, plan)).error.startswith(why)
    assert not peer.got("MISSION_COUNT")


def test_b6_61_a_patrol_for_ever_is_fine() -> None:
    assert check(Plan(PlanKind.MISSION, (waypoint(0), waypoint(1), jump(0)))) == []


def polygon(points: list[tuple[float, float]], said: float | None = None) -> Plan:
    count = float(len(points)) if said is None else said
    items = (PlanItem(5001, 0, (count, 0.0, 0.0, 0.0), round(a * 1e7), round(b * 1e7)) for a, b in points)
    return Plan(PlanKind.FENCE, tuple(items))


def star(points: int) -> list[tuple[float, float]]:
    """Round, jagged, not crossing itself."""
    turn = 2 * math.pi / points
    return [(47 + (0.1 + 0.01 * (i % 2)) * math.cos(i * turn), 8 + 0.1 * math.sin(i * turn)) for i in range(points)]


@pytest.mark.parametrize(
    ("plan", "why"),
    [
        (polygon([(47, 8), (47.1, 8)]), "a polygon of 2 points: it needs 3"),
        (polygon([(47, 8)]), "a polygon of 1 point: it needs 3"),
        (polygon([(47, 8), (47.1, 8.1), (47.1, 8), (47, 8.1)]), "the polygon crosses itself near 47.05, 8.05"),
        (polygon([(47, 8), (47.1, 8), (47.2, 8)]), "the polygon has no area"),
        (polygon(star(10_000)), f"10000 items, at most {MAX_ITEMS} are allowed"),
        (polygon([(80, -170), (89.95, 10), (80, 100)]), "the polygon reaches over a pole"),
        (polygon([(10, 179), (10, -179), (11, -179), (11, 179)]), "the polygon reaches over the antimeridian"),
        (polygon([(47, 8), (47.1, 8), (47.1, 8.1)], said=4), "its 3 points give as their number 4"),
        (fence(PlanItem(5003, 0, (-3.0, 0, 0, 0), 470_000_000, 80_000_000)), "a circle of -3 m"),
        (fence(PlanItem(5003, 0, (9000.0, 0, 0, 0), 898_900_000, 80_000_000)), "the circle reaches over a pole"),
        (
            fence(PlanItem(5003, 0, (9000.0, 0, 0, 0), 100_000_000, 1_799_900_000)),
            "the circle reaches over the antimeridian",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_b6_63_impossible_fences(plan: Plan, why: str) -> None:
    found = check(plan)
    assert found and found[0].text == why
    assert check(fence(*square())) == []


def test_b6_63_the_largest_fence_is_looked_at_in_no_time() -> None:
    began_s = time.process_time()
    assert check(polygon(star(MAX_ITEMS))) == []
    assert time.process_time() - began_s < 0.2


# ---------------------------------------------------------------- 64, 65: what is said of home and of the way


def home(oracle: Oracle, lat: int, lon: int) -> dict[str, Any]:
    return {"latitude": lat, "longitude": lon, "altitude": 0, "x": 0, "y": 0, "z": 0, "q": [1, 0, 0, 0]} | {
        f"approach_{axis}": 0 for axis in "xyz"
    }


@pytest.mark.long
@pytest.mark.parametrize("place", [(0, 0), (910_000_000, 0), (-(2**31), 2**31 - 1)], ids=str)
def test_b6_64_home_where_no_home_can_be(attack: Attack, place: tuple[int, int]) -> None:
    oracle = attack()
    before = oracle.vehicle.telemetry.home_m
    oracle.say("HOME_POSITION", 1, **home(oracle, *place))
    oracle.run(1.0)
    assert oracle.vehicle.telemetry.home_m == before
    oracle.holds(counted="invalid position")


@pytest.mark.parametrize(("seq", "total"), [(6, 5), (65535, 5), (500, 5), (0, 65535), (3, 65535)])
def test_b6_65_a_current_item_that_is_not_there(make: Make, seq: int, total: int) -> None:
    rig, missions = make(peer := ArduPilotPeer(1, reports=False))
    assert run(rig, missions.upload(1, mission(5))).state is JobState.DONE
    peer.say("MISSION_CURRENT", seq=seq, total=total, mission_state=200, mission_mode=77)
    peer.say("MISSION_ITEM_REACHED", seq=seq)
    rig.run(0.1)
    state = missions.state(1)
    assert state.current is None and state.reached is None, "a question mark"
    assert state.progress.name == "UNKNOWN"
