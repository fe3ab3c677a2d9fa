"""The short tasks within a dialogue: list a directory, write and remove a file, compare checksums."""

import zlib
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.base.safe_files import PartFile
from tui_gcs.core.base.text import SafeText, clean
from tui_gcs.core.services.files.ftp_codec import Nak, Op, Packet, crc_fits
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue
from tui_gcs.core.services.files.ftp_read import MAX_WAITS, SESSION_WAIT_S, check_path

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


class FtpLister:
    """Lists a directory of a vehicle."""

    def __init__(self, dialogue: FtpDialogue, path: str, on_end: OnEnd) -> None:
        self._dialogue, self._path, self._on_end = dialogue, path, on_end
        self.entries: list[FtpEntry] = []
        self.truncated = False
        """Whether the directory has more entries than are kept."""
        self._offset = 0

    def start(self) -> None:
        """Request the first entries."""
        why = check_path(self._path)
        if why:
            self._on_end(why)
        else:
            self._ask()

    def _ask(self) -> None:
        path = self._path.encode()
        self._dialogue.ask(Op.LIST, self._on_reply, offset=self._offset, data=path)

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
            self._ask()
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


class FtpWriter:
    """Writes a file and compares its checksum with the vehicle's.

    A vehicle may still refuse the contents: ArduPilot acknowledges the end of an upload of @MISSION or @PARAM that it
    refuses (docs/autopilots.md "Files by MAVFTP of ArduCopter"). Read back what matters.
    """

    def __init__(self, dialogue: FtpDialogue, path: str, data: bytes, on_end: OnEnd, *, verify: bool) -> None:
        """Prepare to write `data` to `path`; with `verify` the vehicle's checksum is compared at the end.

        ArduPilot's virtual files (@...) have no checksum that could be compared.
        """
        self._dialogue, self._path, self._data, self._on_end = dialogue, path, data, on_end
        self._verify = verify
        self._waits = 0
        self.done = 0
        """How many bytes the vehicle has acknowledged."""

    def start(self) -> None:
        """Create the file. The session must have been reset."""
        why = check_path(self._path)
        if why:
            self._on_end(why)
            return
        path = self._path.encode()
        self._dialogue.ask(Op.CREATE, self._on_created, data=path)

    def _on_created(self, reply: Packet | None) -> None:
        if reply is None:
            self._on_end("no answer")
        # Another station has the session; ArduPilot gives it away after 3 s of silence.
        elif reply.nak in (Nak.SESSION, Nak.NO_SESSIONS) and self._waits < MAX_WAITS:
            self._waits += 1
            self._dialogue.wait(SESSION_WAIT_S, lambda: self._dialogue.ask(Op.RESET, lambda _: self.start()))
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
            path = self._path.encode()
            self._dialogue.ask(Op.CRC32, self._on_crc, data=path)
        else:
            self._on_end("")

    def _on_crc(self, reply: Packet | None) -> None:
        if reply is None or reply.number is None or reply.nak:
            self._on_end("written, but the vehicle did not report its checksum: read it back")
        else:
            self._on_end("" if crc_fits(self._data, reply.number) else "what the vehicle holds differs: checksum")


class FtpOneQuestion:
    """One request with one answer: remove a file, or compute its checksum."""

    def __init__(self, dialogue: FtpDialogue, op: Op, path: str, on_end: OnEnd) -> None:
        """Prepare the request; `op` is REMOVE or CRC32."""
        self._dialogue, self._op, self._path, self._on_end = dialogue, op, path, on_end
        self.number: int | None = None
        """The checksum that the vehicle computed; None for REMOVE and before the answer."""

    def start(self) -> None:
        """Send the request, unless the path is refused."""
        why = check_path(self._path)
        if why:
            self._on_end(why)
        else:
            path = self._path.encode()
            self._dialogue.ask(self._op, self._on_reply, data=path)

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
