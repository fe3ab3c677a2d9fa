"""Where a gimbal reports that it points, and whether that is where it was asked to point."""

import math
from dataclasses import dataclass

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import NAN

UNKNOWN_ANGLES = (NAN, NAN, NAN)
YAW_LOCKED, YAW_FROM_NOSE, YAW_FROM_NORTH = 16, 32, 64
"""GIMBAL_DEVICE_FLAGS. Without the last two, YAW_LOCKED decides what yaw is counted from: so common.xml defines it."""
POINTING_TOLERANCE_DEG = 5.0
"""A gimbal within this of its target points there."""
POINTING_TIMEOUT_S = 4.0
"""How long a gimbal may take to reach its target: slow ones turn at 45°/s."""


@dataclass
class GimbalState:
    """One gimbal as its manager reports it."""

    component: int
    """The component that manages it: the gimbal itself or the autopilot."""
    controlled_by: int | None = None
    """The system id in control; 0 if none is, None if that is not known."""
    angles_deg: tuple[float, float, float] = UNKNOWN_ANGLES
    """Roll, pitch and yaw; NaN if unknown."""
    to_north: bool = False
    """Whether yaw is counted from north, and not from the nose."""
    reported_s: float = -math.inf
    """Station time at which `angles_deg` was received."""

    def on_attitude(self, fields: Fields, now: float) -> None:
        """Take over the angles in a GIMBAL_DEVICE_ATTITUDE_STATUS."""
        self.angles_deg, self.reported_s = angles_deg(fields["q"]), now
        flags = fields["flags"]
        self.to_north = bool(flags & YAW_FROM_NORTH) if flags & (YAW_FROM_NORTH | YAW_FROM_NOSE) else (
            bool(flags & YAW_LOCKED)
        )  # fmt: skip

    def text(self) -> str:
        """Where it points, for the operator."""
        _, pitch, yaw = self.angles_deg
        return f"pitch {pitch:.0f}, yaw {yaw:.0f} from {'north' if self.to_north else 'the nose'}"

    def knows_angles(self) -> bool:
        """Whether all three angles are finite."""
        return all(map(math.isfinite, self.angles_deg))


@dataclass(frozen=True)
class GimbalTarget:
    """Where a gimbal was asked to point."""

    pitch_deg: float
    yaw_deg: float
    to_north: bool

    def is_reached(self, gimbal: GimbalState, heading_deg: float) -> bool:
        """Whether it points there. `heading_deg` is the vehicle's: NaN leaves yaw out where it would be needed."""
        if not gimbal.knows_angles():
            return False
        _, pitch, yaw = gimbal.angles_deg
        if gimbal.to_north != self.to_north:
            yaw += heading_deg if self.to_north else -heading_deg
        off = math.remainder(yaw - self.yaw_deg, 360.0) if math.isfinite(yaw) else 0.0
        return abs(pitch - self.pitch_deg) <= POINTING_TOLERANCE_DEG and abs(off) <= POINTING_TOLERANCE_DEG


def angles_deg(q: tuple[float, ...]) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a quaternion (w, x, y, z); NaN if its length is not near 1."""
    length = math.hypot(*q)
    if not (math.isfinite(length) and 0.5 < length < 2.0):
        return UNKNOWN_ANGLES
    w, x, y, z = (value / length for value in q)
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)
