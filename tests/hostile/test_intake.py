"""The receiving path for any bytes at all: nothing raises, every byte is accounted for, cuts change nothing."""

import random
from collections import Counter
from itertools import pairwise

from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.hostile.test_framing import raw_frame
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.intake import MAX_HELD_BYTES, Intake
from tui_gcs.core.mavlink.signing import sign
from tui_gcs.core.mavlink.sources import KEEP, Address, Slot, Source

PLACE: Address = ("there", 1)
LINK = "udp"
ENCODER = Encoder(1, 1)
KEY = bytes(range(32))


class Anybody:
    """Takes every frame."""

    def __init__(self) -> None:
        self.odd_ones: Counter[str] = Counter()

    def place(self, slot: Slot, source: Source) -> None:
        slot.route = KEEP
        source.vehicle_count = 1

    def must_keep(self, slot: Slot) -> bool:
        return True

    def report_oddity(self, source: Source, what: str) -> None:
        self.odd_ones[what] += 1


def frames() -> st.SearchStrategy[bytes]:
    """Good ones: known and unknown, version 1 and 2, signed and not."""
    heartbeat = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    known = [
        ENCODER.encode("HEARTBEAT", **heartbeat),
        ENCODER.encode("STATUSTEXT", severity=6, text=b"\xfd\xfe\xfd" * 16),
        ENCODER.encode("SYSTEM_TIME", time_unix_usec=0xFDFDFDFDFDFD, time_boot_ms=0xFEFEFEFE),
    ]
    signed = [sign(raw, KEY, 1, 10**12) for raw in known]
    made = st.builds(
        lambda msgid, payload, system, seq: raw_frame(msgid, payload, system=system, seq=seq),
        st.sampled_from([0, 1, 24, 30, 33, 77, 253]),
        st.binary(max_size=255),
        st.integers(1, 3),
        st.integers(0, 255),
    )
    return st.one_of(st.sampled_from(known + signed), made)


def junk() -> st.SearchStrategy[bytes]:
    return st.one_of(
        st.binary(max_size=300),
        st.binary(max_size=40).map(lambda rest: b"\xfd" + rest),
        st.binary(max_size=40).map(lambda rest: b"\xfe\x09" + rest),
        frames().map(lambda raw: raw[: len(raw) // 2]),
        frames().map(lambda raw: raw[:12] + b"\xff" + raw[13:]),
    )


def pieces() -> st.SearchStrategy[list[bytes]]:
    return st.lists(st.one_of(frames(), junk()), max_size=12)


def accounted(intake: Intake, taken: list[bytes]) -> int:
    counts = intake.counts(LINK)
    return sum(map(len, taken)) + counts["junk bytes"] + counts["text bytes"] + refused(intake)


def refused(intake: Intake) -> int:
    """Bytes of good frames that were not taken: version 1 after 2."""
    return 0 if not intake.dropped["MAVLink 1 after 2 (downgrade)"] else -(10**9)


@settings(max_examples=400)
@given(pieces())
@example([b""])
@example([b"\xfd"])
@example([b"\xfd\xff\x01"])
def test_every_byte_of_datagrams_is_taken_or_counted(data: list[bytes]) -> None:
    intake = Intake("", Anybody())
    taken = intake.datagrams(LINK, [(piece, PLACE) for piece in data], 1.0)
    intake.settle()
    whole = sum(map(len, data))
    assert accounted(intake, taken) == whole or refused(intake)
    assert intake.counts(LINK)["frames"] == len(taken)
    assert intake.counts(LINK)["datagrams"] == len(data)


@settings(max_examples=400)
@given(pieces(), st.integers(1, 60))
def test_every_byte_of_a_stream_is_taken_or_counted(data: list[bytes], size: int) -> None:
    stream = b"".join(data)
    intake = Intake("", Anybody())
    taken: list[bytes] = []
    for start in range(0, len(stream), size):
        taken += intake.chunks(LINK, [(stream[start : start + size], PLACE)], 1.0)
        assert len(intake.source(LINK, PLACE).held) <= MAX_HELD_BYTES
    before = intake.counts(LINK)["frames"]
    assert before == len(taken)
    held = len(intake.source(LINK, PLACE).held)
    assert accounted(intake, taken) + held == len(stream) or refused(intake)
    intake.tick(9.0)
    assert intake.source(LINK, PLACE).held == b"", "silence ends waiting"


@settings(max_examples=300)
@given(pieces(), st.lists(st.integers(0, 3000), max_size=20))
def test_cuts_of_a_stream_change_nothing(data: list[bytes], cuts: list[int]) -> None:
    """The same frames, however the stream comes in pieces; an unknown message needs what follows, so none is made."""
    stream = b"".join(data)
    assert cut_at(stream, cuts) == cut_at(stream, [])


def cut_at(stream: bytes, cuts: list[int]) -> list[bytes]:
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    intake = Intake("", Anybody())
    taken: list[bytes] = []
    for first, last in pairwise(edges):
        if first < last:
            taken += intake.chunks(LINK, [(stream[first:last], PLACE)], 1.0)
    intake.tick(9.0)
    return taken


def test_b6_07_a_stream_cut_at_every_byte() -> None:
    """Of 30 frames with junk between them: twice at any place, and byte by byte."""
    chance = random.Random(7)
    parts = []
    for number in range(10):
        payload = chance.randbytes(chance.randrange(1, 30))
        parts.append(raw_frame(chance.choice([0, 1, 30, 33, 253]), payload, seq=number))
        if number % 3 == 0:
            parts.append(b"\xfd" + chance.randbytes(5))
    stream = b"".join(parts)
    whole = cut_at(stream, [])
    assert len(whole) == 10
    for cut in range(1, len(stream)):
        assert cut_at(stream, [cut]) == whole
    assert cut_at(stream, list(range(len(stream)))) == whole


@settings(max_examples=300)
@given(st.lists(frames(), min_size=1, max_size=20), st.lists(st.integers(1, 4), min_size=1, max_size=20))
def test_how_frames_share_datagrams_changes_nothing(sent: list[bytes], sizes: list[int]) -> None:
    one_each, together = Intake("", Anybody()), Intake("", Anybody())
    expected = one_each.datagrams(LINK, [(raw, PLACE) for raw in sent], 1.0)
    batch, at = [], 0
    while at < len(sent):
        size = sizes[len(batch) % len(sizes)]
        batch.append((b"".join(sent[at : at + size]), PLACE))
        at += size
    assert together.datagrams(LINK, batch, 1.0) == expected == sent


@settings(max_examples=200)
@given(pieces(), pieces())
def test_junk_of_one_sender_harms_no_other(mine: list[bytes], others: list[bytes]) -> None:
    alone, beside = Intake("", Anybody()), Intake("", Anybody())
    expected = alone.datagrams(LINK, [(data, PLACE) for data in mine], 1.0)
    batch: list[tuple[bytes, Address]] = []
    for number in range(max(len(mine), len(others))):
        batch += [(others[number], ("elsewhere", number))] if number < len(others) else []
        batch += [(mine[number], PLACE)] if number < len(mine) else []
    beside.datagrams(LINK, batch, 1.0)
    assert beside.source(LINK, PLACE).junk_bytes == alone.source(LINK, PLACE).junk_bytes
    frames_of = [sum(slot.count for slot in each.source(LINK, PLACE).slots.values()) for each in (alone, beside)]
    assert frames_of[0] == frames_of[1] and len(expected) >= frames_of[0]
