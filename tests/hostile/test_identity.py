"""Bad input B.6-24…37: identity, recordings played back, signatures. One test for each case of the catalogue."""

import random
from collections.abc import Callable
from typing import Any

import pytest

from tests.core.rigs.forward_rig import KEY as SETUP
from tests.hostile.oracle import KEY, STRANGER, Oracle, Watched
from tui_gcs.core.fleet.vehicle import Signing
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.signing import MAX_TIMESTAMP, TICKS_PER_S, sign, signature_matches, ticks
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness

pytestmark = pytest.mark.long  # nearly each is a flight

Attack = Callable[..., Oracle]
HOME: Address = ("sim", 0)
OTHER_KEY = bytes(range(101, 133))
RADIO = {"rxerrors": 0, "fixed": 0, "rssi": 200, "remrssi": 200, "txbuf": 100, "noise": 10, "remnoise": 10}
HOUR = 3600
SYSTEM_TIME = 2


def heartbeat(**other: int) -> dict[str, int]:
    rest = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 9, "system_status": 3, "mavlink_version": 3}
    return rest | other


def position(oracle: Oracle, x: float, y: float, boot_ms: int) -> dict[str, int]:
    lat, lon = oracle.flight.station.picture.fleet.frame.to_geodetic(x, y)
    place = {"lat": round(float(lat) * 1e7), "lon": round(float(lon) * 1e7), "alt": 130_000, "relative_alt": 20_000}
    return {"time_boot_ms": boot_ms, "vx": 0, "vy": 0, "vz": 0, "hdg": 0} | place


def version(uid: int) -> dict[str, Any]:
    numbers = ("capabilities", "flight_sw_version", "middleware_sw_version", "os_sw_version", "board_version")
    rest = {"vendor_id": 0, "product_id": 0, "uid": uid}
    custom = {f"{part}_custom_version": bytes(8) for part in ("middleware", "os", "flight")}
    return dict.fromkeys(numbers, 0) | rest | custom


def to_home(address: Address, message: str) -> bool:
    return address == HOME


def listening(rig: Watched) -> list[tuple[bytes, Address]]:
    """What this station's vehicles send from now on, as it was on the wire."""
    heard: list[tuple[bytes, Address]] = []

    def note(data: bytes, address: Address) -> None:
        heard.append((data, address))
        rig.link.inject(data, address)

    rig.on_way = note
    return heard


def accepted(rig: Watched) -> int:
    """Frames taken, of all sources."""
    return rig.station.picture.fleet.intakes[""].counts("memory")["frames"]


# ---------------------------------------------------------------- the same id twice


def test_b6_24_a_known_id_from_a_second_address(attack: Attack) -> None:
    """Not used and not answered, and alarmed. While both speak, start-class commands to that id are blocked, too,
    which is more than the catalogue asks: nobody can tell which of the two is ours. In the air it is steered on."""
    oracle = attack()
    for k in range(40):
        oracle.say("HEARTBEAT", 1, address=STRANGER, **heartbeat())
        oracle.say("GLOBAL_POSITION_INT", 1, address=STRANGER, **position(oracle, 60.0, 60.0, 5000 + 100 * k))
        oracle.run(0.1)
    vehicle = oracle.vehicle
    assert vehicle.address == HOME and vehicle.telemetry.custom_mode == 4 and vehicle.telemetry.armed
    assert vehicle.telemetry.position_m == oracle.twin.station.picture.fleet.vehicles[1].telemetry.position_m, (
        "states are not mixed"
    )
    assert vehicle.identity.blocked == "several vehicles use id 1" and vehicle.why_not_commanded == ""
    assert oracle.told("DUPLICATE ID")
    oracle.run(12.0)
    assert oracle.vehicle.identity.blocked == "", "over when it is over"
    oracle.holds(counted="second source of one system id", told="a second source uses this system id")


def test_b6_24_a_twin_on_the_ground_is_not_started(attack: Attack) -> None:
    oracle = attack(flying=False)
    oracle.run(20.0)
    for _ in range(40):
        oracle.say("HEARTBEAT", 1, address=STRANGER, **heartbeat())
        oracle.run(0.1)
    reply = oracle.flight.ask(m.Start(vehicles=(1, 2)))
    assert not reply.ok and "several vehicles use id 1" in str(reply)
    oracle.holds(counted="second source of one system id", told="DUPLICATE ID")


def test_b6_25_two_boards_with_one_id_on_one_address(attack: Attack) -> None:
    """Behind one radio frames of the two look alike: what we send reaches both, so nothing is sent."""
    oracle = attack(flying=False)
    oracle.run(20.0)
    uid = oracle.vehicle.identity.uid
    for _ in range(4):
        oracle.say("AUTOPILOT_VERSION", 1, **version(0xDEAD))
        oracle.run(0.2)
        oracle.say("AUTOPILOT_VERSION", 1, **version(0xBEEF))
        oracle.run(0.2)
    assert uid and oracle.told("DUPLICATE ID: several vehicles use id 1")
    assert "several vehicles use id 1" in oracle.vehicle.why_not_commanded
    assert not oracle.flight.ask(m.Start(vehicles=(1,))).ok
    oracle.holds(told="DUPLICATE ID", sends=to_home, less=to_home)


def test_b6_25_two_boards_with_one_id_on_two_links(attack: Attack) -> None:
    """The second link is asked for its identity (housekeeping only); another hardware id is a conflict."""
    oracle = attack(flying=False, more_links=lambda: [MemoryLink("second")])
    oracle.run(20.0)
    link = oracle.flight.further[0]
    encoder = oracle.frame
    for k in range(40):
        link.inject(encoder("HEARTBEAT", 1, **heartbeat()), ("far", 1))
        if k == 10:
            link.inject(encoder("AUTOPILOT_VERSION", 1, **version(0xDEAD)), ("far", 1))
        oracle.run(0.1)
    asked = [data for data, address in link.sent if address == ("far", 1)]
    assert asked and all(data[7:10] == b"\x4c\0\0" for data in asked), "COMMAND_LONG: who are you?"
    assert "several vehicles use id 1" in oracle.vehicle.why_not_commanded
    assert oracle.vehicle.address == HOME
    oracle.holds(counted="second source of one system id", told="DUPLICATE ID")


def test_b6_25_a_second_autopilot_within_five_seconds(attack: Attack) -> None:
    """Two boot clocks in turn on one address: found from their positions alone."""
    oracle = attack()
    for k in range(100):
        oracle.say("GLOBAL_POSITION_INT", 1, **position(oracle, 200.0, 200.0, 9_000_000 + 50 * k))
        oracle.run(0.05)
        if oracle.vehicle.identity.blocked:
            break
    assert oracle.vehicle.identity.blocked and oracle.now - oracle.begun_s <= 5.0
    oracle.holds(told="DUPLICATE ID", sends=lambda a, _: True, less=lambda a, _: True)


# ---------------------------------------------------------------- another address


def test_b6_26_a_signed_vehicle_behind_a_new_address(attack: Attack) -> None:
    """A NAT gave it another port: followed when the old one has been silent for 1.2 s; a relay speaks beside it."""
    oracle = attack(keyed=(1,))
    oracle.flight.moved[0] = ("nat", 5)
    oracle.flight.on_way = lambda data, address: oracle.inject(data, address)
    before = oracle.vehicle.last_heard_s
    while oracle.vehicle.last_heard_s == before or oracle.vehicle.address == HOME:
        oracle.run(0.05)
        assert oracle.now - oracle.begun_s < 1.6
    oracle.run(5.0)
    assert oracle.vehicle.address == ("nat", 5)
    assert oracle.vehicle.freshness(oracle.now) is Freshness.OK
    assert oracle.flight.phase(1) is m.Phase.FLYING
    new = {("nat", 5), HOME}
    oracle.holds(told="proven by its signature", sends=lambda a, _: a in new, less=lambda a, _: a in new)


def test_b6_26_an_unsigned_vehicle_behind_a_new_address(attack: Attack) -> None:
    """Only when the old address has been silent for 3 s; its identity is requested before anything else is sent."""
    oracle = attack()
    oracle.flight.moved[0] = ("nat", 5)
    oracle.run(2.5)
    assert oracle.vehicle.address == HOME, "not yet"
    assert {message for _, address, message, _ in oracle.sent() if address == ("nat", 5)} == set()
    while oracle.vehicle.address == HOME or not oracle.vehicle.identity.identified:
        oracle.run(0.05)
        assert oracle.now - oracle.begun_s < 5.0
    there = sorted(frame for frame in oracle.sent() if frame[1] == ("nat", 5))
    assert [message for _, _, message, _ in there[:2]] == ["COMMAND_LONG", "COMMAND_LONG"], "who are you?"
    oracle.run(10.0)
    assert oracle.vehicle.freshness(oracle.now) is Freshness.OK
    new = {("nat", 5), HOME}
    oracle.holds(told="now heard from another address", sends=lambda a, _: a in new, less=lambda a, _: a in new)


# ---------------------------------------------------------------- forged and replayed


def test_b6_27_a_forged_time_at_the_end_of_time(attack: Attack) -> None:
    oracle = attack(keyed=(1, 2))
    for link_id in range(4):
        forged = sign(oracle.frame("HEARTBEAT", 1, **heartbeat()), OTHER_KEY, link_id, MAX_TIMESTAMP)
        oracle.inject(forged, HOME)
        oracle.inject(forged, STRANGER)
    oracle.run(5.0)
    assert accepted(oracle.flight) == accepted(oracle.twin), "every genuine frame, and no other"
    assert oracle.vehicle.identity.signing is Signing.OURS
    oracle.holds(counted="signature: bad signature", told="unknown key")


def test_b6_28_a_hundred_thousand_forged_streams(attack: Attack) -> None:
    """Of 2^24 that there could be; the table has none of them."""
    oracle = attack(keyed=(1, 2))
    chance = random.Random(28)
    frame = oracle.frame("HEARTBEAT", 1, **heartbeat())

    def forged(number: int) -> tuple[bytes, Address]:
        tail = bytes((number & 255,)) + chance.randbytes(6) + b"forged"
        raw = bytearray(sign(frame, OTHER_KEY, number & 255, number)[:-13] + tail)
        return bytes(raw), (HOME, STRANGER)[number & 1]

    trust = oracle.flight.station.picture.trust._keyed_vehicles[("", 1)]
    before = len(trust.verifier.streams()["newest"])
    oracle.flood(forged(number) for number in range(100_000))
    assert len(trust.verifier.streams()["newest"]) == before
    assert trust.verifier.streams()["ahead"] == []
    assert accepted(oracle.flight) == accepted(oracle.twin)
    oracle.holds(counted="signature: bad signature", told="unknown key")


def test_b6_29_a_recording_of_ten_seconds_ago(attack: Attack) -> None:
    """From its own address and from elsewhere. Nothing goes to who plays it but a signed heartbeat a second: it could
    be the vehicle itself, whose clock is behind, and that tells it the time."""
    oracle = attack(keyed=(1, 2))
    heard = listening(oracle.flight)
    oracle.run(5.0)
    recording = list(heard)
    oracle.run(10.0)
    for data, address in recording:
        oracle.inject(data, address)
        oracle.inject(data, STRANGER)
    oracle.run(1.0)
    assert accepted(oracle.flight) == accepted(oracle.twin)
    assert oracle.vehicle.telemetry.position_m == oracle.twin.station.picture.fleet.vehicles[1].telemetry.position_m
    oracle.holds(counted="signature: old", told="old signatures", sends=lambda _, message: message == "HEARTBEAT")


def test_b6_30_a_recording_played_after_a_restart(attack: Attack) -> None:
    """What the station before accepted is known to the next one, whether it was closed or killed."""
    oracle = attack(keyed=(1, 2), flying=False)
    heard = listening(oracle.flight)
    oracle.run(58.0)
    recording = list(heard)
    for rig in (oracle.flight, oracle.twin):
        rig.sim.silence(0)
        rig.sim.silence(1)
        rig.link.receive()
        rig.start()
    oracle.others = ()
    oracle.begun_s, oracle.first_event = oracle.now, 0
    for data, address in recording:
        oracle.inject(data, address)
        oracle.inject(data, STRANGER)
    oracle.run(3.0)
    assert len(recording) > 1000 and accepted(oracle.flight) == 0
    assert oracle.flight.station.picture.fleet.vehicles == {}
    oracle.holds(counted="signature: old", told="clock is behind", sends=lambda _, message: message == "HEARTBEAT")


def test_b6_31_a_vehicle_that_signs_with_a_key_we_do_not_hold(attack: Attack) -> None:
    """Shown with its position, and not commanded: its signature proves nothing more.

    (It does not take our requests.)
    """
    oracle = attack(signs=(1,), flying=False)
    place = oracle.frame("GLOBAL_POSITION_INT", 1, **position(oracle, 60.0, 60.0, 30_000))
    oracle.inject(sign(place, KEY, 1, ticks(oracle.flight.clock.wall())), HOME)
    oracle.run(10.0)
    assert oracle.vehicle.identity.signing is Signing.UNKNOWN_KEY
    assert oracle.vehicle.telemetry.position_m == pytest.approx((60.0, 60.0, 20.0), abs=0.1)
    oracle.inject(sign(place, KEY, 1, ticks(oracle.flight.clock.wall())), HOME)
    oracle.run(0.2)
    reply = oracle.flight.ask(m.Start(vehicles=(1,)))
    assert not reply.ok
    frame = oracle.flight.frame
    assert frame is not None and frame.signing[0] == "unknown key" and "key" in frame.problem[0]
    assert "its frames: unknown key" in oracle.flight.texts("vehicle 1")
    oracle.holds()


@pytest.mark.parametrize("ahead_s", [HOUR, 10 * 365 * 24 * HOUR])
def test_b6_32_a_valid_key_with_a_clock_far_ahead(attack: Attack, ahead_s: int) -> None:
    """Another component of vehicle 1, say: that stream is not believed, all others are."""
    oracle = attack(keyed=(1, 2))
    for number in range(20):
        time = ticks(oracle.flight.clock.wall()) + ahead_s * TICKS_PER_S + number
        oracle.inject(sign(oracle.frame("HEARTBEAT", 1, 100, **heartbeat()), KEY, 7, time), HOME)
        oracle.run(0.1)
    assert accepted(oracle.flight) == accepted(oracle.twin)
    assert oracle.vehicle.identity.signing is Signing.OURS
    oracle.holds(
        counted="signature: ahead of our clock", told="more than 5 min ahead", sends=lambda _, name: name == "HEARTBEAT"
    )


@pytest.mark.parametrize("ahead_s", [59, 250])
def test_b6_33_our_time_is_not_pulled_far_ahead(attack: Attack, ahead_s: int) -> None:
    """By a genuine vehicle whose clock is ahead; nor by one at the very end of time."""
    oracle = attack(keyed=(1, 2), others=())
    for link_id, time in (
        (3, ticks(oracle.flight.clock.wall()) + ahead_s * TICKS_PER_S),
        (4, MAX_TIMESTAMP),
        (5, MAX_TIMESTAMP - 1),
    ):
        oracle.inject(sign(oracle.frame("SYSTEM_TIME", 1, time_unix_usec=1, time_boot_ms=2), KEY, link_id, time), HOME)
    oracle.run(2.0)
    now = ticks(oracle.flight.clock.wall())
    times = [
        int.from_bytes(data[-12:-6], "little")
        for t_s, address, data in oracle.flight.wire
        if address == HOME and data[2] & 1 and signature_matches(data, KEY) and t_s > oracle.begun_s
    ]
    assert times and max(times) <= now + 61 * TICKS_PER_S
    assert oracle.vehicle.path.slots[SYSTEM_TIME].raw, "the one whose time is possible"
    assert oracle.dropped()["signature: ahead of our clock"] == 2
    oracle.holds(counted="signature: ahead of our clock", sends=lambda _, name: name == "HEARTBEAT")


def test_b6_34_what_may_be_unsigned_though_there_is_a_key(attack: Attack) -> None:
    """RADIO_STATUS, which a modem puts in; nothing else."""
    oracle = attack(keyed=(1, 2))
    for _ in range(5):
        oracle.say("RADIO_STATUS", 1, **RADIO)
        oracle.say("RADIO_STATUS", 51, 68, address=HOME, **RADIO)
        oracle.say("STATUSTEXT", 1, severity=2, text=b"not believed")
        oracle.say("HEARTBEAT", 1, **heartbeat())
        oracle.run(0.2)
    assert not oracle.told("^not believed$")
    assert oracle.vehicle.telemetry.custom_mode == 4
    assert "txbuf 100" in oracle.flight.status().links[0].radio
    oracle.holds(counted="unsigned, though a key is set", told="unsigned frames are not used")


def test_b6_35_a_radio_status_with_a_bad_signature(attack: Attack) -> None:
    oracle = attack(keyed=(1, 2))
    for number in range(5):
        frame = oracle.frame("RADIO_STATUS", 1, **{**RADIO, "txbuf": 1})
        oracle.inject(sign(frame, OTHER_KEY, 0, ticks(oracle.flight.clock.wall()) + number), HOME)
        oracle.run(0.2)
    assert oracle.flight.status().links[0].radio == ""
    oracle.holds(counted="signature: bad signature", told="unknown key")


def test_b6_35_a_radio_status_from_a_stranger_throttles_no_vehicle(attack: Attack) -> None:
    """Not even if it sends heartbeats first: see case 20."""
    oracle = attack()
    oracle.say("HEARTBEAT", 77, address=STRANGER, **heartbeat())
    for _ in range(10):
        oracle.say("RADIO_STATUS", 77, address=STRANGER, **{**RADIO, "txbuf": 1})
        oracle.run(0.1)
    oracle.holds(counted="radio status from a stranger", sends=lambda address, _: address == STRANGER)


@pytest.mark.parametrize("keyed", [(), (1, 2)], ids=["no key", "key"])
def test_b6_36_setup_signing_from_a_vehicle(attack: Attack, keyed: tuple[int, ...]) -> None:
    """Not applied, not forwarded, in no log. From a keyed vehicle it is signed, else it would not come so far."""
    out: Address = ("other station", 1)

    def partner() -> tuple[Endpoint, ...]:
        link = MemoryLink(spec=LinkSpec("out", scheme="memory", place=""))
        link.partners = [out]
        return (Endpoint(link, commands=False),)

    oracle = attack(keyed=keyed, partners=partner)
    secret = bytes(SETUP["secret_key"])
    for number in range(3):
        frame = oracle.frame("SETUP_SIGNING", 1, **{**SETUP, "target_system": (0, 254, 2)[number]})
        if keyed:
            frame = sign(frame, KEY, 9, ticks(oracle.flight.clock.wall()) + number)
        oracle.inject(frame, HOME)
        oracle.run(0.1)
    oracle.run(1.0)
    oracle.flight.recorder.flush()
    logged = oracle.flight.recorder.path.read_bytes() + oracle.flight.journal.path.read_bytes()
    assert secret not in logged and oracle.flight.recorder.frames > 0
    forwarded = [data for data, _ in oracle.flight.forward[0].link.sent]
    assert forwarded and not any(secret in data or data[7:10] == b"\0\x01\0" for data in forwarded)
    assert [key.name for key in oracle.flight.station.picture.trust.store.keys] == ["ours"] if keyed else True
    oracle.holds(counted="SETUP_SIGNING from a vehicle", told="frames not taken: SETUP_SIGNING from a vehicle")


def test_b6_37_a_vehicle_stops_signing_in_flight(attack: Attack) -> None:
    """Told within 2 s. Its unsigned frames are not used at all, so it is LOST after that, which is more than the
    catalogue's "marked untrusted": what cannot be believed is not shown as its state."""
    oracle = attack(keyed=(1, 2))
    oracle.flight.sim.set_key(0, b"")
    oracle.run(1.95)
    assert oracle.told("stopped signing, or its frames are forged")
    before = oracle.vehicle.telemetry.position_m
    oracle.run(5.0)
    assert oracle.vehicle.telemetry.position_m == before
    assert oracle.vehicle.identity.signing is Signing.UNSIGNED
    assert oracle.vehicle.freshness(oracle.now) is Freshness.LOST
    oracle.holds(counted="unsigned, though a key is set", told="stopped signing", sends=to_home, less=to_home)
