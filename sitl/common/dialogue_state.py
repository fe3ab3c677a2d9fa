"""What a vehicle remembers of its dialogues; plans and parameters outlive a reboot, this does not."""

from dataclasses import dataclass, field
from typing import Any

from sitl.ardupilot.remote_id import RemoteId
from sitl.common.missions import Transfer
from sitl.services.calibration import Calibration
from sitl.services.payload import Payload


@dataclass
class Stores:
    """Dialogues of one vehicle since its boot."""

    uploads: dict[int, Transfer] = field(default_factory=dict)
    """ArduPilot: one per kind of plan at a time."""
    transfer: Transfer | None = None
    """PX4: the one upload or download under way."""
    done: Transfer | None = None
    """PX4: the last upload that was completed; its last item may come again."""
    sending: bool = False
    """PX4: that transfer is a download."""
    complained: set[str] = field(default_factory=set)
    """Texts that were said since the last upload began and are not repeated."""
    ftp: Any = None
    """The file server's session, of the autopilot's kind; made with the first request."""
    calibration: Calibration = field(default_factory=Calibration)
    shell_line: str = ""
    """PX4: what was typed and not ended yet."""
    shell_output: bytes = b""
    """PX4: what is still to be sent."""
    payload: Payload = field(default_factory=Payload)
    traffic: dict[int, tuple[int, dict[str, Any]]] = field(default_factory=dict)
    """ArduPilot: aircraft heard of from stations, by ICAO address: when, and the message."""
    remote_id: RemoteId = field(default_factory=RemoteId)
