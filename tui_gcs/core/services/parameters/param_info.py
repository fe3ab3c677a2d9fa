"""Meaning and range of parameters: PX4's parameters.json, as the vehicle serves it.

The file comes from a vehicle, so a row or value that makes no sense is left out (docs/threats.md B.6-74).
"""

import math
from dataclasses import dataclass, field
from typing import Any

import msgspec

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.base.text import SafeText, clean
from tui_gcs.core.services.parameters.param_values import NAME_BYTES, Number

MAX_CHOICES = 200
NO_TEXT = SafeText("")
MAX_INFOS = 8192


@dataclass(frozen=True)
class ParamMetadata:
    """The description of one parameter."""

    name: SafeText
    short: SafeText = NO_TEXT
    long: SafeText = NO_TEXT
    units: SafeText = NO_TEXT
    group: SafeText = NO_TEXT
    least: Number | None = None
    most: Number | None = None
    default: Number | None = None
    step: Number | None = None
    decimals: int | None = None
    reboot: bool = False
    """Whether a change takes effect only after a reboot."""
    choices: dict[Number, SafeText] = field(default_factory=dict)
    bits: dict[int, SafeText] = field(default_factory=dict)

    def why_not(self, value: Number) -> str:
        """Return why `value` is out of range, or no value that the description lists; or ""."""
        # PX4 gives most lists of values no range: COM_OBL_RC_ACT takes 99, and then nobody knows what it does.
        listed = bool(self.choices) and self.least is None and self.most is None
        if listed and value not in self.choices:
            return f"must be one of {', '.join(f'{shown(choice)} ({text})' for choice, text in self.choices.items())}"
        below = self.least is not None and value < self.least
        above = self.most is not None and value > self.most
        if not below and not above:
            return ""
        least = shown(self.least) if self.least is not None else "…"
        return f"must be within {least} to {shown(self.most) if self.most is not None else '…'}"


class _MetadataRow(msgspec.Struct):
    name: str
    shortDesc: str = ""  # noqa: N815 - as in the file
    longDesc: str = ""  # noqa: N815
    units: str = ""
    group: str = ""
    min: float | int | None = None
    max: float | int | None = None
    default: float | int | None = None
    increment: float | int | None = None
    decimalPlaces: int | None = None  # noqa: N815
    rebootRequired: bool = False  # noqa: N815
    values: list[dict[str, Any]] = []
    bitmask: list[dict[str, Any]] = []


class _MetadataFile(msgspec.Struct):
    parameters: list[msgspec.Raw] = []


def parse_info(data: bytes) -> dict[str, ParamMetadata]:
    """Read the descriptions by name. A broken file gives none, a broken row is skipped."""
    try:
        rows = msgspec.json.decode(data, type=_MetadataFile).parameters[:MAX_INFOS]
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return {}
    infos: dict[str, ParamMetadata] = {}
    for raw in rows:
        try:
            row = msgspec.json.decode(raw, type=_MetadataRow)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            continue
        if 0 < len(row.name) <= NAME_BYTES:
            info = _info(row)
            infos[info.name] = info
    return infos


def _info(row: _MetadataRow) -> ParamMetadata:
    least, most = row.min, row.max
    if (
        least is not None and most is not None and not least <= most
    ):  # docs/threats.md B.6-74; the form also catches NaN
        least = most = None
    return ParamMetadata(
        name=clean(row.name, 64),
        short=clean(row.shortDesc),
        long=clean(" ".join(row.longDesc.split()), 2000),
        units=clean(row.units, 20),
        group=clean(row.group, 40),
        least=least,
        most=most,
        default=row.default,
        step=row.increment
        if row.increment is not None and math.isfinite(row.increment) and row.increment > 0
        else None,
        decimals=row.decimalPlaces if row.decimalPlaces is not None and 0 <= row.decimalPlaces <= 9 else None,
        reboot=row.rebootRequired,
        choices=dict(_pairs(row.values, "value")),
        bits={int(bit): text for bit, text in _pairs(row.bitmask, "index") if 0 <= bit < 32 and bit == int(bit)},
    )


def _pairs(entries: list[dict[str, Any]], key: str) -> list[tuple[Number, SafeText]]:
    return [
        (entry[key], clean(entry["description"]))
        for entry in entries[:MAX_CHOICES]
        if isinstance(entry.get(key), int | float)
        and math.isfinite(entry[key])
        and isinstance(entry.get("description"), str)
    ]
