"""Sensed targets on the map: position, uncertainty, and where each will be soon."""

from collections.abc import Sequence

import numpy as np

from tui_gcs.core.protocol.common import Track
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster, unit_circle
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

PREDICTION_S = 10.0
"""The line ahead of a target ends where it will be after this time."""
STALE_S = 3.0
"""A target that was not detected for this time is grey; its circle grows."""
RING_POINTS = 24
RING_SIGMAS = 2.0


def draw_tracks(raster: DotRaster, view: Viewport, tracks: Sequence[Track], now_s: float) -> None:
    """Draw for each target the ellipse that it is in with 95 %, and its path within `PREDICTION_S`."""
    circle = unit_circle(RING_POINTS)
    for track in tracks:
        if not track.confirmed:
            continue
        ink = ink_of(track, now_s)
        place, velocity = np.array(track.position_m[:2]), np.array(track.velocity_m_s[:2])
        (xx, xy, yy), ahead_s = track.covariance_m2, max(0.0, now_s - track.seen_s)
        # The position is that of the last detection: it is predicted to now.
        here = place + velocity * ahead_s
        raster.polyline(view.to_dots(np.array([here, here + velocity * PREDICTION_S])), ink, closed=False)
        # Without a detection the standard deviation grows by a metre a second.
        spread = np.array([[xx, xy], [xy, yy]]) + np.eye(2) * (ahead_s * ahead_s)
        # Rounding can make an eigenvalue slightly negative.
        values, axes = np.linalg.eigh(spread)
        ring = here + RING_SIGMAS * (circle * np.sqrt(np.maximum(values, 0.0))) @ axes.T
        raster.polyline(view.to_dots(ring), ink, closed=True)


def track_words(view: Viewport, tracks: Sequence[Track], now_s: float) -> list[Word]:
    """Return `@3` for a target, `?` for a detection that is not confirmed."""
    words = []
    for track in tracks:
        x, y, _ = track.position_m
        ahead_s = max(0.0, now_s - track.seen_s)
        cell = view.world_to_cell(x + track.velocity_m_s[0] * ahead_s, y + track.velocity_m_s[1] * ahead_s)
        if cell is not None and view.contains(cell):
            words.append(Word(*cell, f"@{track.id}" if track.confirmed else "?", ink_of(track, now_s)))
    return words


def ink_of(track: Track, now_s: float) -> Ink:
    """Return the ink of a target: grey if it is not confirmed or stale."""
    return Ink.TARGET if track.confirmed and now_s - track.seen_s <= STALE_S else Ink.MUTED
