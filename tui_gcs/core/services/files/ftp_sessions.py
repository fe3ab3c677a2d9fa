"""The file sessions of all vehicles, and the base class of jobs that read files."""

from collections import Counter
from collections.abc import Callable
from random import Random

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.services.files.ftp_dialogue import FIRST_TRIES, FtpDialogue
from tui_gcs.core.services.files.ftp_read import MAX_BYTES, FtpReader, Sink
from tui_gcs.core.uplink.jobs import Job, JobState

MESSAGE = "FILE_TRANSFER_PROTOCOL"
CHANGES = frozenset({Op.CREATE, Op.WRITE, Op.REMOVE})
"""Requests that change a vehicle: they leave as an action, which the guard checks."""
# Sequence number (2 bytes) and session (1 byte) come before the opcode.
_OP_AT = 3

Done = Callable[[Job], None] | None


class FtpSessions:
    """The open dialogues, at most one per vehicle: an autopilot has one session for all stations.

    The job queue runs one job per vehicle, so a new dialogue never ends one that is in use.
    """

    def __init__(self, context: ServiceContext) -> None:
        self.context = context
        self._dialogues: dict[int, FtpDialogue] = {}
        self.ignored: Counter[str] = Counter()
        """Packets that belonged to no request, counted by reason."""
        context.fleet.on_message(MESSAGE, self._on_packet)

    def dialogue(self, vehicle: Vehicle, what: str = "file", *, first_tries: int = FIRST_TRIES) -> FtpDialogue:
        """Open a dialogue with a vehicle, in place of any before. `what` is the operator's word for changes."""
        slow = self.context.is_slow(vehicle.link)
        clock = self.context.clock
        begun = [False]

        def send(payload: list[int]) -> bool:
            # Reading is a question. Writing is an action, which the guard checks; its later packets are parts of that
            # action.
            if payload[_OP_AT] not in CHANGES:
                self.context.uplink.ask(vehicle.id, MESSAGE, target_network=0, payload=payload)
                return True
            if begun[0]:
                return self.context.uplink.transfer(vehicle.id, what, MESSAGE, target_network=0, payload=payload)
            begun[0] = True
            self.context.uplink.action(vehicle.id, Order(what), MESSAGE, target_network=0, payload=payload)
            return True

        self.end(vehicle.id)
        # Seeded by the wall clock: in a rehearsal it is virtual, so that the same seed gives the same run.
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
        max_bytes: int = MAX_BYTES,
        ranges: ByteRanges | None = None,
        first_tries: int = FIRST_TRIES,
    ) -> FtpReader:
        """Return a reader for a job that needs a file: `begin`, `tick` and `abort` it with the job.

        `on_end` is called with "" or why it failed. Call `end` when the job is over.
        """
        dialogue = self.dialogue(vehicle, first_tries=first_tries)
        now = self.context.clock.now
        return FtpReader(dialogue, path, sink, on_end, now=now, max_bytes=max_bytes, ranges=ranges)

    def end(self, vehicle: int) -> None:
        """Close the vehicle's dialogue, if one is open."""
        dialogue = self._dialogues.pop(vehicle, None)
        if dialogue is not None:
            dialogue.close()

    def _on_packet(self, vehicle: Vehicle, fields: Fields) -> None:
        dialogue = self._dialogues.get(vehicle.id)
        if not self.context.is_for_us(fields):
            self.ignored["file answer for another station"] += 1
        elif dialogue is None:
            self.ignored["file answer not requested"] += 1
        else:
            dialogue.on_packet(bytes(fields["payload"]))


class FtpReaderJob(Job):
    """A job that reads files of a vehicle. However it ends, its dialogue ends with it."""

    def __init__(self, ftp: FtpSessions, vehicle: int, name: str, on_done: Done) -> None:
        super().__init__(vehicle, name, on_done)
        self._ftp = ftp
        self._reader: FtpReader | None = None

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Read on, and take over the progress."""
        reader = self._reader
        if reader is not None:
            reader.tick()
            self.done, self.total = reader.ranges.held, reader.announced

    def abort(self) -> None:
        """Close the session on the vehicle without waiting for the answer."""
        if self._reader is not None:
            self._reader.abort()
        self._ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """End the job and its dialogue; while it waits the vehicle's dialogue is another job's."""
        if self.state is JobState.RUNNING:
            self._ftp.end(self.vehicle)
        super().finish(error)
