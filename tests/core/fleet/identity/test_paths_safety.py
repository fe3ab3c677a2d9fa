"""Paths that look alive and are not: stops must still arrive, and no other vehicle is taken for the vehicle."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.core.rigs import orders
from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.fleet.identity.path_rules import is_serial
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import SigningKey, ticks
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.signing.keystore import KeyStore

pytestmark = pytest.mark.long  # nearly each is a flight

MakeWired = Callable[..., Wired]
SECRET = bytes(range(1, 33))
BEAT = {"type": 18, "autopilot": 8, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
RADIO = {"rxerrors": 0, "fixed": 0, "rssi": 200, "remrssi": 200, "txbuf": 100, "noise": 10, "remnoise": 10}
SPEAKERS = {
    "companion": (191, "HEARTBEAT", BEAT),
    "camera": (100, "HEARTBEAT", BEAT),
    "modem": (1, "RADIO_STATUS", RADIO),
}


def keyed(wired: MakeWired, tmp_path: Any, wires: list[Wire]) -> Wired:
    """A flight with one vehicle that signs."""
    keys = KeyStore(tmp_path / "keys")
    keys.add(SigningKey("field", SECRET))
    keys.assign("field", "", 1)
    flight = wired(1, keys=keys, wires=wires)
    flight.sim.set_key(0, SECRET, ticks(flight.clock.wall()))
    return flight


def cut(wire: Wire) -> None:
    """Nothing passes between the autopilot and whoever sits at the wire."""
    wire.loses = lambda way, data: True


def speak(flight: Wired, wire: Wire, who: str, seconds: float) -> None:
    """Something that shares the vehicle's system id goes on to speak on `wire`."""
    component, name, fields = SPEAKERS[who]
    encoder = Encoder(1, component)
    for _ in range(round(seconds / 0.5)):
        wire.link.inject(encoder.encode(name, **fields), ("sim", 0))
        flight.run(0.5)


def land(flight: Wired) -> None:
    flight.station.comms.commands.submit(orders.land(flight, 1))


# ---------------------------------------------------------------- who speaks for a path


@pytest.mark.parametrize("signed", [False, True], ids=["no key", "key"])
@pytest.mark.parametrize("who", list(SPEAKERS))
def test_only_its_autopilot_keeps_a_path_in_use(wired: MakeWired, tmp_path: Any, who: str, signed: bool) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.05)
    flight = keyed(wired, tmp_path, [near, far]) if signed else wired(1, wires=[near, far])
    flight.flying().run(5.0)
    assert flight.vehicle().link == "near" and len(flight.vehicle().used_paths()) == 2
    cut(near)
    speak(flight, near, who, 2.0)
    assert flight.vehicle().link == "far"
    land(flight)
    speak(flight, near, who, 15.0)
    assert flight.place(1)[2] < 20.0


@pytest.mark.parametrize("signed", [False, True], ids=["no key", "key"])
def test_nobody_else_hides_that_an_autopilot_is_lost(wired: MakeWired, tmp_path: Any, signed: bool) -> None:
    near = Wire("near")
    whole = near.loses
    flight = keyed(wired, tmp_path, [near]) if signed else wired(1, wires=[near])
    flight.flying()
    for who in SPEAKERS:
        near.loses = whole
        flight.run(8.0)
        assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK
        cut(near)
        speak(flight, near, who, 4.5)
        assert flight.vehicle().freshness(flight.clock.now()) is Freshness.LOST, who


def test_a_path_whose_positions_stopped_is_left_for_one_that_brings_them(wired: MakeWired) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.4)
    flight = wired(1, wires=[near, far]).run(10.0)
    near.loses = lambda way, data: way == "up" and data[7:10] != b"\0\0\0"
    flight.run(10.0)
    assert flight.vehicle().link == "far"


def test_a_stop_goes_over_every_way_and_nothing_else_does(wired: MakeWired) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.05)
    flight = wired(1, wires=[near, far]).flying().run(5.0)
    since_s = flight.clock.now()
    flight.station.comms.commands.submit(orders.speed(flight, 1, 5.0))
    flight.run(1.0)
    assert 178 in flight.commands(near, since_s) and 178 not in flight.commands(far, since_s)
    land(flight)
    flight.run(1.0)
    assert 176 in flight.commands(near, since_s) and 176 in flight.commands(far, since_s)
    assert "land: begun" in flight.texts("vehicle 1")


# ---------------------------------------------------------------- who repeats signed frames


def relayed(flight: Wired, wire: Wire, loses: Callable[[float], bool], *, first: bool = False) -> None:
    """Somebody at another address of `wire` repeats each frame at once; some of the originals are lost."""
    plain = wire.from_vehicle

    def relay(now: float, data: bytes, address: Address) -> None:
        if first:
            plain(now, data, ("relay", 1))
        if not loses(now):
            plain(now, data, address)
        if not first:
            plain(now, data, ("relay", 1))

    wire.from_vehicle = relay  # type: ignore[method-assign]


@pytest.mark.parametrize("first", [False, True], ids=["after the original", "before it"])
def test_a_relay_on_the_same_link_is_not_followed(wired: MakeWired, tmp_path: Any, first: bool) -> None:
    """Nor as more and more of the originals are lost in one flight."""
    import random

    chance, share_lost = random.Random(7), [0.0]
    near = Wire("near")
    flight = keyed(wired, tmp_path, [near]).flying().run(5.0)
    relayed(flight, near, lambda now: chance.random() < share_lost[-1], first=first)
    reported: list[str] = []
    flight.station.picture.fleet.on_message("STATUSTEXT", lambda v, fields: reported.append(fields["text"]))
    flight.sim._pilots[0].platform.outbox.text(4, "before the relay or after it")
    for loss in (0.0, 0.01, 0.05, 0.3):
        share_lost.append(loss)
        for _ in range(300):
            flight.step()
            assert flight.vehicle().address == ("sim", 0), loss
        if not loss:
            assert reported == ["before the relay or after it"]
    land(flight)
    flight.run(12.0)
    assert flight.place(1)[2] < 20.0


def test_a_relay_is_followed_while_the_vehicle_is_silent_and_no_longer(wired: MakeWired, tmp_path: Any) -> None:
    near = Wire("near")
    flight = keyed(wired, tmp_path, [near]).flying().run(5.0)
    since_s = flight.clock.now()
    relayed(flight, near, lambda now: since_s + 1.0 < now < since_s + 3.0)
    flight.run(2.0)
    assert flight.vehicle().address == ("sim", 0)
    flight.run(0.8)
    assert flight.vehicle().address == ("relay", 1)
    land(flight)
    flight.run(0.4)
    assert flight.vehicle().address == ("sim", 0) and len(flight.vehicle().used_paths()) == 1
    flight.run(12.0)
    assert flight.vehicle().address == ("sim", 0)
    assert flight.place(1)[2] < 20.0, "a stop goes to both"


def test_a_signed_vehicle_that_has_moved_is_followed_within_two_seconds(wired: MakeWired, tmp_path: Any) -> None:
    place: dict[str, Address] = {"now": ("sim", 0)}
    flight = keyed(wired, tmp_path, [Wire("near", place=lambda fleet, index: place["now"])]).flying().run(5.0)
    for port in (5, 6):
        place["now"] = ("nat", port)
        flight.until(lambda port=port: flight.vehicle().address == ("nat", port), 1.6)
        flight.run(5.0)
        assert flight.vehicle().address == ("nat", port) and len(flight.vehicle().used_paths()) == 1
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK and not flight.vehicle().why_not_commanded


# ---------------------------------------------------------------- two vehicles with one power switch


def only(number: int) -> Callable[[int, int], Address | None]:
    """Only that fleet is heard on this wire."""
    return lambda fleet, index: (f"fleet {number}", index) if fleet == number else None


def together(wired: MakeWired, uid: str, age_s: float, north_m: float) -> Wired:
    """Two boards with one id, each on a link of its own, switched on `age_s` apart."""
    flight = wired(1, wires=[Wire("near", place=only(0)), Wire("far", delay_s=0.1, place=only(1))])
    flight.stranger(age_s=age_s)
    flight.fleets[1]._vehicles.position_m[0, 1] += north_m
    flight.same_uid(uid)
    return flight


UIDS = {"equal": "f" * 20, "none": "\0" * 20}


@pytest.mark.parametrize("age_s", [0.0, 0.5, 2.5])
@pytest.mark.parametrize("uid", list(UIDS))
def test_two_vehicles_switched_on_together_are_two(wired: MakeWired, uid: str, age_s: float) -> None:
    flight = together(wired, UIDS[uid], age_s, north_m=30.0).run(40.0)
    assert "several vehicles use id 1" in flight.vehicle().why_not_commanded
    assert len(flight.vehicle().used_paths()) == 1


@pytest.mark.parametrize("age_s", [0.5, 2.5])
@pytest.mark.parametrize("uid", list(UIDS))
def test_two_that_stand_side_by_side_are_never_taken_for_one(wired: MakeWired, uid: str, age_s: float) -> None:
    flight = together(wired, UIDS[uid], age_s, north_m=1.0)
    for _ in range(60):
        flight.run(1.0)
        assert len(flight.vehicle().used_paths()) <= 1
        assert flight.vehicle().link == "near"


@pytest.mark.parametrize("uid", list(UIDS))
def test_a_second_link_in_flight_proves_itself_by_where_the_vehicle_is(wired: MakeWired, uid: str) -> None:
    """The boards say nothing of who they are, and no frame is the same: each link has positions of its own."""

    def every_other(rest: int) -> Callable[[str, bytes], bool]:
        return lambda way, data: way == "up" and data[7:10] == b"\x21\0\0" and sum(data[10:-2]) % 2 == rest

    near = Wire("near", loses=every_other(0))
    far = Wire("far", delay_s=0.1, up=False, numbers=True, loses=every_other(1))
    flight = wired(1, wires=[near, far])
    flight.same_uid(UIDS[uid])
    flight.flying().run(5.0)
    far.up = True
    flight.until(lambda: len(flight.vehicle().used_paths()) == 2, 15.0)
    assert not flight.vehicle().identity.blocked


SERIAL = "K\x01(Q\x19\x07" + "530248" + "\0" * 8
"""Of an STM32, as ArduPilot tells it."""


@pytest.mark.parametrize(("uid", "proven"), [(SERIAL, True), (UIDS["equal"], False)], ids=["serial", "any"])
def test_a_standing_vehicle_is_known_on_a_second_link_by_its_serial_number(
    wired: MakeWired, uid: str, *, proven: bool
) -> None:
    """It sends each link positions of its own; what is not a serial number proves nothing while it stands."""

    def every_other(rest: int) -> Callable[[str, bytes], bool]:
        return lambda way, data: way == "up" and data[7:10] == b"\x21\0\0" and sum(data[10:-2]) % 2 == rest

    far = Wire("far", delay_s=0.1, up=False, numbers=True, loses=every_other(1))
    flight = wired(1, wires=[Wire("near", loses=every_other(0)), far])
    flight.same_uid(uid)
    flight.run(10.0)
    far.up = True
    flight.run(6.0)
    assert (len(flight.vehicle().used_paths()) == 2) is proven
    assert not flight.vehicle().identity.blocked


def test_a_serial_number_that_two_vehicles_tell_proves_nothing(wired: MakeWired) -> None:
    """Whatever the reason: they would be taken for one while they stand side by side."""
    flight = wired(2, wires=[Wire("near", place=only(0)), Wire("far", delay_s=0.1, place=only(1))])
    flight.stranger(age_s=0.5)
    flight.fleets[1]._vehicles.position_m[0, 1] += 1.0
    flight.same_uid(SERIAL)
    for _ in range(30):
        flight.run(1.0)
        assert [path.source.link for path in flight.vehicle().used_paths()] == ["near"]


def test_what_is_a_serial_number() -> None:
    """The first two are forms of real boards, the others are those of the recordings."""
    assert is_serial("4b0128511907353330323438" + "00" * 6)
    assert is_serial("000600000000" + "353330323438190751280001")
    for uid in (
        "",
        "4953ab0123456789",
        "336431323139633763346335343034616100",
        "010000000000000000000000000000000000",
        "00" * 18,
    ):
        assert not is_serial(uid)


def test_two_that_were_taken_for_one_are_told_apart_when_they_part(wired: MakeWired) -> None:
    """Simulated without noise, at one place, at one time: every position is the same to the last bit."""
    flight = together(wired, UIDS["none"], 0.5, north_m=0.0).run(40.0)
    flight.fleets[1]._vehicles.position_m[0, 1] += 30.0
    flight.run(6.0)
    assert "several vehicles use id 1" in flight.vehicle().why_not_commanded
    assert len(flight.vehicle().used_paths()) == 1
    flight.run(20.0)
    assert flight.vehicle().why_not_commanded, "for as long as both are there"


def test_two_links_that_agree_with_each_other_prove_nothing(wired: MakeWired) -> None:
    wires = [Wire("near", place=only(0)), Wire("b", place=only(1)), Wire("c", delay_s=0.1, place=only(1))]
    flight = wired(1, wires=wires)
    flight.stranger(age_s=0.5)
    flight.fleets[1]._vehicles.position_m[0, 1] += 10.0
    flight.same_uid()
    for _ in range(30):
        flight.run(1.0)
        assert [path.source.link for path in flight.vehicle().used_paths()] == ["near"]
