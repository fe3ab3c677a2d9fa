"""MAVFTP as far as both autopilots' file servers are alike: requests and replies on the wire, files, and logs."""

import errno
import struct
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

from sitl.common.autopilot import Handler
from sitl.common.files import FileTree, GeneratedFile
from sitl.common.logs import Log
from sitl.common.outbox import Outbox
from sitl.common.platform import Part, Platform
from sitl.links.wire import ReceivedFrame

# Opcodes, results and sizes (docs/autopilots.md "C10. MAVFTP").
DATA_BYTES = 239
_HEAD = struct.Struct("<HBBBBBBI")
_PAYLOAD_BYTES = _HEAD.size + DATA_BYTES

NONE, TERMINATE, RESET, LIST, OPEN_READ, READ, CREATE, WRITE, REMOVE = range(9)
MAKE_DIRECTORY, REMOVE_DIRECTORY, OPEN_WRITE, TRUNCATE, RENAME, CRC32, BURST = range(9, 16)
ACK, NAK = 128, 129

FAIL, FAIL_ERRNO, INVALID_SIZE, INVALID_SESSION, NO_SESSIONS, END_OF_FILE, UNKNOWN_COMMAND = range(1, 8)
FILE_EXISTS, FILE_NOT_FOUND = 8, 10


class FtpReply(NamedTuple):
    """A reply to a station."""

    system: int
    component: int
    seq: int
    session: int
    opcode: int
    request: int
    """Opcode of the request that is answered."""
    data: bytes = b""
    offset: int = 0
    burst_complete: bool = False


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

    def reply(self, opcode: int, data: bytes = b"", offset: int = 0) -> FtpReply:
        """Return the reply to this request: ACK, or NAK with a refusal as data."""
        return FtpReply(
            self.system, self.component, self.seq + 1 & 0xFFFF, self.session, opcode, self.opcode, data, offset
        )


def parse(frame: ReceivedFrame) -> FtpRequest:
    """Return the request in a FILE_TRANSFER_PROTOCOL."""
    payload = bytes(frame.fields["payload"]).ljust(_PAYLOAD_BYTES, b"\0")
    seq, session, opcode, size, _, _, _, offset = _HEAD.unpack_from(payload)
    data = payload[_HEAD.size : _PAYLOAD_BYTES]
    return FtpRequest(frame.system, frame.component, seq, session, opcode, size, offset, data)


def send(outbox: Outbox, reply: FtpReply) -> None:
    """Send a reply as FILE_TRANSFER_PROTOCOL."""
    seq, size = reply.seq & 0xFFFF, len(reply.data)
    head = _HEAD.pack(seq, reply.session, reply.opcode, size, reply.request, reply.burst_complete, 0, reply.offset)
    payload = tuple((head + reply.data).ljust(_PAYLOAD_BYTES, b"\0"))
    outbox.reply(reply, "FILE_TRANSFER_PROTOCOL", payload=payload)


def refusal(code: int, number: int = 0) -> bytes:
    """Return the data of a NAK: the code and, for FAIL_ERRNO, the errno."""
    return bytes([code, number]) if code == FAIL_ERRNO else bytes([code])


def refusal_of(problem: OSError) -> bytes:
    """Return the data of the NAK for a problem with a file; only two problems have a code of their own."""
    number = problem.errno or errno.EIO
    return refusal({errno.EEXIST: FILE_EXISTS, errno.ENOENT: FILE_NOT_FOUND}.get(number, FAIL_ERRNO), number)


def page(entries: Sequence[bytes]) -> bytes:
    """Return as many entries of a listing as one reply holds."""
    data = b""
    for entry in entries:
        if len(data) + len(entry) > DATA_BYTES:
            break
        data += entry
    return data


class FtpServer(Part, ABC):
    """An autopilot's only MAVFTP session, which all stations share."""

    _receive: Handler
    """The handler that each autopilot has of its own."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._last: FtpReply | None = None
        """The reply that was sent last, for requests that are repeated."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {"FILE_TRANSFER_PROTOCOL": self._receive}

    @abstractmethod
    def _fill(self, tree: FileTree) -> None:
        """Put in the files that such a vehicle has."""

    @abstractmethod
    def _log_path(self, log: Log) -> str:
        """Return the path of a log."""

    def _tree(self) -> FileTree:
        """Return the vehicle's files, made with the first request, with all logs of now."""
        tree = self._files
        if not tree.filled:
            tree.filled = True
            self._fill(tree)
        for log in self._logs.files:
            path = self._log_path(log)
            if path not in tree.files:
                tree.add(path.rpartition("/")[0])
                tree.add(path, self._log_file(log))
        return tree

    def _log_file(self, log: Log) -> GeneratedFile:
        clock = self._clock
        return GeneratedFile(lambda: log.size_at(clock.now_us), lambda at, count: log.read(at, count, clock.now_us))
