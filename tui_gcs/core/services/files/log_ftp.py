"""Downloads a log by FTP (PX4): found by its size among the files in its folders, verified by its checksum."""

from collections.abc import Callable

from tui_gcs.core.base.safe_files import FileRefused
from tui_gcs.core.firmware.log_files import log_folders
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue
from tui_gcs.core.services.files.ftp_edit import CopyCheck, FtpEntry, FtpLister, FtpOneQuestion
from tui_gcs.core.services.files.ftp_read import FtpReader
from tui_gcs.core.services.files.ftp_sessions import FtpSessions
from tui_gcs.core.services.files.log_transfer import LogChannel, LogEntry, LogPart
from tui_gcs.core.uplink.jobs import Job

MAX_FOLDERS = 60
"""How many folders (one for each day) are searched, the newest first."""
MAX_LOG_BYTES = 1 << 30


class LogFtpJob(Job):
    """Downloads one log of an autopilot that serves its logs as files; see `LogDownloadJob`."""

    takes_long = True

    def __init__(
        self,
        channel: LogChannel,
        ftp: FtpSessions,
        vehicle: int,
        entry: LogEntry,
        on_done: Callable[[Job], None] | None,
    ) -> None:
        super().__init__(vehicle, f"download log {entry.id}", on_done)
        self._channel, self._ftp = channel, ftp
        self.entry = entry
        self.path = ""
        self.total = entry.size
        self._vehicle: Vehicle | None = None
        self._dialogue: FtpDialogue | None = None
        self._folders: list[str] = []
        self._reader: FtpReader | None = None
        self._part: LogPart | None = None
        self._remote = ""
        self._check: CopyCheck | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Reset the session and list the first folder."""
        self._vehicle = vehicle
        self._folders = list(log_folders(vehicle))
        if not self._folders:
            self.finish("this autopilot's logs are not had by FTP")
            return
        self._dialogue = dialogue = self._ftp.dialogue(vehicle)
        dialogue.ask(Op.RESET, lambda reply: self.finish("no answer") if reply is None else self._look(dialogue))

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Search, read on, then compare the checksums."""
        if self._reader is not None:
            self._reader.tick()
            self.done = self._reader.ranges.held
        elif self._dialogue is not None:
            self._dialogue.tick()
        if self._check is not None and not self.over:
            self._compare(vehicle, self._check)

    def abort(self) -> None:
        """Keep what has arrived, and close the session."""
        if self._reader is not None:
            self._reader.abort()
        if self._part is not None:
            self._part.keep()
            self._part = None
        self._ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """End the job; after an error what has arrived is kept."""
        if not self.over:
            self._ftp.end(self.vehicle)
            if error and self._part is not None:
                self._part.keep()
                self._part = None
        super().finish(error)

    def _look(self, dialogue: FtpDialogue) -> None:
        if not self._folders:
            self.finish("no file there has the size of that log")
            return
        folder = self._folders.pop(0)
        lister = FtpLister(dialogue, folder, lambda error: self._listed(dialogue, folder, lister.entries))
        lister.start()

    def _listed(self, dialogue: FtpDialogue, folder: str, entries: list[FtpEntry]) -> None:
        for entry in entries:
            if entry.exact and not entry.is_directory and entry.size == self.entry.size:
                self._read(f"{folder}/{entry.name}")
                return
        days = sorted((e.name for e in entries if e.exact and e.is_directory), reverse=True)
        self._folders = [f"{folder}/{day}" for day in days[:MAX_FOLDERS]] + self._folders[: 2 * MAX_FOLDERS]
        self._look(dialogue)

    def _read(self, path: str) -> None:
        if self._vehicle is None:
            return
        try:
            self._part = part = self._channel.open_part(self._vehicle, self.entry)
        except FileRefused as error:
            self.finish(str(error))
            return
        self._remote = path
        self._reader = self._ftp.reader(
            self._vehicle, path, part, self._on_read, max_bytes=MAX_LOG_BYTES, ranges=part.ranges
        )
        self._reader.begin()

    def _on_read(self, error: str) -> None:
        reader, self._reader = self._reader, None
        if error or reader is None or self._vehicle is None:
            if error.startswith("cannot be written here") and self._part is not None:
                self._part.discard()
                self._part = None
                self._channel.alarm(self.vehicle, f"log {self.entry.id} {error}")
            self.finish(error)
            return
        self._dialogue = dialogue = self._ftp.dialogue(self._vehicle)
        question = FtpOneQuestion(dialogue, Op.CRC32, self._remote, lambda why: self._on_crc(why, question.number))
        question.start()

    def _on_crc(self, error: str, crc: int | None) -> None:
        part = self._part
        if error or crc is None or part is None:
            self.finish(f"the vehicle did not report its checksum ({error}): kept to be tried again")
            return
        part.file.cut(part.ranges.end)
        self._check = CopyCheck(part.file, crc)

    def _compare(self, vehicle: Vehicle, check: CopyCheck) -> None:
        """Go on with the checksum of our copy, and end when it is complete."""
        part = self._part
        if part is None:
            return
        good = check.good()
        if good is None:
            return
        self._part = None
        try:
            self.path = self._channel.result_path(
                self.vehicle, part.finish(self._channel.final_name(vehicle, self.entry), bad=not good)
            )
        except FileRefused as refused:
            self.finish(str(refused))
            return
        self.finish("" if good else f"its checksum is wrong: kept as {self.path}")
