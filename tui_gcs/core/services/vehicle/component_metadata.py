"""Fetches the component metadata of vehicles: the files that describe parameters and events (docs/autopilots.md C11).

    metadata.fetch(1, EVENTS, on_done=lambda job: job.data)     # JSON, decompressed

Only files of the vehicle itself (mftp) are read, never an address on a network (docs/threats.md B.6-94). A file has a
checksum and is kept under it, so a fleet of one firmware fetches each file once.
"""

import lzma
import re
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import msgspec

from tui_gcs.core.base.safe_files import FileRefused, SafeFolder
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.files.ftp_codec import crc_fits
from tui_gcs.core.services.files.ftp_read import MemorySink
from tui_gcs.core.services.files.ftp_sessions import FtpReaderJob, FtpSessions

PARAMETERS, EVENTS = 1, 4
"""Values of COMP_METADATA_TYPE."""
NAMES = {PARAMETERS: "descriptions of parameters", EVENTS: "descriptions of events"}
"""What a file holds, in the names of jobs and in the events about them."""
MAX_FILE_BYTES = 1 << 20
MAX_JSON_BYTES = 8 << 20
"""The most that a file may unpack to (docs/threats.md B.6-95); PX4's parameters are 0.7 MB."""
MAX_UNPACK_MEMORY = 80 << 20
"""PX4 packs with `xz -9`, whose dictionary is 64 MiB of address space. Only what is unpacked is really used."""
MAX_KEPT = 40
ASK_TRIES, ASK_GAP_S = 3, 1.0
ADDRESS_MESSAGES = (("COMPONENT_METADATA", 397, "uri"), ("COMPONENT_INFORMATION", 395, "general_metadata_uri"))
"""Message, its id and the field with the address; the second message is the older one."""
_URI = re.compile(r"mftp://(?:\[;comp=(\d{1,3})\])?(/?[A-Za-z0-9@][A-Za-z0-9@._-]*(?:/[A-Za-z0-9_-][A-Za-z0-9._-]*)*)")


class MetadataError(ValueError):
    """The metadata cannot be used; the message gives the reason."""


class _Type(msgspec.Struct):
    type: int
    uri: str = ""
    fileCrc: int = 0  # noqa: N815 - as in the file


class _General(msgspec.Struct):
    metadataTypes: list[_Type] = []  # noqa: N815 - as in the file


def path_of(uri: str, component: int) -> str:
    """Return the path in the vehicle's own files that `uri` names. Raises MetadataError for anything else."""
    match = _URI.fullmatch(uri)
    # Only mftp paths of this component: an address on a network is never fetched (docs/threats.md B.6-94).
    if match is None or ".." in uri or (match[1] and int(match[1]) != component):
        raise MetadataError("its address is not one of the vehicle's own files: not fetched")
    return match[2]


def unpack(data: bytes) -> bytes:
    """Unpack a .xz, a .gz or a plain file. Raises MetadataError, e.g. for more than `MAX_JSON_BYTES`."""
    try:
        if data[:6] == b"\xfd7zXZ\0":
            # Bounded output and memory: a few kB can unpack to gigabytes (docs/threats.md B.6-95).
            unxz = lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=MAX_UNPACK_MEMORY)
            out, whole = unxz.decompress(data, MAX_JSON_BYTES + 1), unxz.eof
        elif data[:2] == b"\x1f\x8b":
            ungz = zlib.decompressobj(31)
            out, whole = ungz.decompress(data, MAX_JSON_BYTES + 1), ungz.eof
        else:
            out, whole = data, True
    except (lzma.LZMAError, zlib.error, MemoryError):
        raise MetadataError("it cannot be unpacked") from None
    if len(out) > MAX_JSON_BYTES:
        raise MetadataError(f"it unpacks to more than {MAX_JSON_BYTES >> 20} MB")
    if not whole:
        raise MetadataError("it is cut short")
    return out


class MetadataService:
    """Submits jobs that fetch metadata, and keeps the files."""

    def __init__(self, context: ServiceContext, ftp: FtpSessions) -> None:
        self.context = context
        self.ftp = ftp
        self.folder: SafeFolder | None = None
        if context.folder is not None:
            # The parameter cache, which is in the same folder, reports it.
            with suppress(FileRefused):
                self.folder = SafeFolder(context.folder / "cache")
        for name, _, field in ADDRESS_MESSAGES:
            context.fleet.on_message(name, partial(self._on_address, field))

    def fetch(self, vehicle: int, kind: int, on_done: "Callable[[MetadataJob], None] | None" = None) -> "MetadataJob":
        """Submit a job that fetches the JSON of a kind (`PARAMETERS`, `EVENTS`, …)."""
        return self.context.jobs.submit(MetadataJob(self, vehicle, kind, on_done))

    def kept(self, kind: int, crc: int) -> bytes | None:
        """Return a file that was fetched before, packed as it came, or None."""
        data = self.folder.read(_file_name(kind, crc), MAX_FILE_BYTES) if self.folder is not None and crc else None
        return data if data is not None and crc_fits(data, crc) else None

    def keep(self, kind: int, crc: int, data: bytes, *, bad: bool = False) -> None:
        """Store a file; a bad one only for inspection."""
        if self.folder is None or not crc:
            return
        try:
            self.folder.replace(_file_name(kind, crc) + (".bad" if bad else ""), data)
            for name in [name for name in self.folder.names() if name.startswith("meta-")][:-MAX_KEPT]:
                self.folder.remove(name)
        except (FileRefused, OSError):
            return  # it is fetched again next time

    def _on_address(self, field: str, vehicle: Vehicle, fields: Fields) -> None:
        job = self.context.jobs.running(vehicle.id)
        if isinstance(job, MetadataJob):
            job.on_address(vehicle, fields[field])


def _file_name(kind: int, crc: int) -> str:
    return f"meta-{kind}-{crc:08x}"


class MetadataJob(FtpReaderJob):
    """Fetches the address, then the table of files, then the file."""

    def __init__(
        self,
        service: MetadataService,
        vehicle: int,
        kind: int,
        on_done: "Callable[[MetadataJob], None] | None" = None,
    ) -> None:
        super().__init__(service.ftp, vehicle, f"read {NAMES.get(kind, f'metadata {kind}')}", on_done)  # type: ignore[arg-type]  # it is called with this job
        self._service = service
        self._kind = kind
        self.data = b""
        """The JSON, once the job is done."""
        self._tries = 0
        self._due_s = 0.0
        self._asking = True
        self._vehicle: Vehicle | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Request the address of the table of files."""
        self._vehicle = vehicle
        self._ask(now)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered."""
        if self._asking and now >= self._due_s:
            self._ask(now)
        super().tick(vehicle, now)

    def on_address(self, vehicle: Vehicle, uri: str) -> None:
        """Take the address of the table of files."""
        if not self._asking or self.over:
            return
        self._asking = False
        try:
            path = path_of(uri, vehicle.component)
        except MetadataError as error:
            self.finish(str(error))
            return
        self._read(path, self._on_general)

    def _ask(self, now: float) -> None:
        which = self._tries // ASK_TRIES
        if which >= len(ADDRESS_MESSAGES):
            self.finish("the vehicle does not say where they are")
            return
        self._tries += 1
        self._due_s = now + ASK_GAP_S
        self._service.context.request_message(self.vehicle, ADDRESS_MESSAGES[which][1])

    def _read(self, path: str, then: Callable[[bytes], None]) -> None:
        if self._vehicle is None:
            return
        sink = MemorySink()
        self._reader = self._ftp.reader(
            self._vehicle,
            path,
            sink,
            lambda error: self.finish(error) if error else then(bytes(sink.data)),
            max_bytes=MAX_FILE_BYTES,
        )
        self._reader.begin()

    def _on_general(self, data: bytes) -> None:
        try:
            table = msgspec.json.decode(unpack(data), type=_General)
            found = next((entry for entry in table.metadataTypes if entry.type == self._kind), None)
            if found is None:
                raise MetadataError("the vehicle has none of that kind")
            component = self._vehicle.component if self._vehicle is not None else 0
            path, crc = path_of(found.uri, component), found.fileCrc & 0xFFFFFFFF
        except MetadataError as error:
            self.finish(str(error))
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            self.finish("the table of its files cannot be read")
        else:
            kept = self._service.kept(self._kind, crc)
            if kept is not None:
                self._use(kept)
            else:
                self._read(path, lambda data: self._on_file(data, crc))

    def _on_file(self, data: bytes, crc: int) -> None:
        # A file with a wrong checksum would be kept for the whole fleet.
        if crc and not crc_fits(data, crc):
            self._service.keep(self._kind, crc, data, bad=True)
            self.finish("its checksum is wrong: kept as .bad, not used")
            return
        self._service.keep(self._kind, crc, data)
        self._use(data)

    def _use(self, data: bytes) -> None:
        try:
            self.data = unpack(data)
        except MetadataError as error:
            self.finish(str(error))
        else:
            self.finish()
