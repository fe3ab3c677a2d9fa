"""The figures at the map's cursor: the ground below it, where a terrain file gives it."""

import numpy as np

from tui_gcs.core.geometry.elevation import Elevation, ElevationGrid
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.widgets.basics.glyphs import UNICODE
from tui_gcs.widgets.map.map_pointer import Pointer, pointer_texts

ORIGIN = Origin(47.0, 8.0, 400.0)


def test_the_ground_below_the_cursor() -> None:
    slope = np.tile(np.arange(21.0) * 10.0 + 300.0, (21, 1))
    elevation = Elevation("slope", [ElevationGrid(46.99, 7.99, 0.001, 0.001, slope)])
    east = Pointer((380.5, 0.0))
    assert "ground 450 m (+50 to origin)" in pointer_texts(east, ORIGIN, UNICODE, elevation)
    assert "ground unknown" in pointer_texts(Pointer((5000.0, 0.0)), ORIGIN, UNICODE, elevation)
    assert not any("ground" in text for text in pointer_texts(east, ORIGIN, UNICODE))
