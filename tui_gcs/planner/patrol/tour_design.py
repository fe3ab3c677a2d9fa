"""The tour of a zone at once, for planners that do not search on for a better one."""

import numpy as np

from tui_gcs.planner.api import Shape
from tui_gcs.planner.patrol.flyable_region import Region
from tui_gcs.planner.patrol.tour_search import begun
from tui_gcs.planner.patrol.tour_site import Design, site_of
from tui_gcs.planner.patrol.tour_smoothing import Motion


def design(
    shape: Shape, region: Region, motion: Motion, footprint_m: float, n: int, rng: np.random.Generator
) -> Design:
    """The best tour found in about a second for `n` vehicles over `shape`. The same arguments give the same tour.

    Raises:
        ValueError: no part of the zone can be seen from where vehicles may fly.
    """
    found = begun(site_of(shape, region, motion, footprint_m), int(rng.integers(2**32)), max(1, n)).best
    if found is None:
        raise ValueError("the zone has no tour")
    return found
