"""Terrain files: SRTM tiles, folders of them, ESRI ASCII grids; unknown ground; files that are none."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.formats.elevation_files import read_elevation
from tui_gcs.core.geometry.elevation import ElevationGrid

ASC = "ncols 3\nnrows 2\nxllcenter 8.0\nyllcenter 47.0\ncellsize 0.5\nNODATA_value -9999\n30 40 50\n0 10 -9999\n"


def tile(folder: Path, name: str, north_row_m: int = 700, void: bool = False) -> Path:
    """Write a tile of three arc-seconds: 500 m everywhere, `north_row_m` in its northern row."""
    heights = np.full((1201, 1201), 500, ">i2")
    heights[0] = north_row_m
    if void:
        heights[600, 600] = -32768
    path = folder / name
    path.write_bytes(heights.tobytes())
    return path


def test_an_srtm_tile_is_read_from_north_to_south(tmp_path: Path) -> None:
    ground = read_elevation(tile(tmp_path, "N47E008.hgt"))
    step_deg = 1 / 1200
    assert ground.place_amsl_m(47.5, 8.5) == 500.0
    assert ground.place_amsl_m(48.0, 8.5) == 700.0
    assert ground.place_amsl_m(48.0 - step_deg / 2, 8.25) == pytest.approx(600.0)
    assert ground.place_amsl_m(46.99, 8.5) is None and ground.place_amsl_m(47.5, 9.01) is None


def test_a_point_that_was_not_measured_is_unknown_and_not_zero(tmp_path: Path) -> None:
    ground = read_elevation(tile(tmp_path, "S34E151.hgt", void=True))
    assert ground.place_amsl_m(-33.5, 151.5) is None
    assert ground.place_amsl_m(-33.4, 151.5) == 500.0


def test_a_folder_gives_each_place_its_own_tile(tmp_path: Path) -> None:
    tile(tmp_path, "N47E008.hgt")
    tile(tmp_path, "n48w001.HGT", north_row_m=500)
    (tmp_path / "N10E010.hgt").write_bytes(b"damaged")
    (tmp_path / "readme.txt").write_text("no tile")
    ground = read_elevation(tmp_path)
    heights_m = ground.amsl_m([47.5, 48.5, 10.5, 0.0, float("nan")], [8.5, -0.5, 10.5, 0.0, 1.0])
    assert heights_m[:2].tolist() == [500.0, 500.0]
    assert np.isnan(heights_m[2:]).all()


def test_an_ascii_grid(tmp_path: Path) -> None:
    path = tmp_path / "field.asc"
    path.write_text(ASC)
    ground = read_elevation(path)
    assert ground.place_amsl_m(47.0, 8.0) == 0.0 and ground.place_amsl_m(47.5, 8.5) == 40.0
    assert ground.place_amsl_m(47.25, 8.25) == pytest.approx(20.0)
    assert ground.place_amsl_m(47.1, 8.9) is None  # beside the point that was not measured
    path.write_text(ASC.replace("xllcenter 8.0", "xllcorner 7.75").replace("yllcenter 47.0", "yllcorner 46.75"))
    assert read_elevation(path).place_amsl_m(47.5, 8.5) == 40.0


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("N47E008.hgt", b"12345", "5 bytes: an SRTM tile has 2884802 or 25934402"),
        ("N95E008.hgt", b"", "called after its south-western corner"),
        ("field.tif", b"II*", "no terrain file"),
        ("a.asc", b"", "line 1: no ESRI ASCII grid"),
        ("a.asc", ASC.replace("ncols 3", "ncols three").encode(), "line 1: ncols is not a number"),
        ("a.asc", ASC.replace("nrows 2", "nrows nan").encode(), "line 2: nrows is not a finite number"),
        ("a.asc", ASC.replace("nrows 2", "nrows 3").encode(), "2 rows of 3 heights, 3 rows of 3 were announced"),
        ("a.asc", ASC.replace("30 40", "30 forty").encode(), "its heights: could not convert string"),
        ("a.asc", ASC.replace("47.0", "470000").encode(), "are no degrees"),
        ("a.asc", ASC.replace("30 40", "30 40000").encode(), "a height of 40000 m"),
        ("a.asc", ASC.replace("ncols 3", "ncols 90000000").encode(), "2 x 90000000 points"),
    ],
)
def test_what_is_no_terrain_file_is_refused_in_one_line(tmp_path: Path, name: str, data: bytes, said: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(FormatError) as error:
        read_elevation(path)
    assert said in str(error.value) and "\n" not in str(error.value)


def test_an_empty_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="without SRTM tiles"):
        read_elevation(tmp_path)


@given(st.floats(-1, 3), st.floats(-1, 4))
def test_between_its_points_a_plane_stays_a_plane(lat_deg: float, lon_deg: float) -> None:
    rows, columns = np.mgrid[0:3, 0:4]
    grid = ElevationGrid(0.0, 0.0, 1.0, 1.0, 100.0 * rows + 7.0 * columns)
    height_m = grid.amsl_m(np.array([lat_deg]), np.array([lon_deg]))[0]
    if 0 <= lat_deg <= 2 and 0 <= lon_deg <= 3:
        assert height_m == pytest.approx(100.0 * lat_deg + 7.0 * lon_deg)
    else:
        assert np.isnan(height_m)
