"""Other aircraft, as transponders report them, and drawings from files, on the map."""

import math
from collections.abc import Sequence

import numpy as np

from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.setup import TrafficRow
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

NEAR_M, NEAR_ABOVE_M = 1000.0, 150.0
"""Traffic this near to one of our vehicles is shown as a caution."""
MAX_OVERLAY_LABELS = 40


def traffic_words(view: Viewport, traffic: Sequence[TrafficRow], frame: LocalFrame) -> list[Word]:
    """Return `*` for each aircraft, with its name and its height above the vehicle that received it; nearest first."""
    words = []
    for row in sorted(traffic, key=lambda row: row.distance_m if math.isfinite(row.distance_m) else math.inf):
        cell = view.world_to_cell(*frame.to_enu(row.lat_deg, row.lon_deg))
        if cell is not None and view.contains(cell):
            above = f" {row.above_m:+.0f}m" if math.isfinite(row.above_m) else ""
            # Comparing NaN is false: an aircraft whose height is not known counts as near.
            near = row.distance_m < NEAR_M and not abs(row.above_m) > NEAR_ABOVE_M
            ink = Ink.MUTED if row.simulated else Ink.CAUTION if near else Ink.ADVISORY
            words.append(Word(*cell, f"*{row.callsign or format(row.icao, '06X')}{above}", ink))
    return words


def draw_overlays(raster: DotRaster, view: Viewport, overlays: Sequence[Overlay], frame: LocalFrame) -> None:
    """Draw lines and outlines from files."""
    for overlay in overlays:
        if overlay.kind != "point":
            dots = view.to_dots(_enu_m(overlay, frame))
            raster.polyline(dots, Ink.OVERLAY, closed=overlay.kind == "area")


def overlay_words(view: Viewport, overlays: Sequence[Overlay], frame: LocalFrame) -> list[Word]:
    """Return points as `o`, and names, of drawings in view; no more than can be read."""
    words: list[Word] = []
    for overlay in overlays:
        place = _enu_m(overlay, frame).mean(axis=0)
        cell = view.world_to_cell(float(place[0]), float(place[1]))
        text = ("o" if overlay.kind == "point" else "") + overlay.name
        if text and cell is not None and view.contains(cell):
            words.append(Word(*cell, text, Ink.OVERLAY))
            if len(words) >= MAX_OVERLAY_LABELS:
                break
    return words


def _enu_m(overlay: Overlay, frame: LocalFrame) -> np.ndarray:
    places = np.array(overlay.places_deg, dtype=np.float64).reshape(-1, 2)
    return np.column_stack(frame.to_enu(places[:, 0], places[:, 1]))
