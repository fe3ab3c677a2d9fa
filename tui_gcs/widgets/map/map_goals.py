"""Where single vehicles are flying to: a line to the goal, or the circle flown. Planners draw their own tours."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from tui_gcs.core.protocol.common import Freshness, VehicleRow
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster, unit_circle
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

GOAL_DASH = (3.0, 2.0)
MIN_LINE_DOTS = 4.0
"""A vehicle nearer to its goal than this has no line to it."""
RING = unit_circle(48)


def draw_goals(raster: DotRaster, view: Viewport, rows: Sequence[VehicleRow]) -> None:
    """Draw a dashed line from each vehicle to its goal, or the circle that it flies."""
    for row in _vehicles_with_goals(view, rows):
        goal = np.array(row.goal_m[:2])
        if row.goal_radius_m > 0:
            raster.polyline(view.to_dots(goal + row.goal_radius_m * RING), Ink.PLAN, closed=True, dash=GOAL_DASH)
        else:
            line = np.array([row.position_m[:2], row.goal_m[:2]])
            raster.polyline(view.to_dots(line), Ink.PLAN, dash=GOAL_DASH)


def goal_words(view: Viewport, rows: Sequence[VehicleRow], glyphs: GlyphSet) -> list[Word]:
    """Return a marker with the vehicle's id for each goal in view."""
    words = []
    for row in _vehicles_with_goals(view, rows):
        cell = view.world_to_cell(*row.goal_m[:2])
        if cell is not None and view.contains(cell):
            words.append(Word(*cell, f"{glyphs.marker}{row.id}", Ink.PLAN))
    return words


def _vehicles_with_goals(view: Viewport, rows: Sequence[VehicleRow]) -> Iterable[VehicleRow]:
    """Yield the vehicles that are away from their goal, except lost ones: these may be anywhere."""
    for row in rows:
        # A lost vehicle may be anywhere, so a line from its last place would be a guess.
        if row.freshness is Freshness.LOST or not all(map(math.isfinite, (*row.goal_m[:2], *row.position_m[:2]))):
            continue
        if row.goal_radius_m > 0 or math.dist(row.goal_m[:2], row.position_m[:2]) > MIN_LINE_DOTS * view.m_per_dot:
            yield row
