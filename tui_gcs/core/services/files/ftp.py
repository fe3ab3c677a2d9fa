"""The jobs that list, read, download, write, remove and verify files of vehicles by MAVFTP.

    ftp.read(1, "@SYS/tasks.txt", on_done=lambda job: print(job.data))

A job of another kind that needs a file uses `FtpSessions.reader`.
"""

from typing import TypeVar

from tui_gcs.core.base.safe_files import FileRefused, PartFile, SafeFolder, safe_name
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue
from tui_gcs.core.services.files.ftp_edit import CopyCheck, FtpEntry, FtpLister, FtpOneQuestion, FtpWriter
from tui_gcs.core.services.files.ftp_read import MAX_BYTES, FtpReader, MemorySink
from tui_gcs.core.services.files.ftp_sessions import Done, FtpReaderJob, FtpSessions
from tui_gcs.core.uplink.jobs import Job

FALLBACK_NAME = "file"
"""The local name of a file whose name on the vehicle cannot be used here."""

J = TypeVar("J", bound=Job)


class FtpJob(Job):
    """A job that is one dialogue: the session is reset, then `work` begins."""

    def __init__(self, ftp: FtpSessions, vehicle: int, name: str, path: str, on_done: Done) -> None:
        super().__init__(vehicle, f"{name} {clean(path, 60)}", on_done)
        self.ftp = ftp
        self.path = path
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
        dialogue.ask(Op.RESET, lambda reply: self.finish("no answer") if reply is None else self.work(dialogue))

    def work(self, dialogue: FtpDialogue) -> None:
        """Send the first request; the session has been reset."""
        raise NotImplementedError

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered."""
        if self.dialogue is not None:
            self.dialogue.tick()

    def abort(self) -> None:
        """Close the session on the vehicle without waiting for the answer."""
        if self.dialogue is not None:
            self.dialogue.terminate_quietly()
        self.ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """End the job and its dialogue."""
        if not self.over:
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


class FtpListJob(FtpJob):
    """Lists a directory of a vehicle."""

    def __init__(self, ftp: FtpSessions, vehicle: int, path: str, on_done: Done) -> None:
        super().__init__(ftp, vehicle, "list", path, on_done)
        self._lister: FtpLister | None = None

    @property
    def entries(self) -> list[FtpEntry]:
        """The entries that have been received."""
        return self._lister.entries if self._lister is not None else []

    def work(self, dialogue: FtpDialogue) -> None:
        """Request the first entries of the directory."""
        self._lister = FtpLister(dialogue, self.path, self.finish)
        self._lister.start()


class FtpWriteJob(FtpJob):
    """Writes a file of a vehicle."""

    def __init__(self, ftp: FtpSessions, vehicle: int, path: str, data: bytes, on_done: Done, verify: bool) -> None:
        super().__init__(ftp, vehicle, "write", path, on_done)
        self._data, self._verify = data, verify
        self._writer: FtpWriter | None = None
        self.total = len(data)

    def work(self, dialogue: FtpDialogue) -> None:
        """Create the file on the vehicle."""
        self._writer = FtpWriter(dialogue, self.path, self._data, self.finish, verify=self._verify)
        self._writer.start()

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered, and take over the progress."""
        super().tick(vehicle, now)
        if self._writer is not None:
            self.done = self._writer.done


class FtpQuestionJob(FtpJob):
    """Removes a file, or has the vehicle compute its checksum."""

    def __init__(self, ftp: FtpSessions, vehicle: int, name: str, op: Op, path: str, on_done: Done) -> None:
        super().__init__(ftp, vehicle, name, path, on_done)
        self._op = op
        self._question: FtpOneQuestion | None = None

    @property
    def number(self) -> int | None:
        """The checksum that the vehicle computed; None before the answer."""
        return self._question.number if self._question is not None else None

    def work(self, dialogue: FtpDialogue) -> None:
        """Send the request to the vehicle."""
        self._question = FtpOneQuestion(dialogue, self._op, self.path, self.finish)
        self._question.start()


class FtpDownloadJob(Job):
    """Downloads a file to the station's disk and compares checksums; `path` is where it is."""

    takes_long = True

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

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Create the local file and open the remote one."""
        self._vehicle = vehicle
        root = self._ftp.context.folder
        if root is None:
            self.finish("this station has no folder for downloads")
            return
        try:
            self._folder = SafeFolder(root / "files" / f"vehicle-{vehicle.id}")
            self._file = file = self._folder.part(safe_name(self._remote) or FALLBACK_NAME)
        except FileRefused as error:
            self.finish(str(error))
            return
        self._reader = self._ftp.reader(vehicle, self._remote, file, self._on_read, max_bytes=self._max_bytes)
        self._reader.begin()

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
        if not self.over:
            self._ftp.end(self.vehicle)
            self._drop()
        super().finish(error)

    def _on_read(self, error: str) -> None:
        reader, self._reader = self._reader, None
        if error or reader is None or self._vehicle is None:
            if error.startswith("cannot be written here"):
                text = f"{self.name}: {error}"
                self._ftp.context.events.report(EventClass.PROCESSING, f"vehicle {self.vehicle}", text, ALERT)
            self.finish(error)
            return
        self.done = self.total = reader.ranges.held
        # ArduPilot generates these files anew for each read, so a checksum proves nothing.
        if self._remote.lstrip("/").startswith("@"):
            self._settle(good=True)
            return
        # The checksum is requested in a new dialogue: the reader has closed its session.
        self._dialogue = dialogue = self._ftp.dialogue(self._vehicle)
        question = FtpOneQuestion(dialogue, Op.CRC32, self._remote, lambda why: self._on_crc(why, question.number))
        question.start()

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

    def list(self, vehicle: int, path: str, on_done: Done = None) -> FtpListJob:
        """Submit a job that lists a directory: `job.entries`."""
        return self._submit(FtpListJob(self, vehicle, path, on_done))

    def read(self, vehicle: int, path: str, on_done: Done = None, *, max_bytes: int = MAX_BYTES) -> FtpReadJob:
        """Submit a job that reads a file into `job.data`. A file larger than `max_bytes` is an error."""
        return self._submit(FtpReadJob(self, vehicle, path, on_done, max_bytes))

    def download(self, vehicle: int, path: str, on_done: Done = None, *, max_bytes: int = MAX_BYTES) -> FtpDownloadJob:
        """Submit a job that downloads a file and compares its checksum: `job.path`, below the state directory."""
        return self._submit(FtpDownloadJob(self, vehicle, path, on_done, max_bytes))

    def write(self, vehicle: int, path: str, data: bytes, on_done: Done = None, *, verify: bool = True) -> FtpWriteJob:
        """Submit a job that writes a file. With `verify` the vehicle's checksum of it must match."""
        return self._submit(FtpWriteJob(self, vehicle, path, data, on_done, verify))

    def remove(self, vehicle: int, path: str, on_done: Done = None) -> FtpQuestionJob:
        """Submit a job that removes a file."""
        return self._submit(FtpQuestionJob(self, vehicle, "remove file", Op.REMOVE, path, on_done))

    def crc32(self, vehicle: int, path: str, on_done: Done = None) -> FtpQuestionJob:
        """Submit a job that lets the vehicle compute a checksum: `job.number`, see `ftp_codec.crc_fits`."""
        return self._submit(FtpQuestionJob(self, vehicle, "file checksum", Op.CRC32, path, on_done))

    def _submit(self, job: J) -> J:
        self.context.jobs.submit(job)
        return job
