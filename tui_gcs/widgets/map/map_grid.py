"""Grid and scale bar: how far things are apart."""

import math

import numpy as np

from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y, Viewport

GRID_DASH = (1.0, 5.0)
GRID_DOTS_MIN = 24.0
"""Least distance of two lines."""
BAR_CELLS_MIN = 5.0


def round_length_m(least_m: float) -> float:
    """The next of 1, 2, 5, 10, 20 … metres."""
    decade = 10.0 ** math.floor(math.log10(least_m))
    return float(next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= least_m * (1.0 - 1e-9)))


def draw_grid(raster: DotRaster, view: Viewport) -> None:
    """Lines of equal easting and northing, at round numbers."""
    step_m = round_length_m(GRID_DOTS_MIN * view.m_per_dot)
    half_m = (view.columns * DOTS_X * view.m_per_dot / 2.0, view.rows * DOTS_Y * view.m_per_dot / 2.0)
    (west, south), (east, north) = (
        tuple(centre + sign * half for centre, half in zip(view.centre_m, half_m, strict=True)) for sign in (-1.0, 1.0)
    )
    for x_m in np.arange(math.ceil(west / step_m), math.floor(east / step_m) + 1) * step_m:
        raster.polyline(view.to_dots([(x_m, south), (x_m, north)]), Ink.GRID, dash=GRID_DASH)
    for y_m in np.arange(math.ceil(south / step_m), math.floor(north / step_m) + 1) * step_m:
        raster.polyline(view.to_dots([(west, y_m), (east, y_m)]), Ink.GRID, dash=GRID_DASH)


def scale_word(view: Viewport, glyphs: GlyphSet) -> Word:
    """A bar of a round length, in the lower left corner."""
    length_m = round_length_m(BAR_CELLS_MIN * DOTS_X * view.m_per_dot)
    cells = max(2, round(length_m / (DOTS_X * view.m_per_dot)))
    left, middle, right = tuple(glyphs.bar)
    text = f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
    return Word(0, view.rows - 1, f"{left}{middle * (cells - 2)}{right} {text}", Ink.MUTED)
