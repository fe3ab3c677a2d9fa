"""A file server for scripted vehicles, with the manners measured on ArduPilot and on PX4.

server = FtpServer(Peer(1), {"/a.txt": b"hello"})     # answers FILE_TRANSFER_PROTOCOL from now on
"""

import json
import lzma
import struct
from typing import Any

from tests.core.rigs.service_rig import PX4, Peer
from tui_gcs.core.services.files.ftp_codec import crc32

HEAD = struct.Struct("<HBBBBBBI")
ACK, NAK = 128, 129
FAIL, ERRNO, DATA_SIZE, SESSION, NO_SESSIONS, EOF, UNKNOWN, EXISTS, PROTECTED, NOT_FOUND = range(1, 11)
TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE, REMOVE = range(1, 9)
CRC, BURST = 14, 15
SESSION_IDLE_S = 3.0


class FtpServer:
    """One session for everybody, the last answer kept for a repeated question."""

    def __init__(self, peer: Peer, files: dict[str, bytes] | None = None, **traits: Any) -> None:
        self.peer = peer
        self.files = dict(files or {})
        self.px4 = peer.autopilot == PX4
        self.announced: int | None = traits.get("announced")
        """Said in place of the true size."""
        self.burst_packets: int = traits.get("burst_packets", 168 if self.px4 else 500)
        self.bursts = traits.get("bursts", True)
        self.listing: dict[str, list[bytes]] = traits.get("listing", {})
        self.same_block = traits.get("same_block", False)
        """As ArduPilot's @PARAM: another block size on the same handle is refused."""
        self.session: int | None = None
        self.open_path = ""
        self.used_s = -100.0
        self.last: tuple[int, bytes] | None = None
        self.asked: list[tuple[int, int, int, int, bytes]] = []
        """(seq, opcode, offset, size, data) of every request."""
        self.handles_block: int | None = None
        self.sabotage: Any = None
        """A function (server, request tuple) -> True if it has answered itself."""
        peer.answers["FILE_TRANSFER_PROTOCOL"] = self.hear

    def ops(self) -> list[int]:
        return [op for _, op, *_ in self.asked]

    # ---------------------------------------------------------------- wire

    def hear(self, peer: Peer, fields: dict[str, Any]) -> None:
        raw = bytes(fields["payload"])
        seq, session, op, size, _, _, _, offset = HEAD.unpack_from(raw)
        data = raw[12 : 12 + size] if op not in (READ, BURST) else b""
        self.asked.append((seq, op, offset, size, data))
        if self.last is not None and self.last[0] == (seq + 1) & 0xFFFF:
            self.send(self.last[1])
            return
        if self.sabotage is not None and self.sabotage(self, (seq, session, op, size, offset, data)):
            return
        self.seq, self.reply_session, self.op, self.offset = seq, session, op, offset
        handler = {
            TERMINATE: self.terminate,
            RESET: self.reset,
            LIST: self.list,
            OPEN: self.open,
            READ: self.read,
            CREATE: self.create,
            WRITE: self.write,
            REMOVE: self.remove,
            CRC: self.crc,
            BURST: self.burst if self.bursts else None,
        }.get(op)
        if handler is None:
            self.nak(UNKNOWN)
        else:
            handler(session, offset, size, data)

    def send(self, raw: bytes) -> None:
        self.peer.say_to_us("FILE_TRANSFER_PROTOCOL", target_network=0, payload=list(raw.ljust(251, b"\0")))

    def raw(self, seq: int, op: int, answers: int, data: bytes = b"", offset: int = 0, **more: int) -> bytes:
        session = more.get("session", self.reply_session)
        head = HEAD.pack(seq & 0xFFFF, session, op, len(data), answers, more.get("complete", 0), 0, offset)
        return head + data

    def reply(self, op: int, data: bytes = b"", *, offset: int | None = None, seq: int | None = None) -> None:
        number = (self.seq + 1 if seq is None else seq) & 0xFFFF
        raw = self.raw(number, op, self.op, data, self.offset if offset is None else offset)
        self.last = (number, raw)
        self.send(raw)

    def ack(self, data: bytes = b"") -> None:
        self.reply(ACK, data)

    def nak(self, code: int, **more: Any) -> None:
        self.reply(NAK, bytes([code]), **more)

    # ---------------------------------------------------------------- what is asked

    def mine(self, session: int) -> bool:
        self.used_s = self.peer.now
        if self.session is None or self.session != session:
            self.nak(SESSION)
            return False
        return True

    def taken(self, session: int) -> bool:
        """Whether an open must be refused."""
        idle = self.peer.now - self.used_s >= SESSION_IDLE_S
        self.used_s = self.peer.now
        if self.px4:
            if self.session is not None:
                self.nak(NO_SESSIONS)
                return True
            return False
        if self.session is not None and not idle:
            self.nak(SESSION if self.session != session else FAIL)
            return True
        return False

    def begin(self, session: int, path: str) -> None:
        self.session = self.reply_session = 0 if self.px4 else session
        self.open_path, self.handles_block = path, None

    def terminate(self, session: int, *_: Any) -> None:
        if self.px4 and session != self.session:
            self.nak(SESSION)
            return
        if session == self.session:
            self.session = None
        self.ack()

    def reset(self, session: int, *_: Any) -> None:
        if self.px4 or session == self.session:
            self.session = None
        self.ack()

    def list(self, session: int, offset: int, size: int, data: bytes) -> None:
        entries = self.listing.get(data.decode())
        if entries is None:
            self.nak(NOT_FOUND)
        elif offset >= len(entries):
            self.nak(EOF)
        else:
            out = b""
            for entry in entries[offset:]:
                if len(out) + len(entry) + 1 > 239:
                    break
                out += entry + b"\0"
            self.ack(out)

    def open(self, session: int, offset: int, size: int, data: bytes) -> None:
        path = data.decode()
        if path not in self.files:
            self.nak(NOT_FOUND)
        elif not self.taken(session):
            self.begin(session, path)
            announced = len(self.files[path]) if self.announced is None else self.announced
            self.ack(announced.to_bytes(4, "little"))

    def wrong_block(self, size: int) -> bool:
        if self.same_block and self.handles_block not in (None, size):
            self.reply(NAK, bytes([ERRNO, 22]))
            return True
        self.handles_block = size
        return False

    def read(self, session: int, offset: int, size: int, data: bytes) -> None:
        if not self.mine(session) or self.wrong_block(size):
            return
        block = self.files[self.open_path][offset : offset + size]
        if block:
            self.ack(block)
        else:
            self.nak(EOF, offset=0)

    def burst(self, session: int, offset: int, size: int, data: bytes) -> None:
        if not self.mine(session) or self.wrong_block(size):
            return
        content, seq = self.files[self.open_path], self.seq
        for number in range(self.burst_packets):
            block = content[offset : offset + size]
            seq = (seq + 1) & 0xFFFF
            if not block:
                self.nak(EOF, offset=self.offset if self.px4 else offset, seq=seq)
                return
            last = number == self.burst_packets - 1
            self.last = None
            self.send(self.raw(seq, ACK, BURST, block, offset, complete=last))
            offset += len(block)

    def create(self, session: int, offset: int, size: int, data: bytes) -> None:
        if not self.taken(session):
            self.begin(session, data.decode())
            self.files[data.decode()] = b""
            self.ack()

    def write(self, session: int, offset: int, size: int, data: bytes) -> None:
        if self.mine(session):
            before = self.files[self.open_path]
            self.files[self.open_path] = before[:offset].ljust(offset, b"\0") + data + before[offset + size :]
            self.ack()

    def remove(self, session: int, offset: int, size: int, data: bytes) -> None:
        if self.files.pop(data.decode(), None) is None:
            self.nak(NOT_FOUND)
        else:
            self.ack()

    def crc(self, session: int, offset: int, size: int, data: bytes) -> None:
        if data.decode() not in self.files:
            self.nak(NOT_FOUND)
        else:
            self.ack(crc32(self.files[data.decode()]).to_bytes(4, "little"))


def describing_px4(text: bytes) -> tuple[Peer, FtpServer]:
    """A PX4 that describes its parameters by parameters.json.xz with that text."""
    packed = lzma.compress(text)
    uri = "mftp://etc/extras/parameters.json.xz"
    general = {
        "version": 1,
        "metadataTypes": [{"type": 1, "uri": uri, "fileCrc": crc32(packed), "uriFallback": "http://x"}],
    }
    peer = Peer(1, autopilot=PX4)
    files = {"etc/extras/component_general.json.xz": lzma.compress(json.dumps(general).encode())}
    server = FtpServer(peer, files | {"etc/extras/parameters.json.xz": packed})

    def command(peer: Peer, fields: dict[str, Any]) -> None:
        if fields["command"] == 512 and fields["param1"] == 397:
            peer.say(
                "COMPONENT_METADATA", time_boot_ms=1, file_crc=5, uri="mftp://etc/extras/component_general.json.xz"
            )
        if fields["command"] in (511, 512):
            peer.ack(fields["command"])

    peer.answers["COMMAND_LONG"] = command
    return peer, server
