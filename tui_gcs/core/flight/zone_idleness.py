"""Idleness of a team's zone: what its vehicles have seen of it, and for how long every place was not seen."""

import math
from collections import deque
from collections.abc import Mapping

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, PositionInterpolator
from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.core.protocol.planning import cells_of, sweep_of_task

WORST_OVER_S = 60
"""The live worst idleness is the largest of the last minute."""
FEW_UNSEEN = 0.01
"""So small a share of the cells that is still unseen does not hide the figures of the others."""
STALLED_S = 60.0
"""After this time without a new cell a few unseen ones will stay so; they count from the beginning."""


class ZoneIdleness:
    """Idleness of one zone since its round began."""

    def __init__(self, task: PlannerTask) -> None:
        self.cells = cells_of(task)
        self._grid = IdlenessGrid(self.cells, task.footprint_radius_m)
        self._fill = PositionInterpolator()
        self._task = task
        self._first_s = math.nan
        self._worst: deque[tuple[float, float]] = deque(maxlen=WORST_OVER_S)
        """(time, largest idleness then), one a second, since every cell was seen."""
        self.average_s = math.nan

    def update(self, now: float, places_m: Mapping[int, tuple[float, float]]) -> None:
        """Mark what vehicles see from these places (by vehicle) now; without any, every place waits on."""
        if places_m and math.isnan(self._first_s):
            self._first_s = now
        for t_s, xy_m in self._fill.take(now, places_m):
            self._grid.update(t_s, xy_m)
        if self._is_seen(now) and (not self._worst or now - self._worst[-1][0] >= 1.0):
            never_s = now - self._first_s
            self._worst.append((now, self._grid.worst_now_s(now, never_s)))
            self.average_s = self._grid.average_now_s(now, never_s)

    def _is_seen(self, now: float) -> bool:
        """Whether every cell was seen, or all but a few that will stay unseen."""
        few = self._grid.cells > 0 and self._grid.unseen <= FEW_UNSEEN * self._grid.cells
        return few and (self._grid.unseen == 0 or now - self._grid.new_cell_t >= STALLED_S)

    @property
    def coverage(self) -> float:
        """Share of the zone's cells seen so far, 0 to 1."""
        return self._grid.coverage

    @property
    def worst_s(self) -> float:
        """Largest idleness of the last minute; NaN before every cell was seen."""
        return max((value for _, value in self._worst), default=math.nan)

    def ideal_s(self, vehicles: int) -> float:
        """Worst idleness of so many vehicles without overlap and turns."""
        return self.cells.ideal_s(*sweep_of_task(self._task, max(vehicles, 1)))

    def bound_s(self, vehicles: int) -> float:
        """Worst idleness that no plan of so many vehicles beats."""
        return self.cells.bound_s(*sweep_of_task(self._task, max(vehicles, 1)))
