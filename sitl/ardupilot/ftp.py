"""ArduPilot's file server: one session for everybody, bursts of up to 500 packets, files that are made when read.

Measured on ArduCopter 4.7; what matters most: the size that is announced is often wrong, an acknowledged upload may
have been refused, and a request whose number is one less than that of the last reply counts as a repetition.
"""

import errno
from collections import deque
from dataclasses import dataclass, field

from sitl.ardupilot import mission_files, param_pack
from sitl.common.autopilot import Autopilot
from sitl.common.logs import Log
from sitl.common.missions import ITEM_BYTES
from sitl.common.parameters import crc32
from sitl.common.states import Severity
from sitl.common.tasks import Task
from sitl.links.wire import Received
from sitl.services import ftp
from sitl.services.ftp import Reply, Request
from sitl.services.ftp_files import MAX_FILE_BYTES, Made, Tree, fail, normal

SESSION_US = 3_000_000
"""After this silence somebody else may take the session over."""
BURST_PACKETS = 500
BURST_US = 5_400
"""Between two packets of a burst."""
WAITING = 5
"""Requests that are kept while a burst is sent; more are lost."""
CRC_BLOCK = 1024
MAX_PARAMETER = 0xFFFF

_BURST = "ftp burst"
_SYS_BYTES = 100_000
_SYS = {
    "tasks.txt": b"TasksV2\n",
    "dma.txt": b"DMAV1\n",
    "memory.txt": b"MemInfoV1\n",
    "uarts.txt": b"UARTV1\nSERIAL0 TX=   31617 RX=    2229 TXBD=  7349 RXBD=   518 FlowCtrl=0\n",
    "timers.txt": b"TIMERV1\n",
}


class Handle:
    """An open file of the tree."""

    def __init__(self, tree: Tree, path: str, *, writing: bool) -> None:
        self.tree, self.path, self.writing = tree, path, writing

    def read(self, offset: int, count: int) -> bytes:
        """Fewer bytes at the end, none behind it."""
        return self.tree.read(self.path, offset, count)

    def write(self, offset: int, data: bytes) -> None:
        """Put bytes."""
        self.tree.write(self.path, offset, data)

    def close(self) -> None:
        """Done."""


class Upload(Handle):
    """A file that is judged when it is closed; nobody is told how that went."""

    def __init__(self, ap: Autopilot, path: str) -> None:
        self.ap, self.path, self.writing = ap, path, True
        self.data = bytearray()

    def read(self, offset: int, count: int) -> bytes:
        """Not while it is written."""
        raise fail(errno.EBADF)

    def write(self, offset: int, data: bytes) -> None:
        """Put bytes; the header makes room for all of it, so that gaps are seen."""
        end = offset + len(data)
        if end > MAX_FILE_BYTES:
            raise fail(errno.ENOSPC)
        self.data.extend(bytes(max(end - len(self.data), 0)))
        self.data[offset:end] = data
        if offset == 0:
            self.data.extend(bytes(max(self._announced() - len(self.data), 0)))

    def _announced(self) -> int:
        if self.path.startswith("@PARAM") and len(self.data) >= param_pack.HEADER.size:
            magic, _, length = param_pack.HEADER.unpack_from(self.data)
            return length if magic == param_pack.MAGIC else 0
        if self.path.startswith("@MISSION") and len(self.data) >= mission_files.HEADER.size:
            number = mission_files.HEADER.unpack_from(self.data)[4]
            return mission_files.HEADER.size + number * ITEM_BYTES if number < MAX_PARAMETER else 0
        return 0

    def close(self) -> None:
        """Take it, or not."""
        if self.path.startswith("@PARAM"):
            self._set_parameters()
            return
        kind = mission_files.KINDS[self.path.removeprefix("@MISSION/")]
        mission_files.store(self.ap, kind, bytes(self.data))

    def _set_parameters(self) -> None:
        try:
            values = param_pack.unpack(bytes(self.data))
        except ValueError:
            return
        for name, value in values:
            self.ap.params.set(name, value)


class Parameters(Handle):
    """`@PARAM/param.pck`, packed for the block size of the first read."""

    def __init__(self, ap: Autopilot, path: str) -> None:
        self.ap, self.path, self.writing = ap, path, False
        self.block = 0
        self.data = b""
        self.start, self.count, self.defaults = _query(path.partition("?")[2])

    def read(self, offset: int, count: int) -> bytes:
        """Always with the same count."""
        if self.block == 0:
            if self.start >= len(self.ap.params):
                raise fail(errno.EINVAL)
            self.block = count
            self.data = param_pack.pack(
                self.ap.params, count, start=self.start, count=self.count, defaults=self.defaults
            )
        if count != self.block:
            raise fail(errno.EINVAL)
        return self.data[offset : offset + count]


class Plan(Handle):
    """An `@MISSION` file as it is now."""

    def __init__(self, ap: Autopilot, kind: int) -> None:
        self.data, self.writing = mission_files.pack(ap, kind), False

    def read(self, offset: int, count: int) -> bytes:
        """Bytes of it."""
        return self.data[offset : offset + count]


def _query(text: str) -> tuple[int, int, bool]:
    """start=, count=, withdefaults= of a path.

    Raises:
        OSError: Values that are too big.
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


@dataclass
class Server:
    """The one session."""

    tree: Tree
    session: int | None = None
    handle: Handle | None = None
    last: Reply | None = None
    last_us: int = -SESSION_US
    """When something was answered."""
    waiting: deque[Request] = field(default_factory=lambda: deque(maxlen=WAITING))


def handle(ap: Autopilot, frame: Received) -> None:
    """FILE_TRANSFER_PROTOCOL. While a burst is sent, requests wait."""
    server, request = _server(ap), ftp.parse(frame)
    if _BURST in ap.tasks:
        if len(server.waiting) < WAITING:
            server.waiting.append(request)
        return
    _serve(ap, server, request)


def _server(ap: Autopilot) -> Server:
    if ap.stores.ftp is None:
        ap.stores.ftp = Server(_tree(ap))
    server: Server = ap.stores.ftp
    return server


def _tree(ap: Autopilot) -> Tree:
    if ap.files is None:
        ap.files = Tree()
        for path in ("terrain", "@ROMFS", "@SYS", "@ROMFS/models"):
            ap.files.add(path)
        ap.files.add("eeprom.bin", bytes(16384))
        ap.files.add("@ROMFS/locations.txt", b"#NAME=latitude,longitude,absolute-altitude,heading\n")
        for name in ("threads.txt", *_SYS, "crash_dump.bin"):
            content = _SYS.get(name)
            if content is not None:
                ap.files.add(f"@SYS/{name}", _made(content))
            else:
                ap.files.order.append(f"@SYS/{name}")  # listed, but cannot be opened
        ap.files.add("@SYS/storage.bin", bytes(16384))
    tree: Tree = ap.files
    for log in ap.logs.files:
        _add_log(ap, tree, log)
    return tree


def _made(content: bytes) -> Made:
    """A file of `@SYS`: its size is never true."""
    return Made(lambda: _SYS_BYTES, lambda offset, count: content[offset : offset + count])


def _add_log(ap: Autopilot, tree: Tree, log: Log) -> None:
    path = f"logs/{log.number:08d}.BIN"
    if path not in tree.files:
        if "logs" not in tree.directories:
            tree.add("logs")
        tree.add(path, Made(lambda: log.size_at(ap.now_us), lambda o, n: log.read(o, n, ap.now_us)))


def _serve(ap: Autopilot, server: Server, request: Request) -> None:
    last = server.last
    if last is not None and (request.system, request.component, request.session, (request.seq + 1) & 0xFFFF) == (
        last.system,
        last.component,
        last.session,
        last.seq,
    ):
        _push(ap, server, last)  # it counts as a repetition, whatever it asks
        return
    if request.opcode in (ftp.ACK, ftp.NAK):
        return
    try:
        answer = _judge(ap, server, request)
    except OSError as problem:
        number = problem.errno or errno.EIO
        code = {errno.EEXIST: ftp.FILE_EXISTS, errno.ENOENT: ftp.FILE_NOT_FOUND}.get(number, ftp.FAIL_ERRNO)
        answer = _no(request, code, number)
    if answer is not None:
        _push(ap, server, answer)
        if request.opcode == ftp.OPEN_READ and answer.opcode == ftp.ACK and request.text.startswith("@PARAM/param.pck"):
            ap.banner()


def _push(ap: Autopilot, server: Server, reply: Reply) -> None:
    server.last, server.last_us = reply, ap.now_us
    ftp.send(ap, reply)
    if reply.request == ftp.TERMINATE:
        server.last_us = ap.now_us - SESSION_US


def _yes(request: Request, data: bytes = b"", offset: int = 0) -> Reply:
    return Reply(
        request.system,
        request.component,
        request.seq + 1 & 0xFFFF,
        request.session,
        ftp.ACK,
        request.opcode,
        data,
        offset,
    )


def _no(request: Request, code: int, number: int = 0, offset: int = 0) -> Reply:
    data = ftp.refusal(code, number)
    return Reply(
        request.system,
        request.component,
        request.seq + 1 & 0xFFFF,
        request.session,
        ftp.NAK,
        request.opcode,
        data,
        offset,
    )


def _judge(ap: Autopilot, server: Server, request: Request) -> Reply | None:
    """What is answered; None if a burst answers."""
    if request.size > ftp.DATA_BYTES:
        return _no(request, ftp.INVALID_SIZE)
    strange = request.session != server.session
    idle = ap.now_us - server.last_us >= SESSION_US
    if strange and request.opcode in (ftp.TERMINATE, ftp.RESET):
        return _yes(request)  # somebody else's session: acknowledged, without effect
    if strange and server.handle is not None:
        if not idle:
            return _no(request, ftp.INVALID_SESSION)
        _close(server)
    if request.opcode in (ftp.TERMINATE, ftp.RESET):
        _close(server)
        return _yes(request)
    if request.opcode in (ftp.READ, ftp.BURST, ftp.WRITE):
        return _transfer(ap, server, request)
    if request.opcode == ftp.NONE:
        return _yes(request)
    return _about_files(ap, server, request)


def _close(server: Server) -> None:
    if server.handle is not None:
        server.handle.close()
    server.handle = None
    server.session = None


def _transfer(ap: Autopilot, server: Server, request: Request) -> Reply | None:
    opened = server.handle
    if opened is None:
        return _no(request, ftp.FILE_NOT_FOUND)
    if opened.writing != (request.opcode == ftp.WRITE):
        return _no(request, ftp.FAIL)
    if request.opcode == ftp.WRITE:
        opened.write(request.offset, request.data[: request.size])
        return _yes(request, offset=request.offset)
    if request.opcode == ftp.READ:
        data = opened.read(request.offset, request.size)
        return _yes(request, data, request.offset) if data else _no(request, ftp.END_OF_FILE)
    ap.tasks.start(_BURST, _burst(ap, server, request, opened), ap.now_us)
    return None


def _burst(ap: Autopilot, server: Server, request: Request, opened: Handle) -> Task:
    """Packets until the end of the file or 500; then who waited is served."""
    block, seq = request.size or ftp.DATA_BYTES, request.seq + 1
    at = request.offset
    for number in range(BURST_PACKETS):
        try:
            data = opened.read(at, block)
            refusal = b"" if data else ftp.refusal(ftp.END_OF_FILE)
        except OSError as problem:
            data, refusal = b"", ftp.refusal(ftp.FAIL_ERRNO, problem.errno or errno.EIO)
        if refusal:
            reply = Reply(
                request.system, request.component, seq & 0xFFFF, request.session, ftp.NAK, ftp.BURST, refusal, at
            )
            _push(ap, server, reply)
            break
        complete = number == BURST_PACKETS - 1
        reply = Reply(
            request.system, request.component, seq & 0xFFFF, request.session, ftp.ACK, ftp.BURST, data, at, complete
        )
        _push(ap, server, reply)
        at += len(data)
        seq += 1
        yield BURST_US
    ap.tasks.stop(_BURST)
    while server.waiting and _BURST not in ap.tasks:
        _serve(ap, server, server.waiting.popleft())


def _about_files(ap: Autopilot, server: Server, request: Request) -> Reply:
    path, tree = request.text, _tree(ap)
    if request.opcode == ftp.RENAME:
        old, _, new = request.data[: request.size].partition(b"\0")
        tree.rename(old.decode("utf-8", "replace"), new.decode("utf-8", "replace"))
        return _yes(request)
    known = {ftp.LIST, ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE, ftp.REMOVE, ftp.CRC32}
    if request.opcode not in known | {ftp.MAKE_DIRECTORY, ftp.REMOVE_DIRECTORY}:
        ap.text(Severity.DEBUG, f"Unsupported FTP: {request.opcode}")
        return _no(request, ftp.FAIL)
    if not path or len(path.encode()) != request.size:
        return _no(request, ftp.INVALID_SIZE)
    if request.opcode == ftp.LIST:
        return _list(tree, request)
    if request.opcode in (ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE):
        return _open(ap, server, request, tree)
    if request.opcode == ftp.CRC32:
        return _yes(request, _crc(ap, tree, path).to_bytes(4, "little"))
    if request.opcode == ftp.MAKE_DIRECTORY:
        tree.make_directory(path)
    elif normal(path) in tree.directories:
        tree.remove_directory(path)
    else:
        tree.remove(path)
    return _yes(request)


def _open(ap: Autopilot, server: Server, request: Request, tree: Tree) -> Reply:
    if server.handle is not None:
        if request.opcode != ftp.OPEN_READ or ap.now_us - server.last_us <= SESSION_US:
            return _no(request, ftp.FAIL)
        _close(server)
    path, writing = request.text, request.opcode != ftp.OPEN_READ
    size, server.handle = _handle(ap, tree, path, writing=writing, truncate=request.opcode == ftp.CREATE)
    server.session = request.session
    return _yes(request, b"" if writing else size.to_bytes(4, "little"))


def _handle(ap: Autopilot, tree: Tree, path: str, *, writing: bool, truncate: bool) -> tuple[int, Handle]:
    """The announced size and the open file.

    Raises:
        OSError: There is none.
    """
    name, query, _ = path.partition("?")
    if name == "@PARAM/param.pck":
        if writing:
            return 0, Upload(ap, path)
        return param_pack.ANNOUNCED_BYTES_EACH * len(ap.params), Parameters(ap, path)
    kind = mission_files.KINDS.get(path.removeprefix("@MISSION/")) if path.startswith("@MISSION/") else None
    if kind is not None and not query:
        return mission_files.ANNOUNCED_BYTES, Upload(ap, path) if writing else Plan(ap, kind)
    if writing:
        tree.create(path, truncate=truncate)
    return tree.size(path), Handle(tree, path, writing=writing)


def _list(tree: Tree, request: Request) -> Reply:
    """Names with two NULs each; what can only be opened by name (`@PARAM`, `@MISSION`) is not there."""
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
    data = b""
    for entry in entries[request.offset :]:
        if len(data) + len(entry) > ftp.DATA_BYTES:
            break
        data += entry
    if not data:
        return _no(request, ftp.END_OF_FILE, offset=request.offset)
    return _yes(request, data, request.offset)


def _crc(ap: Autopilot, tree: Tree, path: str) -> int:
    _, opened = _handle(ap, tree, path, writing=False, truncate=False)
    crc, at = 0, 0
    while data := opened.read(at, CRC_BLOCK):
        crc, at = crc32(data, crc), at + len(data)
    return crc
