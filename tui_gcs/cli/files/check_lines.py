"""What `tui-gcs check` tells: one line for each finding."""

from dataclasses import dataclass

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

NOTE, CAUTION, ERROR = "note", "caution", "ERROR"
WORDS = (NOTE, CAUTION, ERROR)
"""By `missions.findings.Level`."""
AUTOPILOTS = {"ardupilot": AUTOPILOT_ARDUPILOT, "px4": AUTOPILOT_PX4}


@dataclass(frozen=True)
class Line:
    """One finding as it is told."""

    level: str
    where: str
    text: str
