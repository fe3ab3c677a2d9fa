"""Where single vehicles are being flown to: a line to the place, or the circle they fly; of planners' tours nothing."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from tui_gcs.core.protocol.common import Freshness, VehicleRow
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

GOAL_DASH = (3.0, 2.0)
NEAR_DOTS = 4.0
"""Nearer it is there: no line."""
RING = np.column_stack([f(np.linspace(0.0, math.tau, 48, endpoint=False)) for f in (np.cos, np.sin)])


def draw_goals(raster: DotRaster, view: Viewport, rows: Sequence[VehicleRow]) -> None:
    """A dashed line from each vehicle to its place."""
    for row in _going(view, rows):
        goal = np.array(row.goal_m[:2])
        if row.goal_radius_m > 0:
            raster.polyline(view.to_dots(goal + row.goal_radius_m * RING), Ink.PLAN, closed=True, dash=GOAL_DASH)
        else:
            way = np.array([row.position_m[:2], row.goal_m[:2]])
            raster.polyline(view.to_dots(way), Ink.PLAN, dash=GOAL_DASH)


def goal_words(view: Viewport, rows: Sequence[VehicleRow], glyphs: GlyphSet) -> list[Word]:
    """Whose place it is."""
    words = []
    for row in _going(view, rows):
        cell = view.world_to_cell(*row.goal_m[:2])
        if cell is not None and view.contains(cell):
            words.append(Word(*cell, f"{glyphs.marker}{row.id}", Ink.PLAN))
    return words


def _going(view: Viewport, rows: Sequence[VehicleRow]) -> Iterable[VehicleRow]:
    """Those with a place that they are not at; who is not heard may be anywhere."""
    for row in rows:
        if row.freshness is Freshness.LOST or not all(map(math.isfinite, (*row.goal_m[:2], *row.position_m[:2]))):
            continue
        if row.goal_radius_m > 0 or math.dist(row.goal_m[:2], row.position_m[:2]) > NEAR_DOTS * view.m_per_dot:
            yield row
