"""The hot path takes exactly the frames that are good, whatever surrounds them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import common as version1

from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.intake import Intake
from tui_gcs.core.mavlink.signing import sign
from tui_gcs.core.mavlink.sources import Slot, Source

HERE = ("127.0.0.1", 5000)


class Nobody:
    """An owner that wants nothing but the newest raw frames."""

    def place(self, slot: Slot, source: Source) -> None:
        source.vehicle_count = 1  # only where a vehicle is there is a fast path

    def report_oddity(self, source: Source, what: str) -> None:
        pass


class Judge(Nobody):
    """An owner that believes nobody, or everybody; `heard` is what it was handed."""

    def __init__(self, *, believes: bool, bound: int = 1) -> None:
        self.believes, self.bound = believes, bound
        self.oddities: list[str] = []

    def place(self, slot: Slot, source: Source) -> None:
        source.vehicle_count = self.bound
        slot.gate = lambda raw: self.believes

    def report_oddity(self, source: Source, what: str) -> None:
        self.oddities.append(what)


def attitudes(count: int, *, signed: bool = False) -> list[bytes]:
    encoder = Encoder(7, 1)
    plain = [
        encoder.encode("ATTITUDE", time_boot_ms=n, roll=0.1, pitch=0.2, yaw=n, rollspeed=0, pitchspeed=0, yawspeed=n)
        for n in range(count)
    ]
    return [sign(raw, bytes(32), 0, 10**9 + n) for n, raw in enumerate(plain)] if signed else plain


def warm() -> Intake:
    """It knows the message from there already, so that the fast path is what is tested."""
    intake = Intake("", Nobody())
    intake.datagrams("x", [(attitudes(1)[0], HERE)], 0.0)
    return intake


@given(st.booleans(), st.integers(0, 200), st.integers(1, 255))
def test_a_frame_with_any_byte_changed_is_not_taken_as_what_it_was(signed: bool, at: int, change: int) -> None:
    raw = attitudes(2, signed=signed)[1]
    at %= len(raw) - (13 if signed else 0)  # the CRC says nothing of the signature behind it
    damaged = raw[:at] + bytes([raw[at] ^ change]) + raw[at + 1 :]
    taken = warm().datagrams("x", [(damaged, HERE)], 1.0)
    assert damaged not in taken or at in (7, 8, 9)  # another message id may be one that nobody can check


@given(st.lists(st.booleans(), min_size=1, max_size=6))
def test_several_frames_in_one_datagram_are_all_taken_in_order(kinds: list[bool]) -> None:
    frames = [attitudes(n + 1, signed=signed)[n] for n, signed in enumerate(kinds)]
    intake = warm()
    assert intake.datagrams("x", [(b"".join(frames), HERE)], 1.0) == frames
    assert intake.counts("x")["junk bytes"] == 0


def test_a_cut_frame_costs_itself_only() -> None:
    first, second = attitudes(2)
    intake = warm()
    assert intake.datagrams("x", [(first[:20], HERE), (second, HERE), (second[:5], HERE)], 1.0) == [second]
    assert intake.counts("x")["junk bytes"] == 25


def test_an_empty_datagram_is_nothing() -> None:
    intake = warm()
    assert intake.datagrams("x", [(b"", HERE), (b"", ("127.0.0.1", 6000))], 1.0) == []
    assert intake.counts("x")["junk bytes"] == 0


BANNER = b"ArduCopter V4.7.0-dev (12345678)\r\n"
OLD = version1.MAVLink_heartbeat_message(2, 3, 81, 4, 3, 3).pack(version1.MAVLink(None, srcSystem=9, srcComponent=1))
WAYS = {
    "the first one": lambda frames: [frames[0]],
    "one by one": lambda frames: frames,
    "all at once": lambda frames: [b"".join(frames)],
    "behind junk": lambda frames: [b"\x00\x01\xff" + frame for frame in frames],
    "version 1": lambda frames: [OLD],
}


@pytest.mark.parametrize("way", WAYS)
def test_who_is_not_believed_is_taken_in_no_way(way: str) -> None:
    pieces = WAYS[way](attitudes(5))
    for believes in (True, False):
        datagrams, stream = Intake("", Judge(believes=believes)), Intake("", Judge(believes=believes))
        taken = datagrams.datagrams("x", [(attitudes(1)[0], HERE), *((piece, HERE) for piece in pieces)], 1.0)
        streamed = stream.chunks("x", [(piece, HERE) for piece in pieces], 1.0)
        assert (bool(taken), bool(streamed)) == (believes, believes)
        counted = [slot.count for each in (datagrams, stream) for slot in each.source("x", HERE).slots.values()]
        assert all(counted) is believes, "nor shown"


def test_bytes_of_a_stream_become_the_same_frames_in_pieces_of_any_size() -> None:
    frames = attitudes(20)
    data = b"\x01\x02" + b"".join(frames[:10]) + b"\xfd\x09noise" + b"".join(frames[10:])
    for size in (1, 7, 40, 1000):
        intake = Intake("", Nobody())
        taken = [
            raw
            for at in range(0, len(data), size)
            for raw in intake.chunks("x", [(data[at : at + size], HERE)], at / 1e4)
        ]
        assert taken == frames and intake.counts("x")["junk bytes"] == 9
        assert intake.counts("x")["frames"] == 20


def test_what_was_cut_off_when_a_stream_fell_silent_or_ended_is_junk() -> None:
    first, second = attitudes(2)
    for ends in (True, False):
        intake = Intake("", Nobody())
        intake.chunks("x", [(first[:-3], HERE)], 1.0)
        intake.tick(1.4)
        assert intake.counts("x")["junk bytes"] == 0, "the rest may come"
        if ends:
            intake.chunks("x", [(b"", HERE)], 1.5)
        else:
            intake.tick(1.6)
        assert intake.counts("x")["junk bytes"] == len(first) - 3
        assert intake.chunks("x", [(second, HERE)], 2.0) == [second]


@pytest.mark.parametrize(("again", "lost"), [(False, 6), (True, 0)])
def test_what_is_missing_in_the_count_was_lost_unless_it_connected_anew(again: bool, lost: int) -> None:
    frames = attitudes(10)
    intake = Intake("", Nobody())
    intake.chunks("x", [(frame, HERE) for frame in frames[:3]], 1.0)
    if again:
        intake.chunks("x", [(b"", HERE)], 1.5)
    intake.chunks("x", [(frames[9], HERE)], 2.0)
    (stream,) = intake.source("x", HERE).streams.values()
    assert stream.lost == lost


def test_a_banner_is_text_and_text_behind_a_frame_is_junk() -> None:
    intake = warm()
    intake.datagrams("x", [(BANNER, HERE)], 1.0)
    assert (intake.counts("x")["text bytes"], intake.counts("x")["junk bytes"]) == (len(BANNER), 0)
    intake.datagrams("x", [(attitudes(2)[1] + BANNER, HERE), (b"\x00" + BANNER, HERE)], 2.0)
    assert (intake.counts("x")["text bytes"], intake.counts("x")["junk bytes"]) == (len(BANNER), 2 * len(BANNER) + 1)


def test_a_wrong_crc_is_counted_once_for_each_frame_and_hints_at_another_dialect() -> None:
    owner = Judge(believes=True)
    intake = Intake("", owner)
    frame = attitudes(1)[0]
    for number in range(20):
        assert owner.oddities == []
        intake.datagrams("x", [(frame[:-1] + bytes([frame[-1] ^ 1]), HERE)], float(number))
        assert intake.counts("x")["bad CRC"] == number + 1
    assert owner.oddities == ["dialect differs: ATTITUDE"]


def test_a_damaged_frame_among_good_ones_costs_itself_and_is_counted_once() -> None:
    first, second, third, fourth = attitudes(4)
    damaged = second[:12] + bytes([second[12] ^ 1]) + second[13:]
    intake = warm()
    assert intake.datagrams("x", [(first + damaged + third + fourth, HERE)], 1.0) == [first, third, fourth]
    assert (intake.counts("x")["bad CRC"], intake.counts("x")["junk bytes"]) == (1, len(damaged))


def test_junk_and_text_of_strangers_are_counted() -> None:
    intake = Intake("", Nobody())
    intake.datagrams("x", [(b"\x00\x01junk\xff", HERE), (BANNER, ("127.0.0.1", 6000))], 1.0)
    assert (intake.counts("x")["junk bytes"], intake.counts("x")["text bytes"]) == (7, len(BANNER))
    intake.datagrams("x", [(b"\xfd" * 60_000, ("127.0.0.1", 7000))], 1.0)
    assert intake.counts("x")["junk bytes"] == 60_007, "as big as no vehicle sends: not even looked at"


def test_what_is_counted_is_so_also_of_sources_that_were_forgotten() -> None:
    intake = Intake("", Judge(believes=True, bound=0))
    for port in range(1100):
        intake.datagrams("x", [(OLD, ("127.0.0.1", port))], float(port))
    assert len(intake.sources) < 1100 and intake.counts("x")["frames"] == 1100
