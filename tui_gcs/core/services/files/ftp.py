"""Files of vehicles (MAVFTP): jobs that list, read, write, remove and check them.

    ftp.read(1, "@SYS/tasks.txt", on_done=lambda job: print(job.data))

Other jobs that need files on their way open a dialogue of their own with `FtpService.dialogue` and use `FtpReader`.
"""

from collections import Counter
from collections.abc import Callable
from random import Random
from typing import TypeVar

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import Context
from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.services.files.ftp_dialogue import FIRST_TRIES, FtpDialogue
from tui_gcs.core.services.files.ftp_download import FtpDownloadJob
from tui_gcs.core.services.files.ftp_edit import FtpEntry, FtpLister, FtpOneQuestion, FtpWriter
from tui_gcs.core.services.files.ftp_read import MOST_BYTES, FtpReader, MemorySink, Sink
from tui_gcs.core.uplink.jobs import Job

MESSAGE = "FILE_TRANSFER_PROTOCOL"
CHANGES = frozenset({Op.CREATE, Op.WRITE, Op.REMOVE})
"""Requests that change a vehicle: the guard judges them."""
_OP_AT = 3

J = TypeVar("J", bound=Job)
Done = Callable[[Job], None] | None


class FtpService:
    """One dialogue per vehicle at most; the job desk sees to that."""

    def __init__(self, context: Context) -> None:
        """Listen from now on."""
        self.context = context
        self._dialogues: dict[int, FtpDialogue] = {}
        self.ignored: Counter[str] = Counter()
        """Packets that belonged to nothing, by reason."""
        context.fleet.on_message(MESSAGE, self._hear)

    # ---------------------------------------------------------------- jobs

    def list(self, vehicle: int, path: str, on_done: Done = None) -> "FtpListJob":
        """List a directory: `job.entries`."""
        return self._submit(FtpListJob(self, vehicle, path, on_done))

    def read(self, vehicle: int, path: str, on_done: Done = None, *, max_bytes: int = MOST_BYTES) -> "FtpReadJob":
        """Read a file into `job.data`; one that is larger than `max_bytes` is an error."""
        return self._submit(FtpReadJob(self, vehicle, path, on_done, max_bytes))

    def download(self, vehicle: int, path: str, on_done: Done = None, *, max_bytes: int = MOST_BYTES) -> FtpDownloadJob:
        """Read a file onto our disk, proven by its checksum: `job.path`, below the state directory."""
        return self._submit(FtpDownloadJob(self, vehicle, path, on_done, max_bytes))

    def write(
        self, vehicle: int, path: str, data: bytes, on_done: Done = None, *, verify: bool = True
    ) -> "FtpWriteJob":
        """Write a file; with `verify` the vehicle's checksum of it must fit."""
        return self._submit(FtpWriteJob(self, vehicle, path, data, on_done, verify))

    def remove(self, vehicle: int, path: str, on_done: Done = None) -> "FtpQuestionJob":
        """Remove a file."""
        return self._submit(FtpQuestionJob(self, vehicle, "remove file", Op.REMOVE, path, on_done))

    def crc32(self, vehicle: int, path: str, on_done: Done = None) -> "FtpQuestionJob":
        """Have the vehicle compute a file's checksum: `job.number`; compare with `ftp_codec.crc_fits`."""
        return self._submit(FtpQuestionJob(self, vehicle, "file checksum", Op.CRC32, path, on_done))

    def _submit(self, job: J) -> J:
        self.context.jobs.submit(job)
        return job

    # ---------------------------------------------------------------- dialogues

    def dialogue(self, vehicle: Vehicle, what: str = "file", *, first_tries: int = FIRST_TRIES) -> FtpDialogue:
        """A new conversation with a vehicle, in place of any before; `what` is the operator's word for changes."""
        slow = self.context.is_slow(vehicle.link)
        clock = self.context.clock
        begun = [False]

        def send(payload: list[int]) -> bool:
            if payload[_OP_AT] not in CHANGES:
                self.context.door.ask(vehicle.id, MESSAGE, target_network=0, payload=payload)
                return True
            if begun[0]:
                return self.context.door.transfer(vehicle.id, what, MESSAGE, target_network=0, payload=payload)
            begun[0] = True
            self.context.door.action(vehicle.id, what, MESSAGE, target_network=0, payload=payload)
            return True

        self.end(vehicle.id)
        random = Random(f"{clock.wall()!r} {vehicle.id}")
        made = FtpDialogue(send, clock.now, random, slow=slow, first_tries=first_tries, ignored=self.ignored)
        self._dialogues[vehicle.id] = made
        return made

    def reader(
        self,
        vehicle: Vehicle,
        path: str,
        sink: Sink,
        on_end: Callable[[str], None],
        *,
        max_bytes: int = MOST_BYTES,
        ranges: ByteRanges | None = None,
        first_tries: int = FIRST_TRIES,
    ) -> FtpReader:
        """For jobs that need a file on their way: `begin` it, `tick` it, `abort` it with the job.

        `on_end` is told "" or why not; `end` this service's part when the job is over.
        """
        dialogue = self.dialogue(vehicle, first_tries=first_tries)
        now = self.context.clock.now
        return FtpReader(dialogue, path, sink, on_end, now=now, max_bytes=max_bytes, ranges=ranges)

    def end(self, vehicle: int) -> None:
        """Nothing of that vehicle's files is of interest any more."""
        dialogue = self._dialogues.pop(vehicle, None)
        if dialogue is not None:
            dialogue.close()

    def _hear(self, vehicle: Vehicle, fields: Fields) -> None:
        dialogue = self._dialogues.get(vehicle.id)
        if not self.context.is_for_us(fields):
            self.ignored["file answer for another station"] += 1
        elif dialogue is None:
            self.ignored["file answer nobody asked for"] += 1
        else:
            dialogue.hear(bytes(fields["payload"]))


class FtpJob(Job):
    """A job that is a dialogue: the session is reset, then `work` begins."""

    def __init__(self, ftp: FtpService, vehicle: int, name: str, path: str, on_done: Done) -> None:
        """Nothing is asked before its turn."""
        super().__init__(vehicle, f"{name} {clean(path, 60)}", on_done)
        self.ftp = ftp
        self.path = path
        self.only_disarmed = False
        """It may have waited: not if the vehicle is armed by then."""
        self.dialogue: FtpDialogue | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        if self.only_disarmed and vehicle.armed:
            self.finish("it is armed")
            return
        self.dialogue = dialogue = self.ftp.dialogue(vehicle, self.name)
        dialogue.ask(Op.RESET, lambda reply: self.finish("no answer") if reply is None else self.work(dialogue))

    def work(self, dialogue: FtpDialogue) -> None:
        """The session was reset: begin."""
        raise NotImplementedError

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        if self.dialogue is not None:
            self.dialogue.tick()

    def abort(self) -> None:
        """See `Job`."""
        if self.dialogue is not None:
            self.dialogue.terminate_quietly()
        self.ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """See `Job`."""
        if not self.over:
            self.ftp.end(self.vehicle)
        super().finish(error)


class FtpReaderJob(Job):
    """A job that reads files of a vehicle on its way. However it ends, its dialogue ends with it."""

    def __init__(self, ftp: FtpService, vehicle: int, name: str, on_done: Done) -> None:
        """Nothing is asked before its turn."""
        super().__init__(vehicle, name, on_done)
        self._ftp = ftp
        self._reader: FtpReader | None = None

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        reader = self._reader
        if reader is not None:
            reader.tick()
            self.done, self.total = reader.ranges.held, reader.announced

    def abort(self) -> None:
        """See `Job`."""
        if self._reader is not None:
            self._reader.abort()
        self._ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """See `Job`."""
        if not self.over:
            self._ftp.end(self.vehicle)
        super().finish(error)


class FtpReadJob(FtpReaderJob):
    """Reads a file."""

    def __init__(self, ftp: FtpService, vehicle: int, path: str, on_done: Done, max_bytes: int) -> None:
        """See `FtpService.read`."""
        super().__init__(ftp, vehicle, f"read {clean(path, 60)}", on_done)
        self._path, self._most = path, max_bytes
        self._sink = MemorySink()

    @property
    def data(self) -> bytes:
        """The file, once the job is done; empty before and if it failed."""
        return bytes(self._sink.data) if self.over and not self.error else b""

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        self._reader = self._ftp.reader(vehicle, self._path, self._sink, self.finish, max_bytes=self._most)
        self._reader.begin()


class FtpListJob(FtpJob):
    """Lists a directory."""

    def __init__(self, ftp: FtpService, vehicle: int, path: str, on_done: Done) -> None:
        """See `FtpService.list`."""
        super().__init__(ftp, vehicle, "list", path, on_done)
        self._lister: FtpLister | None = None

    @property
    def entries(self) -> list[FtpEntry]:
        """What is there."""
        return self._lister.entries if self._lister is not None else []

    def work(self, dialogue: FtpDialogue) -> None:
        """See `FtpJob`."""
        self._lister = FtpLister(dialogue, self.path, self.finish)
        self._lister.start()


class FtpWriteJob(FtpJob):
    """Writes a file."""

    def __init__(self, ftp: FtpService, vehicle: int, path: str, data: bytes, on_done: Done, verify: bool) -> None:
        """See `FtpService.write`."""
        super().__init__(ftp, vehicle, "write", path, on_done)
        self._data, self._verify = data, verify
        self.total = len(data)

    def work(self, dialogue: FtpDialogue) -> None:
        """See `FtpJob`."""
        self._writer = FtpWriter(dialogue, self.path, self._data, self.finish, verify=self._verify)
        self._writer.start()

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        super().tick(vehicle, now)
        if hasattr(self, "_writer"):
            self.done = self._writer.done


class FtpQuestionJob(FtpJob):
    """Removes a file, or asks for its checksum."""

    def __init__(self, ftp: FtpService, vehicle: int, name: str, op: Op, path: str, on_done: Done) -> None:
        """See `FtpService.remove` and `FtpService.crc32`."""
        super().__init__(ftp, vehicle, name, path, on_done)
        self._op = op
        self._question: FtpOneQuestion | None = None

    @property
    def number(self) -> int | None:
        """The checksum."""
        return self._question.number if self._question is not None else None

    def work(self, dialogue: FtpDialogue) -> None:
        """See `FtpJob`."""
        self._question = FtpOneQuestion(dialogue, self._op, self.path, self.finish)
        self._question.start()
