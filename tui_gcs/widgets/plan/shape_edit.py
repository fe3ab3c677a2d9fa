"""Shapes changed as a whole: moved, turned, sized, converted into another kind of about the same size."""

import math
from enum import Enum
from typing import assert_never

import msgspec

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, area_m2, bounds, outline_m
from tui_gcs.core.scenario.model import OperatingArea

KINDS = ("circle", "rectangle", "polygon")
CIRCLE_CORNERS = 32
"""A circle becomes a polygon with this many corners; with all of them on the rim it is 0.7 % smaller."""
ROUNDING_M = 0.01
"""A corner is this far from its exact place at most: coordinates are rounded."""


class Border(Enum):
    """What a circle must keep when it is converted into a polygon."""

    NOT_LARGER = "not larger"
    """The polygon lies within the circle: vehicles that stay inside must not come farther out."""
    NOT_SMALLER = "not smaller"
    """The polygon lies around the circle: vehicles that are kept out must not come nearer."""
    AS_LARGE = "as large"
    """The polygon has the area of the circle: idleness times of a zone follow from its area."""


def border_of(edited: Zone | OperatingArea) -> Border:
    """Return what the border of this zone or operating area must keep."""
    if isinstance(edited, OperatingArea):
        return Border.NOT_LARGER
    return Border.NOT_SMALLER if edited.role is Role.NO_FLY else Border.AS_LARGE


def kind_of(shape: Shape) -> str:
    """Return the name of the shape's kind, as in a scenario file."""
    match shape:
        case Circle():
            return "circle"
        case Rectangle():
            return "rectangle"
        case Polygon():
            return "polygon"
        case _:
            assert_never(shape)


def centre_of(shape: Shape) -> tuple[float, float]:
    """Return the centre of a shape; of a polygon the middle of its bounding box."""
    if not isinstance(shape, Polygon):
        return shape.centre_m
    min_x, min_y, max_x, max_y = bounds(shape)
    return (min_x + max_x) / 2.0, (min_y + max_y) / 2.0


def converted(shape: Shape, kind: str, border: Border = Border.AS_LARGE) -> Shape:
    """Return the shape as another kind, at about the same place and of about the same area."""
    if kind == kind_of(shape):
        return shape
    if kind == "circle":
        return Circle(tidy(centre_of(shape)), round(math.sqrt(area_m2(shape) / math.pi), 1))
    if kind == "rectangle":
        min_x, min_y, max_x, max_y = bounds(shape)
        return Rectangle(tidy(centre_of(shape)), round(max_x - min_x, 1), round(max_y - min_y, 1))
    return as_polygon(shape, border)


def as_polygon(shape: Shape, border: Border = Border.AS_LARGE) -> Polygon:
    """Return the shape as a polygon; `border` is what a circle must keep."""
    if isinstance(shape, Polygon):
        return shape
    if isinstance(shape, Circle):
        (x, y), reach_m = shape.centre_m, _corner_reach_m(shape.radius_m, border)
        turns = (math.tau * i / CIRCLE_CORNERS for i in range(CIRCLE_CORNERS))
        return Polygon(tuple(tidy((x + reach_m * math.cos(turn), y + reach_m * math.sin(turn))) for turn in turns))
    return Polygon(tuple(tidy(point) for point in outline_m(shape)))


def _corner_reach_m(radius_m: float, border: Border) -> float:
    """Return the distance from the centre of a circle to the corners of its polygon."""
    slice_rad = math.tau / CIRCLE_CORNERS
    match border:
        # Rounding moves a corner by up to a centimetre: that much is given away on the safe side.
        case Border.NOT_LARGER:
            return max(radius_m - ROUNDING_M, radius_m / 2.0)
        case Border.NOT_SMALLER:
            return (radius_m + ROUNDING_M) / math.cos(slice_rad / 2.0)
        case Border.AS_LARGE:
            return radius_m * math.sqrt(slice_rad / math.sin(slice_rad))


def describe_corners(old: Shape, new: Shape) -> str:
    """Describe the polygon that a circle was converted into; "" for anything else."""
    if not (isinstance(old, Circle) and isinstance(new, Polygon)):
        return ""
    more_pct = 100.0 * (area_m2(new) / area_m2(old) - 1.0)
    size = "as large" if abs(more_pct) < 0.05 else f"{abs(more_pct):.1f} % {'larger' if more_pct > 0.0 else 'smaller'}"
    return f"the circle has {len(new.vertices_m)} corners now, and is {size}; u takes it back"


def moved(shape: Shape, east_m: float, north_m: float) -> Shape:
    """Return the shape moved by metres east and north."""
    if isinstance(shape, Polygon):
        return Polygon(tuple(tidy((x + east_m, y + north_m)) for x, y in shape.vertices_m))
    x, y = shape.centre_m
    return msgspec.structs.replace(shape, centre_m=tidy((x + east_m, y + north_m)))


def turned(shape: Shape, clockwise_deg: float) -> Shape:
    """Return the shape turned clockwise about its centre; a circle stays as it is."""
    if isinstance(shape, Circle):
        return shape
    if isinstance(shape, Rectangle):
        return msgspec.structs.replace(shape, heading_deg=(shape.heading_deg + clockwise_deg) % 360.0)
    (cx, cy), angle = centre_of(shape), math.radians(clockwise_deg)
    cos, sin = math.cos(angle), math.sin(angle)
    points = ((x - cx, y - cy) for x, y in shape.vertices_m)
    return Polygon(tuple(tidy((cx + dx * cos + dy * sin, cy - dx * sin + dy * cos)) for dx, dy in points))


def sized(shape: Shape, factor: float) -> Shape:
    """Return the shape larger (factor > 1) or smaller about its centre."""
    match shape:
        case Circle():
            return msgspec.structs.replace(shape, radius_m=round(shape.radius_m * factor, 1))
        case Rectangle():
            width_m, height_m = round(shape.width_m * factor, 1), round(shape.height_m * factor, 1)
            return msgspec.structs.replace(shape, width_m=width_m, height_m=height_m)
        case Polygon():
            cx, cy = centre_of(shape)
            return Polygon(tuple(tidy((cx + (x - cx) * factor, cy + (y - cy) * factor)) for x, y in shape.vertices_m))
        case _:
            assert_never(shape)


def tidy(point: tuple[float, float]) -> tuple[float, float]:
    """Round a point to a centimetre, as people type it; 1e-14 becomes 0.0."""
    return round(point[0], 2) + 0.0, round(point[1], 2) + 0.0


def described(shape: Shape, times: str = "x") -> str:
    """Describe a shape in a few words: `circle r 80`, `rectangle 160 x 120`, `polygon 6`."""
    match shape:
        case Circle():
            return f"circle r {shape.radius_m:g}"
        case Rectangle():
            turn = f" {shape.heading_deg:g}°" if shape.heading_deg else ""
            return f"rectangle {shape.width_m:g} {times} {shape.height_m:g}{turn}"
        case Polygon():
            return f"polygon {len(shape.vertices_m)} corners"
        case _:
            assert_never(shape)
