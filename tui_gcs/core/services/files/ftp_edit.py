"""The short tasks within a dialogue: list a directory, write and remove a file, compare checksums."""

import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.base.safe_files import PartFile
from tui_gcs.core.base.text import SafeText, clean
from tui_gcs.core.services.files.ftp_codec import Nak, Op, Packet, crc_fits
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue, OnReply
from tui_gcs.core.services.files.ftp_read import MAX_WAITS, SESSION_WAIT_S, check_path

# A vehicle that is broken, or a forger, could go on listing for ever.
MAX_ENTRIES = 5000
NAME_CELLS = 200
CHECK_BYTES = 4 << 20
"""How much of our copy goes into the checksum in one tick."""

OnEnd = Callable[[str], None]


@dataclass(frozen=True)
class FtpEntry:
    """One entry of a vehicle's directory."""

    name: SafeText
    is_directory: bool
    size: int | None
    """The size as announced; None for directories and where the entry has no number."""
    exact: bool
    """Whether `name` is exactly what the vehicle calls the entry, so that it can be requested. Else characters were
    cleaned away."""


class FtpTask(ABC):
    """One task with one path of a vehicle, within a dialogue."""

    done = total = 0
    """Progress in bytes, where the task counts them."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._dialogue: FtpDialogue
        self._on_end: OnEnd

    def start(self, dialogue: FtpDialogue, on_end: OnEnd) -> None:
        """Send the first request; the session has been reset. `on_end` is called with "" or why it failed."""
        self._dialogue, self._on_end = dialogue, on_end
        why = check_path(self.path)
        if why:
            on_end(why)
        else:
            self._begin()

    @abstractmethod
    def _begin(self) -> None: ...

    def _ask(self, op: Op, on_reply: OnReply, offset: int = 0) -> None:
        """Send a request that names the path."""
        self._dialogue.ask(op, on_reply, offset=offset, data=self.path.encode())


class FtpLister(FtpTask):
    """Lists a directory of a vehicle."""

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self.entries: list[FtpEntry] = []
        self.truncated = False
        """Whether the directory has more entries than are kept."""
        self._offset = 0

    def _begin(self) -> None:
        self._ask(Op.LIST, self._on_reply, self._offset)

    def _on_reply(self, reply: Packet | None) -> None:
        if reply is None or (reply.nak and reply.nak != Nak.EOF):
            self._on_end("no answer" if reply is None else reply.why)
            return
        entries = [raw for raw in reply.data.split(b"\0") if raw] if not reply.nak else []
        # Entries that the server skips (PX4 sends them as S) count for the offset, too (docs/autopilots.md).
        self._offset += len(entries)
        self.entries.extend(entry for raw in entries if (entry := entry_of(raw)) is not None)
        self.truncated = self._offset >= MAX_ENTRIES
        if entries and not self.truncated:
            self._begin()
        else:
            self._on_end("")


def entry_of(raw: bytes) -> FtpEntry | None:
    """Decode one entry of a listing: D and a name, or F, a name, a tab and a size. Skipped entries give None."""
    kind, rest = raw[:1], raw[1:]
    if kind not in (b"D", b"F") or rest in (b"", b".", b".."):
        return None
    name, _, size = rest.partition(b"\t") if kind == b"F" else (rest, b"", b"")
    text = clean(name, NAME_CELLS)
    # A size of more than 12 digits is no size of a file.
    number = int(size) if size.isdigit() and len(size) <= 12 else None
    # A name with characters that are not shown must not be requested: it would be another file's.
    exact = name == text.encode() and "/" not in text and "\\" not in text
    return FtpEntry(text, kind == b"D", number if kind == b"F" else None, exact)


class FtpWriter(FtpTask):
    """Writes a file and compares its checksum with the vehicle's.

    A vehicle may still refuse the contents: ArduPilot acknowledges the end of an upload of @MISSION or @PARAM that it
    refuses (docs/autopilots.md "Files by MAVFTP of ArduCopter"). Read back what matters.
    """

    def __init__(self, path: str, data: bytes, *, verify: bool) -> None:
        """Prepare to write `data` to `path`; with `verify` the vehicle's checksum is compared at the end.

        ArduPilot's virtual files (@...) have no checksum that could be compared.
        """
        super().__init__(path)
        self._data, self._verify = data, verify
        self._waits = 0
        self.total = len(data)

    def _begin(self) -> None:
        self._ask(Op.CREATE, self._on_created)

    def _on_created(self, reply: Packet | None) -> None:
        if reply is None:
            self._on_end("no answer")
        # Another station has the session; ArduPilot gives it away after 3 s of silence.
        elif reply.nak in (Nak.SESSION, Nak.NO_SESSIONS) and self._waits < MAX_WAITS:
            self._waits += 1
            self._dialogue.wait(SESSION_WAIT_S, lambda: self._dialogue.ask(Op.RESET, lambda _: self._begin()))
        elif reply.nak:
            self._on_end(reply.why)
        else:
            self._next()

    def _next(self) -> None:
        block = self._data[self.done : self.done + self._dialogue.block]
        if block:
            self._dialogue.ask(
                Op.WRITE, lambda reply: self._on_written(reply, len(block)), offset=self.done, data=block
            )
        else:
            self._dialogue.ask(Op.TERMINATE, self._on_closed)

    def _on_written(self, reply: Packet | None, size: int) -> None:
        if reply is None or reply.nak:
            self._dialogue.terminate_quietly()
            self._on_end("no answer: the file is incomplete" if reply is None else f"{reply.why}: it is incomplete")
            return
        self.done += size
        self._next()

    def _on_closed(self, reply: Packet | None) -> None:
        if reply is None or reply.nak:
            self._on_end("not known whether it was closed: read it back" if reply is None else reply.why)
        elif self._verify:
            self._ask(Op.CRC32, self._on_crc)
        else:
            self._on_end("")

    def _on_crc(self, reply: Packet | None) -> None:
        if reply is None or reply.number is None or reply.nak:
            self._on_end("written, but the vehicle did not report its checksum: read it back")
        else:
            self._on_end("" if crc_fits(self._data, reply.number) else "what the vehicle holds differs: checksum")


class FtpOneQuestion(FtpTask):
    """One request with one answer: remove a file, or compute its checksum."""

    def __init__(self, op: Op, path: str) -> None:
        """Prepare the request; `op` is REMOVE or CRC32."""
        super().__init__(path)
        self._op = op
        self.number: int | None = None
        """The checksum that the vehicle computed; None for REMOVE and before the answer."""

    def _begin(self) -> None:
        self._ask(self._op, self._on_reply)

    def _on_reply(self, reply: Packet | None) -> None:
        if reply is None or reply.nak:
            self._on_end("no answer" if reply is None else reply.why)
            return
        self.number = reply.number if self._op == Op.CRC32 else None
        short = self._op == Op.CRC32 and self.number is None
        self._on_end("the answer holds no checksum" if short else "")


class CopyCheck:
    """Compares our copy of a file with the vehicle's checksum, some megabytes at a time, so that a tick stays short."""

    def __init__(self, file: PartFile, crc: int) -> None:
        """Prepare to compare `file` with the vehicle's `crc`."""
        self._file, self._crc = file, crc
        self._ours, self._at = 0xFFFFFFFF, 0

    def good(self) -> bool | None:
        """Go on with the checksum. None until it is complete, then whether the two are equal."""
        block = self._file.read(self._at, CHECK_BYTES)
        if block:
            self._ours = zlib.crc32(block, self._ours)
            self._at += len(block)
            return None
        plain = zlib.crc32(b"", self._ours)
        return self._crc in (plain, plain ^ 0xFFFFFFFF)
