"""Parameter values and their form on the wire, exact both ways, or refused.

A float in PARAM_VALUE holds 24 bits of a whole number. Not every bit pattern survives being a float either: the
processor changes what looks like a signalling NaN. So received values are read from the frame's bytes, and a value that
would not arrive as it is, is not sent.
"""

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

from tui_gcs.core.base.float32 import to_float32
from tui_gcs.core.base.text import SafeText
from tui_gcs.core.firmware.parameter_transport import Encoding

# param_id ends in NUL only if it is shorter (docs/autopilots.md C4).
NAME_BYTES = 16


class ParamType(IntEnum):
    """MAV_PARAM_TYPE, as far as 4 bytes can hold it."""

    UINT8 = 1
    INT8 = 2
    UINT16 = 3
    INT16 = 4
    UINT32 = 5
    INT32 = 6
    REAL32 = 9


_WHOLE = {
    ParamType.UINT8: ("<B", 0, 255),
    ParamType.INT8: ("<b", -128, 127),
    ParamType.UINT16: ("<H", 0, 65535),
    ParamType.INT16: ("<h", -32768, 32767),
    ParamType.UINT32: ("<I", 0, (1 << 32) - 1),
    ParamType.INT32: ("<i", -(1 << 31), (1 << 31) - 1),
}

Number = int | float


class ParamValueError(ValueError):
    """A value that a parameter cannot take; the message gives the reason."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a vehicle."""

    name: SafeText
    value: Number
    """An int for whole types, unless the vehicle reported something else (3.5, NaN)."""
    type: ParamType
    default: Number | None = None
    """The default, where the vehicle reports it."""


def param_type(number: int) -> ParamType | None:
    """Return the type, or None if it is unknown or does not fit into PARAM_VALUE."""
    try:
        return ParamType(number)
    except ValueError:
        return None


def read_value(kind: ParamType, bits: bytes, encoding: Encoding) -> Number:
    """Decode the 4 bytes of `param_value`."""
    number = float(struct.unpack("<f", bits)[0])
    if kind not in _WHOLE:
        return number
    form, least, most = _WHOLE[kind]
    if encoding is Encoding.BYTEWISE:
        return int(struct.unpack_from(form, bits)[0])
    if math.isfinite(number) and number.is_integer() and least <= number <= most:
        return int(number)
    return number


def wire_value(kind: ParamType, value: Number, encoding: Encoding) -> float:
    """Return what `param_value` must be for `value`. Raises ParamValueError."""
    if not math.isfinite(value):
        # ArduPilot does not answer to NaN or infinity; PX4 would fly with it.
        raise ParamValueError("must be a number")
    if kind not in _WHOLE:
        return _real(value)
    form, least, most = _WHOLE[kind]
    if not float(value).is_integer() or not least <= value <= most:
        raise ParamValueError(f"must be a whole number {least} to {most}")
    if encoding is Encoding.C_CAST:
        # ArduPilot casts to float: 24 bits of a whole number arrive.
        if to_float32(value) != value:
            raise ParamValueError("this whole number has too many digits for its 24 bits on the wire")
        return float(value)
    bits = struct.pack(form, int(value)).ljust(4, b"\0")
    number = float(struct.unpack("<f", bits)[0])
    # The processor changes signalling NaNs on the way through a float.
    if struct.pack("<f", number) != bits:
        raise ParamValueError("this whole number cannot be sent exactly")
    return number


def _real(value: Number) -> float:
    try:
        rounded = to_float32(value)
    except OverflowError:
        raise ParamValueError("too large") from None
    # 16777217 would silently become 16777216.
    if rounded != value and float(value).is_integer():
        raise ParamValueError(f"cannot be held exactly: the nearest is {rounded:.0f}")
    return rounded


def same(held: Number, given: Number, kind: ParamType) -> bool:
    """Whether a vehicle holds the requested value, as far as the type can tell."""
    if kind in _WHOLE:
        return held == given
    try:
        return to_float32(held) == to_float32(given)
    except OverflowError:
        return False


def check_name(name: str) -> str:
    """Return why that cannot be a parameter's name, or ""."""
    if 0 < len(name) <= NAME_BYTES and name.isascii() and name.isprintable() and " " not in name:
        return ""
    return f"not a parameter's name: 1 to {NAME_BYTES} visible ASCII characters"
