"""Where vehicles may be: the operating area less no-fly zones, which may have heights of their own, and its band."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from tui_gcs.core.course import Samples
from tui_gcs.core.scenario import OperatingArea
from tui_gcs.core.zones import Zone, polygon_of

SAME_M = 0.01
"""A shorter way is none."""


@dataclass(frozen=True)
class Ban:
    """A no-fly zone between two heights."""

    shape: BaseGeometry
    low_m: float
    high_m: float


class Walls:
    """The operating area and its no-fly zones, all less a margin."""

    def __init__(self, area: OperatingArea, no_fly: tuple[Zone, ...], margin_m: float) -> None:
        """`margin_m` is kept from the edge of the area, and from no-fly zones, sideways and in height."""
        self.free = polygon_of(area.shape).buffer(-margin_m) if margin_m else polygon_of(area.shape)
        """Where one may be at any height."""
        self.bans: list[Ban] = []
        for zone in no_fly:
            shape = polygon_of(zone.shape).buffer(margin_m)
            if zone.alt_min_m is None and zone.alt_max_m is None:
                self.free = self.free.difference(shape)
            else:
                low = -math.inf if zone.alt_min_m is None else zone.alt_min_m - margin_m
                high = math.inf if zone.alt_max_m is None else zone.alt_max_m + margin_m
                self.bans.append(Ban(shape, low, high))
                shapely.prepare(shape)
        shapely.prepare(self.free)
        self._edge = self.free.boundary
        self._convex = self.free.convex_hull.area - self.free.area < SAME_M**2
        """Then the straight way between two places inside is inside."""

    def outside_m(self, places_m: Samples, error_m: float = 0.0) -> Samples:
        """(k,) how far outside places (k, 3) are, 0 inside; each may be anywhere within `error_m`."""
        x, y, z = places_m.T
        inside = shapely.intersects_xy(self.free, x, y)
        if inside.all() and not self.bans and not error_m:  # nearly always
            return np.zeros(len(places_m))
        points = shapely.points(x, y)
        out: Samples = np.where(inside, 0.0, shapely.distance(self.free, points) + error_m)
        if error_m:
            out = np.maximum(out, np.where(inside, error_m - shapely.distance(self._edge, points), 0.0))
        for ban in self.bans:
            depth = np.where(
                shapely.intersects_xy(ban.shape, x, y),
                shapely.distance(ban.shape.boundary, points) + error_m,
                error_m - shapely.distance(ban.shape, points),
            )
            out = np.maximum(out, np.minimum(depth, np.minimum(z - ban.low_m, ban.high_m - z)))
        return out

    def is_clear(self, places_m: Samples) -> bool:
        """Whether the straight ways from place (k, 3) to place, all of them inside, stay inside, at whatever height."""
        if self._convex and not self.bans:  # nearly always
            return True
        way = LineString(places_m[:, :2])
        if way.length > SAME_M and not self.free.covers(way):
            return False
        low, high = places_m[:, 2].min(), places_m[:, 2].max()
        return not any(low < ban.high_m and high > ban.low_m and ban.shape.intersects(way) for ban in self.bans)


def band_miss_m(area: OperatingArea, heights_m: Samples) -> Samples:
    """How far outside of the altitude band heights are, 0 inside."""
    return np.maximum(np.maximum(area.alt_min_m - heights_m, heights_m - area.alt_max_m), 0.0)
