"""COMMAND_LONG and COMMAND_INT in one form."""

from typing import NamedTuple

from sitl.links.wire import ReceivedFrame


class Command(NamedTuple):
    """A command and the component that sent it, which gets the acknowledgement."""

    number: int
    """Number of the command in MAV_CMD."""
    p: tuple[float, float, float, float, float, float, float]
    """param1 to param7. In a COMMAND_INT the fifth and sixth are x and y in 1e-7 degrees."""
    frame: int | None
    """MAV_FRAME of a COMMAND_INT; None in a COMMAND_LONG."""
    system: int
    component: int


def command_of(received: ReceivedFrame) -> Command:
    """Return the command in a COMMAND_LONG or COMMAND_INT."""
    f = received.fields
    if received.name == "COMMAND_INT":
        last, frame = (f["x"], f["y"], f["z"]), f["frame"]
    else:
        last, frame = (f["param5"], f["param6"], f["param7"]), None
    p = (f["param1"], f["param2"], f["param3"], f["param4"], *last)
    return Command(f["command"], p, frame, received.system, received.component)
