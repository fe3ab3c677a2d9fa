"""The dialect: how each message lies in its payload, and what its values are called.

The messages are those of pymavlink's `all` dialect (see `message_tables`) and of the XML files added by `add_xml`. They
are loaded at first use, not on import. No code of pymavlink runs on the receiving or the sending path.
"""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from tui_gcs.core.base.text import clean
from tui_gcs.core.mavlink import message_tables as tables
from tui_gcs.core.mavlink.message_definitions import DialectError, FieldDefinition, MessageDefinition

__all__ = [
    "CRC_EXTRA",
    "DialectError",
    "MavlinkMessage",
    "MessageLayout",
    "add_xml",
    "crc_extra",
    "fields_of",
    "is_known",
    "label",
    "layout",
    "layout_named",
    "message_name",
    "payload_values",
]

_MAGIC_V2 = 0xFD


class MavlinkMessage(NamedTuple):
    """A decoded message. Character fields are `SafeText`, arrays are tuples; integers keep MAVLink's scaling."""

    name: str
    msgid: int
    system: int
    component: int
    fields: dict[str, Any]


class MessageLayout(NamedTuple):
    """How one message lies in its payload."""

    name: str
    msgid: int
    extra: bytes
    """CRC_EXTRA, the byte that goes into the CRC behind the frame."""
    size: int
    """Bytes of the whole payload, extensions included."""
    unpack_from: Callable[..., tuple[Any, ...]]
    """(buffer, offset) -> values in wire order. The buffer must hold the whole payload: see `payload_values`."""
    pack: Callable[..., bytes]
    """All values in wire order -> payload."""
    names: tuple[str, ...]
    """Field names in wire order."""
    special: tuple[tuple[str, int, int, bool], ...]
    """() if every field is one number. Else for every field: name, first and last + 1 value, whether it is text."""
    target_system_at: int
    """Offset of the addressed system's id in the payload; -1 if the message has no addressee."""
    target_component_at: int
    """Offset of the addressed component's id; -1 if there is none."""
    fields: tuple[FieldDefinition, ...]
    """Field definitions in wire order."""


CRC_EXTRA: dict[int, bytes] = {}
"""CRC_EXTRA of every message that was asked for; `crc_extra` knows the others."""
_definitions: dict[int, MessageDefinition] = {}
_ids: dict[str, int] = {}
_layouts: dict[int, MessageLayout] = {}
"""Made when a message is first met: a station meets about 60 of 350."""


def layout(msgid: int) -> MessageLayout | None:
    """Return how message `msgid` lies in its payload; None if unknown."""
    return _layouts.get(msgid) or _make_layout(msgid)


def layout_named(name: str) -> MessageLayout | None:
    """Return the layout by MAVLink's name of the message; None if unknown."""
    if not _definitions:
        _load()
    msgid = _ids.get(name)
    return None if msgid is None else layout(msgid)


def payload_values(layout: MessageLayout, raw: bytes) -> tuple[Any, ...]:
    """Return the values, in wire order, in the whole frame `raw` of this message, MAVLink 1 or 2.

    What was not sent is zero: MAVLink 2 cuts zeros off the end, MAVLink 1 knows no extensions. What is longer than the
    message (fields newer than our dialect) is ignored.
    """
    start = 10 if raw[0] == _MAGIC_V2 else 6
    length = raw[1]
    if length >= layout.size:
        return layout.unpack_from(raw, start)
    return layout.unpack_from(raw[start : start + length].ljust(layout.size, b"\0"))


def fields_of(layout: MessageLayout, values: tuple[Any, ...]) -> dict[str, Any]:
    """Return values in wire order by field name: text is `SafeText`, arrays are tuples."""
    if not layout.special:
        # same length by construction, and `strict` costs 0.1 µs
        return dict(zip(layout.names, values))  # noqa: B905
    fields: dict[str, Any] = {}
    for name, first, last, is_text in layout.special:
        if is_text:
            fields[name] = clean(values[first].split(b"\0", 1)[0])
        elif last - first == 1:
            fields[name] = values[first]
        else:
            fields[name] = values[first:last]
    return fields


def message_name(msgid: int) -> str | None:
    """Return MAVLink's name of a message; None if unknown."""
    definition = (_definitions or _load()).get(msgid)
    return definition.name if definition else None


def label(msgid: int) -> str:
    """Return a name for tables: MAVLink's, or "UNKNOWN_" and the number."""
    return message_name(msgid) or f"UNKNOWN_{msgid}"


def is_known(msgid: int) -> bool:
    """Return whether the dialect knows the message."""
    return msgid in (_definitions or _load())


def crc_extra(msgid: int) -> bytes | None:
    """Return the byte that a message's definition adds to its CRC; None if unknown."""
    found = layout(msgid)
    return found.extra if found else None


def add_xml(path: Path) -> tuple[str, ...]:
    """Add the messages of a MAVLink XML definition and return the names of those that are new or longer than before.

    To be called before frames are taken. If anything is wrong with the file nothing of it is added.

    Raises:
        DialectError: one line with file, message, reason, and what to do.
    """
    from tui_gcs.core.mavlink.dialect_xml import read_xml  # 2 ms that hardly any start needs

    added = read_xml(path, dict(_definitions or _load()))
    for definition in added:
        _definitions[definition.msgid] = definition
        _ids[definition.name] = definition.msgid
        _layouts.pop(definition.msgid, None)
    return tuple(definition.name for definition in added)


def _load() -> dict[int, MessageDefinition]:
    _definitions.update(tables.load())
    _ids.update((definition.name, msgid) for msgid, definition in _definitions.items())
    return _definitions


def _make_layout(msgid: int) -> MessageLayout | None:
    definition = (_definitions or _load()).get(msgid)
    if definition is None:
        return None
    special = []
    first = 0
    for field in definition.fields:
        special.append((field.name, first, first + field.count, field.is_text))
        first += field.count
    plain = all(last - start == 1 and not is_text for _, start, last, is_text in special)
    made = struct.Struct(definition.format)
    # MANUAL_CONTROL is the one message whose addressed system has another name
    target = ("target_system", "target") if definition.name == "MANUAL_CONTROL" else ("target_system",)
    _layouts[msgid] = MessageLayout(
        name=definition.name,
        msgid=msgid,
        extra=bytes([definition.crc_extra]),
        size=made.size,
        unpack_from=made.unpack_from,
        pack=made.pack,
        names=tuple(field.name for field in definition.fields),
        special=() if plain else tuple(special),
        target_system_at=definition.offset(*target),
        target_component_at=definition.offset("target_component"),
        fields=definition.fields,
    )
    CRC_EXTRA[msgid] = _layouts[msgid].extra
    return _layouts[msgid]
