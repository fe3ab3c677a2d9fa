"""MAVFTP on the wire, the same for both autopilots' file servers."""

import struct
from typing import NamedTuple

from sitl.common.outbox import Outbox
from sitl.links.wire import Received

DATA_BYTES = 239
_HEAD = struct.Struct("<HBBBBBBI")
_PAYLOAD_BYTES = _HEAD.size + DATA_BYTES

NONE, TERMINATE, RESET, LIST, OPEN_READ, READ, CREATE, WRITE, REMOVE = range(9)
MAKE_DIRECTORY, REMOVE_DIRECTORY, OPEN_WRITE, TRUNCATE, RENAME, CRC32, BURST = range(9, 16)
ACK, NAK = 128, 129

FAIL, FAIL_ERRNO, INVALID_SIZE, INVALID_SESSION, NO_SESSIONS, END_OF_FILE, UNKNOWN_COMMAND = range(1, 8)
FILE_EXISTS, FILE_PROTECTED, FILE_NOT_FOUND = 8, 9, 10


class FtpRequest(NamedTuple):
    """A request of a station."""

    system: int
    component: int
    seq: int
    session: int
    opcode: int
    size: int
    offset: int
    data: bytes
    """All 239 bytes, whatever `size` is."""

    @property
    def text(self) -> str:
        """The path in the data: the bytes before the first NUL."""
        return self.data[: min(self.size, DATA_BYTES)].split(b"\0", 1)[0].decode("utf-8", "replace")


class FtpReply(NamedTuple):
    """A reply to a station."""

    system: int
    component: int
    seq: int
    session: int
    opcode: int
    request: int
    """Opcode of the request."""
    data: bytes = b""
    offset: int = 0
    burst_complete: bool = False


def parse(frame: Received) -> FtpRequest:
    """Return the request in a FILE_TRANSFER_PROTOCOL."""
    payload = bytes(frame.fields["payload"]).ljust(_PAYLOAD_BYTES, b"\0")
    seq, session, opcode, size, _, _, _, offset = _HEAD.unpack_from(payload)
    data = payload[_HEAD.size : _PAYLOAD_BYTES]
    return FtpRequest(frame.system, frame.component, seq, session, opcode, size, offset, data)


def send(outbox: Outbox, reply: FtpReply) -> None:
    """Send a reply as FILE_TRANSFER_PROTOCOL."""
    head = _HEAD.pack(
        reply.seq & 0xFFFF,
        reply.session,
        reply.opcode,
        len(reply.data),
        reply.request,
        reply.burst_complete,
        0,
        reply.offset,
    )
    outbox.send(
        "FILE_TRANSFER_PROTOCOL",
        target_system=reply.system,
        target_component=reply.component,
        payload=tuple((head + reply.data).ljust(_PAYLOAD_BYTES, b"\0")),
    )


def refusal(code: int, number: int = 0) -> bytes:
    """Return the data of a NAK: the code and, for FAIL_ERRNO, the errno."""
    return bytes([code, number]) if code == FAIL_ERRNO else bytes([code])
