"""The wind as the fleet estimates it: the median of the vehicles' estimates (ArduPilot's WIND, PX4's WIND_COV)."""

import math
import statistics

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import Fields, VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle

FRESH_S = 30.0
"""Older estimates are not used."""
MAX_WIND_M_S = 60.0
"""A larger estimate is implausible: no vehicle flies in such wind."""


class WindEstimator:
    """Keeps the newest wind estimate of each vehicle."""

    def __init__(self, fleet: VehicleRegistry, clock: Clock) -> None:
        """Listen to the wind messages of `fleet`."""
        self._clock = clock
        self._heard: dict[int, tuple[float, float, float]] = {}
        """(station time, east, north) by vehicle: the velocity of the air, m/s."""
        fleet.on_message("WIND", self._wind)
        fleet.on_message("WIND_COV", self._wind_cov)

    def estimate(self) -> tuple[float, float] | None:
        """Return the median velocity of the air (east, north), m/s; None without an estimate of the last `FRESH_S`."""
        oldest_s = self._clock.now() - FRESH_S
        fresh = [wind for wind in self._heard.values() if wind[0] >= oldest_s]
        if not fresh:
            return None
        return statistics.median(w[1] for w in fresh), statistics.median(w[2] for w in fresh)

    def of(self, vehicle_id: int) -> tuple[float, float] | None:
        """Return one vehicle's velocity of the air (east, north) in m/s; None if it is not fresh."""
        t_s, east, north = self._heard.get(vehicle_id, (-math.inf, 0.0, 0.0))
        return (east, north) if t_s >= self._clock.now() - FRESH_S else None

    def _wind(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take ArduPilot's WIND: the direction it comes from, and speed.

        Without an estimate ArduPilot 4.7 sends 0 m/s from -180° (measured).
        """
        if not math.isfinite(fields["direction"]) or fields["speed"] == 0.0:
            return
        towards = math.radians(fields["direction"] + 180.0)
        self._take(vehicle, fields["speed"] * math.sin(towards), fields["speed"] * math.cos(towards))

    def _wind_cov(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take PX4's WIND_COV: north and east components of where the air moves (state of EKF2)."""
        self._take(vehicle, fields["wind_y"], fields["wind_x"])

    def _take(self, vehicle: Vehicle, east_m_s: float, north_m_s: float) -> None:
        if math.hypot(east_m_s, north_m_s) <= MAX_WIND_M_S:  # False for NaN
            self._heard[vehicle.id] = (self._clock.now(), east_m_s, north_m_s)
