"""Where vehicles have been in the last minute."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.messages import VehicleRow
from tui_gcs.widgets.levels import on_ground

TRAIL_S = 60.0
TRAIL_STEP_S = 1.0


class Trails:
    """Positions of airborne vehicles, one a second, forgotten after a minute."""

    def __init__(self) -> None:
        """No trails."""
        self._points: dict[int, deque[tuple[float, float, float]]] = {}

    def update(self, t_s: float, rows: Sequence[VehicleRow]) -> None:
        """Take the positions of a newer frame; a frame from before the last one starts over (replay, restart)."""
        for row in rows:
            x_m, y_m, _ = row.position_m
            trail = self._points.setdefault(row.id, deque())
            if trail and t_s < trail[-1][0]:
                trail.clear()
            while trail and t_s - trail[0][0] > TRAIL_S:
                trail.popleft()
            if on_ground(row) or not (math.isfinite(x_m) and math.isfinite(y_m)):
                continue
            if not trail or t_s - trail[-1][0] >= TRAIL_STEP_S:
                trail.append((t_s, x_m, y_m))
        for gone in self._points.keys() - {row.id for row in rows}:
            del self._points[gone]

    def points_m(self) -> NDArray[np.float64]:
        """(n, 2) ENU metres of all trails."""
        points = [point[1:] for trail in self._points.values() for point in trail]
        return np.array(points, dtype=np.float64).reshape(-1, 2)
