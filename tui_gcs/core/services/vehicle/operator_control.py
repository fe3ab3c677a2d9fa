"""Answers commands that vehicles send to this station, and follows which station has control of them.

MAVLink lets a vehicle command a station. Nothing of that is carried out here: a request for control is denied and
reported, everything else is unsupported (docs/threats.md B.6-48…51). CONTROL_STATUS reports which station a vehicle
obeys.
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
"""A vehicle gets at most one answer in this time."""
REPORT_GAP_S = 10.0
MIN_REPORT_GAP_S = 1.0


@dataclass
class _ControlRecord:
    """What one vehicle has requested and reported."""

    answered_s: float = -math.inf
    in_control: int = -1
    """The system id of the station that it obeys; -1 unknown, 0 none."""
    reported: int = -1
    """The last of these that was reported, and when."""
    reported_s: float = -math.inf


class ControlService:
    """Refuses commands to this station, and follows which station has control."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._vehicles: dict[int, _ControlRecord] = {}
        self.refused: Counter[str] = Counter()
        """Commands to us that were not carried out, and reports that were not believed, by reason."""
        for name in ("COMMAND_LONG", "COMMAND_INT"):
            context.fleet.on_message(name, self._on_command)
        context.fleet.on_message("CONTROL_STATUS", self._on_status)

    def in_control(self, vehicle: int) -> int:
        """The system id of the station that `vehicle` obeys; -1 if it has not reported one, 0 for none."""
        record = self._vehicles.get(vehicle)
        return record.in_control if record is not None else -1

    def _on_command(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        # Broadcast: calibrations send positions that way.
        if fields["target_system"] != self._context.own_system:
            return
        self.refused["command to us"] += 1
        command = fields["command"]
        asks_control = command == REQUEST_OPERATOR_CONTROL
        now = self._context.clock.now()
        record = self._vehicles.setdefault(vehicle.id, _ControlRecord())
        # Answering every command of a flood would make us part of it.
        if now - record.answered_s < ANSWER_GAP_S:
            return
        record.answered_s = now
        result = DENIED if asks_control else UNSUPPORTED
        self._context.uplink.ask(vehicle.id, "COMMAND_ACK", command=command, result=result)
        text = "asks us for control: denied" if asks_control else f"commands us ({command}): refused"
        self._context.events.report(EventClass.OPERATOR, f"vehicle {vehicle.id}", text, WARNING, every_s=REPORT_GAP_S)

    def _on_status(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        # Other components do not speak for the whole system.
        if not fields["flags"] & SYSTEM_MANAGER:
            self.refused["control status of who does not manage the system"] += 1
            return
        record = self._vehicles.setdefault(vehicle.id, _ControlRecord())
        station, now = fields["gcs_main"], self._context.clock.now()
        record.in_control = station
        # It is repeated every second.
        if station == record.reported or now - record.reported_s < MIN_REPORT_GAP_S:
            return
        record.reported, record.reported_s = station, now
        ours = station == self._context.own_system
        holder = "we have" if ours else f"GCS {station} has" if station else "no station has"
        severity = NOTICE if ours or not station else WARNING
        self._context.events.report(EventClass.OPERATOR, f"vehicle {vehicle.id}", f"{holder} control", severity)
