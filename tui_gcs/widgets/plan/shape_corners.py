"""Shapes changed by their corners: moved one by one, added, removed, snapped to what lies near.

A circle has one "corner", the easternmost point of its rim: it sizes the circle.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import assert_never

import numpy as np
import shapely
from msgspec.structs import replace

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Shape, outline_m
from tui_gcs.widgets.plan.shape_edit import as_polygon, centre_of, tidy

Point = tuple[float, float]
MIN_CORNERS = 3


def corners_m(shape: Shape) -> list[Point]:
    """Return the corners that can be taken hold of, in the order of the outline."""
    if isinstance(shape, Circle):
        return [(shape.centre_m[0] + shape.radius_m, shape.centre_m[1])]
    return outline_m(shape)


def with_corner_at(shape: Shape, index: int, point: Point) -> Shape:
    """Return the shape with this corner at `point`: a circle through it, a rectangle about the opposite corner."""
    match shape:
        case Circle():
            return replace(shape, radius_m=round(math.dist(shape.centre_m, point), 2))
        case Rectangle():
            return _spanned(shape, corners_m(shape)[(index + 2) % 4], point)
        case Polygon():
            vertices = list(shape.vertices_m)
            vertices[index % len(vertices)] = tidy(point)
            return Polygon(tuple(vertices))
        case _:
            assert_never(shape)


def _spanned(old: Rectangle, fixed: Point, free: Point) -> Rectangle:
    """Return the rectangle between two opposite corners, with the old heading."""
    heading_rad = math.radians(old.heading_deg)
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    east, north = free[0] - fixed[0], free[1] - fixed[1]
    width_m, height_m = abs(east * cos - north * sin), abs(east * sin + north * cos)
    middle = tidy(((fixed[0] + free[0]) / 2.0, (fixed[1] + free[1]) / 2.0))
    return replace(old, centre_m=middle, width_m=round(width_m, 2), height_m=round(height_m, 2))


def with_corner_after(shape: Shape, index: int) -> tuple[Polygon, int]:
    """Add a corner in the middle of the edge after this corner; return the polygon and the new index."""
    vertices = list(as_polygon(shape).vertices_m)
    at = index % len(vertices)
    (x, y), (next_x, next_y) = vertices[at], vertices[(at + 1) % len(vertices)]
    vertices.insert(at + 1, tidy(((x + next_x) / 2.0, (y + next_y) / 2.0)))
    return Polygon(tuple(vertices)), at + 1


def with_corner_near(shape: Shape, point: Point) -> tuple[Polygon, int]:
    """Add a corner at `point`, in the edge that is nearest to it; return the polygon and the new index."""
    vertices = list(as_polygon(shape).vertices_m)
    place = shapely.Point(point)
    edges = [shapely.LineString([a, b]) for a, b in zip(vertices, [*vertices[1:], vertices[0]], strict=True)]
    at = min(range(len(edges)), key=lambda i: edges[i].distance(place))
    vertices.insert(at + 1, tidy(point))
    return Polygon(tuple(vertices)), at + 1


def without_corner(shape: Shape, index: int) -> Polygon | None:
    """Return the shape without this corner; None if it would have too few."""
    if isinstance(shape, Circle):
        return None
    vertices = list(as_polygon(shape).vertices_m)
    del vertices[index % len(vertices)]
    return Polygon(tuple(vertices)) if len(vertices) >= MIN_CORNERS else None


def turn_deg(shape: Shape, start: Point, now: Point) -> float:
    """Return the angle from one place to another about the centre of the shape, clockwise."""
    x, y = centre_of(shape)
    angle = math.atan2(start[1] - y, start[0] - x) - math.atan2(now[1] - y, now[0] - x)
    return math.degrees(angle)


@dataclass(frozen=True)
class Snap:
    """What corners snap to: corners and edges of other shapes, else a grid."""

    shapes: tuple[Shape, ...] = ()
    grid_m: float = 0.0
    """Width of the grid; 0 for none."""

    def point(self, point: Point, reach_m: float) -> Point:
        """Return where a corner that is moved to `point` comes to lie."""
        found = self._near([point], reach_m)
        if found is not None:
            return point[0] + found[0], point[1] + found[1]
        if self.grid_m > 0.0:
            return round(point[0] / self.grid_m) * self.grid_m, round(point[1] / self.grid_m) * self.grid_m
        return point

    def shift(self, shape: Shape, reach_m: float) -> Point:
        """Return how much farther a moved shape goes so that a corner meets something; (0, 0) if none is near."""
        outline = outline_m(shape)
        # Of a circle four points of its rim are enough: it has no corners that could meet something.
        points = outline[:: len(outline) // 4] if isinstance(shape, Circle) else outline
        return self._near(points, reach_m) or (0.0, 0.0)

    def _near(self, points: Iterable[Point], reach_m: float) -> Point | None:
        """Return the shortest way from one of the points to a corner within reach, else to an edge."""
        lines = [shapely.LinearRing(outline_m(shape)) for shape in self.shapes]
        ends = [corner for shape in self.shapes if not isinstance(shape, Circle) for corner in outline_m(shape)]
        for targets in ([shapely.MultiPoint(ends)] if ends else [], lines):
            best, vector = reach_m, None
            for target in targets:
                for point in points:
                    near = np.array(shapely.shortest_line(shapely.Point(point), target).coords)
                    if math.dist(*near) <= best:
                        best, vector = math.dist(*near), near[1] - near[0]
            if vector is not None:
                return float(vector[0]), float(vector[1])
        return None
