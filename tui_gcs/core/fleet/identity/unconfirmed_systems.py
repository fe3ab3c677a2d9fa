"""Vehicles that are never more than heartbeats. On a network without keys anybody can forge a whole table of them.

Each costs a row and questions that nobody answers, so a crowd of them is told, and who falls silent is forgotten. A
real vehicle that is heard like that loses nothing: it is found again by its next heartbeat.
"""

from collections.abc import Iterable

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import WARNING, EventLog

CONFIRMATION_TIMEOUT_S = 15.0
"""Who has told neither a place nor who it is after that time, though asked, is a ghost: a boot is that long."""
GROUP_WARNING_SIZE = 10
SILENCE_BEFORE_REMOVAL_S = 60.0
WARNING_INTERVAL_S = 60.0


class UnconfirmedSystemMonitor:
    """Finds them."""

    def __init__(self, events: EventLog) -> None:
        """Crowds are told to `events`."""
        self._events = events

    def look(self, vehicles: Iterable[Vehicle], now: float) -> list[Vehicle]:
        """Those to forget: nothing but heartbeats, disarmed, and silent for a minute."""
        ghosts = [vehicle for vehicle in vehicles if _is_ghost(vehicle, now)]
        if len(ghosts) >= GROUP_WARNING_SIZE:
            text = f"{len(ghosts)} vehicles are nothing but heartbeats: forged, or links that are too slow"
            self._events.report(EventClass.CONNECTION, "station", text, WARNING, every_s=WARNING_INTERVAL_S)
        return [
            ghost for ghost in ghosts if not ghost.telemetry.armed and now - ghost.heard_s > SILENCE_BEFORE_REMOVAL_S
        ]


def _is_ghost(vehicle: Vehicle, now: float) -> bool:
    silent = not (vehicle.identity.identified or vehicle.telemetry.has_position() or vehicle.identity.keyed)
    return (
        silent
        and now - vehicle.identity.first_heard_s > CONFIRMATION_TIMEOUT_S
        and vehicle.telemetry.high_latency_s <= vehicle.identity.first_heard_s
    )
