"""What a vehicle is assumed to be able to, where a plan's time and energy are foretold."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Performance:
    """Speeds and battery of one vehicle.

    Vertical speeds are the defaults of ArduCopter (WPNAV_SPEED_UP, WPNAV_SPEED_DN, LAND_SPEED), which are not above
    PX4's (MPC_Z_V_AUTO_UP, MPC_Z_V_AUTO_DN, MPC_LAND_SPEED); `return_height_m` is ArduCopter's RTL_ALT. Nobody tells a
    station how long a full battery lasts: `endurance_s` is the operator's word.
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
    """A full battery lasts so long, hovering or flying: level flight at these speeds needs no more than hovering, and
    what climbing needs more is left to the reserve."""
    reserve_pct: float = 25.0
    """What shall be left after the last landing."""

    def energy_pct(self, duration_s: float) -> float:
        """What flying so long takes out of a full battery."""
        return 100.0 * duration_s / self.endurance_s

    def problem(self) -> str:
        """What is impossible about it; "" if nothing is."""
        for name, value, most in (
            ("speed", self.speed_m_s, 100.0),
            ("climb", self.climb_m_s, 50.0),
            ("descent", self.descent_m_s, 50.0),
            ("endurance", self.endurance_s, 360_000.0),
        ):
            if not 0.1 <= value <= most:  # NaN, too
                return f"{name}: {value:g}; must be from 0.1 to {most:g}"
        return "" if 0 <= self.reserve_pct <= 100 else f"reserve: {self.reserve_pct:g}; must be from 0 to 100"
