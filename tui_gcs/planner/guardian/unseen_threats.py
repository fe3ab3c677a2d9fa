"""A map of where round a zone intruders may be that no sensor has seen yet.

Lines run inwards to the zone's edge from all sides. What a vehicle has looked at is empty. Empty cells move inwards as
fast as intruders do, and new unseen cells enter from outside. So a hole in the ring shows as what may have come through
it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

LINES = 32
BIN_M = 2.0
GROUP = 6
"""Bins in one group: one possible intruder stands in the middle of each group."""
GROUPS = 10
DEPTH = GROUP * GROUPS
"""Bins per line: 120 m, farther than a vehicle on the ring sees."""
NORMALS_AT_M = 20.0
"""Lines are normal to the zone's outline at this distance, so that corners get their share of lines."""
MIN_WEIGHT = 0.05
"""Groups with a smaller unseen share are left out."""


@dataclass(frozen=True)
class Threats:
    """Where h unseen intruders might be."""

    xy_m: Floats
    """(h, 2)"""
    velocity_m_s: Floats
    """(h, 2)"""
    enters_s: Floats
    """(h,) time until they would be in the zone."""
    weight: Floats
    """(h,) share of the group that no vehicle has looked at."""


class UnseenThreatMap:
    """The lines of one zone. Their cells are the planner's state and are passed in; the rest is constant."""

    def __init__(self, zone: shapely.Polygon, sees_m: float, speed_m_s: float) -> None:
        """`sees_m` is the vehicles' sensor range, `speed_m_s` the expected speed of intruders."""
        outline = zone.buffer(NORMALS_AT_M, quad_segs=16).exterior
        points = shapely.line_interpolate_point(outline, (np.arange(LINES) + 0.5) / LINES, normalized=True)
        ways = shapely.get_coordinates(shapely.shortest_line(points, zone)).reshape(LINES, 2, 2)
        self._outwards = (ways[:, 0] - ways[:, 1]) / np.hypot(*(ways[:, 0] - ways[:, 1]).T)[:, None]
        depth = BIN_M * (np.arange(DEPTH) + 0.5)
        self._cells_m = ways[:, 1, None] + depth[:, None] * self._outwards[:, None]
        middles = depth.reshape(GROUPS, GROUP).mean(axis=1)
        self._threats_m = ways[:, 1, None] + middles[:, None] * self._outwards[:, None]
        self._enters_s = np.broadcast_to(middles / speed_m_s, (LINES, GROUPS))
        self._velocity = np.broadcast_to(-speed_m_s * self._outwards[:, None], (LINES, GROUPS, 2))
        self._sees_m, self._speed_m_s = sees_m, speed_m_s

    def none_seen(self) -> bytes:
        """Return cells that are all unseen."""
        return bytes(np.ones(LINES * DEPTH, dtype=np.uint8))

    def moved(self, cells: bytes, left_m: float, since_s: float) -> tuple[bytes, float]:
        """Return the cells after `since_s`, and the remaining way of less than a bin."""
        bins, left_m = divmod(left_m + self._speed_m_s * since_s, BIN_M)
        shift = min(int(bins), DEPTH)
        grid = np.frombuffer(cells, dtype=np.uint8).reshape(LINES, DEPTH)
        # What enters from outside has not been seen.
        entered = np.ones((LINES, shift), dtype=np.uint8)
        return np.concatenate([grid[:, shift:], entered], axis=1).tobytes(), left_m

    def looked_at(self, cells: bytes, vehicles_m: Floats) -> bytes:
        """Return the cells without what vehicles at (n, 2) see."""
        grid = np.frombuffer(cells, dtype=np.uint8).reshape(LINES, DEPTH).copy()
        for x, y in vehicles_m.tolist():
            grid[(self._cells_m[..., 0] - x) ** 2 + (self._cells_m[..., 1] - y) ** 2 <= self._sees_m**2] = 0
        return grid.tobytes()

    def threats(self, cells: bytes) -> Threats:
        """Return the intruders that may be in unseen cells."""
        grid = np.frombuffer(cells, dtype=np.uint8).reshape(LINES, GROUPS, GROUP)
        weight = grid.mean(axis=2)
        there = weight > MIN_WEIGHT
        return Threats(self._threats_m[there], self._velocity[there], self._enters_s[there], weight[there])
