"""Reads all_events.json, and decodes a vehicle's EVENTs with it.

The file comes from the vehicle (`MetadataService`) and, as everything from there, may be forged. The number of
definitions and the lengths of texts are limited, and message templates are filled in by the few rules below, never by
`str.format`. Format: MAVLink's events interface and libevents' JSON (version 1 and 2), as PX4 serves it.
"""

import math
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import msgspec

from tui_gcs.core.base.text import SafeText, clean

MAX_DEFINITIONS = 10_000
"""The most definitions that are kept; PX4 has 378."""
MAX_TEMPLATE = 500
"""The most characters of one message template."""
ARGUMENT_BYTES = 40
_BASE = {
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
}
_PLACE = re.compile(r"\{(\d{1,2})(?::\.(\d{1,2}))?([a-zA-Z^/_]{0,8})\}")
_PROFILE = re.compile(r"<profile [^<>]{0,80}>[^<>]*(?:<(?!/profile)[^<>]{0,80}>[^<>]*)*</profile>")
_TAG = re.compile(r"(?<!\\)</?(?:a|param|profile)(?: [^<>]{0,200})?>")
_ESCAPED = re.compile(r"\\([<>{}\\])")
_UNITS = {"m": " m", "m_v": " m", "m/s": " m/s", "m^2": " m²", "C": " °C"}

Number = int | float


class EventMetadataError(Exception):
    """The file is no event metadata, or of an unknown version; the message is one line."""


class _Argument(msgspec.Struct):
    type: str
    name: str = ""


class _Event(msgspec.Struct):
    message: str
    name: str = ""
    type: str = ""
    arguments: list[_Argument] = []


class _Group(msgspec.Struct):
    events: dict[str, _Event] = {}


class _Entry(msgspec.Struct):
    name: str = ""
    description: str = ""


class _Enum(msgspec.Struct):
    type: str
    entries: dict[str, _Entry] = {}
    is_bitfield: bool = False


class _ModeGroups(msgspec.Struct):
    groups: dict[str, list[int]] = {}


class _Component(msgspec.Struct):
    namespace: str = ""
    enums: dict[str, _Enum] = {}
    event_groups: dict[str, _Group] = {}
    navigation_mode_groups: _ModeGroups | None = None


class _EventsFile(msgspec.Struct):
    version: int
    components: dict[str, _Component]


class Enumeration(NamedTuple):
    """Names of the values of one enumeration."""

    words: dict[int, str]
    is_bitfield: bool


class EventDefinition(NamedTuple):
    """The definition of one kind of event."""

    name: str
    group: str
    """The group, e.g. "default", "arming_check", "health"."""
    type: str
    """The type, e.g. "summary", "append_health_and_arming_messages"; mostly empty."""
    message: str
    """The message template, not cleaned."""
    layout: struct.Struct
    enums: tuple[Enumeration | None, ...]
    """The enumeration of each argument; None for a plain number."""


@dataclass(frozen=True)
class DecodedEvent:
    """One EVENT as it was decoded."""

    name: str
    group: str
    type: str
    text: SafeText
    values: tuple[Number, ...]
    """The arguments as numbers."""


class EventMetadata:
    """The event definitions of one firmware."""

    def __init__(self, definitions: dict[int, EventDefinition], mode_groups: dict[int, int], skipped: int) -> None:
        """Use `parse` to make one."""
        self.definitions = definitions
        """Definitions by event id: the component in bits 24-31, the rest below."""
        self.mode_groups = mode_groups
        """The bit of a group of modes, by custom_mode: arming checks report for such groups whether a mode can arm or
        run."""
        self.skipped = skipped
        """How many definitions cannot be used: unknown types, too many arguments."""

    def decode(self, event_id: int, arguments: bytes) -> DecodedEvent | None:
        """Decode an event; None if it is not in this metadata."""
        definition = self.definitions.get(event_id)
        if definition is None:
            return None
        values = definition.layout.unpack(arguments[: definition.layout.size].ljust(definition.layout.size, b"\0"))
        text = _fill_in(definition, values)
        return DecodedEvent(definition.name, definition.group, definition.type, text, values)


def parse(raw: bytes) -> EventMetadata:
    """Read an all_events.json.

    Raises:
        EventMetadataError: It is damaged, or something else.
    """
    try:
        file = msgspec.json.decode(raw, type=_EventsFile)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise EventMetadataError(f"no event metadata: {clean(str(error), 100)}") from None
    if file.version not in (1, 2):
        raise EventMetadataError(f"event metadata of unknown version {file.version}")
    enums = _enums(file)
    definitions: dict[int, EventDefinition] = {}
    skipped = 0
    mode_groups: dict[int, int] = {}
    for number, component in file.components.items():
        for group, event_id, event in _events(number, component):
            definition = _definition(event, group, component.namespace, enums)
            if definition is None or len(definitions) >= MAX_DEFINITIONS:
                skipped += 1
            else:
                definitions[event_id] = definition
        if component.navigation_mode_groups is not None:
            mode_groups |= _bits(component.navigation_mode_groups)
    if not definitions:
        raise EventMetadataError("event metadata without events")
    return EventMetadata(definitions, mode_groups, skipped)


def _enums(file: _EventsFile) -> dict[str, tuple[str, Enumeration]]:
    """Enumerations by full name ("px4::arm_disarm_reason_t"): base type and names."""
    enums = {}
    for component in file.components.values():
        for name, enum in component.enums.items():
            if enum.type in _BASE and enum.type != "float":
                words = {
                    int(value): entry.description or entry.name
                    for value, entry in enum.entries.items()
                    if value.isdecimal() and len(value) <= 20
                }
                enums[f"{component.namespace}::{name}"] = (_BASE[enum.type], Enumeration(words, enum.is_bitfield))
    return enums


def _events(number: str, component: _Component) -> Iterator[tuple[str, int, _Event]]:
    for group, content in component.event_groups.items():
        for sub_id, event in content.events.items():
            if sub_id.isdecimal() and number.isdecimal() and len(sub_id) <= 8 and len(number) <= 3:
                yield group, int(number) << 24 | int(sub_id), event


def _bits(groups: _ModeGroups) -> dict[int, int]:
    return {
        custom_mode: 1 << int(bit)
        for bit, modes in groups.groups.items()
        if bit.isdecimal() and len(bit) <= 2 and int(bit) < 64
        for custom_mode in modes[:16]
    }


def _definition(
    event: _Event, group: str, namespace: str, enums: dict[str, tuple[str, Enumeration]]
) -> EventDefinition | None:
    layout, words = "<", []
    for argument in event.arguments[: ARGUMENT_BYTES + 1]:
        base, enum = _BASE.get(argument.type), None
        if base is None:
            full = argument.type if "::" in argument.type else f"{namespace}::{argument.type}"
            base, enum = enums.get(full) or enums.get(f"common::{argument.type}") or (None, None)
        if base is None:
            return None
        layout += base
        words.append(enum)
    if struct.calcsize(layout) > ARGUMENT_BYTES:
        return None
    message = event.message[:MAX_TEMPLATE]
    return EventDefinition(event.name[:80], group, event.type, message, struct.Struct(layout), tuple(words))


def _fill_in(definition: EventDefinition, values: tuple[Number, ...]) -> SafeText:
    """Fill the arguments into the message. What is not understood stays as it is."""

    def value(match: re.Match[str]) -> str:
        index = int(match[1]) - 1
        if not 0 <= index < len(values):
            return match[0]
        word = _word(values[index], definition.enums[index], match[2])
        return word + _UNITS.get(match[3], f" {match[3]}" if match[3] else "")

    # Never `str.format`: a template of a vehicle could read attributes of our objects.
    text = _TAG.sub("", _PROFILE.sub("", definition.message))
    return clean(_ESCAPED.sub(r"\1", _PLACE.sub(value, text)).strip())


def _word(value: Number, enum: Enumeration | None, decimals: str | None) -> str:
    if enum is not None:
        if not enum.is_bitfield:
            return enum.words.get(int(value), str(value))
        return ", ".join(word for bit, word in enum.words.items() if bit and int(value) & bit) or "none"
    if isinstance(value, float):
        if not math.isfinite(value):
            return "?"
        return f"{value:.{min(int(decimals), 10)}f}" if decimals else f"{value:g}"
    return str(value)
