"""The hot path takes exactly the frames that are good, whatever surrounds them."""

from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.wire.encode import Encoder
from tui_gcs.core.wire.intake import Intake
from tui_gcs.core.wire.signing import sign
from tui_gcs.core.wire.sources import Slot, Source

HERE = ("127.0.0.1", 5000)


class Nobody:
    """An owner that wants nothing but the newest raw frames."""

    def place(self, slot: Slot, source: Source) -> None:
        source.bound = 1  # only where a vehicle is there is a fast path

    def odd(self, source: Source, what: str) -> None:
        pass


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
