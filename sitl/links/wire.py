"""MAVLink frames, encoded and decoded with the tables of pymavlink's dialect `ardupilotmega`.

The dialect's classes give ids, field order and CRC seeds. Packing goes straight through `struct`: one object per
message would be most of what a simulated vehicle costs.
"""

import struct
from collections.abc import Iterable
from itertools import chain
from typing import Any, NamedTuple

from fastcrc import crc16
from pymavlink.dialects.v20 import ardupilotmega as dialect

from sitl.links.dialect import NEWER, PARAM_VALUE_BYTES

# The first byte of a frame gives its version.
MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
HEADER_V1_BYTES = 6
HEADER_V2_BYTES = 10
SIGNATURE_BYTES = 13
# The one incompatibility flag that is defined; frames with others have to be dropped.
SIGNED = 0x01

_HEADER = struct.Struct("<BBBBBBBHB")


class Layout:
    """Wire layout of one message: its fields in wire order, and the lengths of arrays."""

    def __init__(self, message_class: Any) -> None:
        self.msgid: int = message_class.id
        self.name: str = message_class.msgname
        self.names: tuple[str, ...] = tuple(message_class.ordered_fieldnames)
        self.crc_extra = bytes([message_class.crc_extra])
        self.struct: struct.Struct = message_class.unpacker
        by_field = dict(zip(message_class.fieldnames, message_class.fieldtypes, strict=True))
        # `array_lengths` is in wire order and counts text too; text is one value ("16s") to struct.
        lengths = zip(self.names, message_class.array_lengths, strict=True)
        self.arrays = {name: n for name, n in lengths if n > 1 and by_field[name] != "char"}
        self._zeros: list[Any] = [
            (0,) * self.arrays[name] if name in self.arrays else b"" if by_field[name] == "char" else 0
            for name in self.names
        ]

    def pack(self, fields: dict[str, Any]) -> bytes:
        """Return the payload without trailing zeros; fields that are missing in `fields` are zero."""
        given: Iterable[Any] = map(fields.get, self.names, self._zeros)
        if self.arrays:
            named = zip(self.names, given, strict=True)
            given = chain.from_iterable(value if name in self.arrays else (value,) for name, value in named)
        return self.struct.pack(*given).rstrip(b"\0") or b"\0"

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """Return the fields by name; a short payload is filled with zeros, a long one (newer dialect) is cut."""
        size = self.struct.size
        values = self.struct.unpack(payload[:size].ljust(size, b"\0"))
        if not self.arrays:
            return dict(zip(self.names, values, strict=True))
        fields: dict[str, Any] = {}
        at = 0
        for name in self.names:
            n = self.arrays.get(name)
            fields[name] = values[at] if n is None else values[at : at + n]
            at += n or 1
        return fields


class ReceivedFrame(NamedTuple):
    """One good frame, decoded, and the component that sent it."""

    system: int
    component: int
    name: str
    fields: dict[str, Any]
    raw: bytes
    """All bytes of the frame, signature included."""


LAYOUTS: dict[int, Layout] = {msgid: Layout(cls) for msgid, cls in dialect.mavlink_map.items()}
LAYOUTS |= {definition.id: Layout(definition) for definition in NEWER}
LAYOUT_BY_NAME: dict[str, Layout] = {layout.name: layout for layout in LAYOUTS.values()}
LAYOUT_BY_NAME["PARAM_VALUE_BYTES"] = Layout(PARAM_VALUE_BYTES)


class Encoder:
    """Packs the frames of one component, with its sequence counter."""

    def __init__(self, system: int, component: int = 1) -> None:
        self.system = system
        self.component = component
        self.sequence = 0

    def frame(self, name: str, fields: dict[str, Any]) -> bytes:
        """Return one unsigned MAVLink 2 frame."""
        layout = LAYOUT_BY_NAME[name]
        payload = layout.pack(fields)
        msgid = layout.msgid
        sequence = self.sequence
        self.sequence = (sequence + 1) & 0xFF
        head = _HEADER.pack(
            MAGIC_V2, len(payload), 0, 0, sequence, self.system, self.component, msgid & 0xFFFF, msgid >> 16
        )
        body = head + payload
        return body + crc16.mcrf4xx(body[1:] + layout.crc_extra).to_bytes(2, "little")


def cut(datagram: bytes) -> list[ReceivedFrame]:
    """Return all good frames of known messages in one datagram; everything else is skipped byte by byte."""
    found: list[ReceivedFrame] = []
    at = 0
    while at < len(datagram):
        length = _frame_length(datagram, at)
        received = _decode(datagram, at, length) if length and at + length <= len(datagram) else None
        if received is None:
            at += 1
            continue
        found.append(received)
        at += length
    return found


def _frame_length(data: bytes, at: int) -> int:
    """Return the length of the frame that seems to begin here; 0 if none does."""
    left = len(data) - at
    if data[at] == MAGIC_V2 and left >= HEADER_V2_BYTES + 2:
        flags = data[at + 2]
        # A frame with unknown incompatibility flags must be dropped (MAVLink 2).
        if flags & ~SIGNED:
            return 0
        return HEADER_V2_BYTES + data[at + 1] + 2 + (SIGNATURE_BYTES if flags & SIGNED else 0)
    if data[at] == MAGIC_V1 and left >= HEADER_V1_BYTES + 2:
        return HEADER_V1_BYTES + data[at + 1] + 2
    return 0


def _decode(data: bytes, at: int, length: int) -> ReceivedFrame | None:
    """Return the frame at `at`; None if it is unknown or its checksum is wrong. Signatures are not checked."""
    if data[at] == MAGIC_V2:
        system, component = data[at + 5], data[at + 6]
        msgid = int.from_bytes(data[at + 7 : at + 10], "little")
        start = at + HEADER_V2_BYTES
    else:
        system, component, msgid = data[at + 3], data[at + 4], data[at + 5]
        start = at + HEADER_V1_BYTES
    layout = LAYOUTS.get(msgid)
    if layout is None:
        return None
    end = start + data[at + 1]
    crc = int.from_bytes(data[end : end + 2], "little")
    if crc != crc16.mcrf4xx(data[at + 1 : end] + layout.crc_extra):
        return None
    return ReceivedFrame(system, component, layout.name, layout.unpack(data[start:end]), data[at : at + length])
