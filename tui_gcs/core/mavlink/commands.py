"""MAV_CMD numbers, frames and masks that every autopilot shares (MAVLink common.xml)."""

# MAV_CMD numbers of common.xml.
CMD_TAKEOFF = 22
CMD_SET_MODE, CMD_CHANGE_SPEED, CMD_DO_REPOSITION = 176, 178, 192
CMD_MISSION_START = 300
CMD_REBOOT = 246
CMD_ARM_DISARM, CMD_RUN_PREARM_CHECKS = 400, 401
CMD_SET_MESSAGE_INTERVAL, CMD_REQUEST_MESSAGE = 511, 512
CUSTOM_MODE_ENABLED = 1
"""MAV_MODE_FLAG: the first parameter of DO_SET_MODE; ArduPilot denies the command without it."""
HEARTBEAT, AUTOPILOT_VERSION, HOME_POSITION, EXTENDED_SYS_STATE = 0, 148, 242, 245
"""Ids of messages that are requested once."""
FRAME_GLOBAL_INT, FRAME_RELATIVE_ALT_INT = 5, 6
"""MAV_FRAME: above mean sea level, and above home. Terrain frames (10, 11) are never sent: without terrain data
ArduPilot sinks."""
POSITION_ONLY, POSITION_AND_VELOCITY, VELOCITY_ONLY, ALL_BUT_YAW = 0xDF8, 0xDC0, 0xDC7, 0xC00
"""SET_POSITION_TARGET type_mask: what is used of x, y, z, vx, vy, vz, afx, afy, afz."""
LANDED_IN_AIR, LANDED_TAKEOFF = 2, 3
"""MAV_LANDED_STATE."""
STATUS_BOOT, STATUS_CRITICAL = 1, 5
"""MAV_STATE: booting; a failsafe is active."""
