"""MAVFTP requests to a bench, one at a time, and what comes back."""

import struct
from dataclasses import dataclass

from tests.sitl.rigs.store_rig import Bench

TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE, REMOVE, MAKE_DIRECTORY = 1, 2, 3, 4, 5, 6, 7, 8, 9
RENAME, CRC32, BURST, LIST_WITH_TIME = 13, 14, 15, 16
ACK, NAK = 128, 129


@dataclass
class Answer:
    seq: int
    session: int
    opcode: int
    request: int
    burst_complete: int
    offset: int
    data: bytes

    @property
    def refused(self) -> list[int]:
        """The code of a NAK and what follows it."""
        return list(self.data) if self.opcode == NAK else []


class Client:
    def __init__(self, bench: Bench, system: int = 255, session: int = 0) -> None:
        self.bench, self.system, self.session, self.seq = bench, system, session, 1

    def ask(
        self, opcode: int, data: bytes = b"", *, size: int | None = None, offset: int = 0, session: int | None = None
    ) -> list[Answer]:
        """What comes back at once."""
        self.seq += 1
        return self.send(self.seq, opcode, data, size=size, offset=offset, session=session)

    def send(
        self,
        seq: int,
        opcode: int,
        data: bytes = b"",
        *,
        size: int | None = None,
        offset: int = 0,
        session: int | None = None,
    ) -> list[Answer]:
        head = struct.pack(
            "<HBBBBBBI",
            seq,
            self.session if session is None else session,
            opcode,
            len(data) if size is None else size,
            0,
            0,
            0,
            offset,
        )
        since = len(self.bench.heard)
        self.bench.say("FILE_TRANSFER_PROTOCOL", system=self.system, payload=tuple((head + data).ljust(251, b"\0")))
        answers = self.answers(since)
        if answers:
            self.seq = answers[-1].seq
        return answers

    def answers(self, since: int = 0) -> list[Answer]:
        found = []
        for _, name, fields in self.bench.heard[since:]:
            if name == "FILE_TRANSFER_PROTOCOL" and fields["target_system"] == self.system:
                payload = bytes(fields["payload"])
                seq, session, opcode, size, request, complete, _, offset = struct.unpack_from("<HBBBBBBI", payload)
                found.append(Answer(seq, session, opcode, request, complete, offset, payload[12 : 12 + size]))
        return found

    def one(self, opcode: int, data: bytes = b"", **more: int) -> Answer:
        (answer,) = self.ask(opcode, data, **more)
        return answer

    def burst(self, block: int = 239, offset: int = 0, seconds: float = 4.0) -> list[Answer]:
        """All packets of one burst."""
        since = len(self.bench.heard)
        self.ask(BURST, size=block, offset=offset)
        self.bench.run(seconds)
        answers = self.answers(since)
        self.seq = answers[-1].seq
        return answers

    def read(self, path: bytes, block: int = 239) -> bytes:
        """A file by bursts; the session is closed."""
        opened = self.one(OPEN, path)
        assert opened.opcode == ACK, opened
        content, ended = bytearray(), False
        while not ended:
            for answer in self.burst(block, len(content)):
                if answer.opcode == ACK:
                    assert answer.offset == len(content)
                    content += answer.data
                ended = answer.opcode == NAK
        self.ask(TERMINATE)
        return bytes(content)

    def write(self, path: bytes, content: bytes, block: int = 200) -> Answer:
        """A file; the answer to its end."""
        assert self.one(CREATE, path).opcode == ACK
        for offset in range(0, len(content), block):
            assert self.one(WRITE, content[offset : offset + block], offset=offset).opcode == ACK
        return self.one(TERMINATE)
