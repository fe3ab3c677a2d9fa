"""Shortest route between two places inside a region: around corners and no-fly zones."""

import heapq
import math

import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

Place = tuple[float, float]

INSET_M = 3.0
"""Turning points lie this far inside corners, so that a vehicle that overshoots a turn stays inside."""


def route(region: BaseGeometry, here: Place, there: Place) -> list[Place]:
    """Return the turning points and `there`: `[there]` if the straight way is inside, or if there is none inside.

    It is Dijkstra's algorithm on the visibility graph of the region's corners.
    """
    if _clear(region, here, there):
        return [there]
    # Simplified, because each corner is connected with every other one.
    inner = region.buffer(-INSET_M, join_style="mitre").simplify(INSET_M / 3)
    corners = [(float(x), float(y)) for x, y in shapely.get_coordinates(inner)]
    places = [here, there, *dict.fromkeys(corners)]
    best = {0: 0.0}
    before: dict[int, int] = {}
    waiting = [(0.0, 0)]
    while waiting:
        length, i = heapq.heappop(waiting)
        if i == 1:
            return [places[k] for k in _back(before)]
        for j in range(1, len(places)):
            longer = length + math.dist(places[i], places[j])
            if longer < best.get(j, math.inf) and _clear(region, places[i], places[j]):
                best[j], before[j] = longer, i
                heapq.heappush(waiting, (longer, j))
    return [there]


def _back(before: dict[int, int]) -> list[int]:
    """Return the indices from the first turning point to the end (1), walked back from there to the start (0)."""
    steps = [1]
    while before[steps[-1]] != 0:
        steps.append(before[steps[-1]])
    return steps[::-1]


def _clear(region: BaseGeometry, a: Place, b: Place) -> bool:
    return bool(region.covers(LineString([a, b])))
