"""Flight logs that are mistaken for plans: recognised by how they begin, so that the operator learns what a file is."""

import struct

_BEGINNINGS = {
    b"\xa3\x95\x80": "a log of ArduPilot (.bin)",
    b"ULog\x01\x12\x35": "a log of PX4 (.ulg)",
}
_MAGICS = (0xFE, 0xFD)
"""The first byte of a MAVLink frame, version 1 and 2."""
MIN_TIME_US, MAX_TIME_US = 946_684_800_000_000, 4_102_444_800_000_000
"""The years 2000 and 2100: the time of a record of a telemetry log lies between them."""


def log_in(data: bytes) -> str:
    """Return which kind of log `data` begins like, and how it is shown; "" for anything else."""
    for beginning, name in _BEGINNINGS.items():
        if data.startswith(beginning):
            return name
    # A record is the time in microseconds, big-endian, and one frame.
    if len(data) > 8 and data[8] in _MAGICS and MIN_TIME_US <= struct.unpack_from(">Q", data)[0] <= MAX_TIME_US:
        return "a telemetry log (.tlog; `tui-gcs replay FILE` shows it)"
    # No text begins so, but UTF-16 does with FE FF.
    if data[:1] and data[0] in _MAGICS and data[1:2] != b"\xff":
        return "a stream of MAVLink frames without times"
    return ""
