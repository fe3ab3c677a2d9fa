"""The base map under a map: water, roads, buildings and contour lines of the operator's file, as dotted lines.

Tiles are read and decoded on a thread of their own and kept; drawing those that are there takes some milliseconds. All
lines are dotted, so that without colour, too, none is taken for a zone, an area or a tour.
"""

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum

import numpy as np

from tui_gcs.core.formats.base_map_files import BaseMap, GroundKind, Segments, Tile, TileId, tile_of
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_viewport import Viewport

EQUATOR_M = 40_075_016.686
"""Length of the equator in the Web Mercator projection (EPSG:3857)."""
LEAST_TILE_DOTS = 128
"""A tile is at least so many dots wide on the map: some are then in view, each with the detail that dots can show."""
MAX_IN_VIEW = 40
"""With more tiles in view the file has none for so far a look; nothing of it is drawn."""
MAX_KEPT = 96
MAX_KEPT_PIECES = 4_000_000
"""Of all tiles that are kept, 130 MB: what `MAX_IN_VIEW` tiles have at most, so that no view drops its own."""
COARSEST_M_PER_DOT = {
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


class BaseMapState(StrEnum):
    """Why a map shows what it shows of its base map, in the operator's words."""

    SHOWN = ""
    NO_FILE = "no file"
    TOO_FAR = "zoom in"
    """More tiles would be needed than are read."""
    READING = "reading"
    NOTHING_HERE = "nothing here"
    """The file covers another region, or has none of the layers that are drawn."""
    DAMAGED = "damaged"


class BaseMapTiles:
    """The tiles of a base map that its maps need now: those in view first, read on a thread."""

    def __init__(self, base_map: BaseMap) -> None:
        self.base_map = base_map
        self._kept: OrderedDict[TileId, Tile] = OrderedDict()
        self._pieces = 0
        """Of all tiles that are kept."""
        self.read_count = 0
        """Tiles that were read so far: what was drawn before may lack the newest."""
        self._wanted: dict[object, list[TileId]] = {}
        """The tiles that each map still lacks."""
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._listeners: list[Callable[[], None]] = []

    def listen(self, listener: Callable[[], None]) -> None:
        """Call `listener`, on the thread, whenever another tile is there."""
        self._listeners.append(listener)

    def ready(self, places: Sequence[TileId], viewer: object) -> list[Tile]:
        """The tiles of `places` that are there; the others are read, and what this viewer wanted before no longer is.

        `viewer` stands for one map: another one that already has its tiles must not cancel the reading for this one.
        """
        with self._lock:
            found = [self._kept[place] for place in places if place in self._kept]
            for place in places:
                if place in self._kept:
                    self._kept.move_to_end(place)
            self._wanted.pop(viewer, None)
            if missing := [place for place in places if place not in self._kept]:
                self._wanted[viewer] = missing
                if self._thread is None:
                    self._thread = threading.Thread(target=self._read, name="base map", daemon=True)
                    self._thread.start()
        return found

    def wait(self, timeout_s: float) -> bool:
        """Wait until nothing is being read; return whether that came about in time."""
        thread = self._thread
        if thread is not None:
            thread.join(timeout_s)
        return self._thread is None

    def _read(self) -> None:
        """Read what is wanted, until nothing is."""
        while (place := self._next()) is not None:
            tile = self.base_map.tile(place)
            with self._lock:
                self._keep(place, tile)
            for listener in self._listeners:
                listener()

    def _next(self) -> TileId | None:
        """The tile to be read next, for the map that was drawn last; None ends the thread."""
        with self._lock:
            while self._wanted:
                viewer, places = next(reversed(self._wanted.items()))
                while places:
                    if (place := places.pop(0)) not in self._kept:
                        return place
                del self._wanted[viewer]
            self._thread = None
            return None

    def _keep(self, place: TileId, tile: Tile) -> None:
        self._kept[place] = tile
        self.read_count += 1
        self._pieces += _count(tile)
        while len(self._kept) > MAX_KEPT or self._pieces > MAX_KEPT_PIECES:
            _, dropped = self._kept.popitem(last=False)
            self._pieces -= _count(dropped)


def _count(tile: Tile) -> int:
    return sum(len(pieces) for pieces in tile.values())


def draw_base_map(
    tiles: BaseMapTiles, view: Viewport, frame: LocalFrame, viewer: object = None
) -> tuple[DotRaster, BaseMapState]:
    """Draw what is there of the base map in this view; the rest is asked for. `viewer` stands for the map."""
    raster = DotRaster(view.columns, view.rows)
    needed = list(tiles_in_view(tiles.base_map, view, frame))
    there = tiles.ready(needed, viewer)
    _, south_m, _, north_m = view.bounds_m
    south_deg, north_deg = (frame.to_geodetic(0.0, y_m)[0] for y_m in (south_m, north_m))
    for kind, coarsest in COARSEST_M_PER_DOT.items():
        if view.m_per_dot > coarsest:
            continue
        lines = [_between(tile[kind], south_deg, north_deg) for tile in there if kind in tile]
        if not lines:
            continue
        pieces = np.concatenate(lines)
        begins = np.stack(frame.to_enu(pieces[:, 0], pieces[:, 1]), axis=1)
        ends = np.stack(frame.to_enu(pieces[:, 2], pieces[:, 3]), axis=1)
        ink, dash = LOOKS[kind]
        raster.segments(view.to_dots(begins), view.to_dots(ends), ink, dash=dash)
    return raster, _state(tiles, needed, there)


def _between(pieces: Segments, south_deg: float, north_deg: float) -> Segments:
    """The pieces that are not wholly north or south of the view: mostly a few of a tile, and the rest costs less."""
    begins, ends = pieces[:, 0], pieces[:, 2]
    return pieces[(np.maximum(begins, ends) >= south_deg) & (np.minimum(begins, ends) <= north_deg)]


def _state(tiles: BaseMapTiles, needed: Sequence[TileId], there: Sequence[Tile]) -> BaseMapState:
    if not needed:
        return BaseMapState.TOO_FAR
    if any(there):
        return BaseMapState.SHOWN
    if len(there) < len(needed):
        return BaseMapState.READING
    return BaseMapState.DAMAGED if tiles.base_map.damaged else BaseMapState.NOTHING_HERE


def tiles_in_view(base_map: BaseMap, view: Viewport, frame: LocalFrame) -> Iterator[TileId]:
    """The tiles that the view shows a part of, those in the middle first; none where they would be too many."""
    lat_deg, _ = frame.to_geodetic(*view.centre_m)
    if not abs(lat_deg) < 85.0:
        return
    tile_m = EQUATOR_M * math.cos(math.radians(lat_deg))
    finest = math.floor(math.log2(tile_m / (LEAST_TILE_DOTS * view.m_per_dot)))
    zoom = min(max(finest, base_map.min_zoom), base_map.max_zoom)
    west_m, south_m, east_m, north_m = view.bounds_m
    west, south = tile_of(*frame.to_geodetic(west_m, south_m), zoom)
    east, north = tile_of(*frame.to_geodetic(east_m, north_m), zoom)
    columns = range(math.floor(west), math.floor(east) + 1)
    rows = range(max(0, math.floor(north)), min((1 << zoom) - 1, math.floor(south)) + 1)
    if len(columns) * len(rows) > MAX_IN_VIEW:
        return
    middle = ((west + east) / 2.0 - 0.5, (north + south) / 2.0 - 0.5)
    places = [(math.dist((x, y), middle), x, y) for x in columns for y in rows]
    for _, x, y in sorted(places):
        yield TileId(zoom, x % (1 << zoom), y)
