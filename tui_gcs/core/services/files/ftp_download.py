"""A file of a vehicle onto our disk: below the station's state directory, under a name that leads nowhere else."""

import zlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from tui_gcs.core.base.safe_files import FileRefused, PartFile, SafeFolder, safe_name
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue
from tui_gcs.core.services.files.ftp_edit import FtpOneQuestion
from tui_gcs.core.services.files.ftp_read import FtpReader
from tui_gcs.core.uplink.jobs import Job

if TYPE_CHECKING:
    from tui_gcs.core.services.files.ftp import FtpService

FALLBACK_NAME = "file"
"""For what is called something that is no name here."""
CHECK_BYTES = 4 << 20
"""Of our copy, in one tick."""


class CopyCheck:
    """The checksum of what was downloaded, some megabytes at a time."""

    def __init__(self, file: PartFile, crc: int) -> None:
        """`crc` is what the vehicle said."""
        self._file, self._crc = file, crc
        self._ours, self._at = 0xFFFFFFFF, 0

    def good(self) -> bool | None:
        """Go on; None until it is known whether ours is the same, in either way in which it is computed."""
        block = self._file.read(self._at, CHECK_BYTES)
        if block:
            self._ours = zlib.crc32(block, self._ours)
            self._at += len(block)
            return None
        plain = zlib.crc32(b"", self._ours)
        return self._crc in (plain, plain ^ 0xFFFFFFFF)


class FtpDownloadJob(Job):
    """Downloads a file; `path` is where it is once it is done."""

    takes_long = True

    def __init__(
        self, ftp: "FtpService", vehicle: int, remote: str, on_done: Callable[[Job], None] | None, max_bytes: int
    ) -> None:
        """See `FtpService.download`."""
        super().__init__(vehicle, f"download {clean(remote, 60)}", on_done)
        self._ftp, self._remote, self._most = ftp, remote, max_bytes
        self.path = ""
        """Below the station's state directory; also of a bad copy."""
        self._folder: SafeFolder | None = None
        self._file: PartFile | None = None
        self._reader: FtpReader | None = None
        self._dialogue: FtpDialogue | None = None
        self._vehicle: Vehicle | None = None
        self._check: CopyCheck | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
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
        self._reader = self._ftp.reader(vehicle, self._remote, file, self._on_read, max_bytes=self._most)
        self._reader.begin()

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
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
        """See `Job`."""
        if self._reader is not None:
            self._reader.abort()
        self._drop()
        self._ftp.end(self.vehicle)

    def finish(self, error: str = "") -> None:
        """See `Job`."""
        if not self.over:
            self._ftp.end(self.vehicle)
            self._drop()
        super().finish(error)

    def _on_read(self, error: str) -> None:
        reader, self._reader = self._reader, None
        if error or reader is None or self._vehicle is None:
            if error.startswith("cannot be written here"):
                text = f"{self.name}: {error}"
                self._ftp.context.events.say(EventClass.PROCESSING, f"vehicle {self.vehicle}", text, ALERT)
            self.finish(error)
            return
        self.done = self.total = reader.ranges.held
        if self._remote.lstrip("/").startswith("@"):  # made while they are read: another one each time
            self._settle(good=True)
            return
        self._dialogue = dialogue = self._ftp.dialogue(self._vehicle)
        question = FtpOneQuestion(dialogue, Op.CRC32, self._remote, lambda why: self._on_crc(why, question.number))
        question.start()

    def _on_crc(self, error: str, crc: int | None) -> None:
        if error or crc is None or self._file is None:
            self.finish(f"its checksum was not told ({error})")
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
        """Away with what is not whole."""
        if self._file is not None:
            self._file.discard()
            self._file = None
        if self._folder is not None:
            self._folder.close()
            self._folder = None
