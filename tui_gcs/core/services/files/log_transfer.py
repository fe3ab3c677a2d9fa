"""What all log jobs share: the list of logs, the requests, and the file of a log that is being downloaded.

`LogLister` decides what to ask of LOG_REQUEST_LIST. `LogPart` is the local file of one log: what an interrupted
download left is used by the next one. `LogChannel` sends the requests and opens the files. Reference:
docs/autopilots.md "Logs" of both autopilots.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import msgspec

from tui_gcs.core.base.safe_files import FileRefused, PartFile, SafeFolder
from tui_gcs.core.firmware.log_files import log_ending
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.files.byte_ranges import ByteRanges

MAX_LOGS = 4096
# LOG_REQUEST_LIST.end: all logs (common.xml).
LAST = 0xFFFF
# Time for the first LOG_ENTRY; the second number is for slow links.
WAIT_S, SLOW_WAIT_S = 2.0, 4.0
QUIET_S, SLOW_QUIET_S = 0.6, 2.0
SILENT_TRIES, MAX_ROUNDS = 3, 20
"""How often the list is requested without any answer; how many rounds in a row missing entries are requested in
vain."""
PROOF_BYTES = 900
"""How much of the end of a part is fetched again and compared: ten frames of LOG_DATA are not alike in two logs."""
MAX_STATE_BYTES = 1000


@dataclass(frozen=True)
class LogEntry:
    """One log in a vehicle's list."""

    id: int
    size: int
    """Bytes. The size grows while the log is written, and a little after disarming."""
    time_utc: int
    """Seconds since 1970, 0 if the vehicle does not know the time. ArduPilot reports the time of the newest byte."""


class LogLister:
    """Decides which entries to request next; `over` once all of `first` to `last` have arrived, or none come."""

    def __init__(self, ask: Callable[[int, int], None], now: float, *, slow: bool, first: int, last: int) -> None:
        """Request the list at once.

        Args:
            ask: Sends LOG_REQUEST_LIST with the first and the last number.
            now: Station time in seconds.
            slow: Whether the link is a telemetry radio.
            first: The first log that is wanted.
            last: The last log that is wanted.
        """
        self._ask, self._first, self._last = ask, first, last
        self._wait_s, self._quiet_s = (SLOW_WAIT_S, SLOW_QUIET_S) if slow else (WAIT_S, QUIET_S)
        self.entries: dict[int, LogEntry] = {}
        self.count = 0
        """How many logs there are, as the vehicle announced."""
        self._newest = 0
        self._tries = self._rounds = 0
        self._due_s = 0.0
        self.over = False
        self.error = ""
        self.silent = False
        """No entry came at all: the vehicle has no logs, or does not answer. Both autopilots may be silent without
        logs."""
        self._ask_all(now)

    def on_entry(self, fields: Fields, now: float) -> None:
        """Take a LOG_ENTRY of the vehicle."""
        if self.over:
            return
        self.count, self._newest = fields["num_logs"], fields["last_log_num"]
        if self.count == 0:
            self.over = True
            return
        number = fields["id"]
        # Only a new entry is progress; a vehicle that repeats one entry must not keep the lister busy.
        if number not in self.entries and len(self.entries) < MAX_LOGS and self._first <= number <= self._last:
            self._rounds = 0
        if len(self.entries) < MAX_LOGS:
            self.entries[number] = LogEntry(number, fields["size"], fields["time_utc"])
        self._due_s = now + self._quiet_s
        self.over = not self._missing()

    def tick(self, now: float) -> None:
        """Request again what did not arrive."""
        if self.over or now < self._due_s:
            return
        if not self.count:
            if self._tries >= SILENT_TRIES:
                self.over = self.silent = True
            else:
                self._ask_all(now)
            return
        missing = self._missing()
        self._rounds += 1
        if self._rounds > MAX_ROUNDS:
            self.over, self.error = True, f"{len(self.entries)} of {self.count} entries came"
            return
        last = missing[0]
        while last + 1 in missing:
            last += 1
        self._due_s = now + self._quiet_s
        self._ask(missing[0], last)

    def _ask_all(self, now: float) -> None:
        self._tries += 1
        self._due_s = now + self._wait_s
        self._ask(self._first, self._last)

    def _missing(self) -> list[int]:
        """Return which of the requested entries did not arrive."""
        if len(self.entries) >= min(self.count, MAX_LOGS):
            return []
        # The numbers of the oldest logs may be gone already: count back from the newest.
        oldest = max(0, self._newest - self.count + 1)
        numbers = range(max(oldest, self._first), min(self._newest, self._last, oldest + MAX_LOGS) + 1)
        return [number for number in numbers if number not in self.entries]


class _PartState(msgspec.Struct, forbid_unknown_fields=True):
    uid: str
    id: int
    held: int


class LogPart:
    """The local part of one log, and which bytes it holds. Writing raises OSError.

    Beside `NAME.part` lies `NAME.ranges`: which log it is and how much of it is there. Neither the log's number nor its
    time prove that the vehicle still means the same log: numbers begin anew after erasing. So the last bytes that are
    there are fetched once more, and compared.
    """

    def __init__(self, folder: SafeFolder, name: str, uid: str, entry: LogEntry) -> None:
        """Open the part of that log, or begin one.

        Args:
            folder: The folder of downloads.
            name: The name of the part, made of numbers by us.
            uid: The vehicle's hardware id; "" if unknown.
            entry: The log as the vehicle lists it now.

        Raises:
            FileRefused: It cannot be written there.
        """
        self._folder, self._name = folder, name
        self._uid, self._id = uid, entry.id
        self.ranges = ByteRanges()
        self._proof = b""
        """The last bytes on the disk, until the vehicle has sent the same ones."""
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
        """Store `data`, which `ranges` contains already. If it belongs to another log, everything else is dropped."""
        start, stop = offset - self._proof_at, offset + len(data) - self._proof_at
        # These bytes were fetched once more to prove that the vehicle still means the same log.
        if self._proof and stop > 0 and start < len(self._proof):
            ours = self._proof[max(0, start) : stop]
            if ours != data[max(0, -start) : max(0, -start) + len(ours)]:
                self.file.cut(0)
                self._proof = b""
                self.ranges.clear()
                self.ranges.add(offset, offset + len(data))
        self.file.write(offset, data)

    def room_bytes(self) -> int:
        """The space that the log may take on the disk of the folder."""
        return self._folder.room_bytes()

    def save(self) -> None:
        """Write down how much is there. A failure costs only the resuming."""
        held = self.ranges.first_gap()[0] if self.ranges.covers(1) else 0
        try:
            self._folder.replace(f"{self._name}.ranges", msgspec.json.encode(_PartState(self._uid, self._id, held)))
        except FileRefused:
            return

    def keep(self) -> None:
        """Close the incomplete part, to be resumed by the next download."""
        self.save()
        self.file.keep()
        self._folder.close()

    def discard(self) -> None:
        """Delete the part and its note."""
        self.file.discard()
        self._folder.remove(f"{self._name}.ranges")
        self._folder.close()

    def finish(self, name: str) -> str:
        """Give the complete log its `name`, or a similar one that is free, and return it. Raises FileRefused."""
        final = self.file.finish(name, bad=False)
        self._folder.remove(f"{self._name}.ranges")
        self._folder.close()
        return final

    def _held(self, entry: LogEntry) -> int:
        """How many bytes of that log the part holds from its beginning."""
        stored = self._folder.read(f"{self._name}.ranges", MAX_STATE_BYTES)
        try:
            state = msgspec.json.decode(stored, type=_PartState) if stored else None
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return 0
        if state is None or (state.uid, state.id) != (self._uid, entry.id) or not 0 < state.held <= entry.size:
            return 0
        # Without the part file the note beside it means nothing.
        return state.held if f"{self._name}.part" in self._folder.names() else 0


class LogChannel:
    """Sends the log requests to vehicles, and opens the files that logs are written to."""

    def __init__(self, context: ServiceContext) -> None:
        self.context = context
        self.ignored: Counter[str] = Counter()
        """Messages about logs that belonged to no request, counted by reason."""

    def lister(self, vehicle: Vehicle, now: float, *, first: int = 0, last: int = LAST) -> LogLister:
        """Return a lister that requests the logs `first` to `last` of a vehicle from now on."""

        def ask(start: int, end: int) -> None:
            self.context.uplink.ask(vehicle.id, "LOG_REQUEST_LIST", start=start, end=end)

        return LogLister(ask, now, slow=self.context.is_slow(vehicle.link), first=first, last=last)

    def ask_data(self, vehicle: int, number: int, offset: int, count: int) -> None:
        """Send LOG_REQUEST_DATA to a vehicle."""
        self.context.uplink.ask(vehicle, "LOG_REQUEST_DATA", id=number, ofs=offset, count=count)

    def ask_end(self, vehicle: int) -> None:
        """Send LOG_REQUEST_END, if the vehicle is still there."""
        # ArduPilot refuses to arm from the first request for data until this message (docs/autopilots.md).
        if vehicle in self.context.fleet.vehicles:
            self.context.uplink.ask(vehicle, "LOG_REQUEST_END")

    def refusal(self, vehicle: Vehicle, since_s: float) -> str:
        """Return the vehicle's texts about logs since then: ArduPilot gives no other answer while it is armed."""
        return "; ".join(text for text in vehicle.reasons_since(since_s) if "log" in text.lower())

    def open_part(self, vehicle: Vehicle, entry: LogEntry) -> LogPart:
        """Open the local part of a log. Raises FileRefused."""
        if self.context.folder is None:
            raise FileRefused("this station has no folder for downloads")
        folder = SafeFolder(self.context.folder / "logs" / f"vehicle-{vehicle.id}")
        try:
            return LogPart(folder, f"log-{entry.id:05d}.{log_ending(vehicle)}", vehicle.identity.uid, entry)
        except FileRefused:
            folder.close()
            raise

    def final_name(self, vehicle: Vehicle, entry: LogEntry) -> str:
        """The local name of a complete log, made of numbers only, never of text from the vehicle."""
        day = datetime.fromtimestamp(entry.time_utc, UTC).strftime("-%Y%m%dT%H%M%SZ") if entry.time_utc else ""
        return f"log-{entry.id:05d}{day}.{log_ending(vehicle)}"

    def result_path(self, vehicle: int, name: str) -> str:
        """The path of a complete log below the station's state directory."""
        return f"logs/vehicle-{vehicle}/{name}"

    def alarm(self, vehicle: int, text: str) -> None:
        """Report an error that the operator must act on."""
        self.context.events.report(EventClass.PROCESSING, f"vehicle {vehicle}", text, ALERT)
