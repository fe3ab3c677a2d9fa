"""What turns cost a patrol: the same search for vehicles that turn as well as ours, and for such that hardly need to.

Tours are those of the model in docs/planning.md C: vehicles never stray, use all of their acceleration, and it may
change at once.
"""

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

from tests.bench.planning.planning import ACCEL_M_S2, LIMITS, RADIUS_M, SPEED_M_S, TEAM, best_ratio, rounds
from tests.bench.row import Row
from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.patrol import tour
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.tour_search import begin_search
from tui_gcs.planner.patrol.tour_site import EVENED_M, MISS_M, site_of
from tui_gcs.planner.patrol.tour_smoothing import TourLimits

HARDLY_M_S2 = 50.0
"""A turn of 30 m is flown at full speed, a corner in 0.3 s."""
UNITS = 1000
AT_ONCE_M_S3, AT_ONCE_S = 1e6, 0.05
"""Limits on jerk that limit nothing."""


def planning_turns(_: Path) -> Iterator[Row]:
    """The worst idleness over B1 of the rounds' zones, with either acceleration."""
    warm_up()
    with patch.object(tour, "MAX_TURN_JERK_M_S3", AT_ONCE_M_S3), patch.object(tour, "AVERAGING_S", AT_ONCE_S):
        for name, zone, area in rounds():
            for accel_m_s2 in (ACCEL_M_S2, HARDLY_M_S2):
                ratio = _ratio(zone, area, accel_m_s2)
                yield Row(f"{name}, {accel_m_s2:g} m/s², {UNITS} units: / B1, n = {TEAM}", ratio, "")


def _ratio(zone: Zone, area: OperatingArea, accel_m_s2: float) -> float:
    motion = TourLimits(SPEED_M_S, accel_m_s2, RADIUS_M - MISS_M - EVENED_M)
    site = site_of(zone.shape, FlyableRegion(area, (), LIMITS, zone), motion, RADIUS_M)
    search = begin_search(site, 0, TEAM)
    while search.units < UNITS:
        search.work(site)
    return best_ratio(search, zone.shape)
