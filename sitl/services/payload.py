"""Gimbals on servos and cameras on a relay or trigger pin, as both autopilots manage them themselves.

Measured on ArduCopter 4.7-dev and PX4 1.16.1. Angles that a gimbal cannot reach are accepted, and limited to what it
can. Without a gimbal or camera ArduPilot answers FAILED, PX4 does not answer at all.
"""

import math
from abc import ABC, abstractmethod
from typing import ClassVar

from sitl.common.command import Command
from sitl.common.outbox import Fields
from sitl.common.platform import Part, Platform
from sitl.common.states import Result

# MAV_CMD (common.xml).
DIGICAM_CONTROL, PITCH_YAW, CONFIGURE = 203, 1000, 1001
START_CAPTURE, START_VIDEO, STOP_VIDEO = 2000, 2500, 2501
LEAVE, RELEASE = -1, -3
"""System ids in CONFIGURE: leave the owner unchanged; release the gimbal if the sender owns it."""
# GIMBAL_MANAGER_FLAGS.
ROLL_PITCH_LOCKED, YAW_LOCKED, YAW_FROM_NOSE = 12, 16, 32
MAVLINK_GIMBAL = 4
"""MNT_MODE_IN of a gimbal that MAVLink controls."""
# CAMERA_CAP_FLAGS_CAPTURE_IMAGE.
TAKES_PICTURES = 2
GIMBAL = 1
"""Value of gimbal_device_id in all messages."""


class Payload(Part, ABC):
    """One gimbal and one camera: where the gimbal points, which component owns it, how many pictures were taken."""

    PITCH_DEG: ClassVar[tuple[float, float]]
    """Lowest and highest pitch of the gimbal."""
    CAPABILITIES: ClassVar[int]
    """GIMBAL_MANAGER_INFORMATION.cap_flags."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._pitch_deg = self._yaw_deg = 0.0
        self._yaw_locked = False
        self._owner = (0, 0)
        """System and component that control the gimbal; zeros without an owner."""

    def _configure(self, command: Command) -> bool:
        """Give the gimbal to another owner; return whether the owner has changed."""
        before, sender = self._owner, (command.system, command.component)
        system, component = _whole(command.p[0]), _whole(command.p[1])
        if system == RELEASE:
            self._owner = (0, 0) if self._owner == sender else self._owner
        elif system != LEAVE:
            # Both autopilots keep them in a byte, and cut off what is above.
            self._owner = (system & 0xFF, component & 0xFF)
        return self._owner != before

    def _point(self, p: tuple[float, ...]) -> None:
        """Turn the gimbal as far as it can."""
        if math.isfinite(p[0]) and math.isfinite(p[1]):
            self._pitch_deg, self._yaw_deg = min(max(p[0], self.PITCH_DEG[0]), self.PITCH_DEG[1]), p[1]
            self._yaw_locked = bool(int(p[4]) & YAW_LOCKED) if math.isfinite(p[4]) else False

    def _device_attitude(self, yaw_deg: float, flags: int) -> Fields:
        pitch, yaw = math.radians(self._pitch_deg) / 2, math.radians(yaw_deg) / 2
        q = (
            math.cos(pitch) * math.cos(yaw),
            -math.sin(pitch) * math.sin(yaw),
            math.sin(pitch) * math.cos(yaw),
            math.cos(pitch) * math.sin(yaw),
        )
        flags |= ROLL_PITCH_LOCKED | (YAW_LOCKED if self._yaw_locked else 0)
        return {"flags": flags, "q": q, "gimbal_device_id": GIMBAL}

    @property
    @abstractmethod
    def _has_gimbal(self) -> bool:
        """Whether the parameters name a gimbal."""

    def status(self) -> Fields | None:
        """Return GIMBAL_MANAGER_STATUS; ArduPilot sends it without a request when the owner changes."""
        if not self._has_gimbal:
            return None
        system, component = self._owner
        owner = {"primary_control_sysid": system, "primary_control_compid": component}
        return {"time_boot_ms": self._clock.boot_ms, "flags": ROLL_PITCH_LOCKED, "gimbal_device_id": GIMBAL, **owner}

    def information(self) -> Fields | None:
        """Return the fields of GIMBAL_MANAGER_INFORMATION."""
        if not self._has_gimbal:
            return None
        return {"time_boot_ms": self._clock.boot_ms, "cap_flags": self.CAPABILITIES, "gimbal_device_id": GIMBAL}


class ArduPilotPayload(Payload):
    """ArduPilot's gimbal (MNT1_TYPE) and camera (CAM1_TYPE)."""

    PITCH_DEG = (-90.0, 20.0)
    CAPABILITIES = 206847

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._pictures = 0

    @property
    def _has_gimbal(self) -> bool:
        return self._params["MNT1_TYPE"] > 0

    @property
    def _has_camera(self) -> bool:
        return self._params["CAM1_TYPE"] > 0

    def execute(self, command: Command) -> Result | None:
        """Carry out a command for gimbal or camera; None for all others."""
        if command.number in (PITCH_YAW, CONFIGURE):
            return self._move_gimbal(command)
        if command.number in (START_CAPTURE, DIGICAM_CONTROL):
            return self._take_picture(command)
        return Result.FAILED if command.number in (START_VIDEO, STOP_VIDEO) else None

    def _move_gimbal(self, command: Command) -> Result:
        # ArduPilot does not look at the owner: any sender may point the gimbal.
        if not self._has_gimbal:
            return Result.FAILED
        if command.number == PITCH_YAW:
            self._point(command.p)
        elif self._configure(command):
            self._outbox.send("GIMBAL_MANAGER_STATUS", **self.status() or {})
        return Result.ACCEPTED

    def _take_picture(self, command: Command) -> Result:
        if not self._has_camera:
            return Result.FAILED
        if command.number == DIGICAM_CONTROL and command.p[4] != 1:
            return Result.ACCEPTED
        # Every copy of a command takes another picture: ArduPilot does not look at the command's sequence number.
        self._pictures += 1
        self._outbox.send("CAMERA_FEEDBACK", time_usec=self._clock.boot_ms * 1000, img_idx=self._pictures)
        return Result.ACCEPTED

    def attitude(self) -> Fields | None:
        """Return GIMBAL_DEVICE_ATTITUDE_STATUS; its yaw always counts from the nose."""
        if not self._has_gimbal:
            return None
        nose_deg = math.degrees(self._body.yaw_rad)
        return self._device_attitude(self._yaw_deg - nose_deg * self._yaw_locked, YAW_FROM_NOSE)

    def camera(self) -> Fields | None:
        """Return CAMERA_INFORMATION: a camera without a name that takes pictures only."""
        return {"flags": TAKES_PICTURES} if self._has_camera else None


class Px4Payload(Payload):
    """PX4's gimbal (MNT_MODE_IN) and camera trigger (TRIG_MODE)."""

    PITCH_DEG = (-45.0, 45.0)
    CAPABILITIES = 132530

    @property
    def _has_gimbal(self) -> bool:
        return self._params["MNT_MODE_IN"] == MAVLINK_GIMBAL

    def execute(self, command: Command) -> Result | None:
        """Carry out a command for gimbal or camera; None for all others, and where the device is missing."""
        if command.number == CONFIGURE and self._has_gimbal:
            self._configure(command)
            return Result.ACCEPTED
        if command.number == PITCH_YAW and self._has_gimbal:
            # PX4 obeys the owner only: a station has to take the gimbal over by CONFIGURE first.
            if self._owner != (command.system, command.component):
                return Result.DENIED
            self._point(command.p)
            return Result.ACCEPTED
        # A picture by the newer IMAGE_START_CAPTURE is always UNSUPPORTED.
        if command.number == DIGICAM_CONTROL and self._params["TRIG_MODE"] > 0:
            if command.p[4] == 1:
                boot_ms = self._clock.boot_ms
                self._outbox.send("CAMERA_IMAGE_CAPTURED", time_boot_ms=boot_ms, camera_id=1, capture_result=1)
            return Result.ACCEPTED
        return None

    @staticmethod
    def is_silent_about(command: Command) -> bool:
        """Return whether PX4 does not answer this command if it has no gimbal and no trigger."""
        return command.number in (CONFIGURE, PITCH_YAW, DIGICAM_CONTROL)

    def attitude(self) -> Fields | None:
        """Return GIMBAL_DEVICE_ATTITUDE_STATUS; its yaw counts from north while it is locked."""
        return self._device_attitude(self._yaw_deg, 0) if self._has_gimbal else None


def _whole(value: float) -> int:
    return int(value) if math.isfinite(value) else LEAVE
