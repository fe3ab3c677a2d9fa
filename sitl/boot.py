"""What a vehicle says and can do between power-on and readiness, in the order measured on ArduCopter."""

from sitl.modes import Stage

BOOT_TEXT = (b"\n\nInit ArduCopter V4.7.0-dev (cef8bcef)\n\nFree RAM: 0\n", b"0 ", b"Init Gyro", b"*", b"\n")
"""Plain-text datagrams at power-on: not MAVLink."""

BOOT_STEPS: tuple[tuple[float, Stage, tuple[str, ...]], ...] = (
    (0.10, Stage.BEATING, ()),
    (0.30, Stage.READY, ("ArduPilot Ready", "AHRS: DCM active")),
    (0.40, Stage.EKF_ACTIVE, ("EKF3 IMU0 initialised", "AHRS: EKF3 active")),
    (0.50, Stage.EKF_ALIGNED, ("EKF3 IMU0 tilt alignment complete",)),
    (0.60, Stage.GPS_FOUND, ("GPS 1: detected u-blox",)),
    (0.65, Stage.GPS_FIX, ()),
    (0.75, Stage.HOME_SET, ("EKF3 IMU0 origin set",)),
    (0.85, Stage.PREARM_OK, ()),
    (0.95, Stage.POSITION_OK, ("EKF3 IMU0 is using GPS",)),
    (1.00, Stage.ALL_OK, ()),
)
"""Share of the boot time (really 42.5 s), stage, status texts."""

NOT_BOOTED = (
    "Hardware safety switch",
    "Gyros not healthy",
    "EKF attitude is bad",
    "Compass not healthy",
    "AHRS: EKF3 not started",
    "Battery 1 unhealthy",
)
"""Why it cannot be armed before 'ArduPilot Ready'."""
