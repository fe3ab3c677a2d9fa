"""Base maps: PMTiles and MBTiles of vector tiles; lines by kind in degrees; files that are none, damaged or hostile."""

import gzip
import random
import sqlite3
import sys
from pathlib import Path

import mapbox_vector_tile
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mapbox_vector_tile.Mapbox import vector_tile_pb2
from pmtiles.tile import Compression, TileType

from tests.rigs.base_maps import LAT_DEG, LON_DEG, tile, write_mbtiles, write_pmtiles
from tui_gcs.core.formats.base_map_files import (
    MAX_NUMBERS,
    MAX_TILE_BYTES,
    NO_LIBRARY,
    GroundKind,
    TileId,
    read_base_map,
    tile_of,
)
from tui_gcs.core.formats.content import FormatError

TOWN = TileId(14, *map(int, tile_of(LAT_DEG, LON_DEG, 14)))
PACKED = gzip.compress(tile())


@pytest.mark.parametrize("write", [write_mbtiles, write_pmtiles])
@pytest.mark.parametrize("packed", [True, False])
def test_lines_are_read_by_kind_from_both_kinds_of_file(tmp_path: Path, write: type, packed: bool) -> None:
    base_map = read_base_map(write(tmp_path / "town", PACKED if packed else tile()))
    assert (base_map.name, base_map.min_zoom, base_map.max_zoom) == ("town", 12, 15)
    lines = base_map.tile(TOWN)
    counts = {kind: len(pieces) for kind, pieces in lines.items()}
    assert counts == {
        GroundKind.WATER: 2,  # the two shores; where the river leaves the tile there is none
        GroundKind.MAIN_ROAD: 1,
        GroundKind.ROAD: 1,
        GroundKind.BUILDING: 8,
        GroundKind.CONTOUR: 1,
    }
    assert base_map.damaged == 0


def test_places_are_in_degrees(tmp_path: Path) -> None:
    """The main road begins a quarter down the western border of the tile."""
    (road,) = read_base_map(write_mbtiles(tmp_path / "town", PACKED)).tile(TOWN)[GroundKind.MAIN_ROAD]
    begin, end = road[:2], road[2:]
    assert tile_of(*begin, 14) == pytest.approx((TOWN.x, TOWN.y + 1000 / 4096))
    assert tile_of(*end, 14) == pytest.approx((TOWN.x + 1, TOWN.y + 1400 / 4096))


@given(st.floats(-85, 85), st.floats(-180, 179.99), st.integers(0, 20))
def test_a_place_is_in_its_tile(lat_deg: float, lon_deg: float, zoom: int) -> None:
    x, y = tile_of(lat_deg, lon_deg, zoom)
    assert 0 <= x < 1 << zoom and 0 <= y <= 1 << zoom
    north = np.degrees(np.arctan(np.sinh(np.pi * (1 - 2 * y / (1 << zoom)))))
    assert north == pytest.approx(lat_deg, abs=1e-6)


def test_where_the_file_has_no_tile_nothing_is_drawn(tmp_path: Path) -> None:
    for path in (write_mbtiles(tmp_path / "a", PACKED), write_pmtiles(tmp_path / "b", PACKED)):
        base_map = read_base_map(path)
        assert base_map.tile(TileId(14, 0, 0)) == {} and base_map.tile(TileId(3, 1, 1)) == {}
        assert base_map.damaged == 0


BOMB = gzip.compress(bytes(MAX_TILE_BYTES + 1))


@pytest.mark.parametrize(
    "data", [b"\x1f\x8b\x08", PACKED[:-20], b"\xff" * 50, BOMB], ids=["short", "cut", "no tile", "bomb"]
)
@pytest.mark.parametrize("write", [write_mbtiles, write_pmtiles])
def test_a_damaged_tile_is_empty_and_counted(tmp_path: Path, write: type, data: bytes) -> None:
    base_map = read_base_map(write(tmp_path / "town", data))
    assert base_map.tile(TOWN) == {} and base_map.damaged == 1


@given(st.data())
@settings(max_examples=150, deadline=None)
def test_no_bytes_of_a_tile_do_harm(data: st.DataObject) -> None:
    from tui_gcs.core.formats.base_map_files import _lines_of

    raw = bytearray(tile())
    for _ in range(data.draw(st.integers(1, 6))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    try:
        lines = _lines_of(bytes(raw), TOWN)
    except FormatError as error:
        assert "\n" not in str(error) and len(str(error)) < 120
    else:
        assert all(np.isfinite(pieces).all() for pieces in lines.values())


@given(at=st.integers(0, 600), value=st.integers(0, 255))
@settings(max_examples=150, deadline=None)
def test_no_byte_of_a_pmtiles_file_does_harm(tmp_path_factory: pytest.TempPathFactory, at: int, value: int) -> None:
    path = tmp_path_factory.mktemp("maps") / "town.pmtiles"
    raw = bytearray(write_pmtiles(path, PACKED).read_bytes())
    raw[at % len(raw)] = value
    path.write_bytes(raw)
    try:
        base_map = read_base_map(path)
    except FormatError as error:
        assert "\n" not in str(error)
    else:
        base_map.tile(TOWN)


def test_a_line_of_millions_of_points_is_left_out_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Decoded by the library, 8 MB of such a line took 6 s and 860 MB."""
    monkeypatch.setattr(mapbox_vector_tile.decoder.TileData, "parse_geometry", counted := CountedGeometry())
    message = vector_tile_pb2.tile.FromString(tile())
    bomb = message.layers.add(name="water", version=2, extent=4096).features.add(type=2)
    bomb.geometry.extend([9, 0, 0, (MAX_NUMBERS << 3) | 2, *(1, 2) * MAX_NUMBERS])
    path = write_pmtiles(tmp_path / "town", gzip.compress(message.SerializeToString()), zooms=range(14, 15))
    base_map = read_base_map(path)
    base_map.tile(TOWN)
    assert base_map.damaged == 0 and counted.longest < MAX_NUMBERS


class CountedGeometry:
    """In the place of the library's decoder of lines: notes the longest one, finds no line in any."""

    longest = 0

    def __call__(self, geom: list[int], **_: object) -> dict[str, object]:
        self.longest = max(self.longest, len(geom))
        return {"type": "LineString", "coordinates": []}


@pytest.mark.parametrize("length", [30, 300])
def test_a_file_that_is_overwritten_with_a_shorter_one_ends_nothing(tmp_path: Path, length: int) -> None:
    """Mapped into memory, the first look at what is gone would have ended the console."""
    path = write_pmtiles(tmp_path / "town", gzip.compress(tile() + random.Random(1).randbytes(40_000)))
    base_map = read_base_map(path)
    with path.open("r+b") as file:
        file.truncate(length)
    assert base_map.tile(TOWN) == {} and base_map.damaged == 1


def refused(path: Path) -> str:
    with pytest.raises(FormatError) as error:
        read_base_map(path)
    return str(error.value)


def test_files_that_are_no_base_map_are_refused_in_one_line(tmp_path: Path) -> None:
    other = tmp_path / "x.pmtiles"
    assert refused(other) == "No such file or directory"
    other.write_bytes(b"hello")
    assert refused(other) == "no base map: .pmtiles or .mbtiles with vector tiles"
    other.write_bytes(b"PMTiles\x02" + bytes(200))
    assert "old version" in refused(other)
    other.write_bytes(b"PMTiles\x03")
    assert "header cannot be read" in refused(other)
    other.write_bytes(b"SQLite format 3\0" + bytes(200))
    assert refused(other).startswith("no MBTiles file: ")
    assert refused(tmp_path) == "Is a directory" or "regular file" in refused(tmp_path)
    pictures = write_pmtiles(tmp_path / "p", PACKED, tile_type=TileType.PNG)
    assert refused(pictures) == "its tiles are pictures: a base map needs vector tiles"
    brotli = write_pmtiles(tmp_path / "q", PACKED, tile_compression=Compression.BROTLI)
    assert "brotli" in refused(brotli)
    assert "pictures" in refused(write_mbtiles(tmp_path / "m", PACKED, format="png"))
    assert refused(write_mbtiles(tmp_path / "n", PACKED, zooms=range(0))) == "an MBTiles file without tiles"


def test_a_view_that_computes_for_ever_is_given_up(tmp_path: Path) -> None:
    path = write_mbtiles(tmp_path / "town", PACKED)
    with sqlite3.connect(path) as database:
        database.execute("DROP TABLE tiles")
        endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i, i, i, '' FROM n"
        database.execute(f"CREATE VIEW tiles(zoom_level, tile_column, tile_row, tile_data) AS {endless}")
    database.close()
    assert refused(path) == "no MBTiles file: interrupted"


def test_without_the_extra_the_operator_is_told_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pmtiles", None)
    assert refused(write_mbtiles(tmp_path / "town", PACKED)) == NO_LIBRARY
