"""TIMESYNC and PING: answered at once, floods are not, and each vehicle's clock is requested."""

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.service_rig import ARDUPILOT, Fields, Peer, ServiceRig
from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.timesync import MAX_AT_ONCE, MAX_PER_S

MakeWired = Callable[..., Wired]
ASK, PING = Encoder(1, 1), Encoder(1, 1)
OPENPILOT = 4
"""MAV_AUTOPILOT of one that is not known to answer."""
TO_ALL = {"time_usec": 1, "seq": 1, "target_system": 0, "target_component": 0}


def quiet(wired: MakeWired, *wires: Wire) -> Wired:
    """A known vehicle that asks nothing by itself just now."""
    flight = wired(1, wires=list(wires) or [Wire("near")]).run(12.0)
    flight.sim.silence(0)
    return flight


def answers(flight: Wired, name: str, since_s: float) -> list[dict[str, object]]:
    """What was sent to vehicle 1, except for our own requests (tc1 = 0)."""
    return [f for _, f in flight.sent_to(1, name, since_s) if name != "TIMESYNC" or f["tc1"]]


def test_a_timesync_request_is_answered_with_our_time_in_the_same_step(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    flight.wires[0].link.inject(ASK.encode("TIMESYNC", tc1=0, ts1=123_456_789_012), ("sim", 0))
    flight.run(0.05)
    (answer,) = answers(flight, "TIMESYNC", since_s)
    assert answer["ts1"] == 123_456_789_012
    assert answer["tc1"] == pytest.approx(flight.clock.now() * 1e9)
    assert answer["target_system"] == 1


def test_an_addressed_answer_is_no_request(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    link = flight.wires[0].link
    link.inject(ASK.encode("TIMESYNC", tc1=5, ts1=6), ("sim", 0))
    link.inject(ASK.encode("TIMESYNC", tc1=0, ts1=6, target_system=77, target_component=1), ("sim", 0))
    link.inject(PING.encode("PING", time_usec=1, seq=2, target_system=254, target_component=190), ("sim", 0))
    flight.run(0.2)
    assert not answers(flight, "TIMESYNC", since_s) and not answers(flight, "PING", since_s)


def test_a_ping_comes_back_to_its_sender(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    ping = PING.encode("PING", time_usec=42, seq=7, target_system=0, target_component=0)
    flight.wires[0].link.inject(ping, ("sim", 0))
    flight.run(0.1)
    (answer,) = answers(flight, "PING", since_s)
    assert (answer["time_usec"], answer["seq"], answer["target_system"], answer["target_component"]) == (42, 7, 1, 1)


def test_a_flood_of_questions_is_answered_fifty_times_a_second(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    for _ in range(60):
        for _ in range(20):
            flight.wires[0].link.inject(ASK.encode("TIMESYNC", tc1=0, ts1=1), ("sim", 0))
            flight.wires[0].link.inject(PING.encode("PING", **TO_ALL), ("sim", 0))
        flight.run(0.05)
    count = len(answers(flight, "TIMESYNC", since_s)) + len(answers(flight, "PING", since_s))
    assert 3 * MAX_PER_S - MAX_PER_S <= count <= 4 * MAX_PER_S
    assert flight.station.comms.time_responder.ignored == 2400 - count


def test_a_stranger_gets_no_answer(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    for address, system in ((("stranger", 1), 1), (("stranger", 2), 99)):
        flight.wires[0].link.inject(Encoder(system, 1).encode("TIMESYNC", tc1=0, ts1=1), address)
        flight.wires[0].link.inject(Encoder(system, 1).encode("PING", **TO_ALL), address)
    flight.run(0.2)
    assert "TIMESYNC" not in flight.names(flight.wires[0], since_s)
    assert "PING" not in flight.names(flight.wires[0], since_s)


def test_one_question_heard_over_two_links_gets_one_answer(wired: MakeWired) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.3)
    flight = wired(1, wires=[near, far]).run(12.0)
    assert len(flight.vehicle().used_paths()) == 2
    since_s = flight.clock.now()
    flight.run(30.0)
    assert len(answers(flight, "TIMESYNC", since_s)) == 3, "ArduPilot asks every 10 s"


# ---------------------------------------------------------------- each vehicle's clock


class Clocked(Peer):
    """A vehicle that was on for 1000 s when the test began, and answers TIMESYNC."""

    def __init__(self, system: int = 1) -> None:
        super().__init__(system)
        self.answers = {"TIMESYNC": Clocked.tell}

    def tell(self, fields: Fields) -> None:
        """As PX4 1.16.1 does: the target is what happened to be in its memory."""
        if fields["tc1"] == 0:
            tc1 = round((self.now + 1000.0) * 1e9)
            self.say("TIMESYNC", tc1=tc1, ts1=fields["ts1"], target_system=21, target_component=0)


def test_the_round_trip_to_a_vehicle_is_measured_every_five_seconds(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Clocked(), delay_s=0.1).heard()
    times = rig.station.services.link_timing
    rig.run(30.0)
    assert 6 <= len(rig.peers[1].got("TIMESYNC")) <= 7
    measured = times.of(rig.vehicle())
    assert measured is not None
    assert measured.rtt_s == pytest.approx(0.22, abs=0.05)
    assert measured.age_s < 6


def test_the_quickest_answer_of_a_minute_is_kept(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Clocked(), delay_s=0.02).heard().run(12.0)
    rig.delay_s = 1.0
    rig.run(20.0)
    measured = rig.station.services.link_timing.of(rig.vehicle())
    assert measured is not None and measured.rtt_s > 1.9 and measured.best_rtt_s < 0.1


@pytest.mark.parametrize(
    ("autopilot", "gaps_s"), [(ARDUPILOT, [2.5, 5.0, 5.0, 5.0, 5.0, 5.0]), (OPENPILOT, [2.5, 5.0, 10.0, 10.0])]
)
def test_who_did_not_answer_is_asked_again_soon_and_then_more_seldom(
    tmp_path: Path, autopilot: int, gaps_s: list[float]
) -> None:
    """Once the round trip is measured, an ACK can be matched to its command. An ArduPilot must answer, others may."""
    rig = ServiceRig(tmp_path, Peer(1, autopilot=autopilot)).heard().run(30.0)
    asked_s = [t for t, name, _ in rig.peers[1].heard if name == "TIMESYNC"]
    assert [round(b - a, 1) for a, b in itertools.pairwise(asked_s)] == pytest.approx(gaps_s, abs=0.3)


def test_one_answer_that_was_held_up_does_not_count_as_the_longest(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Clocked(), delay_s=0.1).heard().run(32.0)
    rig.delay_s = 2.0
    rig.run(5.0)
    rig.delay_s = 0.1
    rig.run(20.0)
    measured = rig.station.services.link_timing
    assert measured.round_trips(1) == pytest.approx((0.22, 0.22), abs=0.05)


def test_answers_without_a_request_measure_nothing(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard().run(1.0)
    peer, times = rig.peers[1], rig.station.services.link_timing
    asked = peer.got("TIMESYNC")[0]["ts1"]
    peer.say_to_us("TIMESYNC", tc1=5, ts1=asked + 1)
    rig.run(0.1)
    assert times.of(rig.vehicle()) is None and times.ignored["answer to nothing asked"] == 1
    peer.say_to_us("TIMESYNC", tc1=5, ts1=asked)
    peer.say_to_us("TIMESYNC", tc1=5, ts1=asked)
    rig.run(0.1)
    assert times.of(rig.vehicle()) is not None and times.ignored["answer to nothing asked"] == 2


def test_a_fleet_is_asked_in_turn_and_a_silent_vehicle_not_at_all(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, *[Clocked(i) for i in range(1, 31)]).heard()
    rig.run(2.0)
    assert all(len(peer.got("TIMESYNC")) == 1 for peer in rig.peers.values())
    moments = [t for peer in rig.peers.values() for t, name, _ in peer.heard if name == "TIMESYNC"]
    assert max(moments.count(t) for t in moments) <= MAX_AT_ONCE
    rig.peers[1].silent = True
    rig.run(30.0)
    assert len(rig.peers[1].got("TIMESYNC")) <= 2
