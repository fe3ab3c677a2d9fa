"""The baseline that everybody can write: lanes up and down in the best direction, vehicles equally spaced in time.

It has the same limits, margins and planned footprint as the patrol planner, and ways round obstacles. Its time law is
the planner's, too: what the guard would not let pass is flown slower, so the baseline could be flown.
"""

import math

import numpy as np

from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.core.protocol.planning import cells_of
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.lane_tours import DIRECTIONS, lane_tour
from tui_gcs.planner.patrol.patrol import ACCEL_SHARE, Patrol
from tui_gcs.planner.patrol.tour import evaluate_large, resampled
from tui_gcs.planner.patrol.tour_site import site_of
from tui_gcs.planner.patrol.tour_smoothing import TourDraft, TourLimits, draft_of

MIN_WAY_M = 0.25
"""Lanes over what one place sees may be pulled together beside an obstacle: below this they are no way to fly."""
MAX_PERIOD_S = 20_000.0
"""Twice what 100 ha take with one vehicle. Lanes that an obstacle presses together may have to be crawled."""


def boustrophedon_worst_s(task: PlannerTask) -> float:
    """Return the worst idleness of the best direction; infinite if none sees every cell."""
    default = {param.name: float(param.default) for param in Patrol.params if param.type is float}
    radius_m = max(task.footprint_radius_m - task.off_course_m, task.footprint_radius_m * 0.5)
    speed_m_s = task.limits.speed_m_s * default["speed_fraction"]
    motion = TourLimits(speed_m_s, task.limits.accel_m_s2 * ACCEL_SHARE, radius_m)
    region = FlyableRegion(task.area, task.no_fly, task.limits, task.zone)
    site = site_of(task.zone.shape, region, motion, task.footprint_radius_m)
    best_s, n, cells = math.inf, len(task.members), cells_of(task)
    for k in range(DIRECTIONS):
        path = lane_tour(site.cells, radius_m, math.pi * k / DIRECTIONS)
        path = np.vstack([path, path[:1] + 0.5]) if len(path) < 3 else path
        path = region.closed_inside(region.pulled_inside(resampled(path, 3.0)), 3.0)
        # With corners rounded like a vehicle does it, and with sharp ones where that misses a cell.
        drafts = [draft_of("lanes", path, motion).respaced(2.0), TourDraft("sharp lanes", path, 1.0)]
        if np.ptp(path, axis=0).max() < MIN_WAY_M:
            drafts = [site.draft("loop", path[:1])]
        for draft in drafts:
            tour = site.timed(draft)
            if tour.period_s > MAX_PERIOD_S:
                continue
            found = evaluate_large(tour, cells, task.footprint_radius_m, n)
            if found.coverage == 1.0:
                best_s = min(best_s, found.worst_s)
                break
    return best_s
