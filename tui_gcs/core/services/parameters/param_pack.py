"""Decoder of ArduPilot's `@PARAM/param.pck`: all parameters in one file, names prefix-compressed.

Each name gives how many characters it shares with the name before it (docs/autopilots.md D).
"""

import struct
from dataclasses import dataclass

from tui_gcs.core.base.text import clean
from tui_gcs.core.services.parameters.param_values import NAME_BYTES, Number, Parameter, ParamType

# docs/autopilots.md D: without and with the default of each parameter.
MAGIC, MAGIC_WITH_DEFAULTS = 0x671B, 0x671C
MAX_BYTES = 1 << 18
"""The longest file that is read: 4096 names with 4 bytes of value and default are shorter."""
MAX_NAMES = 4096
_HEAD = struct.Struct("<HHH")
_TYPES: dict[int, tuple[ParamType, str]] = {
    1: (ParamType.INT8, "<b"),
    2: (ParamType.INT16, "<h"),
    3: (ParamType.INT32, "<i"),
    4: (ParamType.REAL32, "<f"),
}
_HAS_DEFAULT = 1


class ParamPackError(ValueError):
    """The file is no parameter file, or broken; the message names what is wrong."""


@dataclass(frozen=True)
class ParamPack:
    """The contents of such a file."""

    params: list[Parameter]
    total: int
    """How many parameters the vehicle has: more than `params` if only some were requested."""


def parse_pack(data: bytes) -> ParamPack:
    """Decode a file. Raises ParamPackError."""
    if len(data) < _HEAD.size or len(data) > MAX_BYTES:
        raise ParamPackError(f"{len(data)} bytes cannot be parameters")
    magic, count, total = _HEAD.unpack_from(data)
    if magic not in (MAGIC, MAGIC_WITH_DEFAULTS):
        raise ParamPackError("it does not begin as it should")
    if count > MAX_NAMES:
        raise ParamPackError(f"{count} parameters, at most {MAX_NAMES} are taken")
    params: list[Parameter] = []
    name = b""
    at = _HEAD.size
    while at < len(data):
        # Padding: ArduPilot lets no parameter cross the end of a block.
        if data[at] == 0:
            at += 1
            continue
        name, param, at = _entry(data, at, name, magic == MAGIC_WITH_DEFAULTS)
        params.append(param)
        if len(params) > count:
            break
    if len(params) != count:
        raise ParamPackError(f"it holds {len(params)} parameters, {count} were announced")
    return ParamPack(params, total)


def _entry(data: bytes, at: int, name_before: bytes, with_defaults: bool) -> tuple[bytes, Parameter, int]:
    """Decode one entry: (name, parameter, where the next entry begins)."""
    try:
        kind, form = _TYPES[data[at] & 0x0F]
        flags, common, length = data[at] >> 4, data[at + 1] & 0x0F, (data[at + 1] >> 4) + 1
    except (KeyError, IndexError):
        raise ParamPackError(f"byte {at} begins no parameter") from None
    if common > len(name_before) or common + length > NAME_BYTES:
        raise ParamPackError(f"byte {at}: a name that cannot be")
    at += 2
    name = name_before[:common] + data[at : at + length]
    at += length
    values: list[Number] = []
    for _ in range(2 if flags & _HAS_DEFAULT else 1):
        try:
            values.append(struct.unpack_from(form, data, at)[0])
        except struct.error:
            raise ParamPackError("it ends within a parameter") from None
        at += struct.calcsize(form)
    # A file with defaults holds only the defaults that differ from the value.
    default = values[1] if len(values) > 1 else values[0] if with_defaults else None
    return name, Parameter(clean(name, 64), values[0], kind, default), at
