"""Bytes from a wire become frames, whatever else is on the wire."""

import itertools
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import Frame, StreamCutter, cut_datagram

HEARTBEAT: dict[str, Any] = {
    "type": 2,
    "autopilot": 3,
    "base_mode": 81,
    "custom_mode": 4,
    "system_status": 3,
    "mavlink_version": 3,
}


def heartbeat(system: int = 1, **changed: int) -> bytes:
    return Encoder(system, 1).encode("HEARTBEAT", **(HEARTBEAT | changed))


def unknown_message(payload: bytes = b"abc", flags: int = 0) -> bytes:
    """Message id 70001 is in no dialect, so its CRC cannot be checked."""
    header = bytes([0xFD, len(payload), flags, 0, 9, 7, 1]) + (70001).to_bytes(3, "little")
    return header + payload + b"\x12\x34"


def version_1_heartbeat() -> bytes:
    link = pymavlink_all.MAVLink(None, srcSystem=3, srcComponent=1)
    return bytes(pymavlink_all.MAVLink_heartbeat_message(2, 3, 81, 4, 3, 3).pack(link, force_mavlink1=True))


def signed_heartbeat() -> bytes:
    link = pymavlink_all.MAVLink(None, srcSystem=5, srcComponent=1)
    link.signing.secret_key = bytes(32)  # PX4 without a key signs with zeros
    link.signing.sign_outgoing = True
    return bytes(pymavlink_all.MAVLink_heartbeat_message(2, 12, 81, 4, 3, 3).pack(link))


def test_one_frame_per_datagram_is_the_usual_case() -> None:
    raw = heartbeat(system=7)
    cut = cut_datagram(raw)
    assert cut == ([Frame(2, 0, 7, 1, 0, raw[10:-2], raw, False)], 0, 0, 0)


def test_version_1_and_signed_frames_are_cut_to_their_own_length() -> None:
    cut = cut_datagram(version_1_heartbeat() + signed_heartbeat() + heartbeat())
    assert [(f.version, f.system, f.signed, len(f.raw)) for f in cut.frames] == [
        (1, 3, False, 17),
        (2, 5, True, 34),
        (2, 1, False, 21),
    ]
    assert cut.junk_bytes == 0


def test_forty_frames_in_one_datagram_all_come_in_order() -> None:
    cut = cut_datagram(b"".join(heartbeat(system=n) for n in range(1, 41)))
    assert [frame.system for frame in cut.frames] == list(range(1, 41))


def test_junk_around_a_frame_costs_only_itself() -> None:
    for before, after in ((b"\xfd\xff\x01", b""), (b"", b"noise"), (b"\xfe", b"\xfd"), (b"\xfd\x00\x00", b"\xfe\x09")):
        cut = cut_datagram(before + heartbeat() + after)
        assert len(cut.frames) == 1, (before, after)
        assert cut.junk_bytes == len(before) + len(after)


def test_a_flipped_bit_is_a_bad_crc_and_does_not_hide_the_next_frame() -> None:
    broken = bytearray(heartbeat())
    broken[12] ^= 1
    cut = cut_datagram(bytes(broken) + heartbeat(system=2))
    assert [frame.system for frame in cut.frames] == [2]
    assert (cut.bad_crc, cut.junk_bytes) == (1, len(broken))


def test_a_frame_split_over_two_datagrams_is_lost_and_counted() -> None:
    raw = heartbeat()
    assert cut_datagram(raw[:9]) == ([], 9, 0, 0)
    assert cut_datagram(raw[9:]).frames == []


def test_frames_with_unknown_incompatibility_flags_are_dropped() -> None:
    raw = bytearray(heartbeat())
    for flags in (0x02, 0x03, 0x80, 0xFE):
        raw[2] = flags
        assert cut_datagram(bytes(raw)).frames == []


def test_any_compatibility_flags_are_fine() -> None:
    link = pymavlink_all.MAVLink(None, srcSystem=5, srcComponent=1)
    message = pymavlink_all.MAVLink_heartbeat_message(2, 3, 81, 4, 3, 3)
    raw = bytearray(message.pack(link))
    raw[3] = 0xFF
    crc = pymavlink_all.x25crc(raw[1:-2])
    crc.accumulate(bytes([message.crc_extra]))
    raw[-2:] = crc.crc.to_bytes(2, "little")
    assert len(cut_datagram(bytes(raw)).frames) == 1


def test_unknown_messages_are_kept_where_a_frame_is_expected() -> None:
    cut = cut_datagram(unknown_message() + heartbeat() + unknown_message())
    assert [frame.msgid for frame in cut.frames] == [70001, 0, 70001]
    assert cut.frames[0].payload == b"abc"


def test_what_looks_like_an_unknown_message_inside_junk_is_junk() -> None:
    data = b"x" + unknown_message()
    assert cut_datagram(data) == ([], len(data), 0, 0)
    followed_by_text = unknown_message() + b"text"
    assert cut_datagram(followed_by_text).frames == []


def test_the_boot_banner_of_ardupilot_is_no_error() -> None:
    banner = b"\n\nInit ArduCopter V4.7.0-dev\r\n\tfree RAM: 1234\n"
    assert cut_datagram(banner) == ([], 0, 0, len(banner))
    assert cut_datagram(b"0 ").junk_bytes == 0
    assert cut_datagram(b"\x00\x01").junk_bytes == 2
    assert cut_datagram(b"") == ([], 0, 0, 0)


def test_a_heartbeat_of_zeros_is_legal() -> None:
    raw = heartbeat(type=0, autopilot=0, base_mode=0, custom_mode=0, system_status=0, mavlink_version=0)
    assert raw[1] == 1  # MAVLink 2 cuts trailing zeros but keeps one byte
    assert len(cut_datagram(raw).frames) == 1


def test_a_stream_may_be_split_anywhere() -> None:
    stream = heartbeat(1) + signed_heartbeat() + version_1_heartbeat()
    for at in range(len(stream) + 1):
        cutter = StreamCutter()
        frames = cutter.feed(stream[:at]) + cutter.feed(stream[at:])
        assert [frame.system for frame in frames] == [1, 5, 3]
        assert cutter.junk_bytes == 0


def test_a_lying_length_delays_a_stream_but_loses_nothing() -> None:
    cutter = StreamCutter()
    frames = cutter.feed(b"\xfd\xff\x01" + heartbeat(1))
    assert frames == []  # might still be a frame of 280 bytes
    assert [frame.system for frame in cutter.flush()] == [1]
    assert cutter.junk_bytes == 3


def test_a_stream_gives_an_unknown_message_once_it_sees_what_follows() -> None:
    cutter = StreamCutter()
    assert cutter.feed(unknown_message()) == []
    assert [frame.msgid for frame in cutter.feed(heartbeat())] == [70001, 0]


PIECES = st.one_of(
    st.sampled_from([heartbeat(1), heartbeat(2), signed_heartbeat(), version_1_heartbeat(), unknown_message()]),
    st.binary(max_size=40),
    st.sampled_from([b"\xfd", b"\xfe\x00", b"\xfd\xff\x01", b"\xfd\x03\x00"]),
)


@given(st.lists(PIECES, max_size=8), st.lists(st.integers(0, 300), max_size=6))
def test_any_split_of_a_stream_gives_the_same_frames(pieces: list[bytes], cuts: list[int]) -> None:
    stream = b"".join(pieces)
    whole = StreamCutter()
    expected = whole.feed(stream) + whole.flush()
    bounds = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    split = StreamCutter()
    frames = [frame for a, b in itertools.pairwise(bounds) for frame in split.feed(stream[a:b])]
    frames += split.flush()
    assert frames == expected
    assert split.junk_bytes == whole.junk_bytes == len(stream) - sum(len(frame.raw) for frame in expected)


@given(st.binary(max_size=600))
def test_any_datagram_is_taken_without_an_error(data: bytes) -> None:
    cut = cut_datagram(data)
    assert sum(len(frame.raw) for frame in cut.frames) + cut.junk_bytes + cut.text_bytes == len(data)
