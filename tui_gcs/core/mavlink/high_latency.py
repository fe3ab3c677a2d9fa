"""HIGH_LATENCY2: the fields that common.xml leaves to autopilots: half a mode, and whether they are armed."""

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4, FLAG_ARMED


def mode_number(autopilot: int, custom_mode: int) -> int:
    """Return the custom_mode of a heartbeat. PX4 sends its upper half (custom_mode_hl of px4_custom_mode.h)."""
    return custom_mode << 16 if autopilot == AUTOPILOT_PX4 else custom_mode


def is_armed(autopilot: int, custom0: int) -> bool | None:
    """Return whether it is armed.

    ArduPilot's base_mode is in `custom0`, a signed byte (GCS_Common.cpp); None for others.
    """
    return bool(custom0 & FLAG_ARMED) if autopilot == AUTOPILOT_ARDUPILOT else None
