"""What the messages mean: pymavlink's dialect tables, without pymavlink's parser.

The tables are those of the `all` dialect, which knows most message ids. They are loaded at first use, not on import,
because that costs about 50 ms. Nothing else of pymavlink touches the receiving path.
"""

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from tui_gcs.core.text import clean

if TYPE_CHECKING:
    from tui_gcs.core.wire.frames import Frame


class Message(NamedTuple):
    """A decoded message. Character fields are `SafeText`, arrays are tuples; integers keep MAVLink's scaling."""

    name: str
    msgid: int
    system: int
    component: int
    fields: dict[str, Any]


class _Layout(NamedTuple):
    """How one message lies in its payload."""

    name: str
    crc_extra: bytes
    size: int
    unpack: Callable[[bytes], tuple[Any, ...]]
    names: tuple[str, ...]
    """In wire order."""
    special: tuple[tuple[str, int, int, bool], ...]
    """Empty if every field is one number. Else for every field: name, first and last + 1 value, is it text."""


CRC_EXTRA: dict[int, bytes] = {}
"""The CRC byte of every known message; empty until something was asked of this module."""
_layouts: dict[int, _Layout] = {}
_classes: dict[str, Any] = {}


def decode(frame: "Frame") -> Message | None:
    """The message in `frame`, or None if the dialect does not know it."""
    layout = (_layouts or _load()).get(frame.msgid)
    if layout is None:
        return None
    payload = frame.payload
    size = layout.size
    if len(payload) != size:  # trailing zeros are not sent; fields newer than our dialect are ignored
        payload = payload[:size].ljust(size, b"\0")
    values = layout.unpack(payload)
    # same length by construction, and `strict` costs 0.1 µs
    fields = _special_fields(layout, values) if layout.special else dict(zip(layout.names, values))  # noqa: B905
    return Message(layout.name, frame.msgid, frame.system, frame.component, fields)


def _special_fields(layout: _Layout, values: tuple[Any, ...]) -> dict[str, Any]:
    """Fields of a message with arrays or text."""
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
    """MAVLink's name of a message, None if unknown."""
    layout = (_layouts or _load()).get(msgid)
    return layout.name if layout else None


def label(msgid: int) -> str:
    """A name for tables: MAVLink's, or "UNKNOWN_" and the number."""
    return message_name(msgid) or f"UNKNOWN_{msgid}"


def is_known(msgid: int) -> bool:
    """Whether the dialect knows the message."""
    return msgid in (_layouts or _load())


def crc_extra(msgid: int) -> bytes | None:
    """The byte that a message's definition adds to its CRC, None if unknown."""
    if not _layouts:
        _load()
    return CRC_EXTRA.get(msgid)


def message_class(name: str) -> Any:
    """The pymavlink class of a message, for encoding. Raises KeyError for an unknown name."""
    if not _layouts:
        _load()
    return _classes[name]


def _load() -> dict[int, _Layout]:
    """Fill the tables from pymavlink."""
    from pymavlink.dialects.v20 import all as pymavlink_all

    for msgid, kind in pymavlink_all.mavlink_map.items():
        _layouts[msgid] = _layout(kind)
        CRC_EXTRA[msgid] = _layouts[msgid].crc_extra
        _classes[kind.msgname] = kind
    return _layouts


def _layout(kind: Any) -> _Layout:
    """Read one message class of pymavlink; `lengths` and `ordered_fieldnames` are in wire order."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    special = []
    first = 0
    for name, length in zip(kind.ordered_fieldnames, kind.lengths, strict=True):
        special.append((name, first, first + length, types[name] == "char"))
        first += length
    plain = all(last - start == 1 and not is_text for _, start, last, is_text in special)
    unpacker: struct.Struct = kind.unpacker
    return _Layout(
        name=kind.msgname,
        crc_extra=bytes([kind.crc_extra]),
        size=unpacker.size,
        unpack=unpacker.unpack,
        names=tuple(kind.ordered_fieldnames),
        special=() if plain else tuple(special),
    )
