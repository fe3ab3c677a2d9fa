"""Tours of parallel lanes, up one and down the next (boustrophedon), for zones of any shape and size.

Lanes are cut where cells are missing, at holes and dents. Pieces of neighbouring lanes that lie side by side form a
block, which is flown whole; blocks follow each other by the shortest way.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

DIRECTIONS = 12
"""Directions of lanes that are compared."""
LANE_SHARE = 0.98
"""Lanes are at most so many footprint diameters apart: cells at the edges of two lanes must be seen by one of them."""
CUT_GAP = 1.0
"""A lane is cut where cells are missing over more than so many footprint radii."""
TURN_M = 30.0
"""Way that a turn costs beyond its length, roughly: it is flown at half the speed."""


@dataclass
class _Block:
    """Pieces of neighbouring lanes, from left to right: (x, low y, high y)."""

    pieces: list[tuple[float, float, float]] = field(default_factory=list)
    lane: int = 0
    """The lane of the last piece."""

    def path(self, *, backward: bool, downward: bool) -> list[tuple[float, float]]:
        """Return the block's corners, flown from its first lane or from its last one, which is begun up or down."""
        points: list[tuple[float, float]] = []
        for i, (x, low, high) in enumerate(reversed(self.pieces) if backward else self.pieces):
            ends = [(x, low), (x, high)]
            points += ends[::-1] if (i % 2 == 0) == downward else ends
        return points


def lane_tour(cells_m: Floats, radius_m: float, angle_rad: float) -> Floats:
    """Return a closed polyline along lanes in this direction, from which `radius_m` sees all cells (n, 2)."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    turn = np.array([[cos, -sin], [sin, cos]])  # lanes run along y
    return np.asarray(_ordered(_blocks(cells_m @ turn, radius_m)) @ turn.T)


def best_lane_tours(cells_m: Floats, radius_m: float, count: int) -> list[Floats]:
    """Return the `count` shortest lane tours of all directions; turns count."""
    tours = [lane_tour(cells_m, radius_m, math.pi * i / DIRECTIONS) for i in range(DIRECTIONS)]
    return sorted(tours, key=_length_m)[:count]


def _length_m(path_m: Floats) -> float:
    legs = np.diff(path_m, axis=0, append=path_m[:1])
    return float(np.hypot(legs[:, 0], legs[:, 1]).sum()) + TURN_M * len(path_m) / 2.0


def _blocks(cells: Floats, radius_m: float) -> list[_Block]:
    """Return the blocks of lanes along y that see all cells."""
    x, y = cells.T
    left, width = float(x.min()), float(np.ptp(x))
    count = max(1, math.ceil(width / (2.0 * LANE_SHARE * radius_m)))
    wide = max(width / count, 1e-6)
    # Cells as far from the lane as its half width are seen from this far before the lane's end.
    ahead_m = math.sqrt(max(radius_m**2 - (wide / 2.0) ** 2, 0.0))
    lane = np.clip(((x - left) / wide).astype(int), 0, count - 1)
    blocks: list[_Block] = []
    for i in range(count):
        open_ = [block for block in blocks if block.lane == i - 1]
        for low, high in _runs(np.sort(y[lane == i]), CUT_GAP * radius_m):
            middle = (low + high) / 2.0
            piece = (left + (i + 0.5) * wide, min(low + ahead_m, middle), max(high - ahead_m, middle))
            beside = max(open_, key=lambda block: _overlap_m(block, low, high), default=None)
            if beside is None or _overlap_m(beside, low, high) <= 0.0:
                beside = _Block()
                blocks.append(beside)
            else:
                open_.remove(beside)
            beside.pieces.append(piece)
            beside.lane = i
    return blocks


def _runs(y: Floats, gap_m: float) -> list[tuple[float, float]]:
    """Return (lowest, highest) of each run of sorted values without gaps."""
    if not len(y):
        return []
    cuts = np.flatnonzero(np.diff(y) > gap_m)
    begins, ends = np.append(0, cuts + 1), np.append(cuts, len(y) - 1)
    return [(float(y[a]), float(y[b])) for a, b in zip(begins, ends, strict=True)]


def _overlap_m(block: _Block, low: float, high: float) -> float:
    _, begin, end = block.pieces[-1]
    return min(high, end) - max(low, begin) + 1.0


def _ordered(blocks: list[_Block]) -> Floats:
    """Return the corners of all blocks, each after the nearest one that is left."""
    path, left = blocks[0].path(backward=False, downward=False), blocks[1:]
    while left:
        here, best = path[-1], None
        for block in left:
            for backward in (False, True):
                for downward in (False, True):
                    way = block.path(backward=backward, downward=downward)
                    if best is None or math.dist(here, way[0]) < best[0]:
                        best = (math.dist(here, way[0]), block, way)
        if best is None:
            break
        left.remove(best[1])
        path += best[2]
    return np.array(path)
