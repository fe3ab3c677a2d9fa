"""The definition of one MAVLink message: its fields in wire order, their types, and the CRC_EXTRA made of them."""

import struct
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from fastcrc.crc16 import mcrf4xx

FieldType = Literal[
    "char", "int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t", "uint64_t", "float", "double"
]
"""MAVLink's types of fields."""
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
    """A definition of messages cannot be used: one line with file, message, reason, and what to do."""


_Name = Annotated[str, msgspec.Meta(pattern="^[A-Za-z_][A-Za-z0-9_]{0,63}$")]


class FieldDefinition(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, gc=False):
    """One field of a message."""

    name: _Name
    type: FieldType
    length: Annotated[int, msgspec.Meta(ge=0, le=255)]
    """Length of an array or text; 0 for a single value."""
    extension: bool
    """Added to MAVLink later: it may be left out, is not part of the CRC, and does not exist in MAVLink 1."""

    @property
    def is_text(self) -> bool:
        """Whether the field is made of characters."""
        return self.type == "char"

    @property
    def count(self) -> int:
        """How many values `struct` makes of the field; a text is one."""
        return 1 if self.is_text else max(1, self.length)

    @property
    def format(self) -> str:
        """The field's part of a `struct` format."""
        return f"{max(1, self.length)}{STRUCT_CODES[self.type]}"


class MessageDefinition(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One message: `fields` in the order in which they lie on the wire."""

    msgid: Annotated[int, msgspec.Meta(ge=0, lt=1 << 24)]
    name: _Name
    fields: Annotated[tuple[FieldDefinition, ...], msgspec.Meta(max_length=64)]

    @property
    def format(self) -> str:
        """The `struct` format of the whole payload."""
        return "<" + "".join(field.format for field in self.fields)

    @property
    def crc_extra(self) -> int:
        """The number that goes into the CRC of every frame, so that both sides mean the same message by an id.

        https://mavlink.io/en/guide/serialization.html#crc_extra
        """
        text = bytearray(f"{self.name} ", "ascii", "replace")
        for field in self.fields:
            if not field.extension:
                text += f"{field.type} {field.name} ".encode("ascii", "replace")
                if field.length:
                    text.append(field.length)
        crc = int(mcrf4xx(bytes(text)))
        return (crc & 0xFF) ^ (crc >> 8)

    def offset(self, *names: str) -> int:
        """Return the offset in the payload of the first field with one of these names; -1 if there is none."""
        at = 0
        for field in self.fields:
            if field.name in names:
                return at
            at += struct.calcsize("<" + field.format)
        return -1


def pymavlink_package() -> Path | None:
    """Return the directory of pymavlink, found without importing it; None if it is not installed."""
    spec = find_spec("pymavlink")
    return Path(spec.origin).parent if spec and spec.origin else None


def pymavlink_xml(file_name: str) -> Path | None:
    """Return the path of the MAVLink definition `file_name` ("common.xml") in pymavlink; None if it has none."""
    package = pymavlink_package()
    return package / "dialects" / "v20" / file_name if package else None
