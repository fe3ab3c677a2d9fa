"""Bad input B.6-1…23: what is no frame, and frames that are not what they say. One test per case of the catalogue."""

import random
import socket
from collections.abc import Callable, Iterator
from itertools import islice, product
from pathlib import Path

import pytest
from fastcrc.crc16 import mcrf4xx

from tests.core.rigs.link_rig import free_port
from tests.hostile.oracle import STRANGER, Oracle
from tui_gcs.core.links import Link, open_link
from tui_gcs.core.links.base import MAX_BYTES_PER_RECEIVE
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.intake import MAX_SLOTS
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.records.tlog_reader import read_tlog

pytestmark = pytest.mark.long  # nearly each is a flight

Attack = Callable[..., Oracle]
ROOT = Path(__file__).parents[2]
HOME: Address = ("sim", 0)
"""Where vehicle 1 is."""
HEARTBEAT = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
HELLO = bytes((0, 0, 0, 0, 2, 3, 81, 3, 3))
"""The same heartbeat as it is on the wire."""


def text(words: str, severity: int = 4) -> dict[str, object]:
    return {"severity": severity, "text": words.encode(), "id": 0, "chunk_seq": 0}


def raw_frame(
    msgid: int, payload: bytes, *, system: int = 1, component: int = 1, seq: int = 0, extra: int | None = None,
    incompat: int = 0, compat: int = 0, version: int = 2,
) -> bytes:  # fmt: skip
    """Any frame at all, with a valid checksum unless `extra` makes it invalid."""
    known = dialect.crc_extra(msgid) or b"\0"
    if version == 2:
        body = bytes((len(payload), incompat, compat, seq, system, component)) + msgid.to_bytes(3, "little") + payload
    else:
        body = bytes((len(payload), seq, system, component, msgid)) + payload
    crc = mcrf4xx(body + (known if extra is None else bytes((extra,))))
    return (b"\xfd" if version == 2 else b"\xfe") + body + crc.to_bytes(2, "little")


def recorded(path: Path, count: int) -> list[bytes]:
    """The first frames of a recording, of vehicles that we do not have."""
    return [frame.raw for _, frame in islice(read_tlog(path), 2 * count) if frame.system > 2][:count]


def housekeeping_to_stranger(address: Address, message: str) -> bool:
    """A sender of heartbeats gets our heartbeats and requests for its identity and clock, never more than that."""
    return address[0] == "stranger" and message in ("HEARTBEAT", "COMMAND_LONG", "TIMESYNC")


def to_home(address: Address, message: str) -> bool:
    """Vehicle 1 itself is hit, so it may be treated otherwise."""
    return address == HOME


# ---------------------------------------------------------------- junk


def test_b6_01_a_million_datagrams_of_one_byte(attack: Attack) -> None:
    """Nine of ten from a stranger, one from where vehicle 1 is."""
    oracle = attack()
    chance = random.Random(1)
    noise = chance.randbytes(1000)
    places: list[Address] = [HOME, *[("stranger", n) for n in range(9)]]
    oracle.flood((noise[n % 997 : n % 997 + 1], places[n % 10]) for n in range(1_000_000))
    link = oracle.flight.status().links[0]
    assert (
        oracle.dropped()["junk bytes"]
        + oracle.flight.station.picture.fleet.intakes[""].counts("memory")["text bytes"]
        - oracle.twin.station.picture.fleet.intakes[""].counts("memory")["text bytes"]
        == 1_000_000
    )
    assert link.datagrams >= 1_000_000
    oracle.holds(counted="junk bytes", told="frames not taken: junk bytes")


def test_b6_02_random_datagrams(attack: Attack) -> None:
    """As fast as a lock-step station takes them; 50,000 a second on a real socket are in test_flood."""
    oracle = attack()
    chance = random.Random(2)
    pool = [chance.randbytes(chance.randrange(1, 1500)) for _ in range(2048)]
    pool += [b"\xfd" + junk for junk in pool[:500]] + [b"\xfe" + junk for junk in pool[:500]]
    places: list[Address] = [HOME, *[("stranger", n) for n in range(7)]]
    oracle.flood((chance.choice(pool), places[n % 8]) for n in range(100_000))
    oracle.holds(counted="junk bytes", told="frames not taken: junk bytes")


def test_b6_02_datagrams_full_of_beginnings(attack: Attack) -> None:
    """The dearest junk: each byte or two could begin a frame. Searched for a while only, so it costs as any other."""
    oracle = attack()
    junk_bytes = 0
    for junk, size in product([b"\xfe\x00", b"\xfd", b"\xfd\xff\x00\x00\x00"], [1472, 65_507]):
        data = (junk * size)[:size]
        count = 4_000_000 // size * 2
        oracle.flood((data, (HOME, STRANGER)[number % 2]) for number in range(count))
        junk_bytes += count * size
        assert oracle.dropped()["junk bytes"] == junk_bytes, (junk, size)
    oracle.holds(counted="junk bytes", told="frames not taken: junk bytes")


@pytest.mark.parametrize(("place", "counted"), [(STRANGER, "junk bytes"), (HOME, "unknown message id")])
def test_b6_05_thousands_of_frames_in_one_datagram(attack: Attack, place: Address, counted: str) -> None:
    """Of kinds that nobody sent before, the dearest of all: more bytes than one look at a link takes."""
    oracle = attack()
    number = 0
    for _ in range(20):
        for _ in range(2):
            frames = [raw_frame(60_000 + number + n, b"", system=77, seq=n & 255) for n in range(5400)]
            oracle.inject(b"".join(frames), place)
            number += 5400
        oracle.run(0.05)
    oracle.holds(counted=counted)


def test_b6_05_a_look_at_a_real_link_is_bounded_in_bytes() -> None:
    link = open_link(f"udpin:127.0.0.1:{free_port()}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(10):
            sender.sendto(bytes(60_000), ("127.0.0.1", link.spec.port))
    sizes = [sum(len(data) for data, _ in link.receive()) for _ in range(10)]
    link.close()
    assert max(sizes) <= MAX_BYTES_PER_RECEIVE + 60_000
    assert sum(sizes) >= 3 * MAX_BYTES_PER_RECEIVE, "the others come with the next looks"


def test_b6_03_three_bytes_before_every_good_frame(attack: Attack) -> None:
    oracle = attack()

    def with_bait(data: bytes, address: Address) -> None:
        oracle.inject(b"\xfd\xff\x01", address)
        oracle.inject(data, address)

    oracle.flight.on_way = with_bait
    oracle.run(20.0)
    assert oracle.vehicle.loss_pct == 0.0
    frames = [rig.station.picture.fleet.intakes[""].counts("memory")["frames"] for rig in (oracle.flight, oracle.twin)]
    assert frames[0] == frames[1] > 500, "not one good frame is lost"
    oracle.holds(counted="junk bytes")


def test_b6_04_a_frame_in_two_datagrams(attack: Attack) -> None:
    oracle = attack()
    frame = oracle.frame("STATUSTEXT", 1, **text("in two pieces"))
    for cut in range(1, len(frame)):
        oracle.inject(frame[:cut], HOME)
        oracle.inject(frame[cut:], HOME)
    oracle.run(0.1)
    assert oracle.dropped()["junk bytes"] == len(frame) * (len(frame) - 1), "both halves are counted"
    assert not oracle.told("pieces")
    oracle.holds(counted="junk bytes", told="frames not taken: junk bytes")


@pytest.mark.parametrize("count", [2, 3, 40])
def test_b6_05_many_frames_in_one_datagram(attack: Attack, count: int) -> None:
    oracle = attack()
    words = [f"text {chr(65 + number)}" for number in range(count)]
    oracle.inject(b"".join(oracle.frame("STATUSTEXT", 1, **text(word)) for word in words), HOME)
    oracle.run(0.1)
    assert [event.text for event in oracle.told("^text")] == words
    oracle.holds()


def test_b6_06_a_good_frame_with_junk_behind_it(attack: Attack) -> None:
    oracle = attack()
    oracle.inject(oracle.frame("STATUSTEXT", 1, **text("good")) + b"\x00\x01\xfdjunk", HOME)
    oracle.run(0.1)
    assert oracle.told("^good$")
    assert oracle.dropped()["junk bytes"] == 7
    oracle.holds(counted="junk bytes")


# ---------------------------------------------------------------- byte streams


def test_b6_07_frames_split_at_every_byte_of_a_stream(attack: Attack) -> None:
    """Vehicle 1's bytes come one by one, vehicle 2's in pieces of 1 to 40 across frames; see test_intake, too."""
    oracle = attack(stream=True)
    chance = random.Random(7)
    waiting = b""

    def in_pieces(data: bytes, address: Address) -> None:
        nonlocal waiting
        if address == HOME:
            for byte in data:
                oracle.inject(bytes((byte,)), address)
            return
        waiting += data
        while len(waiting) > 40:
            size = chance.randrange(1, 41)
            oracle.inject(waiting[:size], address)
            waiting = waiting[size:]

    oracle.others = ()  # up to 40 of its bytes are always late
    oracle.flight.on_way = in_pieces
    oracle.run(20.0)
    for number in (1, 2):
        vehicle = oracle.flight.station.picture.fleet.vehicles[number]
        assert vehicle.loss_pct == 0.0 and vehicle.telemetry.armed
    assert oracle.dropped()["junk bytes"] == oracle.dropped()["bad CRC"] == 0
    oracle.holds(sends=lambda address, _: True, less=lambda address, _: True)  # set-points follow late positions


def test_b6_08_noise_on_a_serial_line(attack: Attack) -> None:
    """One byte in a hundred has a bit flipped: every frame that is whole itself is taken, whatever is before it."""
    oracle = attack(stream=True)
    chance = random.Random(8)
    whole = 0

    def noisy(data: bytes, address: Address) -> None:
        nonlocal whole
        if address != HOME:
            oracle.inject(data, address)
            return
        flipped = bytes(b ^ 1 << chance.randrange(8) if chance.random() < 0.01 else b for b in data)
        whole += flipped == data
        oracle.inject(flipped, address)
        held = [len(source.held) for source in oracle.flight.station.picture.fleet.intakes[""].sources.values()]
        assert max(held) <= 4096

    oracle.flight.on_way = noisy
    intake = oracle.flight.station.picture.fleet.intakes[""]
    source = next(s for s in intake.sources.values() if s.address == HOME)
    before = sum(slot.count for slot in source.slots.values())
    oracle.run(60.0)
    taken = sum(slot.count for slot in source.slots.values()) - before
    assert whole > 500
    assert taken >= 0.99 * whole
    oracle.holds(counted="bad CRC", told="frames not taken: bad CRC", sends=to_home, less=to_home)


@pytest.mark.parametrize("stream", [False, True], ids=["datagram", "stream"])
def test_b6_09_a_length_that_promises_more_than_comes(attack: Attack, stream: bool) -> None:
    oracle = attack(stream=stream)
    liar = b"\xfd\xff\x00\x00\x00\x01\x01\x00\x00\x00" + bytes(9)
    oracle.inject(liar, STRANGER)
    oracle.run(0.4)
    assert oracle.dropped()["junk bytes"] == (0 if stream else len(liar))
    oracle.run(0.3)
    assert oracle.dropped()["junk bytes"] == len(liar), "a stream waits 500 ms for the rest"
    oracle.run(30.0)  # the vehicles' boot texts are junk on a stream, and told before
    oracle.holds(counted="junk bytes", told="frames not taken: junk bytes")


# ---------------------------------------------------------------- lengths, checksums, flags


def test_b6_10_a_heartbeat_of_zeros_cut_off(attack: Attack) -> None:
    """No payload at all is legal by the truncation rule: a generic vehicle of a generic autopilot."""
    oracle = attack()
    for _ in range(20):
        oracle.inject(raw_frame(0, b"", system=77), STRANGER)
        oracle.run(0.1)
    frame = oracle.flight.frame
    assert frame is not None
    row = frame.ids.index(77)
    assert (frame.autopilot[row], frame.vehicle_type[row]) == ("generic", "generic")
    oracle.holds(told="heard on", sends=housekeeping_to_stranger)


def test_b6_11_a_message_longer_than_we_know_it(attack: Attack) -> None:
    oracle = attack()
    payload = b"\x04" + b"from the future".ljust(53, b"\0") + b"\xff" * 40
    oracle.inject(raw_frame(253, payload), HOME)
    oracle.run(0.1)
    assert [event.text for event in oracle.told("future")] == ["from the future"]
    oracle.holds()


def test_b6_12_a_wrong_checksum(attack: Attack) -> None:
    oracle = attack()
    for place in (HOME, STRANGER):
        for bit in range(8, 8 * 20):
            raw = bytearray(oracle.frame("STATUSTEXT", 1, **text("not to be seen")))
            raw[bit // 8] ^= 1 << bit % 8
            if raw[1] == oracle.frame("STATUSTEXT", 1, **text("not to be seen"))[1]:
                oracle.inject(bytes(raw), place)
    oracle.run(0.1)
    assert not oracle.told("to be seen")
    oracle.holds(counted="bad CRC", told="frames not taken: bad CRC")


def test_b6_13_another_dialect(attack: Attack) -> None:
    oracle = attack()
    for number in range(25):
        oracle.inject(raw_frame(253, b"\x04hello", seq=number, extra=17), HOME)
    oracle.run(0.1)
    assert not oracle.told("^hello")
    assert len(oracle.told("dialect differs: STATUSTEXT")) == 1
    oracle.holds(counted="bad CRC", told="dialect differs")


def test_b6_14_an_unknown_message_of_a_vehicle_with_a_key(attack: Attack) -> None:
    """Its checksum cannot be checked; without a signature it is neither delivered, recorded nor kept."""
    oracle = attack(keyed=(1,))
    marker = b"never recorded"
    oracle.inject(raw_frame(70_001, marker, extra=99), HOME)
    oracle.inject(raw_frame(70_001, marker, extra=99), STRANGER)
    oracle.run(1.0)
    oracle.flight.recorder.flush()
    assert marker not in oracle.flight.recorder.path.read_bytes()
    oracle.holds(counted="unsigned, though a key is set", told="unsigned frames are not used")


def test_b6_15_flags(attack: Attack) -> None:
    """Unknown incompatibility flags make a frame unreadable, compatibility flags say nothing."""
    oracle = attack()
    payload = b"\x04" + b"flags"
    for flags in range(2, 255):
        oracle.inject(raw_frame(253, payload, incompat=flags), HOME)
        oracle.inject(raw_frame(253, payload, incompat=flags) + bytes(13), HOME)
    oracle.run(0.1)
    assert not oracle.told("flags")
    oracle.inject(raw_frame(253, payload, compat=0xFF), HOME)
    oracle.run(0.1)
    assert len(oracle.told("^flags$")) == 1
    oracle.holds(counted="junk bytes", told="frames not taken: junk bytes")


@pytest.mark.parametrize("keyed", [(), (1,)], ids=["no key", "key"])
def test_b6_16_version_1_after_version_2(attack: Attack, keyed: tuple[int, ...]) -> None:
    oracle = attack(keyed=keyed)
    for number in range(8):
        oracle.inject(raw_frame(253, b"\x04downgraded".ljust(51, b"\0"), seq=number, version=1), HOME)
    oracle.run(0.1)
    assert not oracle.told("downgraded")
    oracle.holds(counted="MAVLink 1 after 2 (downgrade)", told="MAVLink 1 frames after MAVLink 2")


def test_b6_16_version_1_from_another_address_of_a_vehicle_with_a_key(attack: Attack) -> None:
    oracle = attack(keyed=(1,))
    for number in range(8):
        oracle.inject(raw_frame(253, b"\x04downgraded".ljust(51, b"\0"), seq=number, version=1), STRANGER)
    oracle.run(0.1)
    assert not oracle.told("downgraded")
    oracle.holds(counted="MAVLink 1 (downgrade), though a key is set", told="unsigned frames are not used")


# ---------------------------------------------------------------- who sends


def test_b6_17_system_id_0(attack: Attack) -> None:
    oracle = attack()
    for place in (HOME, STRANGER):
        oracle.say("HEARTBEAT", 0, address=place, **HEARTBEAT)
        oracle.say("STATUSTEXT", 0, address=place, **text("from nobody"))
    oracle.run(0.1)
    assert 0 not in oracle.flight.station.picture.fleet.vehicles and not oracle.told("nobody")
    oracle.holds(counted="system id 0", told="frames not taken: system id 0")


def test_b6_18_our_own_system_id(attack: Attack) -> None:
    oracle = attack()
    for place in (HOME, STRANGER):
        for name, fields in (("HEARTBEAT", HEARTBEAT), ("STATUSTEXT", text("it is me"))):
            oracle.say(name, 254, 190, address=place, **fields)
    oracle.run(0.1)
    assert 254 not in oracle.flight.station.picture.fleet.vehicles and not oracle.told("it is me")
    oracle.holds(counted="our own system id", told="another station uses our system id 254")


def test_b6_19_a_component_that_is_no_autopilot(attack: Attack) -> None:
    """A component's heartbeat does not change a known vehicle; an unknown id does not become a vehicle."""
    oracle = attack()
    disarmed = {**HEARTBEAT, "base_mode": 0, "custom_mode": 9}
    for system, component in ((77, 0), (78, 190), (79, 255)):
        counted = oracle.dropped()["not a vehicle"]
        for _ in range(10):
            oracle.say("HEARTBEAT", 1, component, **disarmed)
            oracle.say("HEARTBEAT", system, component, address=STRANGER, **disarmed)
            oracle.run(0.1)
        told = oracle.vehicle.telemetry
        assert oracle.vehicle.component == 1 and told.armed and told.custom_mode == 4
        assert system not in oracle.flight.station.picture.fleet.vehicles
        assert (1, component) in oracle.vehicle.path.source.streams, "it is heard, as what it is"
        assert oracle.dropped()["not a vehicle"] > counted
    oracle.holds(counted="not a vehicle")


def test_b6_20_every_system_and_component_sends_heartbeats(attack: Attack) -> None:
    """Our vehicles' ids, too, from the flooder's address: a conflict, which stops no set-point (see case 24)."""
    oracle = attack()
    beats = (
        (raw_frame(0, HELLO, system=system, component=component), ("stranger", system % 16))
        for component in range(1, 256)
        for system in range(1, 256)
    )
    oracle.flood(beats)
    fleet = oracle.flight.station.picture.fleet
    assert len(fleet.vehicles) <= 2 + 64
    assert {1, 2} <= set(fleet.vehicles)
    assert fleet.vehicles[1].address == HOME
    assert set(oracle.flight.station.flight.flights.by_id) == {1, 2}, "nobody joins a team by saying so"
    oracle.holds(
        counted="vehicle table full", told="frames not taken: vehicle table full", sends=housekeeping_to_stranger
    )


def test_b6_21_what_is_no_vehicle(attack: Attack) -> None:
    """Ground stations, antenna trackers, ADS-B receivers, cameras, gimbals. Ordinary on a link, so only counted."""
    oracle = attack()
    kinds = [(6, 8), (5, 8), (27, 8), (30, 8), (6, 3), (26, 3), (18, 3), (30, 3), (27, 0)]
    for system, (kind, autopilot) in enumerate(kinds, start=71):
        counted = oracle.dropped()["not a vehicle"]
        for _ in range(5):
            oracle.say("HEARTBEAT", system, address=STRANGER, **{**HEARTBEAT, "type": kind, "autopilot": autopilot})
            oracle.run(0.2)
        assert system not in oracle.flight.station.picture.fleet.vehicles, (kind, autopilot)
        assert oracle.dropped()["not a vehicle"] > counted, (kind, autopilot)
    oracle.holds(counted="not a vehicle")


def test_b6_22_sequence_numbers_that_mean_nothing(attack: Attack) -> None:
    """Four kinds of nonsense in one flight, half a minute each."""
    oracle = attack()
    chance = random.Random(22)
    order, number = "", 0

    def renumbered(data: bytes, address: Address) -> None:
        nonlocal number
        if address != HOME or data[0] != 0xFD:
            oracle.inject(data, address)
            return
        number += 1
        seq = {"random": chance.randrange(256), "backwards": -number & 255, "the same": 5}.get(
            order, number * 128 & 255
        )
        msgid = int.from_bytes(data[7:10], "little")
        payload = data[10 : 10 + data[1]]
        oracle.inject(raw_frame(msgid, payload, component=data[6], seq=seq), address)

    oracle.flight.on_way = renumbered
    for order in ("random", "backwards", "the same", "steps of 128"):
        for _ in range(30):
            oracle.run(1.0)
            assert 0.0 <= oracle.vehicle.loss_pct <= 100.0
            assert all(stream.lost >= 0 for stream in oracle.vehicle.path.streams)
        assert oracle.vehicle.telemetry.armed and oracle.now - oracle.vehicle.telemetry.position_s < 1.0, order
    oracle.holds(sends=to_home, less=to_home)  # its rates look odd, so it is asked again


# ---------------------------------------------------------------- more than can be read


@pytest.mark.skipif(not Path("/proc/net/udp").exists(), reason="only Linux tells what it drops")
def test_b6_23_a_recording_replayed_far_too_fast(attack: Attack) -> None:
    """On a real socket, whose queue is the bound. The system drops the newest there, not the oldest: said and counted.

    Nothing of our own queues: what is read is handled at once.
    """
    links: list[Link] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

        def a_real_link() -> list[Link]:
            if links:
                return []  # the twin has none
            links.append(open_link(f"udpin:127.0.0.1:{free_port()}"))
            sender.connect(("127.0.0.1", links[0].spec.port))
            return [links[0]]

        oracle = attack(more_links=a_real_link)
        frames = recorded(ROOT / "tests/data/px4-8.tlog", 2000)
        drained_s = []
        for _ in range(10):
            for number in range(30_000):
                sender.send(frames[number % len(frames)])
            oracle.run(0.05)
        for _ in range(20):
            oracle.run(0.05)
            drained_s.append(not links[0].receive())
        assert drained_s[-1], "all is read within a second"
        assert oracle.flight.status().links[1].kernel_drops > 0
        links[0].close()
    oracle.holds(counted="kernel drops", told="overload", sends=lambda address, _: address[0] == "127.0.0.1")


def test_b6_20_every_kind_of_frame_from_everybody(attack: Attack) -> None:
    """Tables are bounded in what is kept per message, too, and a full table costs no time."""
    oracle = attack()
    chance = random.Random(20)
    ids = [msgid for msgid in range(400) if dialect.is_known(msgid)] + list(range(50_000, 50_100))

    def frames() -> Iterator[tuple[bytes, Address]]:
        for number in range(100_000):
            system, component = chance.choice([1, 2, *range(1, 250)]), chance.randrange(1, 256)
            place = HOME if system == 1 else ("stranger", number % 8)
            msgid = 0 if chance.random() < 0.2 else chance.choice(ids)
            payload = HELLO if msgid == 0 else b"\x01"
            if msgid not in (109, 166, 253):  # what a radio says where vehicle 1 is, is believed
                yield raw_frame(msgid, payload, system=system, component=component, seq=number & 255), place

    oracle.flood(frames())
    intake = oracle.flight.station.picture.fleet.intakes[""]
    assert sum(len(source.slots) + len(source.unknown) for source in intake.sources.values()) <= MAX_SLOTS
    assert len(oracle.vehicle.path.streams) <= 33
    oracle.holds(
        counted="too many components of one system",
        sends=lambda address, _: address != ("sim", 1),
        less=lambda address, _: address == HOME,  # somebody speaks for it from its own address
    )
