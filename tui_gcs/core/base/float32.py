"""Numbers that travel as 32-bit floats: how they are rounded, and how the operator reads and types them."""

import math
import struct

PLAIN_BELOW = 1e9
"""Numbers below this are shown without an exponent: 90, not 9e+01."""


def to_float32(value: float) -> float:
    """Round to the nearest number that 4 bytes hold. Raises OverflowError."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def whole_number(value: float | None) -> int | None:
    """Return a number that a vehicle reported as the integer that it must be; None for NaN, fractions and nonsense."""
    if value is None or not math.isfinite(value) or abs(value) >= 2**63 or value != int(value):
        return None
    return int(value)


def shown(value: float) -> str:
    """Format a number for the operator: as short as it is exact in 32 bits."""
    if isinstance(value, int):
        return str(value)
    if not math.isfinite(value):
        return "inf" if value > 0 else "-inf" if value < 0 else "NaN"
    texts = (f"{value:.{digits}g}" for digits in range(1, 10))
    text = next((text for text in texts if _is_same(float(text), value)), repr(value))
    return f"{float(text):.0f}" if "e+" in text and abs(value) < PLAIN_BELOW else text


def typed_number(text: str) -> int | float | None:
    """Return a number as an operator types it: 3, 0x1F, 2.5; None if it is no finite number.

    One without a point stays an integer: parameters of integer type are sent as such.
    """
    try:
        return int(text.strip(), 0)
    except ValueError:
        pass
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _is_same(number: float, other: float) -> bool:
    try:
        return to_float32(number) == to_float32(other)
    except OverflowError:
        return False
