"""What worst idleness vehicles could reach: an ideal, which a good tour comes near, and a bound, which nothing beats.

The *ideal* is A / (n v 2r): every metre flown sees new ground, turns cost nothing. A small zone can be seen faster,
because a place stays in sight for a while. The *bound* takes that off and holds for every plan whatsoever.
"""

import math
from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

DIRECTIONS = 36
"""Directions in which the length of a zone is taken; any of them gives a valid bound."""


class Sweep(NamedTuple):
    """The vehicles that sweep a zone, in the order in which ideal and bound take them."""

    n: int
    speed_m_s: float
    """The mean speed: together they sweep n times as much as one vehicle at this speed."""
    footprint_radius_m: float
    """What counts as seen, for each of them."""
    fastest_m_s: float
    """The speed of the fastest; in a fence any vehicle may take any place in the order."""


def sweep_of(speeds_m_s: Collection[float], n: int, footprint_radius_m: float) -> Sweep:
    """Return the `n` fastest of vehicles with these speeds; where there are fewer, more that are like their mean."""
    fastest = sorted(speeds_m_s, reverse=True)[: max(n, 0)]
    mean_m_s = sum(fastest) / len(fastest) if fastest else 0.0
    return Sweep(n, mean_m_s, footprint_radius_m, fastest[0] if fastest else 0.0)


def ideal_idleness_s(area_m2: float, n: int, speed_m_s: float, footprint_radius_m: float) -> float:
    """Return A / (n v 2r), the worst idleness of `n` vehicles without overlap and turns; infinite for none."""
    swept_m2_s = n * speed_m_s * 2.0 * footprint_radius_m
    return area_m2 / swept_m2_s if swept_m2_s > 0.0 else math.inf


def idleness_bound_s(
    area_m2: float,
    length_m: float,
    n: int,
    speed_m_s: float,
    footprint_radius_m: float,
    fastest_m_s: float | None = None,
) -> float:
    """Return the largest of two lower bounds of the worst idleness of any plan of `n` vehicles; infinite for none.

    `speed_m_s` is their mean speed; `fastest_m_s` that of the fastest, where they differ.

    Sweep: in a time T a vehicle sees at most π r² + 2 r v T, and all vehicles together see the whole area in any time
    that is longer than the worst idleness: T >= (A / n - π r²) / (2 r v).

    Fence, for narrow zones: project zone and vehicles on a line on which the zone is L long, and let two vehicles that
    pass each other swap their names, so that they keep their order. The first one must come within r of the zone's end
    at least every T, so it never sees beyond 2r + v T / 2; the second one must come within r of what is beyond that,
    and so on: L <= n (2r + v T / 2), so T >= 2 (L / n - 2r) / v. This is the argument of Czyzowicz et al., Boundary
    patrolling by mobile agents (2011), for vehicles that see as far as r.

    Both hold for the ground itself. A measurement at the centres of cells may take a swath for wider than it is by up
    to a cell, where lanes are aligned with the cells.
    """
    if n <= 0 or speed_m_s <= 0.0 or footprint_radius_m <= 0.0:
        return math.inf
    sweep_s = (area_m2 / n - math.pi * footprint_radius_m**2) / (2.0 * footprint_radius_m * speed_m_s)
    # Vehicles that swap names swap their speeds, too, so the fence holds for the fastest one only.
    fence_s = 2.0 * (length_m / n - 2.0 * footprint_radius_m) / max(speed_m_s, fastest_m_s or 0.0)
    return max(0.0, sweep_s, fence_s)


def gate_reference(ideal_s: float, bound_s: float) -> tuple[float, str]:
    """Return what gates compare worst idleness with, and its name: the ideal, or the bound where that is larger.

    In a narrow zone no plan comes near the ideal: a strip of 700x18 m has a bound of 2.8 x the ideal of 4 vehicles.
    """
    return (bound_s, "bound") if bound_s > ideal_s else (ideal_s, "ideal")


def longest_m(points_m: Floats) -> float:
    """Return the largest extent of the points (n, 2) along any of `DIRECTIONS` directions; 0 for none."""
    if not len(points_m):
        return 0.0
    angle = math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    along = np.asarray(points_m, dtype=float) @ np.stack([np.cos(angle), np.sin(angle)])
    return float(np.ptp(along, axis=0).max())
