"""The wind as the fleet estimates it: the median of what vehicles say (ArduPilot's WIND, PX4's WIND_COV)."""

import math
import statistics

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import Fields, VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle

FRESH_S = 30.0
MAX_WIND_M_S = 60.0
"""More is no wind anybody flies in."""


class WindEstimator:
    """Newest estimate of each vehicle."""

    def __init__(self, fleet: VehicleRegistry, clock: Clock) -> None:
        """Nobody has said anything."""
        self._clock = clock
        self._heard: dict[int, tuple[float, float, float]] = {}
        """(time, east, north) by vehicle; where the air moves to."""
        fleet.on_message("WIND", self._wind)
        fleet.on_message("WIND_COV", self._wind_cov)

    def estimate(self) -> tuple[float, float] | None:
        """Median (east, north) in m/s of where the air moves to; None when nobody has said for `FRESH_S`."""
        oldest_s = self._clock.now() - FRESH_S
        fresh = [wind for wind in self._heard.values() if wind[0] >= oldest_s]
        if not fresh:
            return None
        return statistics.median(w[1] for w in fresh), statistics.median(w[2] for w in fresh)

    def of(self, vehicle_id: int) -> tuple[float, float] | None:
        """One vehicle's fresh estimate."""
        t_s, east, north = self._heard.get(vehicle_id, (-math.inf, 0.0, 0.0))
        return (east, north) if t_s >= self._clock.now() - FRESH_S else None

    def _wind(self, vehicle: Vehicle, fields: Fields) -> None:
        """ArduPilot: the direction it comes from, and speed; without an estimate 0 m/s, from -180° (4.7: measured)."""
        if not math.isfinite(fields["direction"]) or fields["speed"] == 0.0:
            return
        towards = math.radians(fields["direction"] + 180.0)
        self._take(vehicle, fields["speed"] * math.sin(towards), fields["speed"] * math.cos(towards))

    def _wind_cov(self, vehicle: Vehicle, fields: Fields) -> None:
        """PX4: north and east, where it goes to (EKF2's state)."""
        self._take(vehicle, fields["wind_y"], fields["wind_x"])

    def _take(self, vehicle: Vehicle, east_m_s: float, north_m_s: float) -> None:
        if math.hypot(east_m_s, north_m_s) <= MAX_WIND_M_S:  # False for NaN
            self._heard[vehicle.id] = (self._clock.now(), east_m_s, north_m_s)
