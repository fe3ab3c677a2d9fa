"""PX4's EVENTs: numbered messages with arguments, kept in a small buffer for stations that missed some.

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
"""The first number after power-on; it soon wraps."""
# PX4 keeps this many EVENTs for REQUEST_EVENT [source].
BUFFERED = 20
# EVENT.arguments (common.xml).
ARGUMENT_BYTES = 40
UNAVAILABLE = 0
"""MAV_EVENT_ERROR_REASON of an event that is no longer kept."""


class EventKind(NamedTuple):
    """One event of the metadata: its id and the layout of its arguments."""

    id: int
    layout: struct.Struct


@cache
def event_kinds() -> dict[str, EventKind]:
    """Return the events of the firmware by name."""
    packed = (resources.files("sitl") / "data" / "all_events.json.xz").read_bytes()
    components: dict[str, Any] = json.loads(lzma.decompress(packed))["components"]
    enums = {name: enum["type"] for part in components.values() for name, enum in part.get("enums", {}).items()}
    found: dict[str, EventKind] = {}
    for number, part in components.items():
        for group in part.get("event_groups", {}).values():
            for sub, event in group["events"].items():
                types = [argument["type"].split("::")[-1] for argument in event.get("arguments", [])]
                codes = [CODES.get(enums.get(name, name)) for name in types]
                if None not in codes:
                    layout = struct.Struct("<" + "".join(code for code in codes if code))
                    found[event["name"]] = EventKind(int(number) << 24 | int(sub), layout)
    return found


class EventLog:
    """The events of one vehicle since power-on."""

    def __init__(self) -> None:
        self.sequence = FIRST_SEQUENCE
        """Number of the last event."""
        self._buffer: deque[dict[str, Any]] = deque(maxlen=BUFFERED)

    def add(self, name: str, arguments: tuple[float, ...], log_levels: int, boot_ms: int) -> dict[str, Any]:
        """Keep an event and return the fields of its EVENT.

        Raises:
            KeyError: The firmware has no such event.
        """
        kind = event_kinds()[name]
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
        """Return the fields of a kept event; None if it is gone or never existed."""
        return next((fields for fields in self._buffer if fields["sequence"] == sequence), None)

    @property
    def oldest(self) -> int:
        """Number of the oldest event that is kept."""
        return int(self._buffer[0]["sequence"]) if self._buffer else self.sequence
