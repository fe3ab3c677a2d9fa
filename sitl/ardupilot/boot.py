"""ArduCopter's boot: what is sent, reached and possible between power-on and readiness, in the order measured."""

from sitl.common.autopilot import BootStep
from sitl.common.states import Stage

BOOT_TEXT = (b"\n\nInit ArduCopter V4.7.0-dev (cef8bcef)\n\nFree RAM: 0\n", b"0 ", b"Init Gyro", b"*", b"\n")
"""Plain-text datagrams at power-on, which are not MAVLink."""

BOOT: tuple[BootStep, ...] = (
    BootStep(0.10, Stage.BEATING),
    BootStep(0.30, Stage.READY, ("ArduPilot Ready", "AHRS: DCM active")),
    BootStep(0.40, Stage.EKF_ACTIVE, ("EKF3 IMU0 initialised", "AHRS: EKF3 active")),
    BootStep(0.50, Stage.EKF_ALIGNED, ("EKF3 IMU0 tilt alignment complete",)),
    BootStep(0.60, Stage.GPS_FOUND, ("GPS 1: detected u-blox",)),
    BootStep(0.65, Stage.GPS_FIX),
    BootStep(0.75, Stage.HOME_SET, ("EKF3 IMU0 origin set",)),
    BootStep(0.85, Stage.PREARM_OK),
    BootStep(0.95, Stage.POSITION_OK, ("EKF3 IMU0 is using GPS",)),
    BootStep(1.00, Stage.ALL_OK),
)
"""A real ArduCopter takes 42.5 s for these steps (docs/autopilots.md "Boot, arming, take-off")."""

NOT_BOOTED = (
    "Hardware safety switch",
    "Gyros not healthy",
    "EKF attitude is bad",
    "Compass not healthy",
    "AHRS: EKF3 not started",
    "Battery 1 unhealthy",
)
"""Arming checks that fail before 'ArduPilot Ready'."""
