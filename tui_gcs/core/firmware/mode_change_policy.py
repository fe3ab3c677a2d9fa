"""How a change of mode is requested by name: which modes stop a vehicle, and which the operator must confirm.

Hold, return and landing never wait for a question; while armed every other change of mode does (docs/threats.md D.1). A
stop is repeated until telemetry shows it; a mode that takes off or flies by itself is never sent later than 2 s
(docs/threats.md C.4).
"""

from dataclasses import dataclass

from tui_gcs.core.firmware.health import STICK_MODES
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_PX4
from tui_gcs.core.mavlink.mode_names import mode_name
from tui_gcs.core.uplink.actions import RetryClass

_STOPS = {"RTL": "return", "LAND": "land", "BRAKE": "hold"}
_PX4_STOPS = _STOPS | {"HOLD": "hold"}
"""By mode: the stop that it is."""
# Measured: ArduCopter's LOITER sinks at 2.5 m/s with the stick at the bottom.
_STICKS = STICK_MODES | {"STABILIZE", "ACRO", "RATE_ACRO", "ZIGZAG"}
"""Modes that read sticks: a vehicle without a pilot falls or sinks in them."""
_PX4_STICKS = frozenset({"MANUAL", "ALTCTL", "POSCTL", "SLOW", "ORBIT", "ACRO", "STABILIZED", "ALTITUDE_CRUISE"})
_RETURNS = frozenset({"SMART_RTL", "PRECLAND"})
"""Modes as harmless as a stop that are not repeated as one: going home or down needs no confirmation."""
_FLIES = frozenset(
    {"AUTO", "MISSION", "TAKEOFF", "VTOL_TAKEOFF", "OFFBOARD", "FOLLOW", "GUIDED_NOGPS", "THROW", "FLIP", "TURTLE"}
    | {"SYSTEMID", "AUTOROTATE", "AUTO_RTL", "AVOID_ADSB"}
)
"""Modes in which a vehicle takes off or flies by itself."""


@dataclass(frozen=True)
class ModeChangePolicy:
    """How one mode is requested."""

    retry: RetryClass
    name: str
    """The action's name."""
    danger: str = ""
    """Why the operator must confirm it; "" where nothing speaks against it now."""
    is_stop: bool = False
    """Whether it holds the vehicle or brings it home or down: then it is never vetoed, and leaves over every path."""


def mode_change_policy(vehicle: Vehicle, custom_mode: int) -> ModeChangePolicy:
    """How `vehicle` is asked for a mode now."""
    px4 = vehicle.autopilot == AUTOPILOT_PX4
    word = mode_name(vehicle.autopilot, vehicle.type, custom_mode)
    stop = (_PX4_STOPS if px4 else _STOPS).get(word)
    # On the ground a stop that is refused would be repeated for ever.
    if stop is not None and vehicle.telemetry.armed:
        return ModeChangePolicy(RetryClass.STOP, stop, is_stop=True)
    name = f"mode {word}"
    if word in (_PX4_STICKS if px4 else _STICKS):
        danger = f"{word} obeys sticks: without a pilot it sinks or falls" if vehicle.telemetry.armed else ""
        return ModeChangePolicy(RetryClass.START, name, danger)
    if word in _FLIES or word.startswith("EXTERNAL"):
        return ModeChangePolicy(
            RetryClass.START, name, f"{word} takes off or flies by itself" if vehicle.telemetry.armed else ""
        )
    if word in _RETURNS:
        return ModeChangePolicy(RetryClass.SET, name, is_stop=True)
    if not vehicle.telemetry.armed or custom_mode == vehicle.telemetry.custom_mode:
        return ModeChangePolicy(RetryClass.SET, name)
    present = vehicle.mode_name
    return ModeChangePolicy(RetryClass.SET, name, f"it is armed, and leaves {present}")
