"""PX4's file server: one session with the id 0, bursts of 168 packets, everything under its working directory.

Measured on PX4 1.17; `/etc/extras` holds the metadata that tells stations what parameters and events mean.
"""

import errno
from dataclasses import dataclass
from typing import Any

from sitl.common.autopilot import Autopilot
from sitl.common.logs import Log
from sitl.common.parameters import crc32
from sitl.common.tasks import Task
from sitl.links.wire import Received
from sitl.services import ftp
from sitl.services.ftp import Reply, Request
from sitl.services.ftp_files import Made, Tree, fail, packaged

SESSION_US = 10_000_000
"""An open file is closed when nothing was asked for so long."""
BURST_PACKETS = 168
BURST_US = 340
MAX_KEPT_BYTES = 4
"""Longer replies are not kept for who asks again; the request is carried out again."""

METADATA = ("component_general.json.xz", "all_events.json.xz", "parameters.json.xz")
METADATA_URI = b"mftp://etc/extras/component_general.json.xz"
METADATA_CRC = 0x9C443C03
"""As announced by a real one: it is not the CRC of the file as it is stored."""

_BURST = "ftp burst"
_SKIP = b"S\0"
"""An entry without a name (a link, `.` or `..`): it counts for the offset."""


@dataclass
class Server:
    """The one session."""

    path: str | None = None
    """The open file."""
    writing: bool = False
    size: int = 0
    """Its size when it was opened."""
    last: Reply | None = None
    last_us: int = 0


class Refused(Exception):
    """A NAK with one of MAVFTP's codes."""


def component_metadata(ap: Autopilot) -> dict[str, Any]:
    """Fields of COMPONENT_METADATA."""
    return {"time_boot_ms": ap.boot_ms, "file_crc": METADATA_CRC, "uri": METADATA_URI}


def component_information(ap: Autopilot) -> dict[str, Any]:
    """Fields of COMPONENT_INFORMATION, the older form."""
    fields = component_metadata(ap)
    return {
        "time_boot_ms": fields["time_boot_ms"],
        "general_metadata_file_crc": METADATA_CRC,
        "general_metadata_uri": METADATA_URI,
    }


def _tree(ap: Autopilot) -> Tree:
    if ap.files is None:
        tree = ap.files = Tree()
        for path in ("log", "mavlink", "eeprom", "etc", "etc/extras", "etc/init.d", "etc/init.d-posix"):
            tree.add(path)
        tree.add(
            "dataman", Made(lambda: 1_208_528, lambda offset, count: bytes(max(min(count, 1_208_528 - offset), 0)))
        )
        for name in ("parameters_backup.bson", "parameters.bson"):
            tree.add(name, bytes(355))
        tree.add("err.log", b"INFO  [init] found model autostart file as SYS_AUTOSTART\n")
        tree.add("out.log", b"INFO  [init] Startup script returned successfully\n")
        for name in METADATA:
            tree.add(f"etc/extras/{name}", packaged(name))
    tree = ap.files
    for log in ap.logs.files:
        _add_log(ap, tree, log)
    return tree


def _add_log(ap: Autopilot, tree: Tree, log: Log) -> None:
    path = f"log/2026-11-21/{9 + log.number // 60:02d}_{log.number % 60:02d}_10.ulg"
    if path not in tree.files:
        if "log/2026-11-21" not in tree.directories:
            tree.add("log/2026-11-21")
        tree.add(path, Made(lambda: log.size_at(ap.now_us), lambda o, n: log.read(o, n, ap.now_us)))


def handle(ap: Autopilot, frame: Received) -> None:
    """FILE_TRANSFER_PROTOCOL."""
    request = ftp.parse(frame)
    server = _server(ap)
    last = server.last
    if last is not None and (request.seq + 1) & 0xFFFF == last.seq:
        ftp.send(ap, last)  # whoever asks
        return
    if server.path is not None and ap.now_us - server.last_us > SESSION_US:
        _close(ap, server)
    server.last_us = ap.now_us
    try:
        data, opcode = _carry_out(ap, server, request), ftp.ACK
    except Refused as refused:
        data, opcode = ftp.refusal(refused.args[0]), ftp.NAK
    except OSError as problem:
        data, opcode = _of_errno(problem.errno or errno.EIO), ftp.NAK
    server.last = None
    if data is None:
        return  # a burst answers
    session = 0 if request.opcode in (ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE) else request.session
    reply = Reply(
        request.system,
        request.component,
        request.seq + 1 & 0xFFFF,
        session,
        opcode,
        request.opcode,
        data,
        request.offset,
    )
    if len(data) <= MAX_KEPT_BYTES and data[:1] != bytes([ftp.NO_SESSIONS]):
        server.last = reply
    ftp.send(ap, reply)


def _of_errno(number: int) -> bytes:
    code = {errno.EEXIST: ftp.FILE_EXISTS, errno.ENOENT: ftp.FILE_NOT_FOUND}.get(number, ftp.FAIL_ERRNO)
    return ftp.refusal(code, number)


def _server(ap: Autopilot) -> Server:
    if ap.stores.ftp is None:
        ap.stores.ftp = Server()
    server: Server = ap.stores.ftp
    return server


def _close(ap: Autopilot, server: Server) -> None:
    server.path = None
    ap.tasks.stop(_BURST)


def _carry_out(ap: Autopilot, server: Server, request: Request) -> bytes | None:
    """Data of the ACK; None if a burst answers.

    Raises:
        Refused: A NAK with that code.
        OSError: A NAK with the errno.
    """
    if request.size > ftp.DATA_BYTES:
        raise Refused(ftp.INVALID_SIZE)
    if request.opcode in (ftp.NONE, ftp.RESET):
        if request.opcode == ftp.RESET:
            _close(ap, server)
        return b""
    if request.opcode == ftp.TERMINATE:
        if request.session != 0 or server.path is None:
            raise Refused(ftp.INVALID_SESSION)
        _close(ap, server)
        return b""
    if request.opcode in (ftp.READ, ftp.BURST, ftp.WRITE):
        return _transfer(ap, server, request)
    if request.opcode in (ftp.OPEN_READ, ftp.CREATE, ftp.OPEN_WRITE):
        return _open(ap, server, request)
    return _about_files(ap, request)


def _open(ap: Autopilot, server: Server, request: Request) -> bytes:
    if server.path is not None:
        raise Refused(ftp.NO_SESSIONS)
    tree, path = _tree(ap), request.text
    if request.opcode != ftp.OPEN_READ:
        tree.create(path, truncate=request.opcode == ftp.CREATE)
    server.size = tree.size(path)
    server.path, server.writing = path, request.opcode != ftp.OPEN_READ
    return server.size.to_bytes(4, "little")


def _transfer(ap: Autopilot, server: Server, request: Request) -> bytes | None:
    reading = request.opcode == ftp.READ
    if reading and (server.path is None or request.session != 0):
        raise Refused(ftp.INVALID_SESSION)
    if server.path is None:  # the real one forgets to look, as long as the session is 0
        if request.session != 0:
            raise Refused(ftp.INVALID_SESSION)
        raise Refused(ftp.END_OF_FILE if request.opcode == ftp.BURST else ftp.FAIL_ERRNO)
    if request.opcode == ftp.WRITE:
        if not server.writing:
            raise fail(errno.EBADF)
        _tree(ap).write(server.path, request.offset, request.data[: request.size])
        return request.size.to_bytes(4, "little")
    if reading:
        if request.offset >= server.size:
            raise Refused(ftp.END_OF_FILE)
        return _tree(ap).read(server.path, request.offset, request.size)
    ap.tasks.start(_BURST, _burst(ap, server, request, server.path), ap.now_us)
    return None


def _burst(ap: Autopilot, server: Server, request: Request, path: str) -> Task:
    """168 packets, the last of them marked; or the end of the file."""
    tree, at, seq = _tree(ap), request.offset, request.seq
    for number in range(BURST_PACKETS):
        seq = (seq + 1) & 0xFFFF
        opcode, data = ftp.ACK, b""
        try:
            data = tree.read(path, at, ftp.DATA_BYTES) if at < server.size else b""
        except OSError as problem:
            opcode, data = ftp.NAK, _of_errno(problem.errno or errno.EIO)
        if not data:
            opcode, data = ftp.NAK, ftp.refusal(ftp.END_OF_FILE)
        complete = opcode == ftp.ACK and number == BURST_PACKETS - 1
        reply = Reply(request.system, request.component, seq, 0, opcode, ftp.BURST, data, at, complete)
        server.last = reply if len(data) <= MAX_KEPT_BYTES else None
        ftp.send(ap, reply)
        if opcode == ftp.NAK:
            return
        at += len(data)
        yield BURST_US


def _about_files(ap: Autopilot, request: Request) -> bytes:
    tree, path = _tree(ap), request.text
    if request.opcode == ftp.LIST:
        return _list(tree, request)
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
        raise Refused(ftp.UNKNOWN_COMMAND)
    return b""


def _list(tree: Tree, request: Request) -> bytes:
    """Entries from the offset on; those without a name count, too."""
    entries: list[bytes] = []
    root = request.text.strip("/.") == ""
    for path in tree.names(request.text):
        name = path.rpartition("/")[2].encode()
        if root and name == b"etc":
            continue  # a link in the real one: skipped
        is_file = path in tree.files
        entries.append(b"F" + name + f"\t{tree.size(path)}".encode() + b"\0" if is_file else b"D" + name + b"\0")
    entries.insert(1, _SKIP)
    entries.insert(3, _SKIP)
    data = b""
    for entry in entries[request.offset :]:
        if len(data) + len(entry) > ftp.DATA_BYTES:
            break
        data += entry
    if not data:
        raise Refused(ftp.END_OF_FILE)
    return data
