"""Zones: named regions on the ground with a role, a shape and an optional altitude band.

Positions are ENU metres about the scenario origin (x east, y north).
"""

import math
from enum import StrEnum

import msgspec
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

CIRCLE_QUADRANT_SEGMENTS = 32
"""Chords per quadrant of a circle: at radius 100 m they stay within 0.03 m of it."""


class Role(StrEnum):
    """What a zone is for."""

    DEFEND = "defend"
    ATTACK = "attack"
    NO_FLY = "no-fly"


class Circle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="shape", tag="circle"):
    """A disc, given by its centre in ENU metres and its radius."""

    centre_m: tuple[float, float]
    radius_m: float


class Rectangle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="shape", tag="rectangle"):
    """`width_m` along east and `height_m` along north at heading 0, then turned clockwise by `heading_deg`."""

    centre_m: tuple[float, float]
    width_m: float
    height_m: float
    heading_deg: float = 0.0


class Polygon(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="shape", tag="polygon"):
    """A simple polygon of at least three vertices, not closed (the last is not the first again)."""

    vertices_m: tuple[tuple[float, float], ...]


Shape = Circle | Rectangle | Polygon


class Zone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A named region with a role and an optional altitude band, metres above the ground."""

    name: str
    role: Role
    shape: Shape
    alt_min_m: float | None = None
    alt_max_m: float | None = None


def outline_m(shape: Shape) -> list[tuple[float, float]]:
    """Return the shape's corners in order, not closed; a circle as a regular 128-gon on its rim."""
    match shape:
        case Circle():
            return _circle_outline(shape)
        case Rectangle():
            return _rectangle_outline(shape)
        case Polygon():
            return [(float(x), float(y)) for x, y in shape.vertices_m]


def polygon_of(shape: Shape) -> shapely.Polygon:
    """Return the shape as a shapely polygon (metres); a circle as `outline_m` has it."""
    return shapely.Polygon(outline_m(shape))


def area_m2(shape: Shape) -> float:
    """Return the area in square metres; exact, for circles too."""
    match shape:
        case Circle():
            return math.pi * shape.radius_m**2
        case Rectangle():
            return shape.width_m * shape.height_m
        case Polygon():
            return float(polygon_of(shape).area)


def bounds(shape: Shape) -> tuple[float, float, float, float]:
    """Return (min x, min y, max x, max y) in metres."""
    if isinstance(shape, Circle):
        (x, y), r = shape.centre_m, shape.radius_m
        return x - r, y - r, x + r, y + r
    xs, ys = zip(*outline_m(shape), strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def contains(shape: Shape, xy: ArrayLike) -> NDArray[np.bool_]:
    """Return which of the points (n, 2) lie in the shape or on its border. A circle is tested by its radius."""
    points = np.asarray(xy, dtype=float).reshape(-1, 2)
    if isinstance(shape, Circle):
        dx, dy = (points - shape.centre_m).T
        # Exact, unlike the polygon that stands for a circle elsewhere.
        return np.asarray(np.hypot(dx, dy) <= shape.radius_m)
    return np.asarray(shapely.intersects_xy(polygon_of(shape), points[:, 0], points[:, 1]))


def _circle_outline(circle: Circle) -> list[tuple[float, float]]:
    (x, y), r = circle.centre_m, circle.radius_m
    step_rad = math.pi / 2 / CIRCLE_QUADRANT_SEGMENTS
    return [
        (x + r * math.cos(i * step_rad), y + r * math.sin(i * step_rad)) for i in range(4 * CIRCLE_QUADRANT_SEGMENTS)
    ]


def _rectangle_outline(rectangle: Rectangle) -> list[tuple[float, float]]:
    """Return the corners, south-west first (at heading 0), then counter-clockwise."""
    (x, y), heading_rad = rectangle.centre_m, math.radians(rectangle.heading_deg)
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    corners = []
    for side_e, side_n in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
        east, north = side_e * rectangle.width_m, side_n * rectangle.height_m
        # A compass heading turns clockwise: north goes towards east.
        corners.append((x + east * cos + north * sin, y - east * sin + north * cos))
    return corners
