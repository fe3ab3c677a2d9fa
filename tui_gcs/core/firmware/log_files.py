"""Where each autopilot keeps its logs, and what they are called."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4


def log_ending(vehicle: Vehicle) -> str:
    """Ending of a log's file name on this computer."""
    return {AUTOPILOT_ARDUPILOT: "bin", AUTOPILOT_PX4: "ulg"}.get(vehicle.autopilot, "log")


def log_folders(vehicle: Vehicle) -> tuple[str, ...]:
    """Directories with one directory of logs a day, to be read by FTP; () if there are none.

    PX4 has one on a computer and another on a board. ArduPilot serves its logs by FTP, too, at a third of the speed of
    LOG_DATA (docs/autopilots.md).
    """
    return ("/log", "/fs/microsd/log") if vehicle.autopilot == AUTOPILOT_PX4 else ()
