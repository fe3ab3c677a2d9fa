"""The parts of a station that all flight controllers work with, in one record."""

from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.registry import FirmwareRegistry
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.commands import CommandService


@dataclass(frozen=True)
class FlightServices:
    """The parts of one station that its flight controllers share."""

    fleet: VehicleRegistry
    flights: FlightTable
    guard: Guard
    firmware: FirmwareRegistry
    commands: CommandService
    events: EventLog
    clock: Clock
