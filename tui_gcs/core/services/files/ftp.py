"""The jobs that list, read, download, write, remove and verify files of vehicles by MAVFTP.

    ftp.read(1, "@SYS/tasks.txt", on_done=lambda job: print(job.data))

A job of another kind that needs a file uses `FtpSessions.reader`.
"""

from typing import Generic, TypeVar

from tui_gcs.core.base.safe_files import FileRefused, PartFile, SafeFolder, safe_name
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue
from tui_gcs.core.services.files.ftp_edit import CopyCheck, FtpLister, FtpOneQuestion, FtpTask, FtpWriter
from tui_gcs.core.services.files.ftp_read import MAX_BYTES, FtpReader, MemorySink
from tui_gcs.core.services.files.ftp_sessions import Done, FtpReaderJob, FtpSessions
from tui_gcs.core.uplink.jobs import MAX_LONG_RUNNING_S, Job, JobState

FALLBACK_NAME = "file"
"""The local name of a file whose name on the vehicle cannot be used here."""

T = TypeVar("T", bound=FtpTask)


class FtpJob(Job, Generic[T]):
    """A job that is one task in one dialogue: the session is reset, then the task begins. `task` has the result."""

    def __init__(self, ftp: FtpSessions, vehicle: int, name: str, task: T, on_done: Done) -> None:
        super().__init__(vehicle, f"{name} {clean(task.path, 60)}", on_done)
        self.ftp = ftp
        self.task = task
        self.total = task.total
        self.only_disarmed = False
        """Do not begin if the vehicle is armed: the job may have waited in the queue."""
        self.dialogue: FtpDialogue | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Reset the session, and begin to work when the vehicle has confirmed that."""
        # It may have waited in the queue while the vehicle was armed.
        if self.only_disarmed and vehicle.telemetry.armed:
            self.finish("it is armed")
            return
        self.dialogue = dialogue = self.ftp.dialogue(vehicle, self.name)
        dialogue.ask(
            Op.RESET,
            lambda reply: self.finish("no answer") if reply is None else self.task.start(dialogue, self.finish),
        )

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered, and take over the progress."""
        if self.dialogue is not None:
            self.dialogue.tick()
        self.done = self.task.done

    def abort(self) -> None:
        """Close the session on the vehicle without waiting for the answer."""
        if self.dialogue is not None:
            self.dialogue.terminate_quietly()
        self.ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """End the job and its dialogue; while it waits the vehicle's dialogue is another job's."""
        if self.state is JobState.RUNNING:
            self.ftp.end(self.vehicle)
        super().finish(error)


class FtpReadJob(FtpReaderJob):
    """Reads a file into memory."""

    def __init__(self, ftp: FtpSessions, vehicle: int, path: str, on_done: Done, max_bytes: int) -> None:
        super().__init__(ftp, vehicle, f"read {clean(path, 60)}", on_done)
        self._path, self._max_bytes = path, max_bytes
        self._sink = MemorySink()

    @property
    def data(self) -> bytes:
        """The contents, once the job is done; empty before, and if it failed."""
        return bytes(self._sink.data) if self.over and not self.error else b""

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Open the file on the vehicle."""
        self._reader = self._ftp.reader(vehicle, self._path, self._sink, self.finish, max_bytes=self._max_bytes)
        self._reader.begin()


class FtpDownloadJob(Job):
    """Downloads a file to the station's disk and compares checksums; `path` is where it is."""

    takes_long = True
    max_running_s = MAX_LONG_RUNNING_S

    def __init__(self, ftp: FtpSessions, vehicle: int, remote: str, on_done: Done, max_bytes: int) -> None:
        super().__init__(vehicle, f"download {clean(remote, 60)}", on_done)
        self._ftp, self._remote, self._max_bytes = ftp, remote, max_bytes
        self.path = ""
        """The path below the station's state directory, of a copy with a wrong checksum, too."""
        self._folder: SafeFolder | None = None
        self._file: PartFile | None = None
        self._reader: FtpReader | None = None
        self._dialogue: FtpDialogue | None = None
        self._vehicle: Vehicle | None = None
        self._check: CopyCheck | None = None
        self._room_bytes = 0
        """What the file may take of the disk."""
        self._held: ByteRanges | None = None
        """What the local file held when the job was paused."""

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Create the local file, or go on with the one of before the pause, and open the remote one."""
        self._vehicle = vehicle
        root = self._ftp.context.folder
        if root is None:
            self.finish("this station has no folder for downloads")
            return
        held, self._held = self._held, None
        try:
            self._folder = SafeFolder(root / "files" / f"vehicle-{vehicle.id}")
            self._file = file = self._folder.part(safe_name(self._remote) or FALLBACK_NAME, resume=held is not None)
        except FileRefused as error:
            self.finish(str(error))
            return
        self._room_bytes = self._folder.room_bytes() + (held.held if held is not None else 0)
        most = min(self._max_bytes, self._room_bytes)
        self._reader = self._ftp.reader(vehicle, self._remote, file, self._on_read, max_bytes=most, ranges=held)
        self._reader.begin()

    def pause(self) -> bool:
        """Close the session and keep what has arrived; what the vehicle makes anew for each read cannot be resumed."""
        if self._reader is None or self._file is None or self._folder is None or self._is_virtual:
            return False
        self._held = self._reader.ranges
        self._reader.abort()
        self._ftp.end(self.vehicle)
        self._file.keep()
        self._folder.close()
        self._reader = self._file = self._folder = None
        return True

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Read on, then compare the checksums."""
        if self._reader is not None:
            self._reader.tick()
        elif self._dialogue is not None:
            self._dialogue.tick()
        if self._reader is not None:
            self.done, self.total = self._reader.ranges.held, self._reader.announced
        if self._check is not None and not self.over:
            good = self._check.good()
            if good is not None:
                self._settle(good=good)

    def abort(self) -> None:
        """Close the session and discard the local file."""
        if self._reader is not None:
            self._reader.abort()
        self._drop()
        self._ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """End the job and its dialogue; what is incomplete is discarded."""
        if self.state is JobState.RUNNING:
            self._ftp.end(self.vehicle)
            self._drop()
        super().finish(error)

    @property
    def _is_virtual(self) -> bool:
        """Whether ArduPilot generates the file anew for each read: a checksum of it proves nothing."""
        return self._remote.lstrip("/").startswith("@")

    def _on_read(self, error: str) -> None:
        reader, self._reader = self._reader, None
        if error or reader is None or self._vehicle is None:
            if reader is not None and reader.too_large and self._room_bytes < self._max_bytes:
                error = f"no room for more than {self._room_bytes / 1e6:.0f} MB: free space in the state directory"
            if error.startswith("cannot be written here"):
                text = f"{self.name}: {error}"
                self._ftp.context.events.report(EventClass.PROCESSING, f"vehicle {self.vehicle}", text, ALERT)
            self.finish(error)
            return
        self.done = self.total = reader.ranges.held
        if self._is_virtual:
            self._settle(good=True)
            return
        # The checksum is requested in a new dialogue: the reader has closed its session.
        self._dialogue = dialogue = self._ftp.dialogue(self._vehicle)
        question = FtpOneQuestion(Op.CRC32, self._remote)
        question.start(dialogue, lambda why: self._on_crc(why, question.number))

    def _on_crc(self, error: str, crc: int | None) -> None:
        if error or crc is None or self._file is None:
            self.finish(f"the vehicle did not report its checksum ({error})")
        else:
            self._check = CopyCheck(self._file, crc)

    def _settle(self, *, good: bool) -> None:
        file, self._file = self._file, None
        if file is None:
            return
        try:
            self.path = f"files/vehicle-{self.vehicle}/{file.finish(bad=not good)}"
        except FileRefused as refused:
            self.finish(str(refused))
            return
        self.finish("" if good else f"its checksum is wrong: kept as {self.path}")

    def _drop(self) -> None:
        """Discard an incomplete file and close the folder."""
        if self._file is not None:
            self._file.discard()
            self._file = None
        if self._folder is not None:
            self._folder.close()
            self._folder = None


class FtpService(FtpSessions):
    """Submits file jobs to the job queue, and keeps the sessions that they use."""

    def list(self, vehicle: int, path: str, on_done: Done = None) -> FtpJob[FtpLister]:
        """Submit a job that lists a directory: `job.task.entries`."""
        return self._submit("list", vehicle, FtpLister(path), on_done)

    def read(self, vehicle: int, path: str, on_done: Done = None, *, max_bytes: int = MAX_BYTES) -> FtpReadJob:
        """Submit a job that reads a file into `job.data`. A file larger than `max_bytes` is an error."""
        return self.context.jobs.submit(FtpReadJob(self, vehicle, path, on_done, max_bytes))

    def download(self, vehicle: int, path: str, on_done: Done = None, *, max_bytes: int = MAX_BYTES) -> FtpDownloadJob:
        """Submit a job that downloads a file and compares its checksum: `job.path`, below the state directory."""
        return self.context.jobs.submit(FtpDownloadJob(self, vehicle, path, on_done, max_bytes))

    def write(
        self, vehicle: int, path: str, data: bytes, on_done: Done = None, *, verify: bool = True
    ) -> FtpJob[FtpWriter]:
        """Submit a job that writes a file. With `verify` the vehicle's checksum of it must match."""
        job = self._submit("write", vehicle, FtpWriter(path, data, verify=verify), on_done)
        # 4 MB over a radio of 1 kB/s are more than an hour.
        job.max_running_s = MAX_LONG_RUNNING_S
        return job

    def remove(self, vehicle: int, path: str, on_done: Done = None) -> FtpJob[FtpOneQuestion]:
        """Submit a job that removes a file."""
        return self._submit("remove file", vehicle, FtpOneQuestion(Op.REMOVE, path), on_done)

    def crc32(self, vehicle: int, path: str, on_done: Done = None) -> FtpJob[FtpOneQuestion]:
        """Submit a job that lets the vehicle compute a checksum: `job.task.number`, see `ftp_codec.crc_fits`."""
        return self._submit("file checksum", vehicle, FtpOneQuestion(Op.CRC32, path), on_done)

    def _submit(self, name: str, vehicle: int, task: T, on_done: Done) -> FtpJob[T]:
        return self.context.jobs.submit(FtpJob(self, vehicle, name, task, on_done))
