"""Encoding of MAVFTP packets: the 251 bytes in FILE_TRANSFER_PROTOCOL (https://mavlink.io/en/services/ftp.html)."""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

# FILE_TRANSFER_PROTOCOL.payload: 12 bytes of head and at most 239 of data (docs/autopilots.md C10).
PAYLOAD_BYTES = 251
DATA_BYTES = 239
"""How many bytes of a file one packet carries."""
SLOW_DATA_BYTES = 110
"""The same over a telemetry radio: a SiK radio sends so much in one piece (docs/autopilots.md C10)."""
_HEAD = struct.Struct("<HBBBBBBI")
"""The head of a packet: sequence, session, opcode, size, opcode that is answered, burst complete, padding, offset."""


class Op(IntEnum):
    """Opcodes of requests, and the two of answers."""

    TERMINATE = 1
    RESET = 2
    LIST = 3
    OPEN_READ = 4
    READ = 5
    CREATE = 6
    WRITE = 7
    REMOVE = 8
    CRC32 = 14
    BURST = 15
    ACK = 128
    NAK = 129


class Nak(IntEnum):
    """Error codes in the first data byte of a NAK."""

    FAIL = 1
    ERRNO = 2
    DATA_SIZE = 3
    SESSION = 4
    NO_SESSIONS = 5
    EOF = 6
    UNKNOWN_COMMAND = 7
    EXISTS = 8
    PROTECTED = 9
    NOT_FOUND = 10


_WORDS = {
    Nak.FAIL: "the vehicle failed to do it",
    Nak.DATA_SIZE: "the vehicle does not take that block size",
    Nak.SESSION: "the vehicle's file session is another station's",
    Nak.NO_SESSIONS: "the vehicle's file session is in use",
    Nak.EOF: "end of file",
    Nak.UNKNOWN_COMMAND: "the vehicle does not know how",
    Nak.EXISTS: "it exists already",
    Nak.PROTECTED: "it is write-protected",
    Nak.NOT_FOUND: "no such file",
}
_ERRNO_WORDS = {
    1: "not permitted",
    2: "no such file",
    5: "input or output error",
    13: "permission denied",
    17: "it exists already",
    21: "it is a directory",
    22: "invalid argument",
    28: "the vehicle's storage is full",
    30: "read-only file system",
}
"""Values of `errno` that Linux and NuttX have in common."""


@dataclass(frozen=True)
class Packet:
    """One packet of either direction."""

    seq: int
    session: int
    op: int
    size: int
    """The length of `data`; in a request to read, how many bytes are wanted."""
    answers: int
    """The opcode of the request that this packet answers."""
    complete: bool
    """Whether the burst ends with this packet; the file may go on."""
    offset: int
    data: bytes

    @property
    def nak(self) -> int:
        """The error code of a NAK, 0 for an ACK. A NAK without a code counts as FAIL."""
        if self.op != Op.NAK:
            return 0
        # A NAK may come without a code; it must not look like an ACK.
        return self.data[0] if self.data and self.data[0] else Nak.FAIL

    @property
    def why(self) -> str:
        """The reason of a NAK as text for the operator."""
        code = self.nak
        if code == Nak.ERRNO:
            number = self.data[1] if len(self.data) > 1 else 0
            return _ERRNO_WORDS.get(number, f"the vehicle's error {number}")
        return _WORDS.get(Nak(code), "") if code in _WORDS else f"refused with code {code}"

    @property
    def number(self) -> int | None:
        """The 32 bits that answer OPEN_READ (a size, which may be wrong) and CRC32; None if they are missing."""
        return int.from_bytes(self.data[:4], "little") if len(self.data) >= 4 else None


def pack(seq: int, session: int, op: int, size: int, offset: int, data: bytes = b"") -> list[int]:
    """Encode a request as the field `payload`. `data` is at most `DATA_BYTES` long."""
    head = _HEAD.pack(seq & 0xFFFF, session, op, size, 0, 0, 0, offset)
    return list((head + data).ljust(PAYLOAD_BYTES, b"\0"))


def unpack(payload: bytes) -> Packet:
    """Decode the `PAYLOAD_BYTES` of a packet. A size beyond the data is reduced to what is there."""
    # The size is a claim of the sender: it is cut to the data that are there.
    seq, session, op, size, answers, complete, _, offset = _HEAD.unpack_from(payload)
    return Packet(seq, session, op, size, answers, bool(complete), offset, payload[12 : 12 + min(size, DATA_BYTES)])


def crc32(data: bytes | bytearray) -> int:
    """Return the CRC-32 as vehicles compute it of files."""
    # The polynomial is zlib's, but the register starts with 0 and the result is not inverted (measured on ArduPilot and
    # PX4).
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def crc_fits(data: bytes | bytearray, crc: int) -> bool:
    """Whether `crc` belongs to `data`, in either of the two ways in which vehicles compute it."""
    return crc in (crc32(data), zlib.crc32(data))
