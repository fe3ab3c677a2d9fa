"""The base map under a map: water, roads, buildings and contour lines of the operator's file, as dotted lines.

Tiles are read and decoded on a thread of their own and kept; drawing those that are there takes some milliseconds. All
lines are dotted, so that without colour, too, none is taken for a zone, an area or a tour.
"""

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tui_gcs.core.formats.base_map_files import BaseMap, GroundKind, Tile, TileId, tile_of
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y, Viewport

EQUATOR_M = 40_075_016.686
"""Length of the equator in the Web Mercator projection (EPSG:3857)."""
LEAST_TILE_DOTS = 128
"""A tile is at least so many dots wide on the map: some are then in view, each with the detail that dots can show."""
MAX_IN_VIEW = 40
"""With more tiles in view the file has none for so far a look; nothing of it is drawn."""
MAX_KEPT = 96
FINEST_M_PER_DOT = {
    GroundKind.BUILDING: 1.5,
    GroundKind.CONTOUR: 15.0,
    GroundKind.ROAD: 6.0,
    GroundKind.MAIN_ROAD: math.inf,
    GroundKind.WATER: math.inf,
}
"""Up to which scale a kind is drawn: farther out its lines would fill the map. In the order of drawing."""
LOOKS: dict[GroundKind, tuple[Ink, tuple[float, float]]] = {
    GroundKind.BUILDING: (Ink.BUILDING, (1.0, 2.0)),
    GroundKind.CONTOUR: (Ink.CONTOUR, (1.0, 4.0)),
    GroundKind.ROAD: (Ink.ROAD, (1.0, 1.0)),
    GroundKind.MAIN_ROAD: (Ink.ROAD, (3.0, 1.0)),
    GroundKind.WATER: (Ink.WATER, (1.0, 1.0)),
}
"""Ink, and dots on and off."""


class BaseMapTiles:
    """The tiles of a base map that are needed now: those in view first, read on a thread."""

    def __init__(self, base_map: BaseMap) -> None:
        self.base_map = base_map
        self._kept: OrderedDict[TileId, Tile] = OrderedDict()
        self._wanted: list[TileId] = []
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._listeners: list[Callable[[], None]] = []

    def listen(self, listener: Callable[[], None]) -> None:
        """Call `listener`, on the thread, whenever another tile is there."""
        self._listeners.append(listener)

    def ready(self, places: Sequence[TileId]) -> list[Tile]:
        """The tiles of `places` that are there; the others are read, and those wanted before are not any more."""
        with self._lock:
            found = [self._kept[place] for place in places if place in self._kept]
            for place in places:
                if place in self._kept:
                    self._kept.move_to_end(place)
            self._wanted = [place for place in places if place not in self._kept]
            if self._wanted and self._thread is None:
                self._thread = threading.Thread(target=self._read, name="base map", daemon=True)
                self._thread.start()
        return found

    def _read(self) -> None:
        """Read what is wanted, until nothing is."""
        while True:
            with self._lock:
                if not self._wanted:
                    self._thread = None
                    return
                place = self._wanted.pop(0)
            tile = self.base_map.tile(place)
            with self._lock:
                self._kept[place] = tile
                while len(self._kept) > MAX_KEPT:
                    self._kept.popitem(last=False)
            for listener in self._listeners:
                listener()


def draw_base_map(tiles: BaseMapTiles, view: Viewport, frame: LocalFrame) -> DotRaster:
    """Draw what is there of the base map in this view; the rest is asked for."""
    raster = DotRaster(view.columns, view.rows)
    there = tiles.ready(list(tiles_in_view(tiles.base_map, view, frame)))
    for kind, coarsest in FINEST_M_PER_DOT.items():
        lines = [tile[kind] for tile in there if kind in tile]
        if not lines or view.m_per_dot > coarsest:
            continue
        pieces = np.concatenate(lines)
        begins = np.stack(frame.to_enu(pieces[:, 0], pieces[:, 1]), axis=1)
        ends = np.stack(frame.to_enu(pieces[:, 2], pieces[:, 3]), axis=1)
        ink, dash = LOOKS[kind]
        raster.segments(view.to_dots(begins), view.to_dots(ends), ink, dash=dash)
    return raster


def tiles_in_view(base_map: BaseMap, view: Viewport, frame: LocalFrame) -> Iterator[TileId]:
    """The tiles that the view shows a part of, those in the middle first; none where they would be too many."""
    half_x_m = view.columns * DOTS_X * view.m_per_dot / 2.0
    half_y_m = view.rows * DOTS_Y * view.m_per_dot / 2.0
    lat_deg, _ = frame.to_geodetic(*view.centre_m)
    if not abs(lat_deg) < 85.0:
        return
    tile_m = EQUATOR_M * math.cos(math.radians(lat_deg))
    finest = math.floor(math.log2(tile_m / (LEAST_TILE_DOTS * view.m_per_dot)))
    zoom = min(max(finest, base_map.min_zoom), base_map.max_zoom)
    (west, south), (east, north) = (
        tile_of(*frame.to_geodetic(view.centre_m[0] + side * half_x_m, view.centre_m[1] + side * half_y_m), zoom)
        for side in (-1.0, 1.0)
    )
    columns = range(math.floor(west), math.floor(east) + 1)
    rows = range(max(0, math.floor(north)), min((1 << zoom) - 1, math.floor(south)) + 1)
    if len(columns) * len(rows) > MAX_IN_VIEW:
        return
    middle = ((west + east) / 2.0 - 0.5, (north + south) / 2.0 - 0.5)
    places = [(math.dist((x, y), middle), x, y) for x in columns for y in rows]
    for _, x, y in sorted(places):
        yield TileId(zoom, x % (1 << zoom), y)
