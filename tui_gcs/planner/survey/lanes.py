"""Lanes over cells: parallel passes that see every cell, in an order with short ways between them, shared by time.

Cells and points are (n, 2) ENU metres. Nothing here knows vehicles or obstacles; ways between lanes are taken to be
straight, and are led around obstacles where they are flown.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

ANGLES = 12
"""Directions of lanes that are tried, over half a turn."""
HALF_WIDTH_SHARE = 0.9
"""Half the spacing of lanes as a share of the footprint's radius; the rest lets lanes end before the edge."""
TURN_S = 2.0
"""Time that the turn from one lane into the next costs: predicted ends are then within 5 s of flown ones."""


@dataclass(frozen=True)
class Pass:
    """One straight pass from `begin_m` to `end_m`, (2,) each."""

    begin_m: Floats
    end_m: Floats

    @property
    def length_m(self) -> float:
        """Length of the pass."""
        return float(np.hypot(*(self.end_m - self.begin_m)))


def best_passes(cells_m: Floats, cell_m: float, radius_m: float, n: int, speed_m_s: float) -> list[list[Pass]]:
    """Return the passes of `n` parts, of the direction whose longest part takes the least time."""
    found = [shared(passes_at(cells_m, cell_m, radius_m, math.pi * k / ANGLES), n, speed_m_s) for k in range(ANGLES)]
    return min(found, key=lambda parts: max(time_s(part, speed_m_s) for part in parts))


def passes_at(cells_m: Floats, cell_m: float, radius_m: float, angle_rad: float) -> list[Pass]:
    """Return passes in the direction `angle_rad` that see all cells, one after the other with short ways between."""
    if not len(cells_m):
        return []
    along, across = (
        np.array([math.cos(angle_rad), math.sin(angle_rad)]),
        np.array([-math.sin(angle_rad), math.cos(angle_rad)]),
    )
    u, v = cells_m @ along, cells_m @ across
    low, high = float(v.min()) - cell_m / 2.0, float(v.max()) + cell_m / 2.0
    half_m = HALF_WIDTH_SHARE * radius_m
    lanes = max(1, math.ceil((high - low) / (2.0 * half_m) - 1e-9))
    width_m = (high - low) / lanes
    # A footprint sees this far ahead at the edge of its lane.
    ahead_m = math.sqrt(max(radius_m**2 - (width_m / 2.0) ** 2, 0.0))
    found = []
    lane_of = np.minimum(((v - low) / width_m).astype(int), lanes - 1)
    for lane in range(lanes):
        spans = np.sort(u[lane_of == lane])
        middle = low + (lane + 0.5) * width_m
        for run in np.split(spans, np.flatnonzero(np.diff(spans) > 2.0 * ahead_m + 2.0 * cell_m) + 1):
            if len(run):
                found.append(_pass(float(run[0]), float(run[-1]), ahead_m, middle, along, across))
    return _ordered(found)


def _pass(low: float, high: float, ahead_m: float, middle: float, along: Floats, across: Floats) -> Pass:
    """Return the pass that sees cells from `low` to `high` along a lane, as short as it may be."""
    begin, end = low + ahead_m, high - ahead_m
    if begin > end:
        begin = end = (low + high) / 2.0
    return Pass(begin * along + middle * across, end * along + middle * across)


def _ordered(passes: list[Pass]) -> list[Pass]:
    """Return all passes, each next one beginning nearest to where the one before ends, turned where that is nearer."""
    left, order = list(passes), list[Pass]()
    while left:
        if not order:
            order.append(left.pop(0))
            continue
        here = order[-1].end_m
        ends = np.array([[each.begin_m, each.end_m] for each in left]) - here
        away = np.hypot(ends[..., 0], ends[..., 1])
        k, side = np.unravel_index(int(np.argmin(away)), away.shape)
        each = left.pop(int(k))
        order.append(each if side == 0 else Pass(each.end_m, each.begin_m))
    return order


def time_s(passes: list[Pass], speed_m_s: float) -> float:
    """Return about how long it takes to fly these passes one after the other."""
    total = 0.0
    for k, each in enumerate(passes):
        between_m = float(np.hypot(*(each.begin_m - passes[k - 1].end_m))) if k else 0.0
        total += (each.length_m + between_m) / speed_m_s + (TURN_S if k else 0.0)
    return total


def shared(passes: list[Pass], n: int, speed_m_s: float) -> list[list[Pass]]:
    """Return the passes cut into `n` consecutive parts that take equally long; a pass may be cut anywhere."""
    part_s = time_s(passes, speed_m_s) / n
    parts: list[list[Pass]] = [[]]
    spent_s, here = 0.0, None
    for each in passes:
        way_s = 0.0 if here is None else float(np.hypot(*(each.begin_m - here))) / speed_m_s + TURN_S
        here = each.end_m
        spent_s += way_s if parts[-1] else 0.0
        rest = each
        while len(parts) < n and spent_s + rest.length_m / speed_m_s > part_s + 1e-9:
            share = max(part_s - spent_s, 0.0) * speed_m_s / max(rest.length_m, 1e-9)
            cut = rest.begin_m + min(share, 1.0) * (rest.end_m - rest.begin_m)
            if share > 0.0:
                parts[-1].append(Pass(rest.begin_m, cut))
            rest = Pass(cut, rest.end_m)
            parts.append([])
            spent_s = 0.0
        parts[-1].append(rest)
        spent_s += rest.length_m / speed_m_s
    return parts + [[] for _ in range(n - len(parts))]


def path_of(passes: list[Pass]) -> Floats:
    """Return (k, 2) the corners of a way along the passes."""
    return np.array([point for each in passes for point in (each.begin_m, each.end_m)], dtype=float).reshape(-1, 2)
