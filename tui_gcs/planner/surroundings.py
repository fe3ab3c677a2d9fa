"""What a round holds beside zones, at one time: the density map and moving obstacles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tui_gcs.core.scenario.model import DensityPeak, MovingObstacle


@dataclass(frozen=True)
class Obstacles:
    """Moving discs as struct of arrays of k obstacles, in the order of the scenario."""

    position_m: NDArray[np.float64]
    """(k, 2) ENU centres."""
    velocity_m_s: NDArray[np.float64]
    """(k, 2) of the centres; each turns at the corners of its way."""
    radius_m: NDArray[np.float64]


def obstacles_at(obstacles: Sequence[MovingObstacle], t_s: float) -> Obstacles:
    """Return where the obstacles are at `t_s`."""
    moments = [obstacle.loop.at(t_s) for obstacle in obstacles]
    return Obstacles(
        np.array([position for position, _ in moments], dtype=float).reshape(-1, 2),
        np.array([velocity for _, velocity in moments], dtype=float).reshape(-1, 2),
        np.array([obstacle.radius_m for obstacle in obstacles], dtype=float),
    )


def density_at(peaks: Sequence[DensityPeak], xy_m: ArrayLike, t_s: float) -> NDArray[np.float64]:
    """Return (k,) the importance of places (k, 2) at `t_s`: the sum of the peaks, or 1 everywhere without any."""
    points = np.asarray(xy_m, dtype=float).reshape(-1, 2)
    if not peaks:
        return np.ones(len(points))
    total = np.zeros(len(points))
    for peak in peaks:
        away_m = points - peak.loop.at(t_s)[0]
        total += peak.weight * np.exp(-0.5 * (away_m**2).sum(axis=1) / peak.sigma_m**2)
    return total
