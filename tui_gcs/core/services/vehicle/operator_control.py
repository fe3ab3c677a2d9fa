"""What vehicles want of us, and who has control of them.

MAVLink lets a vehicle command a station. Nothing of that is carried out here: who asks for control is denied and told,
everything else is unsupported (docs/threats.md B.6-48…51). CONTROL_STATUS tells which station a vehicle obeys.
"""

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.uplink.commands import DENIED, UNSUPPORTED

REQUEST_OPERATOR_CONTROL = 32100
"""MAV_CMD_REQUEST_OPERATOR_CONTROL (development.xml)."""
SYSTEM_MANAGER = 1
"""GCS_CONTROL_STATUS_FLAGS_SYSTEM_MANAGER: the sender speaks for the whole system."""
ANSWER_GAP_S = 1.0
"""A vehicle gets so many answers a second at most: one."""
TELL_GAP_S = 10.0
TELL_CONTROL_S = 1.0


@dataclass
class _Asker:
    """One vehicle."""

    answered_s: float = -math.inf
    in_control: int = -1
    """System id of the station it obeys; -1 unknown, 0 none."""
    told: int = -1
    """Which of these was told last, and when."""
    told_s: float = -math.inf


class ControlService:
    """Answers commands to us with a no, and watches who has control."""

    def __init__(self, context: ServiceContext) -> None:
        """Listen from now on."""
        self._context = context
        self._vehicles: dict[int, _Asker] = {}
        self.refused: Counter[str] = Counter()
        """Commands to us that were not carried out, and words that were not believed, by reason."""
        for name in ("COMMAND_LONG", "COMMAND_INT"):
            context.fleet.on_message(name, self._on_command)
        context.fleet.on_message("CONTROL_STATUS", self._on_status)

    def in_control(self, vehicle: int) -> int:
        """System id of the station `vehicle` obeys; -1 where it never said, 0 for none."""
        asker = self._vehicles.get(vehicle)
        return asker.in_control if asker is not None else -1

    def _on_command(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        if fields["target_system"] != self._context.own_system:  # to everybody: calibrations tell positions that way
            return
        self.refused["command to us"] += 1
        command = fields["command"]
        asks_control = command == REQUEST_OPERATOR_CONTROL
        now = self._context.clock.now()
        asker = self._vehicles.setdefault(vehicle.id, _Asker())
        if now - asker.answered_s < ANSWER_GAP_S:
            return
        asker.answered_s = now
        result = DENIED if asks_control else UNSUPPORTED
        self._context.uplink.ask(vehicle.id, "COMMAND_ACK", command=command, result=result)
        text = "asks us for control: denied" if asks_control else f"commands us ({command}): refused"
        self._context.events.report(EventClass.OPERATOR, f"vehicle {vehicle.id}", text, WARNING, every_s=TELL_GAP_S)

    def _on_status(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        if not fields["flags"] & SYSTEM_MANAGER:
            self.refused["control status of who does not manage the system"] += 1
            return
        asker = self._vehicles.setdefault(vehicle.id, _Asker())
        station, now = fields["gcs_main"], self._context.clock.now()
        asker.in_control = station
        if station == asker.told or now - asker.told_s < TELL_CONTROL_S:  # it says so again in a second
            return
        asker.told, asker.told_s = station, now
        ours = station == self._context.own_system
        who = "we have" if ours else f"GCS {station} has" if station else "nobody has"
        severity = NOTICE if ours or not station else WARNING
        self._context.events.report(EventClass.OPERATOR, f"vehicle {vehicle.id}", f"{who} control", severity)
