"""What a station gets for a refused request: the answer that the vehicle itself would have given, and the reason.

Other programs look for answers from the vehicle only. A COMMAND_ACK from another system is ignored, and the operator
waits in vain.
"""

from typing import Any

from tui_gcs.core.firmware.foreign_command_policy import foreign_command_policy
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.dialect import MavlinkMessage

TEXT_BYTES = 50
"""Size of STATUSTEXT's text; longer ones come in chunks."""
WARNING = 4
"""MAV_SEVERITY."""
DO_SET_MODE, SET_MODE_ID = 176, 11
"""What acknowledges a SET_MODE: PX4 makes the command of it, ArduPilot names the message id."""
# docs/autopilots.md C10: opcode and reason of a refusal, and where a packet's data begin.
FTP_NAK, FTP_FAIL, FTP_HEADER_BYTES, FTP_BYTES = 129, 1, 12, 251

Answer = tuple[str, dict[str, Any]]


def refusal_answer(vehicle: Vehicle, message: MavlinkMessage, result: int, mission_result: int) -> Answer | None:
    """The vehicle's answer to `message`, as name and fields; None where it would not answer.

    `result` is the MAV_RESULT, `mission_result` the MAV_MISSION_RESULT.
    """
    fields, sender = message.fields, {"target_system": message.system, "target_component": message.component}
    if message.name in ("COMMAND_LONG", "COMMAND_INT", "SET_MODE"):
        mode_id = DO_SET_MODE if foreign_command_policy(vehicle).two_part_modes else SET_MODE_ID
        command = fields.get("command", mode_id)
        return "COMMAND_ACK", {"command": command, "result": result, "progress": 0, "result_param2": 0} | sender
    # A station's own MISSION_ACK is never answered.
    if message.name.startswith("MISSION_") and message.name not in ("MISSION_ACK", "MISSION_SET_CURRENT"):
        return "MISSION_ACK", {"type": mission_result, "mission_type": fields["mission_type"]} | sender
    if message.name == "FILE_TRANSFER_PROTOCOL":
        return message.name, {"target_network": 0, "payload": _ftp_nak(bytes(fields["payload"]))} | sender
    return None


def _ftp_nak(request: bytes) -> list[int]:
    """The payload of MAVFTP's refusal (https://mavlink.io/en/services/ftp.html)."""
    sequence = (int.from_bytes(request[:2], "little") + 1) & 0xFFFF
    head = sequence.to_bytes(2, "little") + bytes((request[2], FTP_NAK, 1, request[3]))
    return list((head.ljust(FTP_HEADER_BYTES, b"\0") + bytes((FTP_FAIL,))).ljust(FTP_BYTES, b"\0"))


def status_texts(text: str, number: int) -> list[dict[str, Any]]:
    """The fields of the STATUSTEXTs that carry `text`; `number`, not 0, joins the chunks."""
    data = text.encode("ascii", "replace")
    chunks = [data[at : at + TEXT_BYTES] for at in range(0, len(data), TEXT_BYTES)]
    # A text that fills its last chunk has no end in it, and an empty one follows.
    if len(chunks) > 1 and len(chunks[-1]) == TEXT_BYTES:
        chunks.append(b"")
    joined = number if len(chunks) > 1 else 0
    return [{"severity": WARNING, "text": chunk, "id": joined, "chunk_seq": at} for at, chunk in enumerate(chunks)]
