"""Detours: ways from a tour to places that see what it leaves out, and back again.

Descent weighs walls against cells, so a tour may look into a pocket through the wall of a no-fly zone. Led round the
wall, it misses the pocket. A few detours see it for certain.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.lazy_scipy import nearest
from tui_gcs.planner.patrol.tour_site import TourSite
from tui_gcs.planner.patrol.tour_smoothing import TourDraft

Floats = NDArray[np.floating[Any]]

STEP_M = 1.0
"""Spacing of a detour's control points: its spline cuts corners by less than half of this."""
OFF_EDGE_M = 0.05
"""How far inside the edge a goal is put that would be outside by rounding."""
MAX_DETOURS = 40
"""A tour that needs more is no tour."""


def with_detours(site: TourSite, draft: TourDraft, farther_m: float) -> TourDraft:
    """Return the draft inside the region, with detours until its path sees all cells of the site.

    A detour turns `farther_m` behind the place that sees its cell, as far as walls allow: averaging shortens it.
    """
    path = site.region.closed_inside(draft.path_m(), STEP_M)
    path = path[_every_step(path)]
    for _ in range(MAX_DETOURS):
        away_m = nearest(path, site.cells)[0]
        cell = int(away_m.argmax())
        if away_m[cell] <= site.motion.radius_m - farther_m / 2.0:
            break
        path = _led_to(site, path, site.cells[cell], farther_m)
    return TourDraft(f"{draft.name}, detours", path, 1.0)


def _led_to(site: TourSite, path: Floats, cell_m: Floats, farther_m: float) -> Floats:
    """Return the path (k, 2) with a way to where the cell is seen, and the same way back."""
    goal_m = site.region.pulled_inside(cell_m[None])
    if not site.region.contains(goal_m)[0]:  # there is no way to it
        goal_m = site.region.pulled_inside(cell_m[None], OFF_EDGE_M)
    begin = int(np.hypot(*(path - goal_m).T).argmin())
    way = site.region.open_inside(np.stack([path[begin], goal_m[0]]), STEP_M)
    sees = np.hypot(*(way - cell_m).T) <= site.motion.radius_m - farther_m
    way = way[: int(sees.argmax()) + 1] if sees.any() else way
    return np.vstack([path[: begin + 1], way[1:], way[-2::-1], path[begin + 1 :]])


def _every_step(path: Floats) -> NDArray[np.intp]:
    """Return rows of a closed path's points that are about `STEP_M` apart; never fewer than eight."""
    way_m = np.cumsum(np.hypot(*np.diff(path, axis=0, prepend=path[-1:]).T))
    _, first = np.unique((way_m / STEP_M).astype(int), return_index=True)
    return np.asarray(first if len(first) >= 8 else np.arange(len(path)))
