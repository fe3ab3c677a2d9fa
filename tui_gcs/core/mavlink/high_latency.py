"""What autopilots put into HIGH_LATENCY2 that common.xml leaves to them: half a mode, and whether they are armed."""

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4, FLAG_ARMED


def mode_number(autopilot: int, said: int) -> int:
    """The custom_mode of a heartbeat: PX4 says its upper half (custom_mode_hl of px4_custom_mode.h)."""
    return said << 16 if autopilot == AUTOPILOT_PX4 else said


def is_armed(autopilot: int, custom0: int) -> bool | None:
    """ArduPilot's base_mode is in `custom0`, a signed byte (GCS_Common.cpp). None: another says nothing of it."""
    return bool(custom0 & FLAG_ARMED) if autopilot == AUTOPILOT_ARDUPILOT else None
