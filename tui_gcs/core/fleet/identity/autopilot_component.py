"""Which component of a system is its autopilot.

MAVLink lets any component say a heartbeat, and one forged or odd one may be the first that is heard of a system. So
the choice is never final: component 1 (MAV_COMP_ID_AUTOPILOT1) wins, and who falls silent is replaced.
"""

from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_INVALID, NOT_VEHICLES

AUTOPILOT1 = 1
"""MAV_COMP_ID_AUTOPILOT1: where an autopilot is, unless somebody set it otherwise."""
NEVER_AUTOPILOT = frozenset({0, 190, 255})
"""Component ids of no flight controller (B.6-19)."""
AUTOPILOT_TIMEOUT_S = 3.0
"""Without a heartbeat of the chosen component for so long, another one that says it is an autopilot is taken."""


def is_autopilot(fields: dict[str, Any], component: int) -> bool:
    """Whether a HEARTBEAT (or HIGH_LATENCY2) with these fields is said by what flies a vehicle."""
    return not (
        fields["autopilot"] == AUTOPILOT_INVALID or fields["type"] in NOT_VEHICLES or component in NEVER_AUTOPILOT
    )


def replaces_autopilot(vehicle: Vehicle, fields: dict[str, Any], component: int, now: float) -> bool:
    """Whether `component`, by this heartbeat of its own, is the vehicle's autopilot instead of the chosen one."""
    if component == vehicle.component or not is_autopilot(fields, component):
        return False
    spoke_s = max(vehicle.identity.first_heard_s, vehicle.telemetry.heartbeat_s, vehicle.telemetry.high_latency_s)
    return component == AUTOPILOT1 or now - spoke_s > AUTOPILOT_TIMEOUT_S
