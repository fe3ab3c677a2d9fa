"""Questions: frames that change nothing a vehicle does, and therefore need no verdict of the guard.

They ask for information or for messages at a rate, answer what the vehicle asked, or announce this station. Everything
that is not listed here needs an `Order` or a set-point's verdict; so no order can leave as a question.
"""

from typing import Any

from tui_gcs.core.guard.permission import Question
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE, CMD_SET_MESSAGE_INTERVAL

HEARTBEAT = Question("HEARTBEAT")
COMMANDS = frozenset({CMD_SET_MESSAGE_INTERVAL, CMD_REQUEST_MESSAGE})
"""MAV_CMDs that only ask."""
MESSAGES = frozenset(
    {
        "COMMAND_ACK",
        "HEARTBEAT",
        "LOG_REQUEST_DATA",
        "LOG_REQUEST_END",
        "LOG_REQUEST_LIST",
        "MISSION_ACK",
        "MISSION_REQUEST",
        "MISSION_REQUEST_INT",
        "MISSION_REQUEST_LIST",
        "OPEN_DRONE_ID_BASIC_ID",
        "OPEN_DRONE_ID_OPERATOR_ID",
        "OPEN_DRONE_ID_SELF_ID",
        "OPEN_DRONE_ID_SYSTEM",
        "PARAM_REQUEST_LIST",
        "PARAM_REQUEST_READ",
        "PING",
        "REQUEST_EVENT",
        "TERRAIN_DATA",
        "TIMESYNC",
    }
)
"""Messages that ask, answer or identify, by name."""
FTP_READS = frozenset({0, 1, 2, 3, 4, 5, 14, 15})
"""MAVLink FTP opcodes that change no file: none, end and reset sessions, list, open for reading, read, checksum, burst
read (https://mavlink.io/en/services/ftp.html)."""
FTP, FTP_OPCODE_AT = "FILE_TRANSFER_PROTOCOL", 3


def question(name: str, fields: dict[str, Any]) -> Question | None:
    """The permission of a message that only asks; None for one that could change the vehicle."""
    if name == FTP:
        asks = fields["payload"][FTP_OPCODE_AT] in FTP_READS
    elif name == "COMMAND_LONG":
        asks = fields["command"] in COMMANDS
    else:
        asks = name in MESSAGES
    return Question(name) if asks else None
