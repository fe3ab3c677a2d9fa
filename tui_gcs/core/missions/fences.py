"""Edits of fences by shape. Every vertex of a polygon carries the number of vertices, which is kept correct."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.plans.model import (
    AMSL,
    CIRCLE_IN,
    CIRCLE_OUT,
    POLYGON_IN,
    POLYGON_OUT,
    POLYGONS,
    RALLY_POINT,
    RELATIVE,
    FenceShape,
    PlanItem,
    fence_shapes,
)

Degrees = tuple[float, float]
"""Latitude and longitude in degrees."""
# PX4 refuses a polygon of fewer corners with ERROR.
MIN_CORNERS = 3
_OTHER_SIDE = {POLYGON_IN: POLYGON_OUT, POLYGON_OUT: POLYGON_IN, CIRCLE_IN: CIRCLE_OUT, CIRCLE_OUT: CIRCLE_IN}


def polygon(corners_deg: Sequence[Degrees], *, inside: bool = True) -> Items:
    """Make a polygon to stay inside, or outside, of."""
    command = POLYGON_IN if inside else POLYGON_OUT
    return _counted([_vertex(command, place) for place in corners_deg])


def circle(centre_deg: Degrees, radius_m: float, *, inside: bool = True) -> Items:
    """Make a circle to stay inside, or outside, of."""
    return (replace(_vertex(CIRCLE_IN if inside else CIRCLE_OUT, centre_deg), params=(radius_m, 0.0, 0.0, 0.0)),)


def rally_point(place_deg: Degrees, height_m: float) -> PlanItem:
    """Make a place to return to instead of home, at a height above home."""
    return replace(_vertex(RALLY_POINT, place_deg), frame=RELATIVE, z=height_m)


def shape_at(items: Items, index: int) -> FenceShape | None:
    """Return the shape that an item belongs to, None if there is none."""
    shapes = fence_shapes(items)
    return next((shape for shape in shapes if shape.first <= index < shape.first + len(shape.items)), None)


def add_corner(items: Items, index: int, place_deg: Degrees) -> Items:
    """Return the items with one more corner after `index`; unchanged if that is no polygon."""
    shape = shape_at(items, index)
    if shape is None or shape.command not in POLYGONS:
        return items
    at = index - shape.first + 1
    corners = (*shape.items[:at], _vertex(shape.command, place_deg), *shape.items[at:])
    return _with(items, shape, _counted(corners))


def delete_item(items: Items, index: int) -> Items:
    """Return the items without the one at `index`.

    A polygon loses a corner, and vanishes with less than three; a circle or return point vanishes.
    """
    shape = shape_at(items, index)
    if shape is None:
        return items
    at = index - shape.first
    # Only a polygon can lose a corner and remain a shape.
    corners = (*shape.items[:at], *shape.items[at + 1 :]) if shape.command in POLYGONS else ()
    return _with(items, shape, _counted(corners) if len(corners) >= MIN_CORNERS else ())


def other_side(items: Items, index: int) -> Items:
    """Return the items with inclusion and exclusion exchanged for the shape at `index`."""
    shape = shape_at(items, index)
    if shape is None or shape.command not in _OTHER_SIDE:
        return items
    return _with(items, shape, tuple(replace(item, command=_OTHER_SIDE[shape.command]) for item in shape.items))


def _with(items: Items, shape: FenceShape, new: Items) -> Items:
    return (*items[: shape.first], *new, *items[shape.first + len(shape.items) :])


def _counted(corners: Iterable[PlanItem]) -> Items:
    all_of_them = tuple(corners)
    count = float(len(all_of_them))
    # Autopilots refuse a polygon whose vertices disagree about their number.
    return tuple(replace(corner, params=(count, *corner.params[1:])) for corner in all_of_them)


def _vertex(command: int, place_deg: Degrees) -> PlanItem:
    return PlanItem(command, AMSL, x=round(place_deg[0] * 1e7), y=round(place_deg[1] * 1e7))
