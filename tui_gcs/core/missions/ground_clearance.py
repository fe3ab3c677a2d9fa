"""How far above the ground a mission is flown, where the heights of the ground are known.

Heights of a path are above home. The ground is compared with the ground at home, from the same source, so that a
constant error of the source (its datum, most of all) does not matter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.timed_path import TimedPath
from tui_gcs.core.plans.model import PLAIN_FRAME, TERRAIN

Floats = NDArray[np.float64]

SAMPLE_M = 15.0
"""The ground is asked for at least this often along the way: half the spacing of the finest SRTM tiles."""
MAX_SAMPLES = 50_000
UPRIGHT_M = 1.0
"""A leg that is shorter over ground is a climb or a descent: it begins or ends on the ground on purpose."""


@dataclass(frozen=True)
class ClearancePoint:
    """The lowest point of a leg above the ground."""

    item: int
    """The index of the mission item that the leg belongs to."""
    clearance_m: float
    along_m: float
    """The distance over ground from the start of the mission."""


def relative_ground_m(elevation: Elevation, frame: LocalFrame, places_m: Floats, home_m: tuple[float, float]) -> Floats:
    """Return the ground at ENU places (n, 2) in metres above the ground at `home_m`, (n,); NaN where unknown."""
    home = float(elevation.amsl_m(*frame.to_geodetic(*home_m))[0])
    lat_deg, lon_deg = frame.to_geodetic(places_m[:, 0], places_m[:, 1])
    return elevation.amsl_m(lat_deg, lon_deg) - home


def lowest_points(
    mission: Items, path: TimedPath, frame: LocalFrame, elevation: Elevation
) -> tuple[list[ClearancePoint], float]:
    """Return the lowest point of each level leg above the ground, and the share of samples without a known ground.

    The path begins at home. Legs to items whose heights are above the ground are left out: the vehicle follows the
    ground there.
    """
    steps_m = np.hypot(*np.diff(path.corners_m[:, :2], axis=0).T)
    follows = [PLAIN_FRAME.get(mission[item].frame) == TERRAIN for item in path.leg_items.tolist()]
    legs = np.flatnonzero((steps_m >= UPRIGHT_M) & ~np.array(follows, dtype=bool))
    if not len(legs):
        return [], 0.0
    spacing_m = max(SAMPLE_M, float(steps_m[legs].sum()) / MAX_SAMPLES)
    counts = np.ceil(steps_m[legs] / spacing_m).astype(np.int64) + 1
    of_leg = np.repeat(np.arange(len(legs)), counts)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    share = (np.arange(counts.sum()) - starts[of_leg]) / (counts - 1)[of_leg]
    begin, end = path.corners_m[legs][of_leg], path.corners_m[legs + 1][of_leg]
    points_m = begin + share[:, None] * (end - begin)
    home_m = (float(path.corners_m[0, 0]), float(path.corners_m[0, 1]))
    clearances_m = points_m[:, 2] - relative_ground_m(elevation, frame, points_m, home_m)
    before_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    found = []
    for number, leg in enumerate(legs.tolist()):
        mine = slice(int(starts[number]), int(starts[number] + counts[number]))
        if not np.isnan(clearances_m[mine]).all():
            low = mine.start + int(np.nanargmin(clearances_m[mine]))
            along_m = float(before_m[leg] + share[low] * steps_m[leg])
            found.append(ClearancePoint(int(path.leg_items[leg]), float(clearances_m[low]), along_m))
    return found, float(np.isnan(clearances_m).mean())
