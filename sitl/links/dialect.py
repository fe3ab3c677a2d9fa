"""Messages that pymavlink 2.4.50's `ardupilotmega` lacks, or knows without their extensions.

Autopilots of 2026 send them. A definition has the attributes of pymavlink's message classes, so that `wire.Layout`
reads both.
"""

import struct
from collections.abc import Iterator

from fastcrc import crc16

CODES = {
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
    "char": "s",
}
"""Codes of MAVLink's types in the module `struct`."""
_SHORT = {"u8": "uint8_t", "u16": "uint16_t", "u32": "uint32_t", "i32": "int32_t", "u64": "uint64_t", "i64": "int64_t"}

# id, name, fields in the order of their XML: type name, with [n] for arrays; "/" begins the extensions.
_MESSAGES = """
8 LINK_NODE_STATUS u64 timestamp, u8 tx_buf, u8 rx_buf, u32 tx_rate, u32 rx_rate, u16 rx_parse_err, u16 tx_overflows, \
u16 rx_overflows, u32 messages_sent, u32 messages_received, u32 messages_lost
42 MISSION_CURRENT u16 seq, / u16 total, u8 mission_state, u8 mission_mode, u32 mission_id, u32 fence_id, \
u32 rally_points_id
44 MISSION_COUNT u8 target_system, u8 target_component, u16 count, / u8 mission_type, u32 opaque_id
47 MISSION_ACK u8 target_system, u8 target_component, u8 type, / u8 mission_type, u32 opaque_id
126 SERIAL_CONTROL u8 device, u8 flags, u16 timeout, u32 baudrate, u8 count, u8 data[70], / u8 target_system, \
u8 target_component
300 PROTOCOL_VERSION u16 version, u16 min_version, u16 max_version, u8 spec_version_hash[8], u8 library_version_hash[8]
380 TIME_ESTIMATE_TO_TARGET i32 safe_return, i32 land, i32 mission_next_item, i32 mission_end, i32 commanded_action
395 COMPONENT_INFORMATION u32 time_boot_ms, u32 general_metadata_file_crc, char general_metadata_uri[100], \
u32 peripherals_metadata_file_crc, char peripherals_metadata_uri[100]
397 COMPONENT_METADATA u32 time_boot_ms, u32 file_crc, char uri[100]
410 EVENT u8 destination_component, u8 destination_system, u32 id, u32 event_time_boot_ms, u16 sequence, \
u8 log_levels, u8 arguments[40]
411 CURRENT_EVENT_SEQUENCE u16 sequence, u8 flags
412 REQUEST_EVENT u8 target_system, u8 target_component, u16 first_sequence, u16 last_sequence
413 RESPONSE_EVENT_ERROR u8 target_system, u8 target_component, u16 sequence, u16 sequence_oldest_available, u8 reason
435 AVAILABLE_MODES u8 number_modes, u8 mode_index, u8 standard_mode, u32 custom_mode, u32 properties, \
char mode_name[35]
436 CURRENT_MODE u8 standard_mode, u32 custom_mode, u32 intended_custom_mode
437 AVAILABLE_MODES_MONITOR u8 seq
"""


class MessageDefinition:
    """One message, with the attributes of pymavlink's classes that `wire.Layout` reads."""

    def __init__(self, line: str) -> None:
        number, name, fields = line.split(" ", 2)
        base, _, extensions = fields.partition("/ ")
        self.id = int(number)
        self.msgname = name
        # MAVLink sends base fields by size, the largest first; extensions stay in the order of their XML.
        sent = sorted(_fields(base), key=lambda field: -struct.calcsize(CODES[field[0]]))
        parsed = sent + list(_fields(extensions))
        self.ordered_fieldnames = self.fieldnames = [name for _, name, _ in parsed]
        self.fieldtypes = [kind for kind, _, _ in parsed]
        self.array_lengths = [length for _, _, length in parsed]
        self.unpacker = struct.Struct("<" + "".join(f"{length or ''}{CODES[kind]}" for kind, _, length in parsed))
        self.crc_extra = _crc_extra(name, sent)


def _fields(text: str) -> Iterator[tuple[str, str, int]]:
    """Yield type, name and array length (0 for no array) of each field."""
    for field in filter(None, text.strip().rstrip(",").split(", ")):
        kind, name = field.split(" ")
        name, _, length = name.partition("[")
        yield _SHORT.get(kind, kind), name, int(length.rstrip("]") or 0)


def _crc_extra(name: str, fields: list[tuple[str, str, int]]) -> int:
    """Return the seed of a message's checksums, which depends on its name and base fields."""
    seed = f"{name} ".encode()
    for kind, field, length in fields:
        seed += f"{kind} {field} ".encode() + (bytes([length]) if length else b"")
    crc = crc16.mcrf4xx(seed)
    return (crc & 0xFF) ^ (crc >> 8)


NEWER: tuple[MessageDefinition, ...] = tuple(MessageDefinition(line) for line in _MESSAGES.strip().splitlines())

PARAM_VALUE_BYTES = MessageDefinition(
    "22 PARAM_VALUE u32 param_value, u16 param_count, u16 param_index, char param_id[16], u8 param_type"
)
"""PARAM_VALUE with four bytes as value: as a float not every integer survives."""
# The checksum is that of the real PARAM_VALUE, whose value is a float.
PARAM_VALUE_BYTES.crc_extra = 220
