"""Wind and GPS noise. Both come from a seed, and both are exactly zero unless a `WeatherSpec` asks for them."""

from dataclasses import dataclass

import numpy as np

from sitl.physics.quantities import Array

GUST_SHARE, GUST_S = 0.2, 4.0
"""Standard deviation of gusts as a share of the mean wind, and their correlation time."""
TRIM_S = 5.0
"""Time constant with which a position controller learns a steady wind."""
GPS_DRIFT_S = 30.0
HEIGHT_NOISE = 1.5
"""Heights by GPS are worse than horizontal positions by this factor."""


@dataclass(frozen=True)
class WeatherSpec:
    """Wind and GPS noise of a run."""

    wind_m_s: tuple[float, float] = (0.0, 0.0)
    """Velocity of the air toward east and north."""
    gps_noise_m: float = 0.0
    """Standard deviation of horizontal positions; the error wanders over half a minute (GPS_DRIFT_S)."""


class Weather:
    """The wind at each of n vehicles, and the GPS error of each."""

    def __init__(self, spec: WeatherSpec, n: int, seed: int) -> None:
        self.windy = any(spec.wind_m_s)
        self.noisy = spec.gps_noise_m > 0.0
        self.wind_m_s: Array = np.zeros((n, 2))
        self.surprise_m_s: Array = np.zeros((n, 2))
        """(n, 2) part of the wind that a controller has not learned yet."""
        self.gps_error_m: Array = np.zeros((n, 3))
        self._mean_m_s: Array = np.array(spec.wind_m_s, dtype=np.float64)
        self._gust_m_s: Array = np.zeros((n, 2))
        self._learned_m_s: Array = np.zeros((n, 2))
        self._noise_m: Array = spec.gps_noise_m * np.array((1.0, 1.0, HEIGHT_NOISE))
        # A generator of its own: weather must not change the draws of the fleet, nor of the sensors.
        self._rng = np.random.default_rng((seed, 1))
        if self.noisy:
            self.gps_error_m = self._rng.normal(size=(n, 3)) * self._noise_m

    def step(self, dt_s: float) -> None:
        """Advance wind and GPS errors by `dt_s`."""
        if self.windy:
            gust = GUST_SHARE * float(np.hypot(*self._mean_m_s))
            self._gust_m_s = _wander(self._gust_m_s, gust, dt_s / GUST_S, self._rng)
            self.wind_m_s = self._mean_m_s + self._gust_m_s
            self._learned_m_s += (self.wind_m_s - self._learned_m_s) * (dt_s / TRIM_S)
            self.surprise_m_s = self.wind_m_s - self._learned_m_s
        if self.noisy:
            self.gps_error_m = _wander(self.gps_error_m, self._noise_m, dt_s / GPS_DRIFT_S, self._rng)


def _wander(values: Array, sigma: Array | float, share: float, rng: np.random.Generator) -> Array:
    """Return one step of an Ornstein-Uhlenbeck process with the standard deviation `sigma`."""
    keep = float(np.exp(-share))
    moved: Array = values * keep + rng.normal(size=values.shape) * sigma * np.sqrt(1.0 - keep * keep)
    return moved
