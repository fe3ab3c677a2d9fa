"""Circuits: closed tours on which any number of vehicles keep equal distances in time.

Vehicles have no numbers. Each flies a little faster while the gap before it is the larger one, and slower while the gap
behind it is. That spaces them equally, and closes the gap of a vehicle that leaves at once and from both sides.
"""

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.tour import PATH_STEP_M, Tour, resampled, timed

Floats = NDArray[np.floating[Any]]

SPACING_GAIN_1_S = 0.25
"""Change of the rate per second of spacing error."""


def ring(zone: shapely.Polygon, out_m: float, region: FlyableRegion, speed_m_s: float, accel_m_s2: float) -> Tour:
    """Return the outline of the zone, `out_m` farther out, where it is flyable. Raises ValueError if it is nowhere."""
    outline = shapely.get_coordinates(zone.buffer(out_m, quad_segs=16).exterior)[:-1]
    path = region.closed_inside(resampled(outline[::-1], 2.0 * PATH_STEP_M), PATH_STEP_M)
    if len(path) < 8 or np.ptp(path, axis=0).max() < 2.0 * PATH_STEP_M:
        raise ValueError("there is no room for a ring around the zone inside the operating area")
    return timed(resampled(path), speed_m_s, accel_m_s2)


def nearest_phase_s(tour: Tour, xy_m: Floats) -> Floats:
    """Return (n,) phases at which the tour comes nearest to each place."""
    away = (tour.xy_m[:, 0, None] - xy_m[:, 0]) ** 2 + (tour.xy_m[:, 1, None] - xy_m[:, 1]) ** 2
    return np.asarray(tour.dt_s * np.argmin(away, axis=0))


def spacing_rates(
    phase_s: Floats, members: NDArray[np.bool_], period_s: float, slowest: float, fastest: float
) -> Floats:
    """Return the rates of n places on a tour that make gaps equal; rate 1 is as timed.

    Only `members` are moved; the others count as neighbours. Places that coincide separate in the order of their rows.
    """
    n = len(phase_s)
    rate = np.ones(n)
    if n < 2:
        return rate
    at = phase_s % period_s
    order = np.argsort(at, kind="stable")
    gap = np.diff(at[order], append=at[order[0]] + period_s)
    # Half of the difference of the gaps before and behind is what would make them equal.
    wrong = (gap - np.roll(gap, 1)) / 2.0
    rate[order] = np.clip(1.0 + SPACING_GAIN_1_S * wrong, slowest, fastest)
    return np.where(members, rate, 1.0)
