"""What a vehicle says and can do between power-on and readiness, in the order measured."""

from typing import NamedTuple

from sitl.common.states import Stage


class BootStep(NamedTuple):
    """Share of the boot time, what is reached then, status texts."""

    share: float
    stage: Stage
    texts: tuple[str, ...] = ()


ARDUPILOT_BOOT_TEXT = (b"\n\nInit ArduCopter V4.7.0-dev (cef8bcef)\n\nFree RAM: 0\n", b"0 ", b"Init Gyro", b"*", b"\n")
"""Plain-text datagrams at power-on: not MAVLink."""

ARDUPILOT_BOOT: tuple[BootStep, ...] = (
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
"""Really 42.5 s."""

NOT_BOOTED = (
    "Hardware safety switch",
    "Gyros not healthy",
    "EKF attitude is bad",
    "Compass not healthy",
    "AHRS: EKF3 not started",
    "Battery 1 unhealthy",
)
"""Why it cannot be armed before 'ArduPilot Ready'."""

PX4_BOOT: tuple[BootStep, ...] = (
    BootStep(0.25, Stage.READY),
    BootStep(0.40, Stage.EKF_ALIGNED),
    BootStep(0.45, Stage.GPS_FIX),
    BootStep(0.80, Stage.HOME_SET),
    BootStep(0.85, Stage.POSITION_OK),
    BootStep(0.90, Stage.ALL_OK),
)
"""Really 6 s."""
