"""TIMESYNC and PING: answered at once, to who asked, and no flood of them."""

from collections.abc import Callable

import pytest
from wires import Wire, Wired

from tui_gcs.core.services.timesync import MOST_PER_S
from tui_gcs.core.wire.encode import Encoder

MakeWired = Callable[..., Wired]
ASK, PING = Encoder(1, 1), Encoder(1, 1)
TO_ALL = {"time_usec": 1, "seq": 1, "target_system": 0, "target_component": 0}


def quiet(wired: MakeWired, *wires: Wire) -> Wired:
    """A known vehicle that asks nothing by itself just now."""
    flight = wired(1, wires=list(wires) or [Wire("near")]).run(12.0)
    flight.sim.silence(0)
    return flight


def answers(flight: Wired, name: str, since_s: float) -> list[dict[str, object]]:
    return [f for _, f in flight.sent_to(1, name, since_s)]


def test_a_timesync_request_is_answered_with_our_time_in_the_same_step(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    flight.wires[0].link.inject(ASK.encode("TIMESYNC", tc1=0, ts1=123_456_789_012), ("sim", 0))
    flight.run(0.05)
    (answer,) = answers(flight, "TIMESYNC", since_s)
    assert answer["ts1"] == 123_456_789_012
    assert answer["tc1"] == pytest.approx(flight.clock.now() * 1e9)
    assert answer["target_system"] == 1


def test_an_answer_to_somebody_is_no_request(wired: MakeWired) -> None:
    flight = quiet(wired)
    since_s = flight.clock.now()
    link = flight.wires[0].link
    link.inject(ASK.encode("TIMESYNC", tc1=5, ts1=6), ("sim", 0))
    link.inject(ASK.encode("TIMESYNC", tc1=0, ts1=6, target_system=77, target_component=1), ("sim", 0))
    link.inject(PING.encode("PING", time_usec=1, seq=2, target_system=254, target_component=190), ("sim", 0))
    flight.run(0.2)
    assert not answers(flight, "TIMESYNC", since_s) and not answers(flight, "PING", since_s)


def test_a_ping_comes_back_to_who_sent_it(wired: MakeWired) -> None:
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
    assert 3 * MOST_PER_S - MOST_PER_S <= count <= 4 * MOST_PER_S
    assert flight.station.answers.ignored == 2400 - count


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
    sent = flight.names(near, since_s) + flight.names(far, since_s)
    assert sent.count("TIMESYNC") == 3, "ArduPilot asks every 10 s"
