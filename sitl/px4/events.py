"""PX4's EVENTs: numbered messages with arguments, kept in a small buffer for who missed some.

Ids and argument types come from the same metadata file that the vehicle serves by FTP.
"""

import json
import lzma
import struct
from collections import deque
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

from sitl.links.dialect import CODES

FIRST_SEQUENCE = 65525
"""The first number after power-on: it wraps soon."""
BUFFERED = 20
ARGUMENT_BYTES = 40
UNAVAILABLE = 0
"""MAV_EVENT_ERROR_REASON."""


class Kind(NamedTuple):
    """One event of the metadata."""

    id: int
    layout: struct.Struct


@cache
def kinds() -> dict[str, Kind]:
    """Events of the autopilot's firmware by name."""
    packed = (resources.files("sitl") / "data" / "all_events.json.xz").read_bytes()
    components: dict[str, Any] = json.loads(lzma.decompress(packed))["components"]
    enums = {name: enum["type"] for part in components.values() for name, enum in part.get("enums", {}).items()}
    found: dict[str, Kind] = {}
    for number, part in components.items():
        for group in part.get("event_groups", {}).values():
            for sub, event in group["events"].items():
                types = [argument["type"].split("::")[-1] for argument in event.get("arguments", [])]
                codes = [CODES.get(enums.get(name, name)) for name in types]
                if None not in codes:
                    layout = struct.Struct("<" + "".join(code for code in codes if code))
                    found[event["name"]] = Kind(int(number) << 24 | int(sub), layout)
    return found


class EventLog:
    """The events of one vehicle since power-on."""

    def __init__(self) -> None:
        self.sequence = FIRST_SEQUENCE
        """Of the last event."""
        self._buffer: deque[dict[str, Any]] = deque(maxlen=BUFFERED)

    def add(self, name: str, arguments: tuple[float, ...], log_levels: int, boot_ms: int) -> dict[str, Any]:
        """Fields of the EVENT; it is kept.

        Raises:
            KeyError: The firmware has no such event.
        """
        kind = kinds()[name]
        self.sequence = (self.sequence + 1) & 0xFFFF
        packed = kind.layout.pack(*arguments)
        fields = {
            "id": kind.id,
            "event_time_boot_ms": boot_ms,
            "sequence": self.sequence,
            "log_levels": log_levels,
            "arguments": packed.ljust(ARGUMENT_BYTES, b"\0"),
        }
        self._buffer.append(fields)
        return fields

    def get(self, sequence: int) -> dict[str, Any] | None:
        """Fields of a kept event; None if it is gone or never was."""
        return next((fields for fields in self._buffer if fields["sequence"] == sequence), None)

    @property
    def oldest(self) -> int:
        """Sequence of the oldest one kept."""
        return int(self._buffer[0]["sequence"]) if self._buffer else self.sequence
