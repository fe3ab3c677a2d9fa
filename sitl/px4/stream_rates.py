"""Rates in Hz at which PX4 sends messages over its GCS link without any request."""

_SLOW: dict[str, float] = {
    "HEARTBEAT": 1,
    "SYS_STATUS": 1,
    "ALTITUDE": 1,
    "EXTENDED_SYS_STATE": 1,
    "MISSION_CURRENT": 1,
    "LINK_NODE_STATUS": 1,
    "OPEN_DRONE_ID_LOCATION": 1,
    "OPEN_DRONE_ID_SYSTEM": 1,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": 1,
    "GIMBAL_MANAGER_STATUS": 0.5,
    "POSITION_TARGET_GLOBAL_INT": 1,
    "ORBIT_EXECUTION_STATUS": 2,
    "HOME_POSITION": 0.5,
    "BATTERY_STATUS": 0.5,
    "CURRENT_MODE": 0.5,
    "ESTIMATOR_STATUS": 0.5,
    "TIME_ESTIMATE_TO_TARGET": 0.5,
    "CURRENT_EVENT_SEQUENCE": 1 / 3,
    "VIBRATION": 0.1,
    "PING": 0.1,
}
NORMAL_HZ: dict[str, float] = {
    **_SLOW,
    "ATTITUDE": 15,
    "GLOBAL_POSITION_INT": 5,
    "VFR_HUD": 4,
    "GPS_RAW_INT": 1,
    "LOCAL_POSITION_NED": 1,
    "POSITION_TARGET_LOCAL_NED": 1.5,
}
"""Rates over a real vehicle's telemetry radio."""
SITL_HZ: dict[str, float] = {
    **_SLOW,
    "POSITION_TARGET_LOCAL_NED": 50,
    "SERVO_OUTPUT_RAW": 50,
    "ATTITUDE_TARGET": 50,
    "ATTITUDE_QUATERNION": 50,
    "ATTITUDE": 50,
    "LOCAL_POSITION_NED": 50,
    "GLOBAL_POSITION_INT": 50,
    "GPS_RAW_INT": 5,
    "VFR_HUD": 4,
}
"""Rates that the start script of PX4's SITL sets (measured)."""
BACK_TO_HZ: dict[str, float] = {"ATTITUDE": 15, "GLOBAL_POSITION_INT": 5, "LOCAL_POSITION_NED": 1}
"""Rates that interval 0 returns to: those of the link's mode, not those of the start script."""
