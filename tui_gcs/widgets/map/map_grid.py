"""Grid and scale bar of the map."""

import math

import numpy as np

from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import DOTS_X, Viewport

GRID_DASH = (1.0, 5.0)
MIN_GRID_DOTS = 24.0
"""The least distance between two grid lines."""
MIN_BAR_CELLS = 5.0


def round_length_m(least_m: float) -> float:
    """Return the next of 1, 2, 5, 10, 20 … metres that is not below `least_m`."""
    decade = 10.0 ** math.floor(math.log10(least_m))
    return float(next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= least_m * (1.0 - 1e-9)))


def draw_grid(raster: DotRaster, view: Viewport) -> None:
    """Draw lines of equal easting and northing, at round numbers."""
    step_m = round_length_m(MIN_GRID_DOTS * view.m_per_dot)
    west, south, east, north = view.bounds_m
    for x_m in np.arange(math.ceil(west / step_m), math.floor(east / step_m) + 1) * step_m:
        raster.polyline(view.to_dots([(x_m, south), (x_m, north)]), Ink.GRID, dash=GRID_DASH)
    for y_m in np.arange(math.ceil(south / step_m), math.floor(north / step_m) + 1) * step_m:
        raster.polyline(view.to_dots([(west, y_m), (east, y_m)]), Ink.GRID, dash=GRID_DASH)


def scale_word(view: Viewport, glyphs: GlyphSet) -> Word:
    """Return a bar of a round length, in the lower left corner."""
    length_m = round_length_m(MIN_BAR_CELLS * DOTS_X * view.m_per_dot)
    cells = max(2, round(length_m / (DOTS_X * view.m_per_dot)))
    left, middle, right = tuple(glyphs.bar)
    text = f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
    return Word(0, view.rows - 1, f"{left}{middle * (cells - 2)}{right} {text}", Ink.MUTED)
