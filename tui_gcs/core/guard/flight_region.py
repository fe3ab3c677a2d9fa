"""Where vehicles may be.

The operating area with its altitude band, less no-fly zones, which may have heights of their own.
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from tui_gcs.core.geometry.zones import Zone, polygon_of
from tui_gcs.core.motion.course import Samples
from tui_gcs.core.scenario.model import OperatingArea

SAME_M = 0.01
"""A way shorter than this counts as none."""


@dataclass(frozen=True)
class NoFlyBand:
    """A no-fly zone between two heights."""

    shape: BaseGeometry
    low_m: float
    high_m: float


class FlightRegion:
    """The operating area and its no-fly zones, all less a margin."""

    def __init__(self, area: OperatingArea, no_fly: tuple[Zone, ...], margin_m: float) -> None:
        """`margin_m` is kept from the edge of the area, and from no-fly zones, sideways and in height."""
        self.free = polygon_of(area.shape).buffer(-margin_m) if margin_m else polygon_of(area.shape)
        """Where vehicles may be at any height."""
        self.bans: list[NoFlyBand] = []
        self._named: list[tuple[str, BaseGeometry]] = []
        """Name and shape, with the margin, of all no-fly zones."""
        for zone in no_fly:
            shape = polygon_of(zone.shape).buffer(margin_m)
            self._named.append((zone.name, shape))
            if zone.alt_min_m is None and zone.alt_max_m is None:
                self.free = self.free.difference(shape)
            else:
                low = -math.inf if zone.alt_min_m is None else zone.alt_min_m - margin_m
                high = math.inf if zone.alt_max_m is None else zone.alt_max_m + margin_m
                self.bans.append(NoFlyBand(shape, low, high))
                shapely.prepare(shape)
        shapely.prepare(self.free)
        self._edge = self.free.boundary
        self._convex = self.free.convex_hull.area - self.free.area < SAME_M**2
        """The region has no dents: the straight way between two places inside is inside."""

    def wall_at(self, *places_m: Samples) -> str:
        """Name the first no-fly zone that a place, or the straight way from place to place, touches; "" for none."""
        flown = LineString([place[:2] for place in places_m]) if len(places_m) > 1 else Point(places_m[0][:2])
        return next((name for name, shape in self._named if shape.intersects(flown)), "")

    def outside_m(self, places_m: Samples, error_m: Samples | float = 0.0) -> Samples:
        """(k,) how far outside places (k, 3) are, 0 inside. Each may be wrong by `error_m`, (k,) or one number."""
        inside = shapely.intersects_xy(self.free, places_m[:, 0], places_m[:, 1])
        error = np.broadcast_to(np.asarray(error_m, dtype=float), inside.shape)
        out = np.zeros(len(places_m))
        doubtful = np.flatnonzero(~inside | (error > 0) | bool(self.bans))  # nearly always none
        if len(doubtful):
            out[doubtful] = self._outside_m(places_m[doubtful], inside[doubtful], error[doubtful])
        return out

    def _outside_m(self, places_m: Samples, inside: NDArray[np.bool_], error_m: Samples) -> Samples:
        x, y, z = places_m.T
        points = shapely.points(x, y)
        out: Samples = np.where(inside, 0.0, shapely.distance(self.free, points) + error_m)
        if error_m.any():
            out = np.maximum(out, np.where(inside, error_m - shapely.distance(self._edge, points), 0.0))
        for ban in self.bans:
            depth = np.where(
                shapely.intersects_xy(ban.shape, x, y),
                shapely.distance(ban.shape.boundary, points) + error_m,
                error_m - shapely.distance(ban.shape, points),
            )
            out = np.maximum(out, np.minimum(depth, np.minimum(z - ban.low_m, ban.high_m - z)))
        return out

    def hold(self, low_m: Samples, high_m: Samples, error_m: Samples) -> NDArray[np.bool_]:
        """(n,) whether boxes between corners (n, 3) and (n, 3), widened by `error_m` (n,), are inside altogether."""
        error = error_m[:, None]
        boxes = shapely.box(*(low_m[:, :2] - error).T, *(high_m[:, :2] + error).T)
        inside: NDArray[np.bool_] = shapely.covers(self.free, boxes)
        for ban in self.bans:
            inside &= (low_m[:, 2] >= ban.high_m) | (high_m[:, 2] <= ban.low_m) | ~shapely.intersects(ban.shape, boxes)
        return inside

    def are_clear(self, ways_m: Samples) -> NDArray[np.bool_]:
        """(n,) whether straight ways (n, k, 3) from place to place, all of them inside, stay inside at all heights."""
        if self._convex and not self.bans:  # nearly always
            return np.ones(len(ways_m), dtype=bool)
        lines = shapely.linestrings(ways_m[:, :, :2])
        clear: NDArray[np.bool_] = (shapely.length(lines) <= SAME_M) | shapely.covers(self.free, lines)
        low, high = ways_m[:, :, 2].min(axis=1), ways_m[:, :, 2].max(axis=1)
        for ban in self.bans:
            clear &= (low >= ban.high_m) | (high <= ban.low_m) | ~shapely.intersects(ban.shape, lines)
        return clear


def band_miss_m(area: OperatingArea, heights_m: Samples) -> Samples:
    """How far outside the altitude band heights are, 0 inside."""
    return np.maximum(np.maximum(area.alt_min_m - heights_m, heights_m - area.alt_max_m), 0.0)
