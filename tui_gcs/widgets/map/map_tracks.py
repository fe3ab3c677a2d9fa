"""Sensed targets on the map: where, how sure, and where each will be soon."""

from collections.abc import Sequence

import numpy as np

from tui_gcs.core.protocol.common import Track
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

SOON_S = 10.0
"""The line ahead of a target is where it will be by then."""
OLD_S = 3.0
"""Not detected for so long a target is grey, and its circle grows."""
RING_POINTS = 24
RING_SIGMAS = 2.0


def draw_tracks(raster: DotRaster, view: Viewport, tracks: Sequence[Track], now_s: float) -> None:
    """For each target a circle it is in with 95 %, and the way it takes within `SOON_S`."""
    angles = np.linspace(0.0, 2.0 * np.pi, RING_POINTS, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for track in tracks:
        if not track.confirmed:
            continue
        ink = ink_of(track, now_s)
        place, velocity = np.array(track.position_m[:2]), np.array(track.velocity_m_s[:2])
        (xx, xy, yy), ahead_s = track.covariance_m2, max(0.0, now_s - track.seen_s)
        here = place + velocity * ahead_s
        raster.polyline(view.to_dots(np.array([here, here + velocity * SOON_S])), ink, closed=False)
        spread = np.array([[xx, xy], [xy, yy]]) + np.eye(2) * (ahead_s * ahead_s)  # a metre a second, unseen
        values, axes = np.linalg.eigh(spread)
        ring = here + RING_SIGMAS * (circle * np.sqrt(np.maximum(values, 0.0))) @ axes.T
        raster.polyline(view.to_dots(ring), ink, closed=True)


def track_words(view: Viewport, tracks: Sequence[Track], now_s: float) -> list[Word]:
    """`@3` at a target, `?` where something was detected that may be nothing."""
    words = []
    for track in tracks:
        x, y, _ = track.position_m
        ahead_s = max(0.0, now_s - track.seen_s)
        cell = view.world_to_cell(x + track.velocity_m_s[0] * ahead_s, y + track.velocity_m_s[1] * ahead_s)
        if cell is not None and view.contains(cell):
            words.append(Word(*cell, f"@{track.id}" if track.confirmed else "?", ink_of(track, now_s)))
    return words


def ink_of(track: Track, now_s: float) -> Ink:
    """Grey for what is doubtful or old."""
    return Ink.TARGET if track.confirmed and now_s - track.seen_s <= OLD_S else Ink.MUTED
