"""Polygons and circles of a fence in metres of one vehicle's frame."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sitl.common import missions
from sitl.common.missions import Item
from sitl.common.platform import Part, Platform
from sitl.physics.point_masses import Body

Corner = tuple[float, float]


@dataclass(frozen=True)
class Shape:
    """One polygon, or a circle, whose only corner is its centre; a polygon has radius 0."""

    corners: tuple[Corner, ...]
    radius_m: float
    keep_in: bool

    def allows(self, x: float, y: float) -> bool:
        """Return whether a vehicle may be there."""
        if self.radius_m > 0.0:
            return (math.hypot(x - self.corners[0][0], y - self.corners[0][1]) <= self.radius_m) == self.keep_in
        return is_within(self.corners, x, y) == self.keep_in


class Fence(Part):
    """The shapes of a vehicle's fence; they are read from the stored plan when they are first needed."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._shapes: tuple[Shape, ...] | None = None

    def changed(self) -> None:
        """Drop the shapes, because the plan has changed."""
        self._shapes = None

    def lists(self) -> list[list[Item]]:
        """Return the lists of items that are in force."""
        return [self._plans.fence]

    def contains(self, x: float, y: float) -> bool:
        """Return whether all shapes allow a place."""
        if self._shapes is None:
            self._shapes = tuple(shape for items in self.lists() for shape in shapes_of(items, self._body))
        return all(shape.allows(x, y) for shape in self._shapes)


def shapes_of(items: Sequence[Item], body: Body) -> tuple[Shape, ...]:
    """Return the shapes in a list of items; p1 of a polygon's corner is the number of its corners."""
    found: list[Shape] = []
    at = 0
    while at < len(items):
        item = items[at]
        size = max(1, int(item.p1)) if item.command in missions.POLYGONS else 1
        corners = tuple(body.to_local(each.lat_deg, each.lon_deg) for each in items[at : at + size])
        keep_in = item.command in (missions.POLYGON_IN, missions.CIRCLE_IN)
        if item.command in missions.POLYGONS:
            found.append(Shape(corners, 0.0, keep_in))
        elif item.command in missions.CIRCLES:
            found.append(Shape(corners, item.p1, keep_in))
        at += size
    return tuple(found)


def is_within(corners: Sequence[Corner], x: float, y: float) -> bool:
    """Return whether a polygon contains a place, by the number of edges to the east of it."""
    inside = False
    for k, (x1, y1) in enumerate(corners):
        x2, y2 = corners[k - 1]
        if (y1 > y) != (y2 > y) and x1 + (y - y1) * (x2 - x1) / (y2 - y1) > x:
            inside = not inside
    return inside
