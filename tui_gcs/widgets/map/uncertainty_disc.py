"""Where a lost vehicle may be: a disc around its last position that grows with time."""

import math
from collections.abc import Sequence

import numpy as np

from tui_gcs.core.protocol.common import Freshness, VehicleRow
from tui_gcs.widgets.basics.number_text import speed_m_s
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.fleet.severity_levels import on_ground
from tui_gcs.widgets.map.map_raster import DotRaster, unit_circle
from tui_gcs.widgets.map.map_viewport import Viewport

# A vehicle that stood still when it was last heard may have begun to move.
MIN_SPEED_M_S = 2.0
DISC_DASH = (2.0, 3.0)
DISC_POINTS = 48


def uncertainty_radius_m(row: VehicleRow, silent_s: float = 0.0) -> float:
    """Return how far a vehicle can have gone at its last speed; 0 while its position is fresh or it is on the ground.

    `silent_s` is the time since the station itself was heard.
    """
    if row.freshness is Freshness.OK or on_ground(row):
        return 0.0
    # Ages are those of the last frame: while the station is silent they do not grow by themselves.
    age_s, speed = row.age_s + silent_s, speed_m_s(row.velocity_m_s)
    if not math.isfinite(age_s):
        return 0.0
    return age_s * max(speed if math.isfinite(speed) else 0.0, MIN_SPEED_M_S)


def draw_uncertainty(raster: DotRaster, view: Viewport, rows: Sequence[VehicleRow], silent_s: float = 0.0) -> None:
    """Draw the discs of all vehicles that are stale or lost."""
    circle = unit_circle(DISC_POINTS)
    for row in rows:
        radius_m = uncertainty_radius_m(row, silent_s)
        if radius_m > view.m_per_dot:
            ring = np.array(row.position_m[:2]) + radius_m * circle
            raster.polyline(view.to_dots(ring), Ink.WARNING, closed=True, dash=DISC_DASH)
