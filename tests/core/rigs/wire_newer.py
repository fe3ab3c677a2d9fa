"""What our tables know and pymavlink 2.4.50 does not, written down a second time: its numbers come from elsewhere.

CRC numbers and sizes are those that MAVLink's own generator makes of MAVLink's own definitions (commit de1e078a).
"""

import struct
from typing import Any

NEW = {
    8: ("LINK_NODE_STATUS", 117, 36),
    80: ("COMMAND_CANCEL", 14, 4),
    290: ("ESC_INFO", 251, 46),
    291: ("ESC_STATUS", 10, 57),
    300: ("PROTOCOL_VERSION", 217, 22),
    380: ("TIME_ESTIMATE_TO_TARGET", 232, 20),
    395: ("COMPONENT_INFORMATION", 0, 212),
    397: ("COMPONENT_METADATA", 182, 108),
    410: ("EVENT", 160, 53),
    411: ("CURRENT_EVENT_SEQUENCE", 106, 3),
    412: ("REQUEST_EVENT", 33, 6),
    413: ("RESPONSE_EVENT_ERROR", 77, 7),
    512: ("CONTROL_STATUS", 21, 12),
}
"""By message id: name, CRC number, bytes of the payload."""
LONGER = {
    42: ("<III", ("mission_id", "fence_id", "rally_points_id")),
    44: ("<I", ("opaque_id",)),
    47: ("<I", ("opaque_id",)),
    111: ("<BB", ("target_system", "target_component")),
    126: ("<BB", ("target_system", "target_component")),
}
"""Extensions that pymavlink lacks, of messages that it has: how they lie behind its own fields."""


def extra_names(msgid: int) -> list[str]:
    """The fields that pymavlink lacks."""
    return list(LONGER[msgid][1]) if msgid in LONGER else []


def extra_fields(msgid: int, payload: bytes, known_bytes: int) -> dict[str, Any]:
    """Their values in a payload of which pymavlink reads `known_bytes`; what was not sent is zero."""
    if msgid not in LONGER:
        return {}
    form, names = LONGER[msgid]
    size = struct.calcsize(form)
    return dict(zip(names, struct.unpack(form, payload[known_bytes:][:size].ljust(size, b"\0")), strict=True))
