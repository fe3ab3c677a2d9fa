"""The lines that `tui-gcs check` prints, one for each finding."""

from dataclasses import dataclass

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

NOTE, CAUTION, ERROR = "note", "caution", "ERROR"
WORDS = (NOTE, CAUTION, ERROR)
"""The printed word for each severity of a finding."""
AUTOPILOTS = {"ardupilot": AUTOPILOT_ARDUPILOT, "px4": AUTOPILOT_PX4}

PREVIEW_S = 10.0
"""Processor time that `--preview` may take, unless it is told otherwise."""


@dataclass(frozen=True)
class FindingLine:
    """One line of output: severity, place and text."""

    level: str
    where: str
    text: str
