"""What a gimbal tells of where it points, and whether that is what was asked of it.

An ACK is not that: a real ArduPilot accepts 80° up of a gimbal that ends at 20° (measured). Neither sends its gimbal's
angles unasked at a useful rate: they are asked for.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import NAN

UNKNOWN_ANGLES = (NAN, NAN, NAN)
YAW_LOCKED, YAW_FROM_NOSE, YAW_FROM_NORTH = 16, 32, 64
"""GIMBAL_DEVICE_FLAGS; with neither of the last two the first decides, so the message's own definition."""
NEAR_DEG = 5.0
"""As near as this it points there."""
AIM_S = 4.0
"""So long it may take to get there: slow ones turn with 45°/s."""


@dataclass
class Gimbal:
    """One gimbal, as its manager tells of it."""

    component: int
    """Who manages it: itself or the autopilot."""
    controlled_by: int | None = None
    """System id in control; 0 is nobody, None not known."""
    angles_deg: tuple[float, float, float] = UNKNOWN_ANGLES
    """Roll, pitch, yaw; NaN if unknown."""
    to_north: bool = False
    """Yaw is counted from north, not from the nose."""
    told_s: float = -math.inf
    """When it told that, station time."""

    def hear(self, fields: Fields, now: float) -> None:
        """GIMBAL_DEVICE_ATTITUDE_STATUS."""
        self.angles_deg, self.told_s = angles_deg(fields["q"]), now
        flags = fields["flags"]
        self.to_north = bool(flags & YAW_FROM_NORTH) if flags & (YAW_FROM_NORTH | YAW_FROM_NOSE) else (
            bool(flags & YAW_LOCKED)
        )  # fmt: skip

    def words(self) -> str:
        """Where it points."""
        _, pitch, yaw = self.angles_deg
        return f"pitch {pitch:.0f}, yaw {yaw:.0f} from {'north' if self.to_north else 'the nose'}"

    def knows_angles(self) -> bool:
        """Whether they are numbers."""
        return all(map(math.isfinite, self.angles_deg))


@dataclass(frozen=True)
class Aim:
    """Where a gimbal was asked to point."""

    pitch_deg: float
    yaw_deg: float
    to_north: bool

    def is_reached(self, gimbal: Gimbal, heading_deg: float) -> bool:
        """Whether it points there. `heading_deg` is the vehicle's: NaN leaves yaw out where it would be needed."""
        if not gimbal.knows_angles():
            return False
        _, pitch, yaw = gimbal.angles_deg
        if gimbal.to_north != self.to_north:
            yaw += heading_deg if self.to_north else -heading_deg
        off = math.remainder(yaw - self.yaw_deg, 360.0) if math.isfinite(yaw) else 0.0
        return abs(pitch - self.pitch_deg) <= NEAR_DEG and abs(off) <= NEAR_DEG


def angles_deg(q: tuple[float, ...]) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a quaternion (w, x, y, z); NaN if it is none."""
    length = math.hypot(*q)
    if not (math.isfinite(length) and 0.5 < length < 2.0):
        return UNKNOWN_ANGLES
    w, x, y, z = (value / length for value in q)
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)
