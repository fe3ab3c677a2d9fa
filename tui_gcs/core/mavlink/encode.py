"""Encoding: makes MAVLink 2 frames (https://mavlink.io/en/guide/serialization.html)."""

import struct
from contextlib import suppress
from typing import Any

from fastcrc.crc16 import mcrf4xx

from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.message_definitions import STRUCT_CODES, FieldDefinition

_MAGIC_V2 = 0xFD
_HEADER = struct.Struct("<BBBBB2sHB").pack
"""Magic, payload length, incompatibility and compatibility flags, sequence, source, message id (16 + 8 bits)."""
_WHOLE_BITS = {"b": 7, "B": 8, "h": 15, "H": 16, "i": 31, "I": 32, "q": 63, "Q": 64}


class EncodeError(ValueError):
    """A message cannot be sent: unknown name, missing or unknown field, or value out of range.

    Values are never quoted: they may be keys or passwords.
    """


class Encoder:
    """Encodes the frames of one sender (system and component id), with its own sequence counter."""

    def __init__(self, system: int, component: int) -> None:
        """Send as `system`/`component`, 0…255 each."""
        self._source = bytes((system, component))
        self._seq = 0

    def encode(self, name: str, /, **fields: Any) -> bytes:
        """Return the frame of message `name` with `fields` (MAVLink's field names and units).

        Fields that MAVLink added later (extensions) may be left out, all others must be there. Text is `str` or `bytes`
        and may be shorter than its field; arrays must have all their values.

        Raises:
            EncodeError: one line with message, field and reason.
        """
        layout = dialect.layout_named(name)
        if layout is None:
            raise EncodeError(f"unknown MAVLink message {name!r}")
        values = _values(layout, fields)
        try:
            payload = layout.pack(*values)
        except (struct.error, OverflowError):
            raise EncodeError(_misfit(layout, values)) from None
        # MAVLink 2 cuts trailing zeros, but never the first byte of a payload.
        payload = payload.rstrip(b"\0") or payload[:1]
        msgid = layout.msgid
        head = _HEADER(_MAGIC_V2, len(payload), 0, 0, self._seq, self._source, msgid & 0xFFFF, msgid >> 16)
        body = head + payload
        crc: int = mcrf4xx(body[1:] + layout.extra)
        # Counted only for frames that could be made: a gap would look like loss to the vehicle.
        self._seq = (self._seq + 1) & 0xFF
        return body + crc.to_bytes(2, "little")


def _values(layout: dialect.MessageLayout, fields: dict[str, Any]) -> list[Any]:
    """Return the arguments of `layout.pack`. Raises EncodeError."""
    # Nearly every message has only number fields, and all of them are given.
    if not layout.special and len(fields) == len(layout.names):
        with suppress(KeyError):
            return [fields[name] for name in layout.names]
    values: list[Any] = []
    used = 0
    for field in layout.fields:
        if field.name in fields:
            used += 1
            value = fields[field.name]
            if field.is_text:
                values.append(_text(layout.name, field, value))
            elif field.count == 1:
                values.append(value)
            else:
                values.extend(_array(layout.name, field, value))
        elif field.extension:
            values.extend([b""] if field.is_text else [0] * field.count)
        else:
            raise EncodeError(f"{layout.name}: field {field.name} is missing")
    if used != len(fields):
        unknown = ", ".join(sorted(fields.keys() - set(layout.names)))
        raise EncodeError(f"{layout.name}: has no field {unknown}; it has {', '.join(layout.names)}")
    return values


def _text(message: str, field: FieldDefinition, value: Any) -> bytes:
    """Return a text field's bytes; `struct` fills up with zeros."""
    if isinstance(value, str):
        try:
            value = value.encode()
        except UnicodeEncodeError:
            raise EncodeError(f"{message}: {field.name} has a character that UTF-8 cannot express") from None
    if not isinstance(value, bytes | bytearray):
        raise EncodeError(f"{message}: {field.name} must be text, not {type(value).__name__}")
    most = max(1, field.length)
    if len(value) > most:
        raise EncodeError(f"{message}: {field.name} is {len(value)} bytes long, {most} fit")
    return bytes(value)


def _array(message: str, field: FieldDefinition, value: Any) -> tuple[Any, ...]:
    """Return an array field's values."""
    try:
        items = tuple(value)
    except TypeError:
        raise EncodeError(f"{message}: {field.name} must be {field.count} values, not one") from None
    if len(items) != field.count:
        raise EncodeError(f"{message}: {field.name} has {len(items)} values, must have {field.count}")
    return items


def _misfit(layout: dialect.MessageLayout, values: list[Any]) -> str:
    """Return which of the values does not fit its field, and what would."""
    at = 0
    for field in layout.fields:
        code = STRUCT_CODES[field.type]
        for index in range(0 if field.is_text else field.count):
            try:
                struct.pack(f"<{code}", values[at + index])
            except (struct.error, OverflowError):
                where = f"{field.name}[{index}]" if field.count > 1 else field.name
                return f"{layout.name}: {where} must be {_range(field)}"
        at += field.count
    return f"{layout.name}: a value does not fit its field"


def _range(field: FieldDefinition) -> str:
    """Return what a number field takes, in words."""
    bits = _WHOLE_BITS.get(STRUCT_CODES[field.type])
    if bits is None:
        return f"a number that fits {field.type}"
    lowest = 0 if field.type.startswith("u") else -(1 << bits)
    return f"a whole number {lowest} to {(1 << bits) - 1} ({field.type})"
