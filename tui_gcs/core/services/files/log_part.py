"""A log that is being downloaded: what of it is on our disk, so that it can be gone on with.

Beside `NAME.part` is `NAME.ranges`: whose log it is and how much of it is there. Neither its number nor its time prove
that the vehicle still means the same log (numbers begin anew after erasing, ArduPilot's time is that of the newest
byte). So the last bytes that are there are fetched once more, and compared.
"""

import msgspec

from tui_gcs.core.base.safe_files import FileRefused, PartFile, SafeFolder
from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.log_list import LogEntry

PROOF_BYTES = 900
"""Ten frames of a log do not look like those of another."""
MOST_STATE_BYTES = 1000


class _State(msgspec.Struct, forbid_unknown_fields=True):
    uid: str
    id: int
    held: int


class LogPart:
    """The file and its ranges. Writing raises OSError."""

    def __init__(self, folder: SafeFolder, name: str, uid: str, entry: LogEntry) -> None:
        """Go on with what is there of that log, else begin.

        Args:
            folder: Where.
            name: Of the part, made of numbers by us.
            uid: The vehicle's hardware id; "" if unknown.
            entry: The log as the vehicle lists it now.

        Raises:
            FileRefused: it cannot be written there.
        """
        self._folder, self._name = folder, name
        self._uid, self._id = uid, entry.id
        self.ranges = ByteRanges()
        self._proof = b""
        """What is on the disk behind the held bytes, until the vehicle has sent the same."""
        self._proof_at = 0
        held = self._held(entry)
        self.file: PartFile = folder.part(name, resume=held > 0)
        if held:
            self._proof_at = max(0, held - PROOF_BYTES)
            self._proof = self.file.read(self._proof_at, held - self._proof_at)
            if self._proof_at + len(self._proof) == held:
                self.ranges.add(0, self._proof_at)
            else:
                self._proof = b""

    def write(self, offset: int, data: bytes) -> None:
        """See `ftp_read.Sink`. `ranges` has these bytes already; if they are of another log, all others are dropped."""
        start, stop = offset - self._proof_at, offset + len(data) - self._proof_at
        if self._proof and stop > 0 and start < len(self._proof):
            ours = self._proof[max(0, start) : stop]
            if ours != data[max(0, -start) : max(0, -start) + len(ours)]:
                self.file.cut(0)
                self._proof = b""
                self.ranges.clear()
                self.ranges.add(offset, offset + len(data))
        self.file.write(offset, data)

    def save(self) -> None:
        """Note what is there. What prevents it costs only the resuming."""
        held = self.ranges.first_gap()[0] if self.ranges.covers(1) else 0
        try:
            self._folder.replace(f"{self._name}.ranges", msgspec.json.encode(_State(self._uid, self._id, held)))
        except FileRefused:
            return

    def keep(self) -> None:
        """It is not whole: leave it to be resumed."""
        self.save()
        self.file.keep()
        self._folder.close()

    def discard(self) -> None:
        """Away with it."""
        self.file.discard()
        self._folder.remove(f"{self._name}.ranges")
        self._folder.close()

    def finish(self, name: str, *, bad: bool = False) -> str:
        """It is whole and called `name`, or as similar as is free; its name in the folder. Raises FileRefused."""
        final = self.file.finish(name, bad=bad)
        self._folder.remove(f"{self._name}.ranges")
        self._folder.close()
        return final

    def _held(self, entry: LogEntry) -> int:
        """How many bytes of that log seem to be there, from its beginning."""
        stored = self._folder.read(f"{self._name}.ranges", MOST_STATE_BYTES)
        try:
            state = msgspec.json.decode(stored, type=_State) if stored else None
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return 0
        if state is None or (state.uid, state.id) != (self._uid, entry.id) or not 0 < state.held <= entry.size:
            return 0
        return state.held if f"{self._name}.part" in self._folder.names() else 0
