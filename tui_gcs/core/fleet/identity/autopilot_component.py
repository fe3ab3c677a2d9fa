"""The choice of the component that is a system's autopilot.

Any component may send HEARTBEAT, and a forged or odd one may be the first that is received of a system. So the choice
is never final: component 1 (MAV_COMP_ID_AUTOPILOT1) wins, and an autopilot that falls silent is replaced.
"""

from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_INVALID, NOT_VEHICLES

AUTOPILOT1 = 1
"""MAV_COMP_ID_AUTOPILOT1, the component id of an autopilot unless it is configured otherwise."""
NEVER_AUTOPILOT = frozenset({0, 190, 255})
"""Component ids that no flight controller uses (docs/threats.md B.6-19)."""
AUTOPILOT_TIMEOUT_S = 3.0
"""After this long without a heartbeat of the chosen component, another one that reports an autopilot is taken."""


def is_autopilot(fields: dict[str, Any], component: int) -> bool:
    """Return whether a HEARTBEAT or HIGH_LATENCY2 with these fields comes from a flight controller of a vehicle."""
    return not (
        fields["autopilot"] == AUTOPILOT_INVALID or fields["type"] in NOT_VEHICLES or component in NEVER_AUTOPILOT
    )


def replaces_autopilot(vehicle: Vehicle, fields: dict[str, Any], component: int, now: float) -> bool:
    """Return whether `component`, by its heartbeat `fields`, is to be the autopilot instead of the chosen component."""
    if component == vehicle.component or not is_autopilot(fields, component):
        return False
    spoke_s = max(vehicle.identity.first_heard_s, vehicle.telemetry.heartbeat_s, vehicle.telemetry.high_latency_s)
    return component == AUTOPILOT1 or now - spoke_s > AUTOPILOT_TIMEOUT_S
