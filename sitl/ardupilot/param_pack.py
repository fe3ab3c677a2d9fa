"""ArduPilot's `@PARAM/param.pck`: all parameters in one file, each name without what it shares with the one before.

The length depends on the reader's block size: zero bytes before an entry keep its value from crossing a border between
two blocks.
"""

import math
import struct

from sitl.common.parameters import ParameterTable

# The first two bytes of param.pck, without and with defaults (docs/autopilots.md "D. Fast fleet connect").
MAGIC, MAGIC_WITH_DEFAULTS = 0x671B, 0x671C
HEADER = struct.Struct("<HHH")
ANNOUNCED_BYTES_EACH = 12
"""Bytes per parameter in the size that is announced when the file is opened, which is always wrong."""
MAX_NAME = 16

_KINDS = {
    2: (1, struct.Struct("<b")),
    4: (2, struct.Struct("<h")),
    6: (3, struct.Struct("<i")),
    9: (4, struct.Struct("<f")),
}
"""AP_Param's type and the layout of a value, by MAV_PARAM_TYPE."""
_VALUES = dict(_KINDS.values())
_HAS_DEFAULT = 0x10
_FLOAT_EPSILON = 1.2e-7


def pack(table: ParameterTable, block: int, *, start: int = 0, count: int = 0, defaults: bool = False) -> bytes:
    """Return the whole file for a reader of `block` bytes at a time; `count` 0 stands for all parameters."""
    chosen = list(table)[start:]
    if count:
        chosen = chosen[:count]
    out = bytearray(HEADER.pack(MAGIC_WITH_DEFAULTS if defaults else MAGIC, len(chosen), len(table)))
    last = ""
    for name, value, kind, _ in chosen:
        number, layout = _KINDS[kind]
        default = table.default(name)
        differs = defaults and not math.isclose(value, default, rel_tol=0.0, abs_tol=_FLOAT_EPSILON)
        shared = min(_shared(name, last), len(name) - 1)
        data = layout.pack(value) + (_packed(layout, default) if differs else b"")
        entry = bytes([number | (_HAS_DEFAULT if differs else 0), shared | (len(name) - shared - 1) << 4])
        entry += name[shared:].encode("ascii") + data
        beyond = (len(out) + len(entry)) % block
        if layout.size > 1 and 0 < beyond < layout.size:
            out += bytes(layout.size - beyond)
        out += entry
        last = name
    return bytes(out)


def _packed(layout: struct.Struct, value: float) -> bytes:
    """Return a default; one that its type cannot hold (65535 of a signed 16-bit mask) loses its upper bits."""
    if isinstance(value, int):
        return (value & (1 << 8 * layout.size) - 1).to_bytes(layout.size, "little")
    return layout.pack(value)


def _shared(a: str, b: str) -> int:
    n = 0
    while n < min(len(a), len(b)) and a[n] == b[n]:
        n += 1
    return n


def unpack(data: bytes) -> list[tuple[str, float]]:
    """Return the names and values in an uploaded file.

    Raises:
        ValueError: The magic, the length or an entry is wrong; ArduPilot drops such a file.
    """
    if len(data) < HEADER.size:
        raise ValueError("short")
    magic, number, length = HEADER.unpack_from(data)
    if magic != MAGIC or length != len(data):
        raise ValueError("header")
    found: list[tuple[str, float]] = []
    at, last = HEADER.size, ""
    for _ in range(number):
        if at + 2 > len(data):
            raise ValueError("cut short")
        kind, flags = data[at] & 0x0F, data[at] >> 4
        shared, added = data[at + 1] & 0x0F, (data[at + 1] >> 4) + 1
        layout = _VALUES.get(kind)
        if flags or layout is None or shared + added > MAX_NAME or at + 2 + added + layout.size > len(data):
            raise ValueError("entry")
        last = last[:shared] + data[at + 2 : at + 2 + added].decode("ascii", "replace")
        at += 2 + added
        found.append((last, float(layout.unpack_from(data, at)[0])))
        at += layout.size
    return found
