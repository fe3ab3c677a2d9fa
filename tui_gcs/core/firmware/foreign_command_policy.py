"""How autopilots read commands that another station sends them; `forward` checks such commands by it.

Measured on ArduCopter 4.7 and PX4 1.17 (docs/autopilots.md).
"""

from dataclasses import dataclass

from tui_gcs.core.firmware.ardupilot import COPTER_TYPES
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4


@dataclass(frozen=True)
class ForeignCommandPolicy:
    """How one autopilot reads commands. The defaults are those of an autopilot that was never measured."""

    heights_above_sea: bool = False
    """The height of a command is above mean sea level, whatever its frame."""
    heights_above_home: bool = False
    """The height of a command without a frame is above home."""
    zero_is_here: bool = False
    """A command to latitude 0, longitude 0 means where the vehicle is; other autopilots would fly there."""
    two_part_modes: bool = False
    """DO_SET_MODE has a main mode and a sub mode."""
    own_take_off_height: bool = False
    """A take-off without a height climbs to one of its own, and no farther."""
    first_item_is_home: bool = False
    """Item 0 of a mission is stored as the real home, and not flown to."""
    takes_off_here: bool = False
    """A take-off item's place is not flown to."""
    requests_float_items: bool = False
    """It requests the items of an upload with MISSION_REQUEST, the only request that DroneKit answers."""


_UNKNOWN = ForeignCommandPolicy()
_POLICIES = {
    AUTOPILOT_ARDUPILOT: ForeignCommandPolicy(
        heights_above_home=True,
        zero_is_here=True,
        first_item_is_home=True,
        takes_off_here=True,
        requests_float_items=True,
    ),
    AUTOPILOT_PX4: ForeignCommandPolicy(heights_above_sea=True, two_part_modes=True, own_take_off_height=True),
}

_STOP_MODES = {
    "BRAKE": "hold",
    "HOLD": "hold",
    "LAND": "land",
    "PRECLAND": "land",
    "QLAND": "land",
    "QRTL": "return",
    "RTL": "return",
    "SMART_RTL": "return",
}
"""Modes that stop a vehicle or bring it down, and the guard's word for each."""
MISSION_MODES = frozenset({"AUTO", "MISSION"})
"""Modes in which the mission on board is flown."""
OTHER_MODES = MISSION_MODES | frozenset({"GUIDED", "READY", "TAKEOFF"})
"""What else may be set: modes that need no pilot's sticks and no set-points to stay where they are."""


def foreign_command_policy(vehicle: Vehicle) -> ForeignCommandPolicy:
    """The policy of the vehicle's autopilot."""
    return _POLICIES.get(vehicle.autopilot, _UNKNOWN)


def stop_word(vehicle: Vehicle, mode: str) -> str:
    """The guard's word for a mode that stops or brings down a vehicle, or ""."""
    # ArduCopter reads a throttle stick in LOITER; planes circle in it.
    if mode == "LOITER" and vehicle.type not in COPTER_TYPES:  # which read a throttle stick in it
        return "hold"
    return _STOP_MODES.get(mode, "")


def comes_down_by(vehicle: Vehicle) -> str:
    """What the vehicle's present mode does if that brings it down: "return" or "land"; "" if it does not."""
    word = stop_word(vehicle, vehicle.mode_name)
    return word if word in ("return", "land") else ""
