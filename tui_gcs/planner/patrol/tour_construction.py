"""Constructs first tours for zones of any shape: short round trips through lattice points (travelling salesman).

Points lie on rows and columns along the zone's sides, or on a lattice that is turned and shifted at random. Every
lattice gives another topology.
"""

import math
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

Floats = NDArray[np.floating[Any]]
Order = NDArray[np.int64]

SPACING = (1.6, 2.3)
"""Spacing of the random lattice, in footprint radii."""
INSET = (0.1, 0.7)
"""Distance of the outermost points from the zone's edge, in footprint radii."""
FITTED_SHARE = 0.7
"""Share of lattices along the zone's sides."""
FITTED_INSET = (0.35, 1.0)
"""As `INSET`, for lattices along the zone's sides."""
FITTED_SPARE = 0.4
"""A lane may be left out if less than this share of it is needed."""
MORE_LANES = ((0, 1, 2), (0.55, 0.35, 0.1))
"""Lanes beyond the least number, and their probabilities."""
ZONE_INSET_M = 2.0
"""Points of lattices along the sides lie at least this far inside the zone."""
JITTER_M = 0.5
"""Random shift of points: a lattice has many equally short round trips, and each try should find another one."""
MAX_LATTICE_POINTS = 250
"""Larger lattices are not tried: 2-opt and or-opt look at all pairs of points."""
MAX_SEGMENT = 3
"""Longest piece that or-opt moves."""
GAIN_M = 1e-6
"""Smallest gain that counts as an improvement."""


def lattice_tour(zone: BaseGeometry, radius_m: float, rng: np.random.Generator) -> Floats | None:
    """Return a closed polyline; None where the zone holds fewer than five lattice points, or very many."""
    if rng.random() < FITTED_SHARE:
        points = _fitted(zone, radius_m, rng)
    else:
        points = _lattice(zone, radius_m * rng.uniform(*SPACING), rng)
        inner = shapely.buffer(zone, -radius_m * rng.uniform(*INSET))
        points = points[shapely.intersects_xy(inner, points[:, 0], points[:, 1])]
    if not 5 <= len(points) <= MAX_LATTICE_POINTS:
        return None
    return np.asarray(points[shortest_order(points + rng.normal(0.0, JITTER_M, points.shape))])


def shortest_order(points: Floats) -> Order:
    """Return a short closed order of the points: nearest neighbour, then 2-opt and or-opt until neither helps."""
    away = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    order = _nearest_neighbour(away)
    while True:
        better = _two_opt(order, away)
        if better is None:
            better = _or_opt(order, away)
        if better is None:
            return order
        order = better


def _nearest_neighbour(away: Floats) -> Order:
    order, open_ = [0], np.ones(len(away), dtype=bool)
    for _ in range(len(away) - 1):
        open_[order[-1]] = False
        order.append(int(np.argmin(np.where(open_, away[order[-1]], np.inf))))
    return np.array(order)


def _two_opt(order: Order, away: Floats) -> Order | None:
    """Return the order with the best reversal of a stretch, None if none is shorter."""
    after = np.roll(order, -1)
    leg = away[order, after]
    gain = leg[:, None] + leg[None] - away[order[:, None], order] - away[after[:, None], after]
    gain = np.triu(gain, 2)
    i, j = divmod(int(np.argmax(gain)), len(order))
    if gain[i, j] < GAIN_M:
        return None
    return np.concatenate([order[: i + 1], order[i + 1 : j + 1][::-1], order[j + 1 :]])


def _or_opt(order: Order, away: Floats) -> Order | None:
    """Return the order with the best move of up to three neighbours, either way round; None if none is shorter."""
    count, best_gain, best = len(order), GAIN_M, None
    place, after = np.arange(count), np.roll(order, -1)
    leg = away[order, after]
    for length in range(1, min(MAX_SEGMENT, count - 3) + 1):
        head, tail = order, np.roll(order, 1 - length)
        before, then = np.roll(order, 1), np.roll(order, -length)
        saved = away[before, head] + away[tail, then] - away[before, then]
        # Rows are pieces that begin there, columns the legs that they are put into; these must not touch the piece.
        inside = (place[None] - place[:, None] + 1) % count <= length
        for turned in (False, True):
            first, last = (tail, head) if turned else (head, tail)
            added = away[first[:, None], order] + away[last[:, None], after] - leg
            gain = np.where(inside, -np.inf, saved[:, None] - added)
            i, j = divmod(int(np.argmax(gain)), count)
            if gain[i, j] > best_gain:
                piece, rest = np.roll(order, -i)[:length], np.roll(order, -i)[length:]
                k = (j - i - length) % count + 1
                best_gain = float(gain[i, j])
                best = np.concatenate([rest[:k], piece[::-1] if turned else piece, rest[k:]])
    return best


def _fitted(zone: BaseGeometry, radius_m: float, rng: np.random.Generator) -> Floats:
    """Return rows and columns along the zone's sides, evenly spread, which suit anything rectangular."""
    turn_rad, middle = long_axis_rad(zone), np.array([zone.centroid.x, zone.centroid.y])
    cos, sin = math.cos(turn_rad), math.sin(turn_rad)
    back = np.array([[cos, sin], [-sin, cos]])
    corners = (shapely.get_coordinates(zone) - middle) @ back.T
    inset_m = radius_m * rng.uniform(*FITTED_INSET, 2)
    low, high = corners.min(axis=0) + inset_m, corners.max(axis=0) - inset_m
    least = np.ceil((corners.max(axis=0) - corners.min(axis=0)) / (2.0 * radius_m) - FITTED_SPARE).astype(int)
    lanes = np.maximum(2, least + rng.choice(MORE_LANES[0], size=2, p=MORE_LANES[1]))
    columns, rows = (np.linspace(low[axis], high[axis], lanes[axis]) for axis in range(2))
    x, y = np.meshgrid(columns, rows)
    points = np.stack([x.ravel(), y.ravel()], axis=1) @ back + middle
    inner = shapely.buffer(zone, -ZONE_INSET_M)
    return np.asarray(points[shapely.intersects_xy(inner, points[:, 0], points[:, 1])])


def _lattice(zone: BaseGeometry, spacing_m: float, rng: np.random.Generator) -> Floats:
    """Return square or hexagonal lattice points around the zone, turned and shifted at random; some lie outside."""
    turn_rad, shift = rng.uniform(0.0, math.pi), rng.uniform(0.0, 1.0, 2)
    x0, y0, x1, y1 = zone.bounds
    reach = math.ceil(math.hypot(x1 - x0, y1 - y0) / spacing_m) + 1
    column, row = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    if rng.random() < 0.5:
        x, y = column + 0.5 * (row % 2), row * math.sqrt(0.75)
    else:
        x, y = column.astype(float), row.astype(float)
    x, y = (x.ravel() + shift[0]) * spacing_m, (y.ravel() + shift[1]) * spacing_m
    cos, sin = math.cos(turn_rad), math.sin(turn_rad)
    return np.stack([(x0 + x1) / 2 + cos * x - sin * y, (y0 + y1) / 2 + sin * x + cos * y], axis=1)


def long_axis_rad(zone: BaseGeometry) -> float:
    """Return the direction of the long side of the smallest rectangle around the zone."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(zone))
    if len(corners) < 4:
        return 0.0
    sides = np.diff(corners[:3], axis=0)
    side = sides[int(np.argmax(np.hypot(*sides.T)))]
    return math.atan2(side[1], side[0]) % math.pi
