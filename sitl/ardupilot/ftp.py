"""ArduPilot's file server: one session for all stations, bursts of up to 500 packets, files generated on reading.

Measured on ArduCopter 4.7 (docs/autopilots.md "Files by MAVFTP of ArduCopter"). What matters most to a station: the
announced size is often wrong, an acknowledged upload may have been refused, and a request whose number is one less
than that of the last reply counts as a repetition.
"""

import errno
from collections import deque
from collections.abc import Callable

from sitl.ardupilot import mission_files, param_pack
from sitl.ardupilot.mission_files import MissionFiles
from sitl.ardupilot.mission_protocol import ArduPilotMissions
from sitl.common.files import MAX_FILE_BYTES, FileTree, GeneratedFile, fail, normal
from sitl.common.logs import Log
from sitl.common.missions import ITEM_BYTES
from sitl.common.parameters import ParameterTable, crc32
from sitl.common.platform import Platform
from sitl.common.states import MavSeverity
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame
from sitl.services import ftp
from sitl.services.ftp import FtpReply, FtpRequest, FtpServer

SESSION_US = 3_000_000
"""After this silence another station may take the session over."""
# Measured: burst_complete comes after 500 packets, and the next burst has to be asked for.
BURST_PACKETS = 500
BURST_US = 5_400
"""Time between two packets of a burst."""
MAX_WAITING = 5
"""Number of requests that are kept during a burst; further ones are lost."""
CRC_BLOCK_BYTES = 1024
MAX_PARAMETER = 0xFFFF

_BURST = "ftp burst"
# Files of @SYS are announced with 100,000 bytes, whatever they hold.
_SYS_BYTES = 100_000
_NO_BYTES = "TX=       0 RX=       0 TXBD=     0 RXBD=     0"
_UARTS = f"""UARTV1
SERIAL0 TX=   31617 RX=    2229 TXBD=  7349 RXBD=   518 connected     (udpclient:127.0.0.1:14550)
SERIAL1 {_NO_BYTES} not connected (none:1)
SERIAL2 {_NO_BYTES} not connected (none:2)
SERIAL3 TX=    4307 RX=   86478 TXBD=  1001 RXBD= 20103 connected     (GPS1)
SERIAL4 {_NO_BYTES} connected     (GPS2)
SERIAL5 {_NO_BYTES} not connected (tcp:5)
SERIAL6 {_NO_BYTES} not connected (tcp:6)
SERIAL7 {_NO_BYTES} not connected (tcp:7)
SERIAL8 {_NO_BYTES} not connected (tcp:8)
"""
_SYS: dict[str, bytes | None] = {
    "threads.txt": None,
    "tasks.txt": b"TasksV2\n",
    "dma.txt": None,
    "memory.txt": None,
    "uarts.txt": _UARTS.encode(),
    "timers.txt": None,
    "crash_dump.bin": None,
}
"""Files of `@SYS` as listed, and as they were read from a real ArduCopter in SITL; None: it cannot be opened, because
that HAL has nothing to say (AP_Filesystem_Sys.cpp), though on a flight controller it can."""


class OpenFile:
    """An open file of the tree."""

    def __init__(self, tree: FileTree, path: str, *, writing: bool) -> None:
        self._tree, self._path, self.writing = tree, path, writing

    def read(self, offset: int, count: int) -> bytes:
        """Return bytes: fewer at the end of the file, none behind it."""
        return self._tree.read(self._path, offset, count)

    def write(self, offset: int, data: bytes) -> None:
        """Put bytes into the file."""
        self._tree.write(self._path, offset, data)

    def close(self) -> None:
        """Close the file; one that was uploaded is judged now."""


class UploadedFile(OpenFile):
    """An `@PARAM` or `@MISSION` file that is judged when it is closed; the result is not reported."""

    def __init__(self, path: str, params: ParameterTable, plans: MissionFiles) -> None:
        self._path, self._params, self._plans = path, params, plans
        self.writing = True
        self._data = bytearray()

    def read(self, offset: int, count: int) -> bytes:
        """Refuse to read a file that is being written."""
        raise fail(errno.EBADF)

    def write(self, offset: int, data: bytes) -> None:
        """Put bytes into the file; its header makes room for the whole file, so that gaps are seen."""
        end = offset + len(data)
        if end > MAX_FILE_BYTES:
            raise fail(errno.ENOSPC)
        self._data.extend(bytes(max(end - len(self._data), 0)))
        self._data[offset:end] = data
        if offset == 0:
            self._data.extend(bytes(max(self._announced_bytes() - len(self._data), 0)))

    def _announced_bytes(self) -> int:
        if self._path.startswith("@PARAM") and len(self._data) >= param_pack.HEADER.size:
            magic, _, length = param_pack.HEADER.unpack_from(self._data)
            return length if magic == param_pack.MAGIC else 0
        if self._path.startswith("@MISSION") and len(self._data) >= mission_files.HEADER.size:
            number = mission_files.HEADER.unpack_from(self._data)[4]
            return mission_files.HEADER.size + number * ITEM_BYTES if number < MAX_PARAMETER else 0
        return 0

    def close(self) -> None:
        """Store the file, or drop it."""
        if self._path.startswith("@PARAM"):
            self._set_parameters()
            return
        kind = mission_files.KINDS[self._path.removeprefix("@MISSION/")]
        self._plans.store(kind, bytes(self._data))

    def _set_parameters(self) -> None:
        try:
            values = param_pack.unpack(bytes(self._data))
        except ValueError:
            return
        for name, value in values:
            self._params.set(name, value)


class ParameterFile(OpenFile):
    """`@PARAM/param.pck`, packed for the block size of the first read."""

    def __init__(self, params: ParameterTable, path: str) -> None:
        self._params, self.writing = params, False
        self._block = 0
        self._data = b""
        self._start, self._count, self._defaults = _query(path.partition("?")[2])

    def read(self, offset: int, count: int) -> bytes:
        """Return bytes of the file; every read must have the same count."""
        # The layout depends on the block size, so all reads of a handle must use one
        # (docs/autopilots.md "Files by MAVFTP of ArduCopter").
        if self._block == 0:
            if self._start >= len(self._params):
                raise fail(errno.EINVAL)
            self._block = count
            self._data = param_pack.pack(
                self._params, count, start=self._start, count=self._count, defaults=self._defaults
            )
        if count != self._block:
            raise fail(errno.EINVAL)
        return self._data[offset : offset + count]


class PlanFile(OpenFile):
    """An `@MISSION` file as it was when it was opened."""

    def __init__(self, data: bytes) -> None:
        self._data, self.writing = data, False

    def read(self, offset: int, count: int) -> bytes:
        """Return bytes of the file."""
        return self._data[offset : offset + count]


def _query(text: str) -> tuple[int, int, bool]:
    """Return start=, count= and withdefaults= of a path.

    Raises:
        OSError: A value is too big.
    """
    values = {"start": 0, "count": 0, "withdefaults": 0}
    for part in text.split("&"):
        name, _, value = part.partition("=")
        if name in values:
            digits = "".join(ch for ch in value[:9] if ch in "0123456789")
            values[name] = int(digits or 0)
    if max(values["start"], values["count"]) >= MAX_PARAMETER or values["withdefaults"] > 1:
        raise fail(errno.EINVAL)
    return values["start"], values["count"], values["withdefaults"] == 1


class ArduPilotFtpServer(FtpServer):
    """ArduPilot's only MAVFTP session, which all stations share."""

    def __init__(self, platform: Platform, missions: ArduPilotMissions, banner: Callable[[], None]) -> None:
        """`banner` sends the texts that come with the file of all parameters."""
        super().__init__(platform)
        self._missions, self._banner = MissionFiles(platform.plans, missions), banner
        self._session: int | None = None
        self._open: OpenFile | None = None
        self._last_us = -SESSION_US
        """When a request was answered last."""
        self._waiting: deque[FtpRequest] = deque(maxlen=MAX_WAITING)

    def _receive(self, frame: ReceivedFrame) -> None:
        request = ftp.parse(frame)
        if _BURST in self._tasks:
            # Requests during a burst wait; beyond five they are lost, and stations have to repeat them.
            if len(self._waiting) < MAX_WAITING:
                self._waiting.append(request)
            return
        self._serve(request)

    def _fill(self, tree: FileTree) -> None:
        for path in ("terrain", "@ROMFS", "@SYS", "@ROMFS/models"):
            tree.add(path)
        tree.add("eeprom.bin", bytes(16384))
        tree.add("@ROMFS/locations.txt", b"#NAME=latitude,longitude,absolute-altitude,heading\n")
        for name, content in _SYS.items():
            if content is None:
                tree.order.append(f"@SYS/{name}")  # listed, but cannot be opened
            else:
                tree.add(f"@SYS/{name}", _sys_file(content))
        tree.add("@SYS/storage.bin", bytes(16384))

    def _log_path(self, log: Log) -> str:
        return f"logs/{log.number:08d}.BIN"

    def _serve(self, request: FtpRequest) -> None:
        # A request with the station, number and session of the last reply counts as a repetition, whatever it contains.
        if self._last is not None and request.reply(ftp.ACK)[:4] == self._last[:4]:
            self._reply(self._last)
            return
        if request.opcode in (ftp.ACK, ftp.NAK):
            return
        try:
            answer = self._answer(request)
        except OSError as problem:
            answer = request.reply(ftp.NAK, ftp.refusal_of(problem))
        if answer is not None:
            self._reply(answer)
            opened = request.opcode == ftp.OPEN_READ and answer.opcode == ftp.ACK
            if opened and request.text.startswith("@PARAM/param.pck"):
                self._banner()

    def _reply(self, reply: FtpReply) -> None:
        self._last, self._last_us = reply, self._clock.now_us
        ftp.send(self._outbox, reply)
        # A terminated session may be taken over at once, without the 3 s of silence.
        if reply.request == ftp.TERMINATE:
            self._last_us = self._clock.now_us - SESSION_US

    def _answer(self, request: FtpRequest) -> FtpReply | None:
        """Return the reply to a request; None if a burst answers.

        Raises:
            OSError: A NAK with this errno is the reply.
        """
        if request.size > ftp.DATA_BYTES:
            return _nak(request, ftp.INVALID_SIZE)
        # One session serves all stations: another one with the same session id can read and reset it.
        strange = request.session != self._session
        idle = self._clock.now_us - self._last_us >= SESSION_US
        if strange and request.opcode in (ftp.TERMINATE, ftp.RESET):
            # The end of another session is acknowledged without effect.
            return request.reply(ftp.ACK)
        if strange and self._open is not None:
            if not idle:
                return _nak(request, ftp.INVALID_SESSION)
            self._close()
        if request.opcode in (ftp.TERMINATE, ftp.RESET):
            self._close()
            return request.reply(ftp.ACK)
        if request.opcode in (ftp.READ, ftp.BURST, ftp.WRITE):
            return self._transfer(request)
        if request.opcode == ftp.NONE:
            return request.reply(ftp.ACK)
        return self._change_files(request)

    def _close(self) -> None:
        if self._open is not None:
            self._open.close()
        self._open = None
        self._session = None

    def _transfer(self, request: FtpRequest) -> FtpReply | None:
        opened = self._open
        if opened is None:
            return _nak(request, ftp.FILE_NOT_FOUND)
        if opened.writing != (request.opcode == ftp.WRITE):
            return _nak(request, ftp.FAIL)
        if request.opcode == ftp.WRITE:
            opened.write(request.offset, request.data[: request.size])
            return request.reply(ftp.ACK, offset=request.offset)
        if request.opcode == ftp.READ:
            data = opened.read(request.offset, request.size)
            return request.reply(ftp.ACK, data, request.offset) if data else _nak(request, ftp.END_OF_FILE)
        self._tasks.start(_BURST, self._burst(request, opened), self._clock.now_us)
        return None

    def _burst(self, request: FtpRequest, opened: OpenFile) -> Task:
        """Send packets until the end of the file, or 500; then serve the requests that waited."""
        block, at = request.size or ftp.DATA_BYTES, request.offset
        for number in range(BURST_PACKETS):
            try:
                data = opened.read(at, block)
                refusal = b"" if data else ftp.refusal(ftp.END_OF_FILE)
            except OSError as problem:
                data, refusal = b"", ftp.refusal(ftp.FAIL_ERRNO, problem.errno or errno.EIO)
            packet = request._replace(seq=request.seq + number)
            if refusal:
                self._reply(packet.reply(ftp.NAK, refusal, at))
                break
            self._reply(packet.reply(ftp.ACK, data, at)._replace(burst_complete=number == BURST_PACKETS - 1))
            at += len(data)
            yield BURST_US
        self._tasks.stop(_BURST)
        while self._waiting and _BURST not in self._tasks:
            self._serve(self._waiting.popleft())

    def _change_files(self, request: FtpRequest) -> FtpReply:
        path, tree = request.text, self._tree()
        if request.opcode == ftp.RENAME:
            old, _, new = request.data[: request.size].partition(b"\0")
            tree.rename(old.decode("utf-8", "replace"), new.decode("utf-8", "replace"))
            return request.reply(ftp.ACK)
        known = {ftp.LIST, ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE, ftp.REMOVE, ftp.CRC32}
        if request.opcode not in known | {ftp.MAKE_DIRECTORY, ftp.REMOVE_DIRECTORY}:
            self._outbox.text(MavSeverity.DEBUG, f"Unsupported FTP: {request.opcode}")
            return _nak(request, ftp.FAIL)
        if not path or len(path.encode()) != request.size:
            return _nak(request, ftp.INVALID_SIZE)
        if request.opcode == ftp.LIST:
            return _listing(tree, request)
        if request.opcode in (ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE):
            return self._open_session(request, tree)
        if request.opcode == ftp.CRC32:
            return request.reply(ftp.ACK, self._crc(tree, path).to_bytes(4, "little"))
        if request.opcode == ftp.MAKE_DIRECTORY:
            tree.make_directory(path)
        elif normal(path) in tree.directories:
            tree.remove_directory(path)
        else:
            tree.remove(path)
        return request.reply(ftp.ACK)

    def _open_session(self, request: FtpRequest, tree: FileTree) -> FtpReply:
        if self._open is not None:
            if request.opcode != ftp.OPEN_READ or self._clock.now_us - self._last_us <= SESSION_US:
                return _nak(request, ftp.FAIL)
            self._close()
        path, writing = request.text, request.opcode != ftp.OPEN_READ
        size, self._open = self._opened(tree, path, writing=writing, truncate=request.opcode == ftp.CREATE)
        self._session = request.session
        return request.reply(ftp.ACK, b"" if writing else size.to_bytes(4, "little"))

    def _opened(self, tree: FileTree, path: str, *, writing: bool, truncate: bool) -> tuple[int, OpenFile]:
        """Return the size to be announced, and the open file.

        Raises:
            OSError: The file does not exist.
        """
        name, query, _ = path.partition("?")
        if name == "@PARAM/param.pck":
            if writing:
                return 0, UploadedFile(path, self._params, self._missions)
            return param_pack.ANNOUNCED_BYTES_EACH * len(self._params), ParameterFile(self._params, path)
        kind = mission_files.KINDS.get(path.removeprefix("@MISSION/")) if path.startswith("@MISSION/") else None
        if kind is not None and not query:
            if writing:
                return mission_files.ANNOUNCED_BYTES, UploadedFile(path, self._params, self._missions)
            return mission_files.ANNOUNCED_BYTES, PlanFile(self._missions.pack(kind))
        if writing:
            tree.create(path, truncate=truncate)
        return tree.size(path), OpenFile(tree, path, writing=writing)

    def _crc(self, tree: FileTree, path: str) -> int:
        _, opened = self._opened(tree, path, writing=False, truncate=False)
        crc, at = 0, 0
        while data := opened.read(at, CRC_BLOCK_BYTES):
            crc, at = crc32(data, crc), at + len(data)
        return crc


def _nak(request: FtpRequest, code: int, offset: int = 0) -> FtpReply:
    return request.reply(ftp.NAK, ftp.refusal(code), offset)


def _sys_file(content: bytes) -> GeneratedFile:
    """Return a file of `@SYS`; its announced size is never true."""
    return GeneratedFile(lambda: _SYS_BYTES, lambda offset, count: content[offset : offset + count])


def _listing(tree: FileTree, request: FtpRequest) -> FtpReply:
    """Return names with two NULs each. `@PARAM` and `@MISSION` can be opened by name only: they are not listed."""
    directory = request.text
    names = tree.names(directory)
    at_root = normal(directory) == ""
    entries = [b"D.\0\0", b"D..\0\0"] if at_root else []
    for path in names:
        name = path.rpartition("/")[2]
        if path in tree.directories:
            if not at_root or directory.startswith("/") or not path.startswith("@"):
                entries.append(f"D{name}".encode() + b"\0\0")
        elif path != "eeprom.bin" or not directory.startswith("/"):
            size = tree.size(path) if path in tree.files else _SYS_BYTES
            entries.append(f"F{name}\t{size}".encode() + b"\0\0")
    data = ftp.page(entries[request.offset :])
    if not data:
        return _nak(request, ftp.END_OF_FILE, offset=request.offset)
    return request.reply(ftp.ACK, data, request.offset)
