"""Gimbals on servos and cameras on a relay or trigger pin, as both autopilots manage them themselves.

Measured on ArduCopter 4.7-dev and PX4 1.16.1. Angles that a gimbal cannot reach are accepted, and cut to what it can.
Without a gimbal or camera ArduPilot says FAILED, PX4 nothing at all.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sitl.common.states import Result

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter
    from sitl.common.autopilot import Autopilot, Command
    from sitl.px4.multicopter import Px4

DIGICAM_CONTROL, PITCH_YAW, CONFIGURE = 203, 1000, 1001
START_CAPTURE, START_VIDEO, STOP_VIDEO = 2000, 2500, 2501
LEAVE, RELEASE = -1, -3
"""Of CONFIGURE's owners: unchanged; nobody, if it was who asks."""
ROLL_PITCH_LOCKED, YAW_LOCKED, YAW_FROM_NOSE = 12, 16, 32
ARDUPILOT_PITCH_DEG, PX4_PITCH_DEG = (-90.0, 20.0), (-45.0, 45.0)
MAVLINK_GIMBAL = 4
"""MNT_MODE_IN."""
TAKES_PICTURES = 2
ARDUPILOT_CAN, PX4_CAN = 206847, 132530
GIMBAL = 1

Fields = dict[str, Any]


@dataclass
class Payload:
    """Where it points, who points it, what it took."""

    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    yaw_locked: bool = False
    owner: tuple[int, int] = (0, 0)
    """System and component."""
    pictures: int = 0

    def take_over(self, system: int, component: int, asker: tuple[int, int]) -> bool:
        """Who points it from now on; whether that is news."""
        before = self.owner
        if system == RELEASE:
            self.owner = (0, 0) if self.owner == asker else self.owner
        elif system != LEAVE:
            self.owner = (system, component)
        return self.owner != before

    def point(self, p: tuple[float, ...], pitch_deg: tuple[float, float]) -> None:
        """Angles, cut to what it can reach."""
        if math.isfinite(p[0]) and math.isfinite(p[1]):
            self.pitch_deg, self.yaw_deg = min(max(p[0], pitch_deg[0]), pitch_deg[1]), p[1]
            self.yaw_locked = bool(int(p[4]) & YAW_LOCKED) if math.isfinite(p[4]) else False

    def attitude(self, yaw_deg: float, flags: int) -> Fields:
        """GIMBAL_DEVICE_ATTITUDE_STATUS, roll 0."""
        pitch, yaw = math.radians(self.pitch_deg) / 2, math.radians(yaw_deg) / 2
        q = (
            math.cos(pitch) * math.cos(yaw),
            -math.sin(pitch) * math.sin(yaw),
            math.sin(pitch) * math.cos(yaw),
            math.cos(pitch) * math.sin(yaw),
        )
        flags |= ROLL_PITCH_LOCKED | (YAW_LOCKED if self.yaw_locked else 0)
        return {"flags": flags, "q": q, "gimbal_device_id": GIMBAL}


def _manager_status(ap: "Autopilot") -> Fields:
    system, component = ap.stores.payload.owner
    owner = {"primary_control_sysid": system, "primary_control_compid": component}
    return {"time_boot_ms": ap.boot_ms, "flags": ROLL_PITCH_LOCKED, "gimbal_device_id": GIMBAL, **owner}


def _whole(value: float) -> int:
    return int(value) if math.isfinite(value) else LEAVE


# ---------------------------------------------------------------- ArduPilot


def ardupilot_order(ap: "ArduCopter", command: "Command", system: int, component: int) -> Result | None:
    """What becomes of an order for a gimbal or camera; None if it is none."""
    if command.number in (PITCH_YAW, CONFIGURE):
        return _ardupilot_gimbal(ap, command, (system, component))
    if command.number in (START_CAPTURE, DIGICAM_CONTROL):
        return _ardupilot_picture(ap, command)
    return Result.FAILED if command.number in (START_VIDEO, STOP_VIDEO) else None


def _ardupilot_gimbal(ap: "ArduCopter", command: "Command", asker: tuple[int, int]) -> Result:
    """Whoever asks may point it."""
    payload = ap.stores.payload
    if ap.params["MNT1_TYPE"] <= 0:
        return Result.FAILED
    if command.number == PITCH_YAW:
        payload.point(command.p, ARDUPILOT_PITCH_DEG)
    elif payload.take_over(_whole(command.p[0]), _whole(command.p[1]), asker):
        ap.send("GIMBAL_MANAGER_STATUS", **_manager_status(ap))
    return Result.ACCEPTED


def _ardupilot_picture(ap: "ArduCopter", command: "Command") -> Result:
    """Each copy of an order takes another one: its number is not looked at."""
    if ap.params["CAM1_TYPE"] <= 0:
        return Result.FAILED
    if command.number == DIGICAM_CONTROL and command.p[4] != 1:
        return Result.ACCEPTED
    ap.stores.payload.pictures += 1
    ap.send("CAMERA_FEEDBACK", time_usec=ap.boot_ms * 1000, img_idx=ap.stores.payload.pictures)
    return Result.ACCEPTED


def ardupilot_attitude(ap: "ArduCopter") -> Fields | None:
    """Yaw is always counted from the nose."""
    payload = ap.stores.payload
    if ap.params["MNT1_TYPE"] <= 0:
        return None
    nose_deg = math.degrees(float(ap.vehicles.yaw_rad[ap.index]))
    return payload.attitude(payload.yaw_deg - nose_deg * payload.yaw_locked, YAW_FROM_NOSE)


def ardupilot_manager(ap: "ArduCopter") -> Fields | None:
    """GIMBAL_MANAGER_INFORMATION."""
    if ap.params["MNT1_TYPE"] <= 0:
        return None
    return {"time_boot_ms": ap.boot_ms, "cap_flags": ARDUPILOT_CAN, "gimbal_device_id": GIMBAL}


def ardupilot_manager_status(ap: "ArduCopter") -> Fields | None:
    """GIMBAL_MANAGER_STATUS; unasked only when its owner changes."""
    return _manager_status(ap) if ap.params["MNT1_TYPE"] > 0 else None


def ardupilot_camera(ap: "ArduCopter") -> Fields | None:
    """CAMERA_INFORMATION: no names, pictures only."""
    return {"flags": TAKES_PICTURES} if ap.params["CAM1_TYPE"] > 0 else None


# ---------------------------------------------------------------- PX4


def px4_order(ap: "Px4", command: "Command", system: int, component: int) -> Result | None:
    """As above. Nobody there: nobody answers, and the picture by its new name is always UNSUPPORTED."""
    payload = ap.stores.payload
    if command.number == CONFIGURE and _px4_has_gimbal(ap):
        payload.take_over(_whole(command.p[0]), _whole(command.p[1]), (system, component))
        return Result.ACCEPTED
    if command.number == PITCH_YAW and _px4_has_gimbal(ap):
        if payload.owner != (system, component):
            return Result.DENIED
        payload.point(command.p, PX4_PITCH_DEG)
        return Result.ACCEPTED
    if command.number == DIGICAM_CONTROL and ap.params["TRIG_MODE"] > 0:
        if command.p[4] == 1:
            ap.send("CAMERA_IMAGE_CAPTURED", time_boot_ms=ap.boot_ms, camera_id=1, capture_result=1)
        return Result.ACCEPTED
    return None


def px4_is_silent(command: "Command") -> bool:
    """Orders that nobody answers where there is no gimbal and no trigger."""
    return command.number in (CONFIGURE, PITCH_YAW, DIGICAM_CONTROL)


def _px4_has_gimbal(ap: "Px4") -> bool:
    return ap.params["MNT_MODE_IN"] == MAVLINK_GIMBAL


def px4_attitude(ap: "Px4") -> Fields | None:
    """Yaw is from north while it is locked."""
    payload = ap.stores.payload
    return payload.attitude(payload.yaw_deg, 0) if _px4_has_gimbal(ap) else None


def px4_manager(ap: "Px4") -> Fields | None:
    """GIMBAL_MANAGER_INFORMATION."""
    if not _px4_has_gimbal(ap):
        return None
    return {"time_boot_ms": ap.boot_ms, "cap_flags": PX4_CAN, "gimbal_device_id": GIMBAL}


def px4_manager_status(ap: "Px4") -> Fields | None:
    """GIMBAL_MANAGER_STATUS."""
    return _manager_status(ap) if _px4_has_gimbal(ap) else None
