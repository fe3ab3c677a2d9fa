"""What MAVLink messages consist of, as plain tables: of pymavlink's `all` dialect, the one that knows most messages.

What autopilots send and it does not know yet is in `newer.xml`, beside this file.

Importing its generated module costs some 80 ms and 14 MB, so what both say is kept in a file of ours
(`$XDG_CACHE_HOME/tui-gcs`, else `~/.cache/tui-gcs`). The file is data with a checksum and every value in it is checked
while it is read; one that is broken, foreign, or of another version is made anew, and without one all works as well.
"""

import os
import re
import stat
import struct
import sys
import zlib
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from fastcrc.crc16 import mcrf4xx

FORMAT = 1
"""Of the cache file. Count up when `Field` or `Definition` change."""
NEWER_XML = Path(__file__).with_name("newer.xml")
"""What autopilots send and pymavlink lacks: EVENT and others, opaque ids of missions, who a TIMESYNC is for."""
MOST_BYTES = 1 << 20
"""The tables of `all` are some 80 kB: a larger file is none of ours."""

FieldType = Literal[
    "char", "int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t", "uint64_t", "float", "double"
]
STRUCT_CODES: dict[str, str] = {
    "char": "s",
    "int8_t": "b",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "int64_t": "q",
    "uint64_t": "Q",
    "float": "f",
    "double": "d",
}
"""Python's `struct` letter of each MAVLink type."""


class DialectError(Exception):
    """A definition of messages that cannot be used: one line with file, message, reason, and what to do."""


_Name = Annotated[str, msgspec.Meta(pattern="^[A-Za-z_][A-Za-z0-9_]{0,63}$")]


class Field(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, gc=False):
    """One field of a message."""

    name: _Name
    type: FieldType
    length: Annotated[int, msgspec.Meta(ge=0, le=255)]
    """Of an array or text; 0 for a single value."""
    extension: bool
    """Added to MAVLink later: may be left out, is not part of the CRC, does not exist in MAVLink 1."""

    @property
    def is_text(self) -> bool:
        """Whether it is made of characters."""
        return self.type == "char"

    @property
    def count(self) -> int:
        """How many values `struct` makes of it; a text is one."""
        return 1 if self.is_text else max(1, self.length)

    @property
    def format(self) -> str:
        """Its part of a `struct` format."""
        return f"{max(1, self.length)}{STRUCT_CODES[self.type]}"


class Definition(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One message: `fields` in the order in which they lie on the wire."""

    msgid: Annotated[int, msgspec.Meta(ge=0, lt=1 << 24)]
    name: _Name
    fields: Annotated[tuple[Field, ...], msgspec.Meta(max_length=64)]

    @property
    def format(self) -> str:
        """For `struct`."""
        return "<" + "".join(field.format for field in self.fields)

    @property
    def crc_extra(self) -> int:
        """The number that goes into the CRC of every frame, so that both sides mean the same message by an id.

        https://mavlink.io/en/guide/serialization.html#crc_extra
        """
        said = bytearray(f"{self.name} ", "ascii", "replace")
        for field in self.fields:
            if not field.extension:
                said += f"{field.type} {field.name} ".encode("ascii", "replace")
                if field.length:
                    said.append(field.length)
        crc = int(mcrf4xx(bytes(said)))
        return (crc & 0xFF) ^ (crc >> 8)

    def offset(self, *names: str) -> int:
        """Where in the payload the first field with one of these names begins; -1 if there is none."""
        at = 0
        for field in self.fields:
            if field.name in names:
                return at
            at += struct.calcsize("<" + field.format)
        return -1


_DECODER = msgspec.msgpack.Decoder(list[Definition])


def load() -> dict[int, Definition]:
    """All messages of pymavlink's `all` dialect and of `newer.xml`, by id: from the cache file if it is good."""
    package = _package()
    key = _key(package) if package else None
    path = _cache_path() if key else None
    definitions = _read(path, key) if path and key else None
    if definitions is None:
        definitions = made_anew()
        if path and key:
            _write(path, key, definitions)
    return {definition.msgid: definition for definition in definitions}


def made_anew() -> list[Definition]:
    """The same without the cache file. Slow.

    Raises:
        DialectError: `newer.xml` is not there, or contradicts pymavlink (it may make messages longer, not others).
    """
    from tui_gcs.core.mavlink.dialect_xml import read_xml  # rarely needed, and needs this module itself

    known = {definition.msgid: definition for definition in from_pymavlink()}
    known.update((definition.msgid, definition) for definition in read_xml(NEWER_XML, known))
    return list(known.values())


def from_pymavlink() -> list[Definition]:
    """Read pymavlink's generated message classes. Slow: imports them."""
    from pymavlink.dialects.v20 import all as pymavlink_all

    return [_definition(kind) for kind in pymavlink_all.mavlink_map.values()]


def pymavlink_xml(file_name: str) -> Path | None:
    """Where pymavlink keeps the MAVLink definition `file_name` ("common.xml"), if it brings one of that name."""
    package = _package()
    return package / "dialects" / "v20" / file_name if package else None


def _definition(kind: Any) -> Definition:
    """Of one generated class; extensions are the arguments of its constructor that have a default."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    required = len(kind.fieldnames) - len(kind.__init__.__defaults__ or ())
    extensions = set(kind.fieldnames[required:])
    lengths = zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)
    return Definition(
        kind.id, kind.msgname, tuple(Field(name, types[name], length, name in extensions) for name, length in lengths)
    )


# ---------------------------------------------------------------- the file


def _package() -> Path | None:
    """The directory of pymavlink, found without importing it."""
    spec = find_spec("pymavlink")
    return Path(spec.origin).parent if spec and spec.origin else None


def _key(package: Path) -> bytes | None:
    """What the tables were made from: a file with another key is of no use. None if that cannot be told."""
    try:
        version = re.search(r"__version__ *= *['\"]([\w.+-]{1,40})['\"]", (package / "__init__.py").read_text())
        generated = (package / "dialects" / "v20" / "all.py").stat().st_size  # differs if built from other XML
        newer = zlib.crc32(NEWER_XML.read_bytes())
    except (OSError, UnicodeDecodeError):
        return None
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return f"pymavlink-{version[1]}-{generated}-py{python}-{FORMAT}-{newer:08x}".encode() if version else None


def _cache_path() -> Path | None:
    """The file; None without a home directory. A relative `$XDG_CACHE_HOME` is ignored, as its standard demands."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        base = Path(named) if named.startswith("/") else Path.home() / ".cache"
    except RuntimeError:
        return None
    return base / "tui-gcs" / "mavlink-tables"


def _read(path: Path, key: bytes) -> list[Definition] | None:
    """What the file holds; None if it is not there, not ours alone, or anything about it is wrong.

    Laid out as: key, line feed, CRC-32 of the rest (4 bytes, little endian), the definitions as msgpack.
    """
    try:
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)  # neither a link nor a pipe to wait for
        try:
            info = os.fstat(file)
            ours = stat.S_ISREG(info.st_mode) and info.st_uid == os.geteuid() and not info.st_mode & 0o077
            held = os.read(file, MOST_BYTES) if ours else b""
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


def _write(path: Path, key: bytes, definitions: list[Definition]) -> None:
    """Replace the file, readable for us alone. What prevents it, prevents it: then there is no cache."""
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
