"""How each autopilot keeps what it knows of a transmitter: parameters per channel, and which stick is which."""

from dataclasses import dataclass
from enum import StrEnum

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4


class Stick(StrEnum):
    """The four that fly."""

    THROTTLE = "throttle"
    YAW = "yaw"
    ROLL = "roll"
    PITCH = "pitch"


@dataclass(frozen=True)
class RcParameters:
    """One autopilot's parameters."""

    reversed_param: str
    """With the channel's number for {n}."""
    normal: int
    reverse: int
    maps: dict[Stick, str]
    """The parameter that says which channel a stick is."""
    count_param: str
    """How many channels there are; "" if it is not told."""
    forward_is_high: bool
    """A pitch stick pushed forward makes long pulses where the channel is not reversed."""
    map_needs_reboot: bool


_WORDS = {
    AUTOPILOT_ARDUPILOT: RcParameters(
        "RC{n}_REVERSED",
        0,
        1,
        {stick: f"RCMAP_{stick.name}" for stick in Stick},
        "",
        forward_is_high=False,
        map_needs_reboot=True,
    ),
    AUTOPILOT_PX4: RcParameters(
        "RC{n}_REV",
        1,
        -1,
        {stick: f"RC_MAP_{stick.name}" for stick in Stick},
        "RC_CHAN_CNT",
        forward_is_high=True,
        map_needs_reboot=False,
    ),
}


def rc_parameters(vehicle: Vehicle) -> RcParameters | None:
    """How this vehicle keeps it; None if that is not known."""
    return _WORDS.get(vehicle.autopilot)
