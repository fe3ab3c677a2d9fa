"""What a flood may cost: work, table and record are bounded for each sender, and vehicles stay heard."""

import pytest
from fastcrc.crc16 import mcrf4xx

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.mavlink import intake as intake_module
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import FrameScan, scan_step
from tui_gcs.core.mavlink.intake import (
    MAX_STEPS,
    MAX_STRANGER_DATAGRAM_BYTES,
    MAX_STRANGER_FRAMES,
    MAX_STRANGER_STEPS,
    STRANGER_FRAMES_PER_S,
    Intake,
)
from tui_gcs.core.mavlink.sources import CALL, STATE, VERSION_1_AFTER_S, Address, Slot, Source
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.station.reception import MAX_BYTES, Reception

HOME: Address = ("vehicle", 1)
STRANGER: Address = ("stranger", 1)
LINK = "udp"
UNKNOWN_V1 = bytes((0xFE, 0, 0, 1, 1, 3, 0, 0))
"""The shortest frame there is, of an id that no dialect knows: its CRC cannot be checked."""
BEAT = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}


class Owner:
    """Accepts a vehicle wherever a heartbeat comes from HOME."""

    def place(self, slot: Slot, source: Source) -> None:
        if source.address == HOME:
            source.vehicle_count = 1

    def must_keep(self, slot: Slot) -> bool:
        return True

    def report_oddity(self, source: Source, what: str) -> None:
        pass


def heartbeat(seq: int = 0, version: int = 2) -> bytes:
    encoder = Encoder(1, 1)
    raw = b""
    for _ in range(seq + 1):
        raw = encoder.encode("HEARTBEAT", **BEAT)
    if version == 2:
        return raw
    body = bytes((9, raw[4], 1, 1, 0)) + raw[10:19].ljust(9, b"\0")
    return b"\xfe" + body + int(mcrf4xx(body + b"\x32")).to_bytes(2, "little")


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for each step off the fast path."""
    made: list[int] = []

    def counted(data: bytes, done: FrameScan, *, final: bool) -> None:
        made.append(done.used)
        scan_step(data, done, final=final)

    monkeypatch.setattr(intake_module, "scan_step", counted)
    return made


@pytest.fixture
def intake() -> Intake:
    """A vehicle is at HOME."""
    made = Intake("", Owner())
    made.datagrams(LINK, [(heartbeat(), HOME)], 0.0)
    made.chunks("tcp", [(heartbeat(), HOME)], 0.0)
    return made


@pytest.mark.parametrize("flood", [UNKNOWN_V1, b"\xfd\0\0", heartbeat(), heartbeat(version=1)])
def test_a_strangers_datagram_costs_a_few_frames_whatever_is_in_it(
    intake: Intake, steps: list[int], flood: bytes
) -> None:
    data = flood * (1400 // len(flood))
    taken = intake.datagrams(LINK, [(data, STRANGER)], 1.0)
    assert len(steps) <= MAX_STRANGER_FRAMES
    assert len(taken) <= STRANGER_FRAMES_PER_S
    counts = intake.counts(LINK)
    assert counts["junk bytes"] >= len(data) - MAX_STRANGER_FRAMES * max(len(flood), 12), "the rest is counted"


def test_a_datagram_of_a_size_that_mavlink_never_has_is_junk(intake: Intake, steps: list[int]) -> None:
    data = heartbeat() * (MAX_STRANGER_DATAGRAM_BYTES // 21 + 1)
    assert intake.datagrams(LINK, [(data, STRANGER)], 1.0) == []
    assert (len(steps), intake.counts(LINK)["junk bytes"]) == (0, len(data))


def test_a_vehicles_long_datagram_is_taken_whole(intake: Intake, steps: list[int]) -> None:
    frames = [heartbeat(n) for n in range(60)] * 50
    assert intake.datagrams(LINK, [(b"".join(frames), HOME)], 1.0) == frames
    assert steps == []


def test_odd_frames_from_a_vehicles_address_are_bounded_too(intake: Intake, steps: list[int]) -> None:
    intake.datagrams(LINK, [(UNKNOWN_V1 * 8000, HOME)], 1.0)
    assert len(steps) == MAX_STEPS
    assert intake.counts(LINK)["junk bytes"] == len(UNKNOWN_V1) * (8000 - MAX_STEPS)


@pytest.mark.parametrize(("place", "most"), [(STRANGER, MAX_STRANGER_STEPS), (HOME, MAX_STEPS)])
@pytest.mark.parametrize("flood", [UNKNOWN_V1, b"\xfd\0\0", b"\xfd"])
def test_a_piece_of_a_stream_costs_so_much_at_most_and_the_next_is_heard(
    intake: Intake, steps: list[int], flood: bytes, place: Address, most: int
) -> None:
    intake.chunks("tcp", [(flood * (16384 // len(flood)), place)], 1.0)
    assert len(steps) <= most
    intake.chunks("tcp", [(b"", place)], 2.0)
    assert intake.chunks("tcp", [(heartbeat(1), place)], 2.0) == [heartbeat(1)]


def test_frames_of_no_vehicle_do_not_fill_the_record(intake: Intake) -> None:
    def second(now: float) -> int:
        return sum(len(intake.datagrams(LINK, [(heartbeat(), STRANGER)], now + n / 3000)) for n in range(2900))

    assert [second(1.0), second(2.0), second(3.0)] == [STRANGER_FRAMES_PER_S] * 3
    assert intake.dropped["from no known vehicle, more than is recorded"] == 3 * (2900 - STRANGER_FRAMES_PER_S)
    assert len(intake.datagrams(LINK, [(heartbeat(), HOME)] * 100, 3.0)) == 100


def test_one_forged_version_2_frame_does_not_end_a_version_1_vehicle(intake: Intake) -> None:
    def heard(version: int, now: float) -> bool:
        return bool(intake.datagrams(LINK, [(heartbeat(version=version), HOME)], now))

    assert not heard(1, 1.0), "a downgrade: version 2 came a second ago"
    assert heard(1, VERSION_1_AFTER_S)
    assert heard(1, 4.0)
    assert heard(2, 4.5), "the forged one"
    assert not heard(1, 5.0)
    assert not heard(1, 4.5 + VERSION_1_AFTER_S - 0.1)
    assert heard(1, 4.5 + VERSION_1_AFTER_S)


def test_while_version_2_goes_on_version_1_is_never_believed(intake: Intake) -> None:
    for n in range(100):
        assert intake.datagrams(LINK, [(heartbeat(), HOME)], n * 1.0)
        assert not intake.datagrams(LINK, [(heartbeat(version=1), HOME)], n + 0.5)


def test_a_stream_that_begins_anew_may_speak_version_1(intake: Intake) -> None:
    assert intake.chunks("tcp", [(heartbeat(version=1), HOME)], 0.5) == []
    intake.chunks("tcp", [(b"", HOME)], 0.6)
    assert intake.chunks("tcp", [(heartbeat(version=1), HOME)], 0.7) == [heartbeat(version=1)]


def test_what_was_placed_anew_before_it_settled_stays_as_it_was_placed(intake: Intake) -> None:
    (slot,) = intake.source(LINK, HOME).slots.values()
    settled: list[float] = []
    slot.route, slot.call = STATE, lambda slot, now: settled.append(now)
    intake.datagrams(LINK, [(heartbeat(), HOME)], 1.0)
    slot.route, slot.call = CALL, lambda slot, now: False
    intake.settle()
    assert slot.route == CALL
    assert intake.datagrams(LINK, [(heartbeat(), HOME)], 2.0) == []
    assert settled == []


class Unused:
    """Forwarder and recorder that take everything."""

    has_keys = False

    def feed(self, *of: object) -> None: ...

    def write_many(self, *of: object) -> None: ...


def reception(links: dict[str, MemoryLink]) -> Reception:
    clock = VirtualClock()
    events = EventLog(clock)
    fleet = VehicleRegistry(clock, events, LocalFrame(Origin(lat_deg=47.4, lon_deg=8.5, ground_amsl_m=0.0)), 255)
    unused: object = Unused()
    return Reception(links, fleet, unused, unused, unused, clock, events)  # type: ignore[arg-type]


def test_a_flooded_link_leaves_the_others_their_turn() -> None:
    links = {name: MemoryLink(name) for name in ("a", "b")}
    seen = reception(dict(links))
    for _ in range(5 * 2048):
        links["a"].inject(bytes(1400), STRANGER)
    links["b"].inject(heartbeat(), HOME)
    assert seen.receive() == 2048, "more than enough bytes: the other link is first the next time"
    assert links["a"].bytes_in > MAX_BYTES
    assert links["b"].bytes_in == 0
    seen.receive()
    assert links["b"].bytes_in == 21


def test_when_time_is_up_the_next_link_is_first_the_next_time() -> None:
    links = {name: MemoryLink(name) for name in ("a", "b", "c")}
    seen = reception(dict(links))
    for link in links.values():
        link.inject(heartbeat(), HOME)
    heard = []
    for _ in range(3):
        seen.receive(lambda: False)
        heard.append([name for name, link in links.items() if link.bytes_in])
    assert heard == [["a"], ["a", "b"], ["a", "b", "c"]]
