"""Frames: cuts bytes into MAVLink frames, version 1 and 2, checks the CRC, and decodes whole frames.

Framing: https://mavlink.io/en/guide/serialization.html. A frame of a message that the dialect does not know cannot be
checked (its CRC includes a number from the dialect). Such a frame is kept, so that it can be counted and recorded, but
only where a frame is expected: at the start or directly behind a good frame, and ending where the data ends or another
frame begins. Frames with incompatibility flags other than "signed" are dropped, as the standard demands.
"""

import re
import struct
from dataclasses import dataclass, field
from typing import NamedTuple

from fastcrc.crc16 import mcrf4xx

from tui_gcs.core.mavlink import dialect

# The first byte of a frame gives its version.
MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
SIGNED = 0x01
"""Incompatibility flag: 13 bytes of signature follow the CRC."""
# Link id, 6 bytes of time and 6 bytes of hash (docs/threats.md A.1).
SIGNATURE_BYTES = 13
_OVERHEAD_V1 = 8  # 6 header, 2 CRC
_OVERHEAD_V2 = 12  # 10 header, 2 CRC
_TRAILER_V2 = {0: 0, SIGNED: SIGNATURE_BYTES}  # by incompatibility flags
_HEADER_V2 = struct.Struct("<xBBxBBBHB").unpack_from  # length, flags, seq, system, component, message id 16 + 8 bits
MAGIC = re.compile(rb"[\xfd\xfe]")
_NOT_TEXT = re.compile(rb"[^\t\n\r -~]")


class Frame(NamedTuple):
    """One MAVLink frame as it was on the wire. `payload` may be shorter than the message (zeros are cut off)."""

    version: int
    """MAVLink version, 1 or 2."""
    seq: int
    system: int
    component: int
    msgid: int
    payload: bytes
    raw: bytes
    """The whole frame, signature included."""
    signed: bool
    """It carries a signature, which is not checked here: PX4 signs with a zero key when it has none."""


class DatagramFrames(NamedTuple):
    """The contents of a datagram."""

    frames: list[Frame]
    junk_bytes: int
    """Bytes that belong to no good frame."""
    bad_crc: int
    """Complete frames of known messages with a wrong CRC."""
    text_bytes: int = 0
    """Plain text, as ArduPilot's boot banner: neither frames nor an error."""


@dataclass(slots=True)
class FrameScan:
    """Progress through a piece of a byte stream; see `scan`."""

    frames: list[Frame] = field(default_factory=list)
    used: int = 0
    junk_bytes: int = 0
    bad_crc: int = 0
    bad_msgid: int = 0
    """Message id of the newest complete frame with a wrong CRC."""
    good: int = 0
    """How many frames were good, also those that were taken out of `frames`."""
    in_sync: bool = True


def cut_datagram(data: bytes) -> DatagramFrames:
    """Return the frames of one UDP datagram. A frame lies wholly in one datagram, so nothing is carried over."""
    size = len(data)
    # Nearly every datagram is one good frame.
    if size >= _OVERHEAD_V2 and data[0] == MAGIC_V2 and size == _OVERHEAD_V2 + data[1] + _TRAILER_V2.get(data[2], size):
        frame = _frame_v2(data)
        if frame is not None:
            return DatagramFrames([frame], 0, 0)
    done = FrameScan()
    scan(data, done, final=True)
    if not done.frames and done.junk_bytes and is_text(data):
        return DatagramFrames([], 0, 0, len(data))
    return DatagramFrames(done.frames, done.junk_bytes, done.bad_crc)


def is_text(data: bytes) -> bool:
    """Return whether `data` is printable ASCII and line ends, as ArduPilot's boot banner."""
    return not _NOT_TEXT.search(data)


def decode(frame: Frame) -> dialect.MavlinkMessage | None:
    """Decode a frame to its message; None if the dialect does not know it."""
    found = dialect.layout(frame.msgid)
    if found is None:
        return None
    payload = frame.payload
    if len(payload) < found.size:
        payload = payload.ljust(found.size, b"\0")
    fields = dialect.fields_of(found, found.unpack_from(payload))
    return dialect.MavlinkMessage(found.name, frame.msgid, frame.system, frame.component, fields)


class StreamCutter:
    """Cuts a byte stream (TCP, serial line) that arrives in pieces of any size.

    Holds back at most one incomplete frame. A frame of an unknown message is returned when the byte behind it has
    arrived, because what follows is the only check it can have.
    """

    def __init__(self) -> None:
        self.junk_bytes = 0
        self.bad_crc = 0
        self._rest = b""
        self._in_sync = True

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes."""
        return self._cut(self._rest + data, final=False)

    def flush(self) -> list[Frame]:
        """Return what is held back, cut as it stands: the stream ended or fell silent."""
        return self._cut(self._rest, final=True)

    def _cut(self, data: bytes, *, final: bool) -> list[Frame]:
        done = FrameScan(in_sync=self._in_sync)
        scan(data, done, final=final)
        self._rest = data[done.used :]
        self._in_sync = done.in_sync
        self.junk_bytes += done.junk_bytes
        self.bad_crc += done.bad_crc
        return done.frames


def scan(data: bytes, done: FrameScan, *, final: bool) -> None:
    """Cut `data` from `done.used` on and add the frames to `done`.

    With `final` nothing follows `data`; without, it stops where more bytes are needed to decide.
    """
    before = -1
    while before != done.used < len(data):
        before = done.used
        scan_step(data, done, final=final)


def scan_step(data: bytes, done: FrameScan, *, final: bool) -> None:
    """Do one step of `scan`: a frame, or the junk before the next possible start, or nothing until more bytes come."""
    size = len(data)
    start = done.used
    if start >= size:
        return
    end = frame_end(data, start, size)
    if end > size and not final:
        return
    frame = None
    if start < end <= size:
        frame = check_frame(data[start:end])
        if frame is None:
            done.bad_crc += 1
            done.bad_msgid = _msgid(data, start)
        # The CRC of an unknown message cannot be checked. It counts only where a frame is due and another one
        # follows.
        elif not dialect.is_known(frame.msgid):
            if end == size and not final and done.in_sync:
                return
            if not (done.in_sync and (end == size or data[end] in (MAGIC_V1, MAGIC_V2))):
                frame = None
    if frame is not None:
        done.frames.append(frame)
        done.good += 1
        done.used = end
        done.in_sync = True
    else:
        # Search from the next byte on: a magic byte inside junk or a torn frame may hide a good frame behind it.
        following = MAGIC.search(data, start + 1)
        done.used = following.start() if following else size
        done.junk_bytes += done.used - start
        done.in_sync = False


def _msgid(data: bytes, start: int) -> int:
    if data[start] == MAGIC_V2:
        return int.from_bytes(data[start + 7 : start + 10], "little")
    return data[start + 5]


def frame_end(data: bytes, start: int, size: int) -> int:
    """Return where the frame at `start` ends: `start` if none can begin there, beyond `size` if it is incomplete."""
    magic = data[start]
    if magic == MAGIC_V2:
        if size - start < 3:
            return size + 1
        trailer = _TRAILER_V2.get(data[start + 2])
        return start if trailer is None else start + _OVERHEAD_V2 + data[start + 1] + trailer
    if magic == MAGIC_V1:
        return start + _OVERHEAD_V1 + data[start + 1] if size - start > 1 else size + 1
    return start


def check_frame(raw: bytes) -> Frame | None:
    """Return the complete frame `raw`; None if its CRC is wrong."""
    if raw[0] == MAGIC_V2:
        return _frame_v2(raw)
    _, length, seq, system, component, msgid = raw[:6]
    crc_at = 6 + length
    if not _crc_is_good(raw, crc_at, msgid):
        return None
    return Frame(1, seq, system, component, msgid, raw[6:crc_at], raw, False)


def _frame_v2(raw: bytes) -> Frame | None:
    length, flags, seq, system, component, low, high = _HEADER_V2(raw)
    msgid = low | high << 16
    crc_at = 10 + length
    if not _crc_is_good(raw, crc_at, msgid):
        return None
    return Frame(2, seq, system, component, msgid, raw[10:crc_at], raw, flags == SIGNED)


def _crc_is_good(raw: bytes, crc_at: int, msgid: int) -> bool:
    """Return whether the CRC at `crc_at` matches; True if the dialect does not know the message."""
    extra = dialect.CRC_EXTRA.get(msgid) or dialect.crc_extra(msgid)
    if extra is None:
        return True
    expected: int = mcrf4xx(raw[1:crc_at] + extra)
    return expected == raw[crc_at] | raw[crc_at + 1] << 8
