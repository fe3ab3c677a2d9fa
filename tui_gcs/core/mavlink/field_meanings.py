"""What the fields of messages mean: units, and the names of enumeration values, from pymavlink's `all` dialect.

Only people need them, so they are not on the receiving path: importing pymavlink's module takes about 80 ms and 14 MB,
which happens with the first call here.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from tui_gcs.core.base.text import clean

FieldValue = int | float | str | tuple[int | float, ...]
"""A number in MAVLink's own scaling, a cleaned text, or an array."""

_SCALED = {
    "degE7": ("deg", 1e-7, 7),
    "degE5": ("deg", 1e-5, 5),
    "cdeg": ("deg", 0.01, 2),
    "rad": ("deg", 57.29577951308232, 2),
    "rad/s": ("deg/s", 57.29577951308232, 2),
    "mrad/s": ("deg/s", 0.05729577951308232, 2),
    "mm": ("m", 1e-3, 3),
    "cm": ("m", 0.01, 2),
    "dm": ("m", 0.1, 1),
    "mm/s": ("m/s", 1e-3, 3),
    "cm/s": ("m/s", 0.01, 2),
    "dm/s": ("m/s", 0.1, 1),
    "mV": ("V", 1e-3, 3),
    "cV": ("V", 0.01, 2),
    "mA": ("A", 1e-3, 3),
    "cA": ("A", 0.01, 2),
    "cdegC": ("degC", 0.01, 2),
    "c%": ("%", 0.01, 2),
    "d%": ("%", 0.1, 1),
}
"""Units of MAVLink's fields as (unit that people read, factor, decimals)."""
_NOT_SENT = {
    "int8_t": 0x7F,
    "uint8_t": 0xFF,
    "int16_t": 0x7FFF,
    "uint16_t": 0xFFFF,
    "int32_t": 0x7FFFFFFF,
    "uint32_t": 0xFFFFFFFF,
}
"""The largest number of a type means "not known" in most fields: it is not converted."""
MAX_ARRAY_VALUES = 32
MAX_FLAGS = 32


@dataclass(frozen=True)
class FieldMeaning:
    """Unit and enumeration of one field."""

    unit: str = ""
    values: Mapping[int, str] = field(default_factory=dict)
    """Names of values, or of bits, without the enumeration's own name."""
    is_bitmask: bool = False


NO_MEANING = FieldMeaning()


def split_element(name: str) -> tuple[str, int | None]:
    """Return the field and the index of `voltages[3]`; the index of a field without brackets is None.

    What is no index of a payload, which has at most 255 bytes, becomes -1.
    """
    field_name, bracket, index = name.removesuffix("]").partition("[")
    if not bracket:
        return field_name, None
    # A number of thousands of digits cannot be converted.
    return field_name, int(index) if index.isdecimal() and len(index) <= 3 else -1


def number_in(value: object, index: int | None) -> int | float | None:
    """Return the number of a field, or the one at an index of an array; None if there is no such number."""
    if index is not None:
        value = value[index] if isinstance(value, tuple) and 0 <= index < len(value) else None
    return value if isinstance(value, int | float) else None


@lru_cache(4096)
def field_meaning(message: str, name: str) -> FieldMeaning:
    """Return what a field means; `NO_MEANING` for a message or field that pymavlink does not know."""
    # Deferred import: see above.
    from pymavlink.dialects.v20 import all as pymavlink_all

    kind = next((kind for kind in pymavlink_all.mavlink_map.values() if kind.msgname == message), None)
    if kind is None or name not in kind.fieldnames:
        return NO_MEANING
    enum = kind.fieldenums_by_name.get(name, "")
    entries = pymavlink_all.enums.get(enum, {})
    prefix = f"{enum}_"
    return FieldMeaning(
        # pymavlink's generator leaves the brackets of the XML out; text of a file is cleaned all the same.
        unit=clean(kind.fieldunits_by_name.get(name, ""), 12),
        values={
            value: clean(entry.name.removeprefix(prefix), 60)
            for value, entry in entries.items()
            if not entry.name.endswith("_ENUM_END")
        },
        is_bitmask=kind.fielddisplays_by_name.get(name) == "bitmask",
    )


def value_words(value: FieldValue, meaning: FieldMeaning, type_: str = "") -> tuple[str, str]:
    """Return a value as it was sent, with its unit, and what people read in it: a name, or other units; "" if nothing.

    `type_` is MAVLink's type of the field; the largest number of a type is not converted.
    """
    if isinstance(value, tuple):
        shown = " ".join(_number(each) for each in value[:MAX_ARRAY_VALUES])
        more = " …" if len(value) > MAX_ARRAY_VALUES else ""
        return f"{shown}{more}{_unit(meaning)}", ""
    if isinstance(value, str):
        return repr(value) if value != value.strip() or not value else value, ""
    sent = f"{_number(value)}{_unit(meaning)}"
    if meaning.values and isinstance(value, int):
        return sent, _names(value, meaning)
    if meaning.unit in _SCALED and value == value and value != _NOT_SENT.get(type_):
        unit, factor, decimals = _SCALED[meaning.unit]
        # Adding 0.0 takes the sign off a negative zero.
        return sent, f"{round(value * factor, decimals) + 0.0:.{decimals}f} {unit}"
    return sent, ""


def usual_unit(unit: str) -> tuple[str, float]:
    """Return the unit that people read for a unit of MAVLink, and the factor to it."""
    name, factor, _ = _SCALED.get(unit, (unit, 1.0, 0))
    return name, factor


def usual_value(value: float, meaning: FieldMeaning, type_: str) -> float:
    """Return a field's number in the unit of `usual_unit`; NaN for the number that means "not known"."""
    _, factor = usual_unit(meaning.unit)
    return math.nan if meaning.unit in _SCALED and value == _NOT_SENT.get(type_) else value * factor


def _names(value: int, meaning: FieldMeaning) -> str:
    if not meaning.is_bitmask:
        return meaning.values.get(value, "no such value")
    names = [name for bit, name in sorted(meaning.values.items()) if bit and value & bit == bit]
    return " | ".join(names[:MAX_FLAGS]) if names else ""


def _unit(meaning: FieldMeaning) -> str:
    return f" {meaning.unit}" if meaning.unit else ""


def _number(value: float) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
