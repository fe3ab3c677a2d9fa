"""An endpoint that an operator closes while another station sends: what goes on, and what ends."""

from tests.core.forward.test_mission_rules import (
    HOME,
    acknowledge,
    count,
    names,
    request,
    send,
    starts,
    station,
    take,
    upload,
)
from tests.core.rigs.forward_rig import OWN, QGC, Rig, frames, heartbeat, hold, link
from tui_gcs.core.forward.forwarder import Endpoint


def heard(flight: Rig) -> list[bytes]:
    """A heartbeat of vehicle 1, and what of it leaves."""
    flight.forwarder.feed("", "radio", [flight.frame("HEARTBEAT", 1, 1, **heartbeat())])
    return [frame.raw for made in flight.links for frame in frames(made)]


def test_a_closed_endpoint_gets_nothing_and_what_it_sends_is_not_read() -> None:
    flight = station()
    assert len(heard(flight)) == 1
    flight.forwarder.close("udpin:a", "console-1")
    hold(flight)
    flight.clock.advance(100.0)
    flight.forwarder.tick()
    assert heard(flight) == [] and flight.uplink.taken == []
    (port,) = flight.forwarder.ports
    assert port.link.error == "closed by console-1" and len(port.partners) == 1, "it stays known"
    assert flight.forwarder.filenos() == []


def test_each_partner_has_its_own_counts_and_the_endpoint_those_of_all() -> None:
    flight = station()
    other = ("192.0.2.8", 14550)
    flight.beat(system=251, at=other)
    hold(flight)
    flight.say("SET_MODE", system=251, at=other, target_system=1, base_mode=1, custom_mode=14)
    flight.say("HEARTBEAT", system=1, at=("192.0.2.9", 14550), **heartbeat())  # a vehicle's id, and no partner
    (port,) = flight.forwarder.ports
    assert [(p.address, p.passed, p.refused) for p in port.partners.values()] == [
        (QGC, 1, {}),
        (other, 0, {"by the rules": 1}),
    ]
    assert (port.passed, port.refused) == (1, {"by the rules": 1, "a vehicle's system id": 1})


def test_others_are_served_on() -> None:
    flight = Rig(link("udpin:a"), link("udpout:b", partner=("192.0.2.9", 14550)), commands=True)
    flight.forwarder.close("udpin:a", "console-1")
    assert len(heard(flight)) == 1


def test_a_mission_that_is_being_collected_is_dropped() -> None:
    flight = station()
    count(flight, 3)
    send(flight, 0, *HOME)
    names(flight)
    flight.forwarder.close("udpin:a", "console-1")
    for _ in range(20):
        flight.clock.advance(1.0)
        flight.forwarder.tick()
    assert flight.uplink.taken == [] and names(flight) == []
    assert [text for text in flight.texts() if "mission" in text] == []


def test_a_mission_that_the_vehicle_is_taking_goes_to_the_end() -> None:
    flight = station()
    count(flight, 3)
    for seq, place in enumerate([HOME, (60.0, 60.0), (60.0, 140.0)]):
        send(flight, seq, *place)
    request(flight, 0)
    flight.forwarder.close("udpin:a", "console-1")
    names(flight)
    take(flight, 3)
    assert flight.uplink.whats == ["mission upload"] + ["mission upload item"] * 4
    assert names(flight) == [], "its station is not told any more"


def reopened(flight: Rig) -> None:
    """The operator adds the same address again, and the station there is heard."""
    flight.links = (link("udpin:a"),)
    flight.forwarder.open(Endpoint(flight.links[0], commands=True))
    flight.beat()


def test_a_mission_that_is_still_on_board_is_started_when_its_station_comes_back() -> None:
    flight = station()
    upload(flight, [HOME, (60.0, 60.0), (60.0, 140.0)])
    flight.forwarder.close("udpin:a", "console-1")
    reopened(flight)
    assert starts(flight)


def test_a_mission_that_was_replaced_meanwhile_is_not_started() -> None:
    flight = station()
    upload(flight, [HOME, (60.0, 60.0), (60.0, 140.0)])
    flight.forwarder.close("udpin:a", "console-1")
    acknowledge(flight, to=OWN)  # of the plan screen of this station, for example
    reopened(flight)
    assert not starts(flight)


def test_a_mission_that_was_replaced_while_its_station_was_silent_is_not_started() -> None:
    flight = station()
    upload(flight, [HOME, (60.0, 60.0), (60.0, 140.0)])
    flight.clock.advance(100.0)
    flight.forwarder.tick()
    acknowledge(flight, to=OWN)
    flight.beat()
    assert not starts(flight)


def test_a_vehicle_that_another_endpoint_wants_is_free_after_the_first_was_closed() -> None:
    flight = station()
    count(flight, 3)
    flight.forwarder.close("udpin:a", "console-1")
    reopened(flight)
    flight.beat(system=251)
    count(flight, 2, system=251)
    assert names(flight) == ["MISSION_REQUEST 0"]
    assert [port.is_closed for port in flight.forwarder.ports] == [False], "one of this name"
