"""Messages from a MAVLink XML definition (https://mavlink.io/en/guide/xml_schema.html), for `--dialect FILE.xml`.

pymavlink's own parser is not used: it runs Python code found in the file (`eval` of enumeration values), and reads
files of any size. Here only messages are read, any DOCTYPE is refused (no entities, so no entity bombs and no files
fetched), and sizes are bounded.
"""

import re
import struct
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import get_args
from xml.parsers import expat

from tui_gcs.core.mavlink.message_definitions import (
    STRUCT_CODES,
    DialectError,
    FieldDefinition,
    FieldType,
    MessageDefinition,
    pymavlink_xml,
)

MAX_FILE_BYTES = 1 << 20
MAX_TOTAL_BYTES = 2 << 20
"""Of a file and its includes. MAVLink's own definitions are 1 MB together, the largest file 0.6 MB."""
MAX_INCLUDE_DEPTH = 8
"""Includes within includes, at most."""
MAX_INCLUDE_CHARS = 4096
"""Length of the path of an included file; a longer one is cut, and so no valid name."""
MAX_FIELDS = 64  # as MAVLink's own generator
# The length of a payload is one byte in the frame.
MAX_PAYLOAD_BYTES = 255
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_FILE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")
_TYPE = re.compile(r"([a-z0-9_]{1,30})(?:\[([0-9]{1,3})\])?")
_TYPES: dict[str, FieldType] = {name: name for name in get_args(FieldType)} | {"uint8_t_mavlink_version": "uint8_t"}


def read_xml(path: Path, known: Mapping[int, MessageDefinition]) -> list[MessageDefinition]:
    """Return the messages of the file and of its includes that add to those `known`.

    Includes are looked for beside the file, else among those of pymavlink. A message that is known is taken if it is
    longer by extension fields, and left if it is the same or shorter.

    Raises:
        DialectError: see there; also for a message that differs from the known one of its id or name.
    """
    messages = dict(known)
    ids = {definition.name: msgid for msgid, definition in known.items()}
    waiting = deque([(path, 0)])
    seen = {path.name}
    total_bytes = 0
    while waiting:
        file, depth = waiting.popleft()
        data = _bytes_of(file)
        total_bytes += len(data)
        if total_bytes > MAX_TOTAL_BYTES:
            raise DialectError(f"{path}: more than {MAX_TOTAL_BYTES >> 20} MiB with its includes; include less")
        parsed = _Parser(file).parse(data)
        for definition in parsed.messages:
            _merge(file, definition, messages, ids)
        for include in parsed.includes:
            name = include.rpartition("/")[2]
            if not _FILE_NAME.fullmatch(name):
                raise DialectError(f"{file}: includes {include!r:.80}, which is no file name; correct it")
            if name in seen:
                continue
            seen.add(name)
            if depth >= MAX_INCLUDE_DEPTH:
                text = f"includes {name} more than {MAX_INCLUDE_DEPTH} files deep; include it above"
                raise DialectError(f"{file}: {text}")
            waiting.append((_found(file, include, name), depth + 1))
    return [definition for msgid, definition in messages.items() if known.get(msgid) != definition]


def _found(file: Path, include: str, name: str) -> Path:
    """Return the path of an included file. Raises DialectError."""
    places = [pymavlink_xml(name)] if include != name else [file.parent / name, pymavlink_xml(name)]
    for place in places:
        if place is not None and place.exists():
            return place
    raise DialectError(f"{file}: includes {include!r:.80}, which is not in the same directory; put it there")


def _merge(file: Path, new: MessageDefinition, messages: dict[int, MessageDefinition], ids: dict[str, int]) -> None:
    """Take `new` unless it is known. Raises DialectError if it contradicts what is known."""
    known = messages.get(new.msgid)
    if ids.get(new.name, new.msgid) != new.msgid:
        raise DialectError(f"{file}: message {new.name} ({new.msgid}) is known with id {ids[new.name]}; rename it")
    if known is not None:
        shorter, longer = sorted((known, new), key=lambda definition: len(definition.fields))
        more = longer.fields[len(shorter.fields) :]
        same = longer.fields[: len(shorter.fields)] == shorter.fields and all(field.extension for field in more)
        if known.name != new.name or not same:
            raise DialectError(
                f"{file}: message {new.name} ({new.msgid}, CRC {new.crc_extra}) differs from the known"
                f" {known.name} ({known.msgid}, CRC {known.crc_extra}); give it an id of its own"
            )
        new = longer
    messages[new.msgid] = new
    ids[new.name] = new.msgid


def _bytes_of(path: Path) -> bytes:
    """Return the whole file. Raises DialectError for one that is too large, no file, or unreadable."""
    try:
        if not path.is_file():  # a pipe would block
            raise DialectError(f"{path}: is not there, or no regular file; name a MAVLink XML definition")
        with path.open("rb") as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise DialectError(f"{path}: cannot be read ({error.strerror}); name a MAVLink XML definition") from None
    if len(data) > MAX_FILE_BYTES:
        raise DialectError(f"{path}: larger than {MAX_FILE_BYTES >> 20} MiB; leave out what is not needed")
    return data


class _Parser:
    """Reads the messages and includes of one file."""

    def __init__(self, path: Path) -> None:
        self.messages: list[MessageDefinition] = []
        self.includes: list[str] = []
        self._path = path
        self._expat = expat.ParserCreate()
        self._expat.StartElementHandler = self._start
        self._expat.EndElementHandler = self._end
        self._expat.CharacterDataHandler = self._characters
        self._expat.StartDoctypeDeclHandler = self._doctype
        self._open: list[str] = []
        self._message = ("", 0)
        self._fields: list[FieldDefinition] = []
        self._in_extensions = False

    def parse(self, data: bytes) -> "_Parser":
        """Fill `messages` and `includes`. Raises DialectError."""
        try:
            self._expat.Parse(data, True)
        except expat.ExpatError as error:
            reason = expat.errors.messages.get(error.code, "error")
            raise DialectError(f"{self._path}: no XML ({reason}, line {error.lineno}); correct it") from None
        # expat raises these for an unknown encoding in the XML declaration.
        except (LookupError, ValueError):
            raise DialectError(f"{self._path}: in an unknown encoding; write it in UTF-8") from None
        return self

    def _refuse(self, why: str) -> DialectError:
        message = f"message {self._message[0]}: " if self._message[0] else ""
        return DialectError(f"{self._path}: {message}{why} (line {self._expat.CurrentLineNumber})")

    def _doctype(self, *_: object) -> None:
        raise self._refuse("a DOCTYPE is not allowed here; remove it")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._open.append(name)
        depth = len(self._open)
        if depth == 1 and name != "mavlink":
            raise self._refuse(f"begins with <{name:.40}>, not <mavlink>; name a MAVLink XML definition")
        if depth == 2 and name == "include":
            self.includes.append("")
        elif depth == 3 and self._open[1] == "messages" and name == "message":
            self._start_message(attributes)
        elif depth == 4 and self._message[0]:
            if name == "extensions":
                self._in_extensions = True
            elif name == "field":
                self._fields.append(self._field(attributes))

    def _end(self, name: str) -> None:
        if len(self._open) == 3 and self._message[0]:
            self._end_message()
        elif len(self._open) == 2 and name == "include":
            self.includes[-1] = self.includes[-1].strip()
        self._open.pop()

    def _characters(self, text: str) -> None:
        if len(self._open) == 2 and self._open[1] == "include" and len(self.includes[-1]) < MAX_INCLUDE_CHARS:
            self.includes[-1] += text

    def _start_message(self, attributes: dict[str, str]) -> None:
        name, number = attributes.get("name", ""), attributes.get("id", "")
        if not _NAME.fullmatch(name):
            raise self._refuse("a message needs a name of letters, digits and _; give it one")
        self._message = (name, 0)
        if not re.fullmatch("[0-9]{1,8}", number) or int(number) >= 1 << 24:
            raise self._refuse("needs an id from 0 to 16777215; give it one")
        self._message = (name, int(number))
        self._fields = []
        self._in_extensions = False

    def _field(self, attributes: dict[str, str]) -> FieldDefinition:
        name = attributes.get("name", "")
        if not _NAME.fullmatch(name) or any(field.name == name for field in self._fields):
            raise self._refuse(f"field {name!r:.40} needs a name of its own, of letters, digits and _")
        if len(self._fields) >= MAX_FIELDS:
            raise self._refuse(f"has more than {MAX_FIELDS} fields; make it two messages")
        type_text = attributes.get("type", "")
        found = _TYPE.fullmatch(type_text)
        kind = _TYPES.get(found[1]) if found else None
        length = int(found[2]) if found and found[2] else 0
        if kind is None or length > MAX_PAYLOAD_BYTES or (found and found[2] and not length):
            raise self._refuse(f"field {name} has the unknown type {type_text!r:.40}; use one like uint8_t or float[4]")
        return FieldDefinition(name, kind, length, self._in_extensions)

    def _end_message(self) -> None:
        base = [field for field in self._fields if not field.extension]
        base.sort(key=lambda field: -struct.calcsize(STRUCT_CODES[field.type]))  # stable: that is the wire order
        extensions = [field for field in self._fields if field.extension]
        name, msgid = self._message
        definition = MessageDefinition(msgid, name, (*base, *extensions))
        if struct.calcsize(definition.format) > MAX_PAYLOAD_BYTES:
            raise self._refuse(f"is longer than {MAX_PAYLOAD_BYTES} bytes; make it two messages")
        self.messages.append(definition)
        self._message = ("", 0)
