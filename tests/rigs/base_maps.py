"""Small base maps of one town, made here: the same tile everywhere, in both kinds of file."""

import gzip
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mapbox_vector_tile
from pmtiles.tile import Compression, TileType, zxy_to_tileid
from pmtiles.writer import Writer

from tui_gcs.core.formats.base_map_files import tile_of

LAT_DEG, LON_DEG = 52.0720, -0.6280
"""Where the map is: the origin of the shipped scenario."""
SHORE, PRIMARY, STREET, HOUSES, CONTOUR = (
    "POLYGON((1000 -64, 2000 -64, 2000 4160, 1000 4160, 1000 -64))",
    "LINESTRING(0 1000, 4096 1400)",
    "LINESTRING(2500 0, 2600 4096)",
    "MULTIPOLYGON(((3000 700, 3200 700, 3200 800, 3000 800, 3000 700)),"
    "((3000 2700, 3200 2700, 3200 2800, 3000 2800, 3000 2700)))",
    "LINESTRING(0 3000, 4096 3600)",
)
HOSTILE = "[bold]\x1b[31m/etc/passwd"


def layer(name: str, *features: tuple[str, dict[str, Any]]) -> dict[str, Any]:
    return {"name": name, "features": [{"geometry": shape, "properties": of} for shape, of in features]}


def tile() -> bytes:
    """A vector tile with a river, two roads, two houses, a contour line, and names to be ignored."""
    layers = [
        layer("water", (SHORE, {"class": "river"})),
        layer("transportation", (PRIMARY, {"class": "primary"}), (STREET, {"class": "minor"})),
        layer("building", (HOUSES, {"name": HOSTILE})),
        layer("contour", (CONTOUR, {"ele": 40})),
        layer("poi", ("POINT(10 10)", {"name": HOSTILE})),
    ]
    return bytes(mapbox_vector_tile.encode(layers, default_options={"y_coord_down": True}))


def around(zooms: range, count: int = 2) -> Iterator[tuple[int, int, int]]:
    """Zoom, column and row of the tiles about the town."""
    for zoom in zooms:
        x, y = map(int, tile_of(LAT_DEG, LON_DEG, zoom))
        yield from ((zoom, x + dx, y + dy) for dx in range(-count, count + 1) for dy in range(-count, count + 1))


def write_mbtiles(path: Path, data: bytes, zooms: range = range(12, 16), **metadata: str) -> Path:
    """Write the tile `data`, packed as it is."""
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE metadata (name TEXT, value TEXT)")
        database.execute(
            "CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_data BLOB)"
        )
        database.executemany("INSERT INTO metadata VALUES (?, ?)", ({"format": "pbf"} | metadata).items())
        rows = [(zoom, x, (1 << zoom) - 1 - y, data) for zoom, x, y in around(zooms)]
        database.executemany("INSERT INTO tiles VALUES (?, ?, ?, ?)", rows)
    database.close()
    return path


def write_pmtiles(path: Path, data: bytes, zooms: range = range(12, 16), **header: Any) -> Path:
    """Write the tile `data`, packed as it is."""
    with path.open("wb") as file:
        writer = Writer(file)
        for place in sorted(around(zooms), key=lambda each: zxy_to_tileid(*each)):
            writer.write_tile(zxy_to_tileid(*place), data)
        kind = {"tile_type": TileType.MVT, "tile_compression": Compression.GZIP}
        writer.finalize(kind | {"min_zoom": zooms[0], "max_zoom": zooms[-1]} | header, {})
    return path


def base_map_file(folder: Path) -> Path:
    """A PMTiles file of the town."""
    return write_pmtiles(folder / "town.pmtiles", gzip.compress(tile()))
