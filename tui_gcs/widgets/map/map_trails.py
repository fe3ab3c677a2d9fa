"""Trails: where vehicles have been in the last minute."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.protocol.common import VehicleRow
from tui_gcs.widgets.fleet.severity_levels import on_ground

TRAIL_S = 60.0
TRAIL_STEP_S = 1.0


class Trails:
    """Positions of airborne vehicles, one a second, for a minute."""

    def __init__(self) -> None:
        self._points: dict[int, deque[tuple[float, float, float]]] = {}
        self._together: NDArray[np.float64] | None = None
        """All points in one array, until one comes or goes: the map is drawn more often than that."""

    def update(self, t_s: float, rows: Sequence[VehicleRow]) -> None:
        """Add the positions of a newer frame; a frame from before the last one (replay, restart) starts over."""
        for row in rows:
            x_m, y_m, _ = row.position_m
            trail = self._points.setdefault(row.id, deque())
            # A replay can go back in time, and a restarted station counts from 0.
            if trail and t_s < trail[-1][0]:
                trail.clear()
                self._together = None
            while trail and t_s - trail[0][0] > TRAIL_S:
                trail.popleft()
                self._together = None
            if on_ground(row) or not (math.isfinite(x_m) and math.isfinite(y_m)):
                continue
            if not trail or t_s - trail[-1][0] >= TRAIL_STEP_S:
                trail.append((t_s, x_m, y_m))
                self._together = None
        for gone in self._points.keys() - {row.id for row in rows}:
            del self._points[gone]
            self._together = None

    def points_m(self) -> NDArray[np.float64]:
        """Return the points of all trails, (n, 2) ENU metres."""
        if self._together is None:
            points = [point for trail in self._points.values() for point in trail]
            self._together = np.array(points, dtype=np.float64).reshape(-1, 3)[:, 1:]
        return self._together
