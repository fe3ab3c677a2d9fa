"""Message tables: the definitions of all messages of pymavlink's `all` dialect and of `newer.xml` beside this file.

Importing pymavlink's generated module costs about 80 ms and 14 MB, so the tables are kept in a cache file
(`$XDG_CACHE_HOME/tui-gcs`, else `~/.cache/tui-gcs`). The file is data with a checksum, and every value in it is checked
while it is read. One that is broken, foreign, or of another version is made anew, and without one everything works.
"""

import os
import re
import stat
import sys
import zlib
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.mavlink.message_definitions import FieldDefinition, MessageDefinition, pymavlink_package

FORMAT = 1
"""Version of the cache file; to be increased when `FieldDefinition` or `MessageDefinition` change."""
NEWER_XML = Path(__file__).with_name("newer.xml")
"""What autopilots send and pymavlink lacks: EVENT and others, opaque ids of missions, targets of TIMESYNC."""
MAX_CACHE_BYTES = 1 << 20
"""The tables of `all` are about 80 kB: a larger file was not written by this program."""

_DECODER = msgspec.msgpack.Decoder(list[MessageDefinition])


def load() -> dict[int, MessageDefinition]:
    """Return all messages of the `all` dialect and of `newer.xml`, by id: from the cache file if it is good."""
    package = pymavlink_package()
    key = _key(package) if package else None
    path = _cache_path() if key else None
    definitions = _read(path, key) if path and key else None
    if definitions is None:
        definitions = load_uncached()
        if path and key:
            _write(path, key, definitions)
    return {definition.msgid: definition for definition in definitions}


def load_uncached() -> list[MessageDefinition]:
    """Return the same without the cache file. Slow.

    Raises:
        DialectError: `newer.xml` is missing, or contradicts pymavlink (it may make messages longer, not others).
    """
    from tui_gcs.core.mavlink.dialect_xml import read_xml  # 2 ms that hardly any start needs

    known = {definition.msgid: definition for definition in from_pymavlink()}
    known.update((definition.msgid, definition) for definition in read_xml(NEWER_XML, known))
    return list(known.values())


def from_pymavlink() -> list[MessageDefinition]:
    """Return the definitions of pymavlink's generated message classes. Slow: imports them."""
    from pymavlink.dialects.v20 import all as pymavlink_all

    return [_definition(kind) for kind in pymavlink_all.mavlink_map.values()]


def _definition(kind: Any) -> MessageDefinition:
    """Return the definition of one generated class; extensions are the arguments of its constructor with a default."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    required = len(kind.fieldnames) - len(kind.__init__.__defaults__ or ())
    extensions = set(kind.fieldnames[required:])
    lengths = zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)
    return MessageDefinition(
        kind.id,
        kind.msgname,
        tuple(FieldDefinition(name, types[name], length, name in extensions) for name, length in lengths),
    )


def _key(package: Path) -> bytes | None:
    """Return what the tables were made from, as the key of the cache file; None if unknown."""
    try:
        version = re.search(r"__version__ *= *['\"]([\w.+-]{1,40})['\"]", (package / "__init__.py").read_text())
        # The size of the generated module differs if pymavlink was built from other XML.
        generated = (package / "dialects" / "v20" / "all.py").stat().st_size
        newer = zlib.crc32(NEWER_XML.read_bytes())
    except (OSError, UnicodeDecodeError):
        return None
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return f"pymavlink-{version[1]}-{generated}-py{python}-{FORMAT}-{newer:08x}".encode() if version else None


def _cache_path() -> Path | None:
    """Return the path of the cache file; None without a home directory."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        # The XDG standard demands that a relative path is ignored.
        base = Path(named) if named.startswith("/") else Path.home() / ".cache"
    except RuntimeError:
        return None
    return base / "tui-gcs" / "mavlink-tables"


def _read(path: Path, key: bytes) -> list[MessageDefinition] | None:
    """Return the contents of the cache file; None if it is missing, not ours alone, or wrong in any way.

    Layout: key, line feed, CRC-32 of the rest (4 bytes, little endian), the definitions as msgpack.
    """
    try:
        # Neither a link is followed nor a pipe waited for.
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            info = os.fstat(file)
            ours = stat.S_ISREG(info.st_mode) and info.st_uid == os.geteuid() and not info.st_mode & 0o077
            held = os.read(file, MAX_CACHE_BYTES) if ours else b""
        finally:
            os.close(file)
    except OSError:
        return None
    head = len(key) + 1
    body = held[head + 4 :]
    if held[:head] != key + b"\n" or held[head : head + 4] != zlib.crc32(body).to_bytes(4, "little"):
        return None
    try:
        return _DECODER.decode(body) or None
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None


def _write(path: Path, key: bytes, definitions: list[MessageDefinition]) -> None:
    """Replace the cache file, readable for us alone. Errors are ignored: then there is no cache."""
    body = msgspec.msgpack.encode(definitions)
    new = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        info = path.parent.lstat()
        if not stat.S_ISDIR(info.st_mode) or info.st_uid != os.geteuid():
            return
        path.parent.chmod(0o700)
        new.unlink(missing_ok=True)
        file = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            with os.fdopen(file, "wb") as opened:
                opened.write(key + b"\n" + zlib.crc32(body).to_bytes(4, "little") + body)
            new.replace(path)
        finally:
            new.unlink(missing_ok=True)
    except OSError:
        return
