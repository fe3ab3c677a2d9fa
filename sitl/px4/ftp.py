"""PX4's file server: one session with the id 0, bursts of 168 packets, everything under its working directory.

Measured on PX4 1.17 (docs/autopilots.md "Files by MAVFTP of PX4"). `/etc/extras` holds the metadata from which stations
know what parameters and events mean.
"""

import errno

from sitl.common.files import FileTree, GeneratedFile, fail, packaged
from sitl.common.logs import Log
from sitl.common.parameters import crc32
from sitl.common.platform import Platform
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame
from sitl.services import ftp
from sitl.services.ftp import FtpRequest, FtpServer

SESSION_US = 10_000_000
"""An open file is closed after this time without a request."""
# A burst brings 168 frames, then burst_complete (docs/autopilots.md "Files by MAVFTP of PX4").
BURST_PACKETS = 168
BURST_US = 340
"""Time between two packets of a burst."""
MAX_KEPT_BYTES = 4
"""Replies with more data are not kept for repetitions: the request is carried out again."""
# The size of a real one's file of missions.
DATAMAN_BYTES = 1_208_528

METADATA = ("component_general.json.xz", "all_events.json.xz", "parameters.json.xz")
METADATA_URI = b"mftp://etc/extras/component_general.json.xz"
METADATA_CRC = 0x9C443C03
"""As announced by a real PX4; it is not the CRC of the file as it is stored."""

_BURST = "ftp burst"
_SKIP = b"S\0"
"""An entry without a name (a link, `.` or `..`): it counts for the offset."""


class FtpRefusal(Exception):
    """A NAK with one of MAVFTP's codes."""


class Px4FtpServer(FtpServer):
    """PX4's only MAVFTP session, which all stations share."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._path: str | None = None
        """Path of the open file; None without one."""
        self._writing = False
        self._size = 0
        """Size of the file when it was opened."""
        self._last_us = 0

    def _fill(self, tree: FileTree) -> None:
        for path in ("log", "mavlink", "eeprom", "etc", "etc/extras", "etc/init.d", "etc/init.d-posix"):
            tree.add(path)
        dataman = GeneratedFile(lambda: DATAMAN_BYTES, lambda at, count: bytes(max(min(count, DATAMAN_BYTES - at), 0)))
        tree.add("dataman", dataman)
        for name in ("parameters_backup.bson", "parameters.bson"):
            tree.add(name, bytes(355))
        tree.add("err.log", b"INFO  [init] found model autostart file as SYS_AUTOSTART\n")
        tree.add("out.log", b"INFO  [init] Startup script returned successfully\n")
        for name in METADATA:
            tree.add(f"etc/extras/{name}", packaged(name))

    def _log_path(self, log: Log) -> str:
        return f"log/2026-11-21/{9 + log.number // 60:02d}_{log.number % 60:02d}_10.ulg"

    def _receive(self, frame: ReceivedFrame) -> None:
        request = ftp.parse(frame)
        last = self._last
        # PX4 does not compare stations: the request of another one with the right number gets this reply, too.
        if last is not None and (request.seq + 1) & 0xFFFF == last.seq:
            # A repetition, whichever station sends it.
            ftp.send(self._outbox, last)
            return
        if self._path is not None and self._clock.now_us - self._last_us > SESSION_US:
            self._close()
        self._last_us = self._clock.now_us
        try:
            data, opcode = self._carry_out(request), ftp.ACK
        except FtpRefusal as refused:
            data, opcode = ftp.refusal(refused.args[0]), ftp.NAK
        except OSError as problem:
            data, opcode = ftp.refusal_of(problem), ftp.NAK
        self._last = None
        if data is None:
            return  # a burst answers
        session = 0 if request.opcode in (ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE) else request.session
        reply = request.reply(opcode, data, request.offset)._replace(session=session)
        if len(data) <= MAX_KEPT_BYTES and data[:1] != bytes([ftp.NO_SESSIONS]):
            self._last = reply
        ftp.send(self._outbox, reply)

    def _close(self) -> None:
        self._path = None
        self._tasks.stop(_BURST)

    def _carry_out(self, request: FtpRequest) -> bytes | None:
        """Return the data of the ACK; None if a burst answers.

        Raises:
            FtpRefusal: A NAK with that code is the reply.
            OSError: A NAK with the errno is the reply.
        """
        if request.size > ftp.DATA_BYTES:
            raise FtpRefusal(ftp.INVALID_SIZE)
        if request.opcode in (ftp.NONE, ftp.RESET):
            if request.opcode == ftp.RESET:
                self._close()
            return b""
        if request.opcode == ftp.TERMINATE:
            if request.session != 0 or self._path is None:
                raise FtpRefusal(ftp.INVALID_SESSION)
            self._close()
            return b""
        if request.opcode in (ftp.READ, ftp.BURST, ftp.WRITE):
            return self._transfer(request)
        if request.opcode in (ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE):
            return self._open(request)
        return self._change_files(request)

    def _open(self, request: FtpRequest) -> bytes:
        if self._path is not None:
            raise FtpRefusal(ftp.NO_SESSIONS)
        tree, path = self._tree(), request.text
        if request.opcode != ftp.OPEN_READ:
            tree.create(path, truncate=request.opcode == ftp.CREATE)
        self._size = tree.size(path)
        self._path, self._writing = path, request.opcode != ftp.OPEN_READ
        return self._size.to_bytes(4, "little")

    def _transfer(self, request: FtpRequest) -> bytes | None:
        reading = request.opcode == ftp.READ
        if reading and (self._path is None or request.session != 0):
            raise FtpRefusal(ftp.INVALID_SESSION)
        # For bursts and writes PX4 does not check the session, as long as its id is 0.
        if self._path is None:
            if request.session != 0:
                raise FtpRefusal(ftp.INVALID_SESSION)
            raise FtpRefusal(ftp.END_OF_FILE if request.opcode == ftp.BURST else ftp.FAIL_ERRNO)
        if request.opcode == ftp.WRITE:
            if not self._writing:
                raise fail(errno.EBADF)
            self._tree().write(self._path, request.offset, request.data[: request.size])
            return request.size.to_bytes(4, "little")
        if reading:
            if request.offset >= self._size:
                raise FtpRefusal(ftp.END_OF_FILE)
            return self._tree().read(self._path, request.offset, request.size)
        self._tasks.start(_BURST, self._burst(request, self._path), self._clock.now_us)
        return None

    def _burst(self, request: FtpRequest, path: str) -> Task:
        """Send 168 packets, the last of them marked, or fewer until the end of the file."""
        tree, at = self._tree(), request.offset
        for number in range(BURST_PACKETS):
            opcode, data = ftp.ACK, b""
            try:
                data = tree.read(path, at, ftp.DATA_BYTES) if at < self._size else b""
            except OSError as problem:
                opcode, data = ftp.NAK, ftp.refusal_of(problem)
            if not data:
                opcode, data = ftp.NAK, ftp.refusal(ftp.END_OF_FILE)
            # After 168 packets the station has to ask for the next burst.
            complete = opcode == ftp.ACK and number == BURST_PACKETS - 1
            packet = request._replace(seq=request.seq + number, session=0)
            reply = packet.reply(opcode, data, at)._replace(burst_complete=complete)
            self._last = reply if len(data) <= MAX_KEPT_BYTES else None
            ftp.send(self._outbox, reply)
            if opcode == ftp.NAK:
                return
            at += len(data)
            yield BURST_US

    def _change_files(self, request: FtpRequest) -> bytes:
        tree, path = self._tree(), request.text
        if request.opcode == ftp.LIST:
            return _listing(tree, request)
        if request.opcode == ftp.CRC32:
            crc = crc32(tree.read(path, 0, tree.size(path)))
            return crc.to_bytes(4, "little")
        if request.opcode == ftp.REMOVE:
            tree.remove(path)
        elif request.opcode == ftp.TRUNCATE:
            tree.truncate(path, request.offset)
        elif request.opcode == ftp.MAKE_DIRECTORY:
            tree.make_directory(path)
        elif request.opcode == ftp.REMOVE_DIRECTORY:
            tree.remove_directory(path)
        elif request.opcode == ftp.RENAME:
            old, _, new = request.data[: request.size].partition(b"\0")
            tree.rename(old.decode("utf-8", "replace"), new.rstrip(b"\0").decode("utf-8", "replace"))
        else:
            raise FtpRefusal(ftp.UNKNOWN_COMMAND)
        return b""


def _listing(tree: FileTree, request: FtpRequest) -> bytes:
    """Return the entries from the offset on; entries without a name count, too."""
    entries: list[bytes] = []
    root = request.text.strip("/.") == ""
    for path in tree.names(request.text):
        name = path.rpartition("/")[2].encode()
        if root and name == b"etc":
            # A real PX4 has a link here, and skips links.
            continue
        is_file = path in tree.files
        entries.append(b"F" + name + f"\t{tree.size(path)}".encode() + b"\0" if is_file else b"D" + name + b"\0")
    # As recorded: `.` and `..` are listed as entries to skip, which count for the offset of the next request.
    entries.insert(1, _SKIP)
    entries.insert(3, _SKIP)
    data = ftp.page(entries[request.offset :])
    if not data:
        raise FtpRefusal(ftp.END_OF_FILE)
    return data
