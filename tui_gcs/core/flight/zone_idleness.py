"""Idleness of a team's zone: what its vehicles have seen of it, and for how long every place was not seen."""

import math
from collections import deque

import numpy as np

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, sweep_bound_s
from tui_gcs.core.geometry.zones import Shape, area_m2
from tui_gcs.core.scenario.model import Scenario

WORST_OVER_S = 60
"""The live worst idleness is the largest of the last minute."""


class ZoneIdleness:
    """Idleness of one zone since its round began."""

    def __init__(self, shape: Shape, scenario: Scenario) -> None:
        self._grid = IdlenessGrid(shape, scenario.footprint_radius_m)
        self._zone_m2 = area_m2(shape)
        self._speed_m_s, self._radius_m = scenario.limits.speed_m_s, scenario.footprint_radius_m
        self._worst: deque[tuple[float, float]] = deque(maxlen=WORST_OVER_S)
        """(time, largest idleness then), one a second, since every cell was seen."""
        self.average_s = math.nan

    def update(self, now: float, places_m: list[tuple[float, float]]) -> None:
        """Mark what vehicles see from these places now; without any, every place waits on."""
        if places_m:
            self._grid.update(now, np.array(places_m))
        if self._grid.coverage >= 1.0 and (not self._worst or now - self._worst[-1][0] >= 1.0):
            self._worst.append((now, self._grid.worst_now_s(now)))
            self.average_s = self._grid.average_now_s(now)

    @property
    def coverage(self) -> float:
        """Share of the zone's cells seen so far, 0 to 1."""
        return self._grid.coverage

    @property
    def worst_s(self) -> float:
        """Largest idleness of the last minute; NaN before every cell was seen."""
        return max((value for _, value in self._worst), default=math.nan)

    def bound_s(self, vehicles: int) -> float:
        """Smallest worst idleness that so many vehicles could reach."""
        return sweep_bound_s(self._zone_m2, max(vehicles, 1), self._speed_m_s, self._radius_m)
