"""Zones that nobody tuned a planner to: random ones of every kind, from fixed seeds."""

import math
from collections.abc import Iterator

import numpy as np
import shapely

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, polygon_of
from tui_gcs.core.scenario.model import OperatingArea

AREA = OperatingArea(Rectangle((300.0, 200.0), 600.0, 400.0), 20.0, 90.0)
MIDDLE = np.array([300.0, 200.0])
SWATH_M = 30.0
WIDE_SHARE = 0.85
KINDS = ("rectangle", "L", "U", "star", "triangle", "polygon", "circle", "hole", "no room", "strip")


def unseen(count: int, seed: int) -> Iterator[tuple[str, Zone, OperatingArea, tuple[Zone, ...]]]:
    """(kind, zone, area, no-fly zones), kinds in turn."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        kind = KINDS[i % len(KINDS)]
        shape, closed, area = _shape(kind, rng), tuple[Zone, ...](), AREA
        if kind == "hole":
            at = MIDDLE + rng.uniform(-15.0, 15.0, 2)
            closed = (Zone("closed", Role.NO_FLY, Circle((float(at[0]), float(at[1])), float(rng.uniform(4.0, 8.0)))),)
        if kind == "no room":
            area = OperatingArea(shape, 20.0, 90.0)
        yield kind, Zone("zone", Role.DEFEND, shape), area, closed


def wide(shape: Shape) -> bool:
    """Whether a zone is two swaths wide nearly everywhere: a disc of that width reaches most of it."""
    polygon = polygon_of(shape)
    reached = shapely.buffer(shapely.buffer(polygon, -SWATH_M), SWATH_M)
    return bool(reached.area >= WIDE_SHARE * polygon.area)


def widest_swaths(shape: Shape) -> float:
    """Diameter of the largest disc inside, in swaths."""
    return 2.0 * float(shapely.maximum_inscribed_circle(polygon_of(shape)).length) / SWATH_M


def _shape(kind: str, rng: np.random.Generator) -> Shape:
    wide, high, turn = (float(x) for x in rng.uniform((90.0, 70.0, 0.0), (220.0, 150.0, 180.0)))
    if kind == "circle":
        return Circle((300.0, 200.0), wide / 2.5)
    if kind == "strip":
        return Rectangle((300.0, 200.0), wide, float(rng.uniform(8.0, 45.0)), turn)
    if kind in ("rectangle", "hole", "no room"):
        return Rectangle((300.0, 200.0), wide, high, turn)
    arm = float(rng.uniform(60.0, 75.0))
    wide, high = max(wide, 2.2 * arm), max(high, 2.0 * arm)
    if kind == "L":
        corners = [(0, 0), (wide, 0), (wide, arm), (arm, arm), (arm, high), (0, high)]
    elif kind == "U":
        corners = [(0, 0), (wide, 0), (wide, high), (wide - arm, high), (wide - arm, arm), (arm, arm)]
        corners += [(arm, high), (0, high)]
    elif kind == "triangle":
        corners = [(0, 0), (wide, 0), (float(rng.uniform(0.0, wide)), high + 40.0)]
    else:
        count = 10 if kind == "star" else int(rng.integers(5, 9))
        angles = np.sort(rng.uniform(0.0, 2 * math.pi, count)) if kind == "polygon" else np.arange(count) * math.pi / 5
        reach = rng.uniform(55.0, 95.0, count) if kind == "polygon" else np.where(np.arange(count) % 2, 45.0, 95.0)
        corners = list(zip((reach * np.cos(angles)).tolist(), (reach * np.sin(angles)).tolist(), strict=True))
    points = np.array(corners, dtype=float)
    points -= (points.max(axis=0) + points.min(axis=0)) / 2
    cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    placed = points @ np.array([[cos, sin], [-sin, cos]]) + MIDDLE
    polygon = shapely.Polygon(placed)
    if not polygon.is_valid or polygon.area < 3000.0:
        return Rectangle((300.0, 200.0), wide, high, turn)
    return Polygon(tuple((float(x), float(y)) for x, y in placed))
