"""Unconfirmed systems: MAVLink systems from which only heartbeats have been received.

On an unsigned network anyone can forge heartbeats for a whole table of systems. Each costs a row and unanswered
requests, so the operator is warned about large groups, and silent ones are removed. A real vehicle that is removed is
found again at its next heartbeat.
"""

from collections.abc import Iterable

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import WARNING, EventLog

CONFIRMATION_TIMEOUT_S = 15.0
"""A system that has reported neither position nor AUTOPILOT_VERSION this long after its first frame is unconfirmed.
Autopilots boot within this time."""
GROUP_WARNING_SIZE = 10
"""The operator is warned of this many unconfirmed systems."""
SILENCE_BEFORE_REMOVAL_S = 60.0
"""A disarmed unconfirmed system is removed after this much silence."""
WARNING_INTERVAL_S = 60.0


class UnconfirmedSystemMonitor:
    """Reports large groups of unconfirmed systems and lists those to remove from the fleet."""

    def __init__(self, events: EventLog) -> None:
        """Report to `events`."""
        self._events = events

    def look(self, vehicles: Iterable[Vehicle], now: float) -> list[Vehicle]:
        """Return the systems to remove: unconfirmed, disarmed and silent for a minute."""
        unconfirmed = [vehicle for vehicle in vehicles if _is_heartbeat_only(vehicle, now)]
        if len(unconfirmed) >= GROUP_WARNING_SIZE:
            text = f"{len(unconfirmed)} vehicles are nothing but heartbeats: forged, or links that are too slow"
            self._events.report(EventClass.CONNECTION, "station", text, WARNING, every_s=WARNING_INTERVAL_S)
        return [
            vehicle
            for vehicle in unconfirmed
            if not vehicle.telemetry.armed and now - vehicle.last_heard_s > SILENCE_BEFORE_REMOVAL_S
        ]


def _is_heartbeat_only(vehicle: Vehicle, now: float) -> bool:
    anonymous = not (vehicle.identity.identified or vehicle.telemetry.has_position() or vehicle.identity.keyed)
    return (
        anonymous
        and now - vehicle.identity.first_heard_s > CONFIRMATION_TIMEOUT_S
        and vehicle.telemetry.high_latency_s <= vehicle.identity.first_heard_s
    )
