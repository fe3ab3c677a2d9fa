"""The performance that is assumed of a vehicle when the time and energy of a plan are computed."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Performance:
    """Speeds and battery of one vehicle.

    Vertical speeds are the defaults of ArduCopter (WPNAV_SPEED_UP, WPNAV_SPEED_DN, LAND_SPEED), which are not above
    PX4's (MPC_Z_V_AUTO_UP, MPC_Z_V_AUTO_DN, MPC_LAND_SPEED); `return_height_m` is ArduCopter's RTL_ALT. No message
    reports how long a full battery lasts: the operator sets `endurance_s`.
    """

    speed_m_s: float = 8.0
    accel_m_s2: float = 2.5
    climb_m_s: float = 2.5
    descent_m_s: float = 1.5
    land_m_s: float = 0.5
    land_slow_m: float = 10.0
    """Below this height a landing is slow (LAND_ALT_LOW)."""
    return_height_m: float = 15.0
    """A return climbs to this height at least."""
    endurance_s: float = 1200.0
    """How long a full battery lasts, hovering or flying. Level flight at these speeds needs no more than hovering; what
    climbing needs more is left to the reserve."""
    reserve_pct: float = 25.0
    """The charge that shall be left after the last landing."""

    def energy_pct(self, duration_s: float) -> float:
        """How much of a full battery a flight of this duration takes, percent."""
        return 100.0 * duration_s / self.endurance_s

    def problem(self) -> str:
        """Return what is impossible about the values, or ""."""
        for name, value, most in (
            ("speed", self.speed_m_s, 100.0),
            ("climb", self.climb_m_s, 50.0),
            ("descent", self.descent_m_s, 50.0),
            ("endurance", self.endurance_s, 360_000.0),
        ):
            if not 0.1 <= value <= most:  # NaN, too
                return f"{name}: {value:g}; must be from 0.1 to {most:g}"
        return "" if 0 <= self.reserve_pct <= 100 else f"reserve: {self.reserve_pct:g}; must be from 0 to 100"
