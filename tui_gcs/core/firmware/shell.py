"""Which autopilots have a command line that can be reached by SERIAL_CONTROL, and how it looks."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_PX4

# On ArduPilot 100 is SERIAL0, that is, our own link, which is dead at once and for good (measured).
DEVICE = 10
"""SERIAL_CONTROL_DEV_SHELL, the only device that is ever opened."""
PROMPTS = (b"pxh> ", b"nsh> ")
"""What ends an answer, in simulation and on real boards."""
ERASE_LINE = b"\x1b[K"
"""The shell sends it before each prompt; it means nothing where lines are drawn by others."""


def why_no_shell(vehicle: Vehicle) -> str:
    """Why this vehicle has no command line, or ""."""
    return "" if vehicle.autopilot == AUTOPILOT_PX4 else "this autopilot has no shell"
