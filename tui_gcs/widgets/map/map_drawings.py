"""Lines and words that a screen has the map draw besides the scene: in ENU metres, each with its ink."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import SOLID, DotRaster, Points
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport


class MapLine(NamedTuple):
    """A line through (n, 2) points, ENU metres; `dash` is dots on, dots off."""

    points_m: Points
    ink: Ink
    closed: bool = False
    dash: tuple[float, float] = SOLID


class MapWord(NamedTuple):
    """A sign or a few letters at a place; those that `must` be seen are written over others."""

    place_m: tuple[float, float]
    text: str
    ink: Ink
    must: bool = False


def draw_lines(raster: DotRaster, view: Viewport, lines: Sequence[MapLine]) -> None:
    """Draw these lines into the raster."""
    for line in lines:
        raster.polyline(view.to_dots(np.asarray(line.points_m)), line.ink, closed=line.closed, dash=line.dash)


def words_at(view: Viewport, words: Sequence[MapWord], *, must: bool) -> list[Word]:
    """Return the words in view, either those that must be seen or the others."""
    found = []
    for word in words:
        cell = view.world_to_cell(*word.place_m) if word.must is must else None
        if cell is not None and view.contains(cell):
            found.append(Word(*cell, word.text, word.ink))
    return found
