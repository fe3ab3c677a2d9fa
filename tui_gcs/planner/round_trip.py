"""Short round trips through points (a travelling salesman's, roughly solved): first guesses for zones of any shape.

Points lie on a lattice about two footprints wide, turned and shifted at random; every lattice gives another topology.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Order = NDArray[np.int64]

SPACING = (1.6, 2.3)
"""Of the lattice, in footprint radii."""
INSET = (0.1, 0.7)
"""How far inside the rim the outermost points lie, in footprint radii."""
MOST_POINTS = 250
MOST_SEGMENT = 3
GAIN_M = 1e-6


def round_trips(zone: shapely.Polygon, radius_m: float, count: int, rng: np.random.Generator) -> Iterator[Floats]:
    """At most `count` closed polylines; none where the zone holds fewer than five lattice points."""
    for i in range(count):
        spacing_m = radius_m * rng.uniform(*SPACING)
        turn_rad, shift = rng.uniform(0.0, math.pi), rng.uniform(0.0, 1.0, 2)
        inner = shapely.buffer(zone, -radius_m * rng.uniform(*INSET))
        points = _lattice(zone, spacing_m, turn_rad, shift, hexagonal=i % 2 == 1)
        points = points[shapely.intersects_xy(inner, points[:, 0], points[:, 1])]
        if 5 <= len(points) <= MOST_POINTS:
            yield points[shortened(points)]


def shortened(points: Floats) -> Order:
    """An order to visit the points in and return: nearest neighbour, then 2-opt and or-opt until neither helps."""
    away = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    order = _nearest_first(away)
    while True:
        better = _uncrossed(order, away)
        if better is None:
            better = _moved(order, away)
        if better is None:
            return order
        order = better


def _nearest_first(away: Floats) -> Order:
    order, open_ = [0], np.ones(len(away), dtype=bool)
    for _ in range(len(away) - 1):
        open_[order[-1]] = False
        order.append(int(np.argmin(np.where(open_, away[order[-1]], np.inf))))
    return np.array(order)


def _uncrossed(order: Order, away: Floats) -> Order | None:
    """The best reversal of a stretch (2-opt), None if none is shorter."""
    after = np.roll(order, -1)
    leg = away[order, after]
    gain = leg[:, None] + leg[None] - away[order[:, None], order] - away[after[:, None], after]
    gain = np.triu(gain, 2)
    i, j = divmod(int(np.argmax(gain)), len(order))
    if gain[i, j] < GAIN_M:
        return None
    return np.concatenate([order[: i + 1], order[i + 1 : j + 1][::-1], order[j + 1 :]])


def _moved(order: Order, away: Floats) -> Order | None:
    """The best move of up to three neighbours to elsewhere, either way round (or-opt), None if none is shorter."""
    best_gain, best = GAIN_M, None
    for length in range(1, min(MOST_SEGMENT, len(order) - 3) + 1):
        for first in range(len(order)):
            turned = np.roll(order, -first)
            piece, rest = turned[:length], turned[length:]
            saved = away[rest[-1], piece[0]] + away[piece[-1], rest[0]] - away[rest[-1], rest[0]]
            for way in (piece, piece[::-1]):
                added = away[rest[:-1], way[0]] + away[way[-1], rest[1:]] - away[rest[:-1], rest[1:]]
                k = int(np.argmin(added))
                if saved - added[k] > best_gain:
                    best_gain, best = float(saved - added[k]), np.concatenate([rest[: k + 1], way, rest[k + 1 :]])
    return best


def _lattice(zone: shapely.Polygon, spacing_m: float, turn_rad: float, shift: Floats, *, hexagonal: bool) -> Floats:
    """Lattice points around the zone, some outside it."""
    x0, y0, x1, y1 = zone.bounds
    reach = math.ceil(math.hypot(x1 - x0, y1 - y0) / spacing_m) + 1
    column, row = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    if hexagonal:
        x, y = column + 0.5 * (row % 2), row * math.sqrt(0.75)
    else:
        x, y = column.astype(float), row.astype(float)
    x, y = (x.ravel() + shift[0]) * spacing_m, (y.ravel() + shift[1]) * spacing_m
    cos, sin = math.cos(turn_rad), math.sin(turn_rad)
    return np.stack([(x0 + x1) / 2 + cos * x - sin * y, (y0 + y1) / 2 + sin * x + cos * y], axis=1)
