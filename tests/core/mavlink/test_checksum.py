"""The CRC checked over a whole frame agrees with the one cut out, recomputed and compared."""

from fastcrc.crc16 import mcrf4xx
from hypothesis import example, given
from hypothesis import strategies as st

from tui_gcs.core.mavlink.checksum import BEFORE_MAGIC, HIGH, LOW, residue


def judged(raw: bytes, extra: bytes) -> bool:
    return bool(mcrf4xx(raw, BEFORE_MAGIC) == LOW[raw[-2]] ^ HIGH[raw[-1]] ^ residue(extra))


@given(st.binary(min_size=9, max_size=270), st.binary(min_size=1, max_size=1), st.integers(0, 0xFFFF))
@example(bytes(9), b"\0", 0)
@example(bytes(9), b"\xff", 0xFFFF)
def test_a_frame_is_good_exactly_if_it_ends_in_its_crc(content: bytes, extra: bytes, other: int) -> None:
    right = mcrf4xx(content + extra)
    assert judged(b"\xfd" + content + right.to_bytes(2, "little"), extra)
    assert judged(b"\xfd" + content + other.to_bytes(2, "little"), extra) == (other == right)


@given(st.binary(min_size=9, max_size=60), st.integers(1, 255))
def test_another_first_byte_makes_it_bad(content: bytes, changed: int) -> None:
    raw = b"\xfd" + content + mcrf4xx(content + b"\x32").to_bytes(2, "little")
    assert not judged(bytes([raw[0] ^ changed]) + raw[1:], b"\x32")


def test_every_wrong_crc_of_one_frame_is_seen() -> None:
    content = b"\x09\x00\x00\x07\x01\x01\x00\x00\x00\x04\x00\x00\x00\x02\x03\x51\x03\x03"
    good = [crc for crc in range(65536) if judged(b"\xfd" + content + crc.to_bytes(2, "little"), b"\x32")]
    assert good == [mcrf4xx(content + b"\x32")]
