"""What each autopilot's logs are called."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4


def log_ending(vehicle: Vehicle) -> str:
    """Ending of a log's file name on this computer."""
    return {AUTOPILOT_ARDUPILOT: "bin", AUTOPILOT_PX4: "ulg"}.get(vehicle.autopilot, "log")
