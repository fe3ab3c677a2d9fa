"""First tours of a zone from fixed patterns: combs, there-and-back lanes, spirals and rings, as rough polylines.

They need not be smooth nor cover everything: `tour_smoothing` bends them. What matters is their topology, the number
and order of lanes, which descent cannot change.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.patrol.tour import resampled
from tui_gcs.planner.patrol.tour_construction import long_axis_rad

Floats = NDArray[np.floating[Any]]

TURN_STEPS = 48
RING_STEP_M = 3.0
RING_WIDTHS = (0.88, 0.95, 1.03)
"""Half a lane, in footprint radii."""
MIN_RING_M2 = 30.0
"""Smaller rings are left out."""
LOOP_SHARE = 0.75
"""Share of the innermost ring that is flown as a loop."""


def seeds(zone: shapely.Polygon, radius_m: float) -> Iterator[tuple[str, Floats]]:
    """Yield (name, closed polyline) of each pattern, in a fixed order."""
    base = long_axis_rad(zone)
    for degrees in (0, 90):
        turned = _TurnedZone(zone, base + math.radians(degrees))
        for spare in (0, 1):
            lanes = max(1, turned.lanes(radius_m) + spare)
            yield f"comb {degrees} {lanes}", turned.comb(lanes, radius_m)
            yield f"lanes {degrees} {lanes}", turned.there_and_back(lanes, radius_m)
    reach = math.sqrt(zone.area / math.pi)
    arms = max(1, round(reach / (2.0 * radius_m)))
    for lanes in (arms, arms + 1):
        yield f"spiral {lanes}", double_spiral(zone, lanes, radius_m, base)
    yield from rings(zone, radius_m)


def rings(zone: shapely.Polygon, radius_m: float) -> Iterator[tuple[str, Floats]]:
    """Yield the zone's contour moved inwards by odd numbers of half lanes, and ways to fly these rings in turn.

    "in": outer to inner. "loop": the innermost the other way round, most of it, which makes the way back a smooth turn.
    "inserted": the innermost in the middle of the last but one.
    """
    for wide in RING_WIDTHS:
        found = _contours(zone, wide * radius_m)
        for depth in range(max(1, len(found) - 1), len(found) + 1):
            *outer, inner = found[:depth]
            yield f"rings {wide:g} {depth} in", np.vstack([*outer, inner])
            if outer:
                back = np.roll(inner[::-1], 1, axis=0)
                yield f"rings {wide:g} {depth} loop", np.vstack([*outer, back[: math.ceil(LOOP_SHARE * len(back))]])
                half = len(outer[-1]) // 2
                meet = int(np.argmin(np.hypot(*(inner - outer[-1][half]).T)))
                between = [outer[-1][:half], np.roll(inner, -meet, axis=0), outer[-1][half:]]
                yield f"rings {wide:g} {depth} inserted", np.vstack([*outer[:-1], *between])


def _contours(zone: shapely.Polygon, half_lane_m: float) -> list[Floats]:
    """Return closed rings from the outside inwards, each beginning where it is nearest to the end of the one before."""
    found: list[Floats] = []
    while True:
        inner = shapely.buffer(zone, -half_lane_m * (2 * len(found) + 1), join_style="mitre")
        part = max(getattr(inner, "geoms", [inner]), key=lambda g: g.area)
        if part.area < MIN_RING_M2:
            return found
        ring = resampled(shapely.get_coordinates(part.exterior)[:-1], RING_STEP_M)
        if found:
            ring = np.roll(ring, -int(np.argmin(np.hypot(*(ring - found[-1][-1]).T))), axis=0)
        found.append(ring)


class _TurnedZone:
    """A zone turned so that lanes run along y."""

    def __init__(self, zone: shapely.Polygon, angle_rad: float) -> None:
        centre = zone.centroid
        self._middle = np.array([centre.x, centre.y])
        cos, sin = math.cos(angle_rad), math.sin(angle_rad)
        self._back = np.array([[cos, sin], [-sin, cos]])
        corners = (shapely.get_coordinates(zone.exterior) - self._middle) @ self._back.T
        self._zone = shapely.Polygon(corners)
        self._left, self._bottom, self._right, self._top = self._zone.bounds

    def lanes(self, radius_m: float) -> int:
        """Return the number of lanes that cover the width."""
        width_m = float(self._right - self._left)
        return math.ceil(width_m / (2.0 * radius_m) - 0.05)

    def comb(self, lanes: int, radius_m: float) -> Floats:
        """Return a path up and down the lanes except for their lower ends, then home along these."""
        spans = self._spans(lanes)
        points: list[tuple[float, float]] = []
        for i, (x, low, high) in enumerate(spans):
            ends = [(x, min(low + 3.0 * radius_m, high - radius_m)), (x, max(high - radius_m, low))]
            points += ends if i % 2 == 0 else ends[::-1]
        points += [(x, low + radius_m * 0.8) for x, low, _ in reversed(spans)]
        return self._home(points)

    def there_and_back(self, lanes: int, radius_m: float) -> Floats:
        """Return a path up and down the lanes, then straight to the first."""
        points: list[tuple[float, float]] = []
        for i, (x, low, high) in enumerate(self._spans(lanes)):
            ends = [(x, low + min(radius_m, (high - low) / 2)), (x, high - min(radius_m, (high - low) / 2))]
            points += ends if i % 2 == 0 else ends[::-1]
        return self._home(points)

    def _spans(self, lanes: int) -> list[tuple[float, float, float]]:
        """Return (x, lowest y, highest y) of each lane."""
        width = (self._right - self._left) / lanes
        found = []
        for i in range(lanes):
            x = self._left + (i + 0.5) * width
            strip = shapely.box(x - width / 4, self._bottom - 1.0, x + width / 4, self._top + 1.0)
            _, low, _, high = shapely.intersection(self._zone, strip).bounds
            found.append((x, low, high) if math.isfinite(low) else (x, self._bottom, self._top))
        return found

    def _home(self, points: list[tuple[float, float]]) -> Floats:
        return np.asarray(np.array(points) @ self._back + self._middle)


def double_spiral(zone: shapely.Polygon, lanes: int, radius_m: float, start_rad: float) -> Floats:
    """Return a path inwards on one spiral arm, through the middle, and outwards between its windings."""
    middle = zone.representative_point() if not zone.contains(zone.centroid) else zone.centroid
    centre = np.array([middle.x, middle.y])
    reach = math.sqrt(zone.area / math.pi)
    outer = max(0.2, 1.0 - radius_m / reach)
    turns = lanes / 2.0
    count = max(8, round(TURN_STEPS * turns))
    inward = np.linspace(0.0, 1.0, count, endpoint=False)
    around = 2.0 * math.pi * turns * inward
    share = outer * (1.0 - inward)
    half = np.linspace(math.pi, 2.0 * math.pi, TURN_STEPS // 2, endpoint=False)
    angles = np.concatenate([around, (around + math.pi)[::-1], half]) + start_rad
    shares = np.concatenate([share, share[::-1], np.full(len(half), outer)])
    reach_m = (shares * _rim_m(zone, centre, angles))[:, None]
    return np.asarray(centre + reach_m * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def _rim_m(zone: shapely.Polygon, centre: Floats, angles: Floats) -> Floats:
    """Return distances from `centre` to the nearest crossing of the rim in each direction."""
    far = 2.0 * float(np.hypot(zone.bounds[2] - zone.bounds[0], zone.bounds[3] - zone.bounds[1]))
    ends = centre + far * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rays = shapely.linestrings(np.stack([np.broadcast_to(centre, ends.shape), ends], axis=1))
    return np.asarray(shapely.distance(shapely.intersection(rays, zone.exterior), shapely.Point(centre)))
