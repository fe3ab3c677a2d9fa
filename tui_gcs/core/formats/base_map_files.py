"""Base maps: vector tiles of water, roads, buildings and contour lines in one file, PMTiles or MBTiles.

PMTiles version 3 (github.com/protomaps/PMTiles, spec/v3) is read by `pmtiles`, MBTiles 1.3 (an SQLite database with the
rows counted from the south) by Python's sqlite3; a tile is a Mapbox Vector Tile version 2, read by
`mapbox_vector_tile`. Both libraries are an extra of this package (`pip install "tui-gcs[maps]"`).

Nothing of a file is shown as text: only lines are taken, of layers whose names say what they are. The files come from
anywhere, so sizes and counts are limited; a damaged tile is empty, and is counted.
"""

import math
import sqlite3
import threading
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import FormatError

MAX_TILE_BYTES = 8 << 20
"""Of one tile, unpacked; those of towns are below 1 MB."""
MAX_DIRECTORY_BYTES = 1 << 20
"""Of one PMTiles directory, unpacked: some 100,000 entries; writers begin another one after some thousand."""
MAX_NUMBERS = 1_000_000
"""Of coordinates and properties in one tile, before it is decoded; lines beyond are left out. The centre of Florence
has 220,000. As lists of Python they take a hundred times the room that they have in the tile: 8 MB became 860 MB."""
MAX_SEGMENTS = 100_000
"""Straight pieces of one tile; more are left out. The centre of Florence has 49,000."""
MAX_ZOOM = 22
SQL_STEPS = 100_000
"""Virtual machine steps of SQLite after which a query is given up: a tile is found by its index in a few hundred."""
LEAST_ZOOM = "SELECT zoom_level FROM tiles ORDER BY zoom_level ASC LIMIT 1"
MOST_ZOOM = "SELECT zoom_level FROM tiles ORDER BY zoom_level DESC LIMIT 1"
TOO_OLD = "a PMTiles file of an old version; `pmtiles convert` makes version 3 of it"
NO_LIBRARY = 'reading base maps takes more packages: pip install "tui-gcs[maps]"'

Segments = NDArray[np.float64]
"""(n, 4): latitude and longitude of the begin, then of the end of straight pieces, in degrees."""


class GroundKind(StrEnum):
    """What a line of a base map is."""

    WATER = "water"
    MAIN_ROAD = "main road"
    ROAD = "road"
    BUILDING = "building"
    CONTOUR = "contour line"


LAYER_KINDS = {
    **dict.fromkeys(
        ("water", "ocean", "water_polygons", "waterway", "water_lines", "physical_line", "coastline"), GroundKind.WATER
    ),
    **dict.fromkeys(("transportation", "roads", "road", "streets", "highway"), GroundKind.ROAD),
    **dict.fromkeys(("building", "buildings"), GroundKind.BUILDING),
    **dict.fromkeys(("contour", "contours", "contour_lines", "elevation"), GroundKind.CONTOUR),
}
"""By a layer's name in the schemas of OpenMapTiles, Protomaps, Shortbread and Mapbox Streets."""
CLASS_KEYS = ("class", "kind", "highway", "pmap:kind", "kind_detail")
"""The properties that hold the class of a road in these schemas."""
MAIN_ROADS = frozenset({"motorway", "trunk", "primary", "secondary", "highway", "major_road", "rail"})


class TileId(NamedTuple):
    """A tile of the Web Mercator pyramid: column from the west, row from the north."""

    zoom: int
    x: int
    y: int


Tile = dict[GroundKind, Segments]


@dataclass(frozen=True)
class _TileSource:
    """Where the packed tiles of a file are."""

    packed: Callable[[TileId], bytes | None]
    """The bytes of a tile, None if the file has none there. Raises FormatError."""
    min_zoom: int
    max_zoom: int


class BaseMap:
    """A base map file. Tiles may be asked for on any one thread at a time."""

    def __init__(self, name: str, source: _TileSource) -> None:
        self.name = name
        """The file's name, cleaned."""
        self.min_zoom, self.max_zoom = source.min_zoom, source.max_zoom
        self.damaged = 0
        """How many tiles could not be read."""
        self._packed = source.packed
        self._lock = threading.Lock()

    def tile(self, place: TileId) -> Tile:
        """The lines of a tile; empty where the file has none, and where it is damaged."""
        with self._lock:
            try:
                data = self._packed(place)
                return _lines_of(_unpacked(data, MAX_TILE_BYTES), place) if data else {}
            except FormatError:
                self.damaged += 1
                return {}


def read_base_map(path: Path) -> BaseMap:
    """Open a base map; its tiles are read when they are asked for.

    Raises FormatError, one line without the path.
    """
    _need_libraries()
    try:
        with open_plain(path) as file:
            begin = file.read(16)
    except (OSError, ValueError) as error:
        raise FormatError(error.strerror or "" if isinstance(error, OSError) else str(error)) from None
    if begin.startswith(b"PMTiles"):
        source = _pmtiles(path)
    elif begin.startswith(b"SQLite format 3\0"):
        source = _mbtiles(path)
    else:
        raise FormatError("no base map: .pmtiles or .mbtiles with vector tiles")
    if not 0 <= source.min_zoom <= source.max_zoom <= MAX_ZOOM:
        raise FormatError(f"zoom {source.min_zoom} to {source.max_zoom}: 0 to {MAX_ZOOM} are possible")
    return BaseMap(clean(path.name, 60), source)


def _need_libraries() -> None:
    """Raises FormatError if the extra is not installed."""
    try:
        import mapbox_vector_tile  # noqa: F401
        import pmtiles  # noqa: F401
    except ImportError:
        raise FormatError(NO_LIBRARY) from None


def _pmtiles(path: Path) -> _TileSource:
    """Open a PMTiles file. Raises FormatError."""
    from pmtiles.tile import Compression, SpecVersionUnsupported, TileType, deserialize_header

    get_bytes = _reader(path)
    try:
        header = deserialize_header(get_bytes(0, 127))
    except SpecVersionUnsupported:
        raise FormatError(TOO_OLD) from None
    except (ValueError, IndexError):
        raise FormatError("a damaged PMTiles file: its header cannot be read") from None
    if header["tile_type"] is not TileType.MVT:
        raise FormatError("its tiles are pictures: a base map needs vector tiles")
    if header["internal_compression"] is not Compression.GZIP:
        raise FormatError("its directories are not packed with gzip, which this program needs")
    if header["tile_compression"] not in (Compression.GZIP, Compression.NONE):
        raise FormatError("its tiles are packed with brotli or zstd: gzip or none is needed")
    return _TileSource(lambda place: _pmtiles_tile(get_bytes, header, place), header["min_zoom"], header["max_zoom"])


def _reader(path: Path) -> Callable[[int, int], bytes]:
    """Return a function for so many bytes from an offset of the file, which stays open. Both raise FormatError.

    The library would map the file into memory: writing a shorter one over it then ends the whole console (SIGBUS).
    """
    try:
        file = open_plain(path)
    except OSError as error:
        raise FormatError(error.strerror or "cannot be read") from None

    def get_bytes(offset: int, length: int) -> bytes:
        try:
            file.seek(offset)
            return file.read(max(length, 0))
        except (OSError, ValueError, OverflowError) as error:
            raise FormatError(f"damaged: {clean(str(error), 60)}") from None

    return get_bytes


def _pmtiles_tile(get_bytes: Callable[[int, int], bytes], header: Any, place: TileId) -> bytes | None:
    """Look a tile up in the directories: the root and at most three below it. Raises FormatError."""
    from pmtiles.tile import deserialize_directory, find_tile, zxy_to_tileid

    number = zxy_to_tileid(*place)
    offset, length = header["root_offset"], header["root_length"]
    for _ in range(4):
        packed = get_bytes(offset, min(length, MAX_DIRECTORY_BYTES))
        _unpacked(packed, MAX_DIRECTORY_BYTES)  # the library would unpack any size
        try:
            found = find_tile(deserialize_directory(packed), number)
        except (EOFError, OSError, IndexError, zlib.error) as error:
            raise FormatError(f"a damaged directory: {clean(str(error), 60)}") from None
        if found is None:
            return None
        if found.run_length > 0:
            data = get_bytes(header["tile_data_offset"] + found.offset, min(found.length, MAX_TILE_BYTES + 1))
            if len(data) < found.length:
                raise FormatError("damaged: the file is cut off, or a tile is too large")
            return data
        offset, length = header["leaf_directory_offset"] + found.offset, found.length
    return None


def _mbtiles(path: Path) -> _TileSource:
    """Open an MBTiles file, read-only. Raises FormatError."""
    try:
        # Other threads ask, one at a time; `immutable` keeps SQLite from writing a journal beside the file.
        database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False)
        # A file may hold views that compute for ever.
        database.set_progress_handler(lambda: 1, SQL_STEPS)
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_TILE_BYTES + 1)
        named = dict(database.execute("SELECT name, value FROM metadata LIMIT 1000"))
        # One at a time SQLite finds them by its index, without looking at all tiles.
        (least,), (most,) = (database.execute(query).fetchone() or (None,) for query in (LEAST_ZOOM, MOST_ZOOM))
    except sqlite3.Error as error:
        raise FormatError(f"no MBTiles file: {clean(str(error), 80)}") from None
    if named.get("format", "pbf") != "pbf":
        raise FormatError("its tiles are pictures: a base map needs vector tiles (format pbf)")
    if not isinstance(least, int) or not isinstance(most, int):
        raise FormatError("an MBTiles file without tiles")
    return _TileSource(lambda place: _mbtiles_tile(database, place), least, most)


def _mbtiles_tile(database: sqlite3.Connection, place: TileId) -> bytes | None:
    query = "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?"
    try:
        row = database.execute(query, (place.zoom, place.x, (1 << place.zoom) - 1 - place.y)).fetchone()
    except (sqlite3.Error, OverflowError) as error:
        raise FormatError(clean(str(error), 80)) from None
    return row[0] if row is not None and isinstance(row[0], bytes) else None


def _unpacked(data: bytes, most_bytes: int) -> bytes:
    """Unpack gzip; other bytes stay as they are. Raises FormatError if it is damaged or larger than `most_bytes`."""
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        unpacker = zlib.decompressobj(wbits=31)
        found = unpacker.decompress(data, most_bytes + 1)
    except zlib.error as error:
        raise FormatError(f"damaged: {error}") from None
    if len(found) > most_bytes:
        raise FormatError(f"larger than {most_bytes >> 20} MB")
    if not unpacker.eof:
        raise FormatError("damaged: it is cut off")
    return found


def _lines_of(data: bytes, place: TileId) -> Tile:
    """The lines of a vector tile by their kind. Raises FormatError."""
    import mapbox_vector_tile
    from google.protobuf.message import DecodeError
    from mapbox_vector_tile.Mapbox import vector_tile_pb2

    try:
        message = vector_tile_pb2.tile.FromString(data)
        _keep_lines(message)
        layers = mapbox_vector_tile.decode(message.SerializeToString(), default_options={"y_coord_down": True})
    except (DecodeError, ValueError, IndexError, KeyError, AssertionError, OverflowError, MemoryError) as error:
        raise FormatError(f"a damaged tile: {clean(str(error), 60)}") from None
    found: dict[GroundKind, list[Segments]] = {}
    count = 0
    for name, layer in layers.items():
        extent = layer["extent"] if 0 < layer["extent"] <= 1 << 16 else 4096
        for feature in layer["features"]:
            for line in _lines(feature["geometry"]):
                pieces = _inside(np.array(line, dtype=np.float64).reshape(-1, 2) / extent)
                count += len(pieces)
                if len(pieces) and count <= MAX_SEGMENTS:
                    found.setdefault(_kind(name, feature["properties"]), []).append(pieces)
    return {kind: _to_degrees(np.concatenate(pieces), place) for kind, pieces in found.items()}


def _keep_lines(message: Any) -> None:
    """Remove from a parsed tile what is not drawn and what is too much, so that neither is decoded.

    Names and points of interest are most of many tiles. Only roads have properties that matter.
    """
    left = MAX_NUMBERS
    for number in reversed(range(len(message.layers))):
        layer = message.layers[number]
        if layer.name not in LAYER_KINDS:
            del message.layers[number]
            continue
        is_road = LAYER_KINDS[layer.name] is GroundKind.ROAD
        kept = 0
        for feature in layer.features:
            if not is_road:
                feature.ClearField("tags")
            left -= 2 + len(feature.geometry) + len(feature.tags)
            if left < 0:
                break
            kept += 1
        del layer.features[kept:]


def _kind(layer: str, properties: dict[str, Any]) -> GroundKind:
    kind = LAYER_KINDS[layer]
    is_main = kind is GroundKind.ROAD and any(properties.get(key) in MAIN_ROADS for key in CLASS_KEYS)
    return GroundKind.MAIN_ROAD if is_main else kind


def _lines(geometry: dict[str, Any]) -> Iterator[list[list[int]]]:
    """Lines, and the borders of areas; points are nothing to draw."""
    parts = geometry["coordinates"]
    if geometry["type"] == "LineString":
        yield parts
    elif geometry["type"] in ("MultiLineString", "Polygon"):
        yield from parts
    elif geometry["type"] == "MultiPolygon":
        for polygon in parts:
            yield from polygon


def _inside(points: NDArray[np.float64]) -> Segments:
    """(n, 4) the straight pieces between (n, 2) points of a tile, 0 to 1; those on or outside its border left out.

    An area that reaches beyond a tile is cut off along the border, or a little outside: that is no shore.
    """
    begin, end = points[:-1], points[1:]
    outside = ((begin <= 0.0) & (end <= 0.0)) | ((begin >= 1.0) & (end >= 1.0))
    kept = ~outside.any(axis=1) & (begin != end).any(axis=1)
    return np.hstack([begin[kept], end[kept]])


def _to_degrees(pieces: Segments, place: TileId) -> Segments:
    """Latitudes and longitudes of pieces in parts of a tile (spherical Web Mercator, EPSG:3857)."""
    size = float(1 << place.zoom)
    lon_deg = (place.x + pieces[:, ::2]) / size * 360.0 - 180.0
    north = math.pi * (1.0 - 2.0 * (place.y + pieces[:, 1::2]) / size)
    lat_deg = np.degrees(np.arctan(np.sinh(north)))
    return np.stack([lat_deg[:, 0], lon_deg[:, 0], lat_deg[:, 1], lon_deg[:, 1]], axis=1)


def tile_of(lat_deg: float, lon_deg: float, zoom: int) -> tuple[float, float]:
    """Column and row of a place, with fractions; latitudes beyond the map's edge (85.05 degrees) are at its edge."""
    size = float(1 << zoom)
    lat_rad = math.radians(min(max(lat_deg, -85.05), 85.05))
    return (lon_deg + 180.0) / 360.0 * size, (1.0 - math.asinh(math.tan(lat_rad)) / math.pi) / 2.0 * size
