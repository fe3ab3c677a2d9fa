"""Where each autopilot keeps its logs, and what they are called."""

from tui_gcs.core.vehicle import Vehicle

_ARDUPILOT, _PX4 = 3, 12
"""MAV_AUTOPILOT."""


def log_ending(vehicle: Vehicle) -> str:
    """Of a log's file name here."""
    return {_ARDUPILOT: "bin", _PX4: "ulg"}.get(vehicle.autopilot, "log")


def log_folders(vehicle: Vehicle) -> tuple[str, ...]:
    """Directories with one directory of logs a day, by FTP: of PX4 on a computer and on a board; () if there are none.

    ArduPilot serves its logs by FTP, too, at a third of the speed of LOG_DATA (ardupilot.md).
    """
    return ("/log", "/fs/microsd/log") if vehicle.autopilot == _PX4 else ()
