"""Forwarding out: who gets what telemetry, and who counts as a partner."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.core.rigs.forward_rig import (
    KEY,
    OUT,
    OWN,
    QGC,
    TEXT,
    Rig,
    ack,
    any_frame,
    frames,
    heartbeat,
    hold,
    link,
    unknown_frame,
)
from tui_gcs.core.links import LinkError
from tui_gcs.core.mavlink.signing import sign
from tui_gcs.core.mavlink.sources import Address

MP: Address = ("192.0.2.8", 14551)


# ---------------------------------------------------------------- telemetry out


def test_what_is_for_everybody_goes_to_every_partner_byte_for_byte() -> None:
    flight = Rig(link("udpin:a"), link("udpout:b", partner=OUT))
    flight.beat()
    flight.beat(system=251, at=MP)
    sent = [flight.frame("HEARTBEAT", 1, 1, **heartbeat()) for _ in range(3)]
    sent.insert(1, sign(flight.frame("STATUSTEXT", 1, 1, **TEXT), b"k" * 32, 3, 10**9))
    sent.insert(3, unknown_frame())
    flight.forwarder.feed("", "radio", sent)
    for endpoint, partner in ((flight.links[0], QGC), (flight.links[0], MP), (flight.links[1], OUT)):
        assert b"".join(data for data, to in endpoint.sent if to == partner) == b"".join(sent)
    assert flight.forwarder.forwarded == 15


def test_what_is_addressed_goes_only_where_the_addressed_was_heard() -> None:
    flight = Rig(link("udpin:a"), link("udpout:b", partner=OUT))
    flight.beat(system=252)
    flight.beat(system=251, at=MP)
    to_qgc, to_nobody = (flight.frame("COMMAND_ACK", 1, 1, **ack(to)) for to in (252, 253))
    other_component = flight.frame("COMMAND_ACK", 1, 1, **ack(251, 77))
    all_components = flight.frame("COMMAND_ACK", 1, 1, **ack(251, 0))
    to_all = flight.frame("COMMAND_ACK", 1, 1, **ack(0, 0))
    flight.forwarder.feed("", "radio", [to_qgc, to_nobody, other_component, all_components, to_all])
    assert [f.raw for f in frames(flight.links[0], QGC)] == [to_qgc, to_all]
    flight.forwarder.feed("", "radio", [all_components, to_qgc])
    assert [f.raw for f in frames(flight.links[0], MP)] == [all_components]
    assert [f.raw for f in frames(flight.links[1])] == [to_all]
    assert flight.forwarder.dropped == {"for no system at an endpoint": 2, "endpoint takes no commands": 2}


def test_mavlink_1_has_no_extension_and_so_no_address() -> None:
    flight = Rig(link("udpout:b", partner=OUT))
    version1 = bytes.fromhex("fe030001014d900100d6e2")  # COMMAND_ACK without the fields that MAVLink 2 added
    flight.forwarder.feed("", "radio", [version1])
    assert flight.links[0].sent[0][0] == version1


def test_nothing_goes_back_to_where_it_came_from_nor_to_another_network() -> None:
    flight = Rig(link("udpout:a", partner=OUT), link("udpout:b", partner=MP), link("c", partner=QGC, network="north"))
    beat = flight.frame("HEARTBEAT", 1, 1, **heartbeat())
    flight.forwarder.feed("", "udpout:a", [beat])
    assert [len(each.sent) for each in flight.links] == [0, 1, 0]
    flight.forwarder.feed("north", "radio", [beat])
    assert [len(each.sent) for each in flight.links] == [0, 1, 1]


def test_an_endpoint_of_a_network_that_is_not_there_is_said_at_the_start() -> None:
    with pytest.raises(LinkError, match="udpout:a: no link has network 'nort'; there is \\(default\\), north"):
        Rig(link("udpout:a", partner=OUT, network="nort"))


def test_keys_are_never_sent_on() -> None:
    flight = Rig(link("udpout:b", partner=OUT))
    keys = [flight.frame("SETUP_SIGNING", 1, 1, **KEY), flight.frame("AUTH_KEY", 1, 1, key="secret")]
    flight.forwarder.feed("", "radio", [*keys, flight.frame("WIFI_CONFIG_AP", 1, 1, ssid="a", password="secret")])
    assert not flight.links[0].sent
    assert flight.forwarder.refused == {"key": 3}


def test_frames_that_leave_together_share_datagrams_of_bounded_size() -> None:
    flight = Rig(link("udpout:b", partner=OUT))
    sent = [flight.frame("STATUSTEXT", 1, 1, **TEXT) for _ in range(200)]
    flight.forwarder.feed("", "radio", sent)
    sizes = [len(data) for data, _ in flight.links[0].sent]
    assert max(sizes) <= 1200 and len(sizes) < 200 / 20
    assert [f.raw for f in frames(flight.links[0])] == sent


# ---------------------------------------------------------------- partners


def test_who_listens_is_learned_from_a_valid_frame_only() -> None:
    flight = Rig(link("udpin:a"))
    beat = flight.frame("HEARTBEAT", 1, 1, **heartbeat())
    broken = bytearray(flight.frame("HEARTBEAT", 252, 190, **heartbeat(6, 8)))
    broken[-1] ^= 1
    for data in (b"junk", b"\xfd\xff\x01", bytes(broken), unknown_frame(), flight.frame("HEARTBEAT", 0, **heartbeat())):
        flight.links[0].inject(data, QGC)
    flight.forwarder.tick()
    flight.forwarder.feed("", "radio", [beat])
    assert not flight.links[0].sent
    assert flight.forwarder.refused == {"bad CRC": 1, "system id 0": 1}
    assert flight.forwarder.dropped == {"unknown message id": 1}
    flight.beat()
    flight.forwarder.feed("", "radio", [beat])
    assert [to for _, to in flight.links[0].sent] == [QGC]


def test_who_falls_silent_is_forgotten_after_60_s() -> None:
    flight = Rig(link("udpin:a"))
    beat, answer = flight.frame("HEARTBEAT", 1, 1, **heartbeat()), flight.frame("COMMAND_ACK", 1, 1, **ack(252))
    flight.beat(system=252)
    flight.clock.advance(40.0)
    flight.beat(system=251)
    flight.clock.advance(21.0)
    flight.forwarder.tick()
    flight.forwarder.feed("", "radio", [beat, answer])
    assert [f.raw for f in frames(flight.links[0])] == [beat], "251 is still there, 252 is not"
    flight.clock.advance(40.0)
    flight.forwarder.tick()
    flight.forwarder.feed("", "radio", [beat])
    assert not flight.links[0].sent


def test_sixteen_partners_and_no_more_and_the_first_stay() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    for port in range(40):
        flight.beat(at=("192.0.2.7", 5000 + port))
    flight.command(193, 0, at=("192.0.2.7", 5039))
    flight.forwarder.feed("", "radio", [flight.frame("HEARTBEAT", 1, 1, **heartbeat())])
    assert [to for _, to in flight.links[0].sent] == [("192.0.2.7", 5000 + port) for port in range(16)]
    assert flight.forwarder.refused == {"too many partners": 25}
    assert not flight.uplink.taken
    assert len(flight.texts()) == 1


def test_systems_behind_one_partner_are_bounded() -> None:
    flight = Rig(link("udpout:b", partner=OUT))
    for system in range(100, 200):
        for component in range(5):
            flight.beat(system=system, component=component, at=OUT)
    answers = [flight.frame("COMMAND_ACK", 1, 1, **ack(system)) for system in range(100, 200)]
    flight.forwarder.feed("", "radio", answers)
    partner = flight.forwarder.ports[0].partners[OUT]
    assert len(partner.systems) == 64


def test_the_partner_of_a_point_to_point_link_is_known_and_stays() -> None:
    flight = Rig(link("udpout:b", partner=OUT))
    for _ in range(3):
        flight.forwarder.feed("", "radio", [flight.frame("HEARTBEAT", 1, 1, **heartbeat())])
        flight.clock.advance(1000.0)
        flight.forwarder.tick()
    assert [to for _, to in flight.links[0].sent] == [OUT] * 3


def test_a_station_with_our_own_id_may_listen_but_not_ask() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    hold(flight, system=OWN)
    beat, for_us = flight.frame("HEARTBEAT", 1, 1, **heartbeat()), flight.frame("COMMAND_ACK", 1, 1, **ack(OWN))
    flight.forwarder.feed("", "radio", [for_us, beat])
    assert [f.raw for f in frames(flight.links[0])] == [beat]
    assert not flight.uplink.taken
    assert flight.forwarder.refused == {"our own system id": 1}
    assert flight.texts() == ["192.0.2.7:14550 255/190 uses our own system id 255: give that station another one"]


@given(st.lists(any_frame(), max_size=8))
def test_whatever_vehicles_send_goes_out_unchanged_or_not_at_all(raws: list[bytes]) -> None:
    flight = Rig(link("udpout:b", partner=OUT))
    flight.beat(at=OUT)
    flight.forwarder.feed("", "radio", raws)
    out = b"".join(data for data, _ in flight.links[0].sent)
    for raw in raws:
        if out.startswith(raw):
            out = out.removeprefix(raw)
    assert out == b"", "whole frames, in order"
    assert flight.forwarder.forwarded + flight.forwarder.dropped[
        "for no system at an endpoint"
    ] + flight.forwarder.refused["key"] == len(raws)
