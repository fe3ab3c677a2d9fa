"""How each autopilot stores the calibration of a transmitter: parameters per channel, and which stick is which."""

from dataclasses import dataclass
from enum import StrEnum

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4


class Stick(StrEnum):
    """The four sticks that fly."""

    THROTTLE = "throttle"
    YAW = "yaw"
    ROLL = "roll"
    PITCH = "pitch"


@dataclass(frozen=True)
class RcParameters:
    """The parameters of one autopilot."""

    reversed_param: str
    """Name with {n} for the channel's number."""
    normal: int
    reverse: int
    maps: dict[Stick, str]
    """The parameter that holds the channel of each stick."""
    count_param: str
    """The parameter with the number of channels; "" if there is none."""
    forward_is_high: bool
    """A pitch stick pushed forward makes long pulses where the channel is not reversed."""
    map_needs_reboot: bool


_PARAMETERS = {
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
    """The parameters of this vehicle; None if they are not known."""
    return _PARAMETERS.get(vehicle.autopilot)
