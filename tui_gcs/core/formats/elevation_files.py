"""Terrain files: heights of the ground as SRTM tiles (`N47E008.hgt`), a folder of them, or an ESRI ASCII grid (`.asc`).

An SRTM tile covers one degree; its name gives the south-western corner, its points are big-endian 16-bit metres from
north to south, 1201 or 3601 a side, and -32768 stands for "not measured" (SRTM topography, version 2.1, NASA). An ESRI
ASCII grid begins with `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or `yllcenter`, `cellsize` and perhaps
`NODATA_value`; here its unit must be degrees.
"""

import math
import re
from collections import OrderedDict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.bounded import data_of
from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.geometry.elevation import Elevation, ElevationGrid

Heights = NDArray[np.float32]

TILE_NAME = re.compile(r"([NS])(\d{2})([EW])(\d{3})\.hgt", re.IGNORECASE)
TILE_SIDES = (1201, 3601)
"""Points along one side of a tile: three arc-seconds apart, or one."""
NOT_MEASURED = -32768
MAX_NAME = 60
MAX_TILES = 4
"""A tile of one arc-second takes 52 MB as heights: so many are kept, those used last."""
MAX_ASCII_BYTES = 64 << 20
MAX_POINTS = 20_000_000
ASCII_KEYS = frozenset(
    {"ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value"}
)
HEIGHT_RANGE_M = (-500.0, 9000.0)
"""The Dead Sea's shore lies at -430 m, Mount Everest's top at 8849 m: other figures are no heights in metres."""


def read_elevation(path: Path) -> Elevation:
    """Read a terrain file, or make a folder of tiles ready to be read where a height is asked for.

    Raises FormatError, one line without the path.
    """
    name = clean(path.name, MAX_NAME)
    if path.is_dir():
        tiles = _TileFolder(path)
        if not tiles.paths:
            raise FormatError("a folder without SRTM tiles (N47E008.hgt)")
        return Elevation(name, grid_at=tiles.grid)
    if path.suffix.lower() == ".hgt":
        return Elevation(name, [_tile(path)])
    if path.suffix.lower() == ".asc":
        return Elevation(name, [_ascii_grid(path)])
    raise FormatError("no terrain file: .hgt (SRTM), a folder of them, or .asc (ESRI ASCII grid in degrees)")


class _TileFolder:
    """The SRTM tiles of a folder; each is read when it is first needed."""

    def __init__(self, folder: Path) -> None:
        try:
            names = list(folder.iterdir())
        except OSError as error:
            raise FormatError(error.strerror or "cannot be read") from None
        self.paths = {corner: path for path in names if (corner := _corner_of(path)) is not None}
        self._read: OrderedDict[tuple[int, int], ElevationGrid | None] = OrderedDict()

    def grid(self, south_deg: int, west_deg: int) -> ElevationGrid | None:
        """Return the tile with this corner; None if there is none or it cannot be read."""
        corner = (south_deg, west_deg)
        if corner not in self.paths:
            return None
        if corner not in self._read:
            try:
                self._read[corner] = _tile(self.paths[corner])
            # A damaged tile is unknown ground, and the caller reports unknown ground.
            except FormatError:
                self._read[corner] = None
            if len(self._read) > MAX_TILES:
                self._read.popitem(last=False)
        self._read.move_to_end(corner)
        return self._read[corner]


def _corner_of(path: Path) -> tuple[int, int] | None:
    """Return the south-western corner that a tile's name gives, in whole degrees; None if it is no tile's name."""
    match = TILE_NAME.fullmatch(path.name)
    if match is None:
        return None
    north, lat, east, lon = match.groups()
    corner = (int(lat) * (1 if north in "Nn" else -1), int(lon) * (1 if east in "Ee" else -1))
    return corner if -90 <= corner[0] < 90 and -180 <= corner[1] < 180 else None


def _tile(path: Path) -> ElevationGrid:
    corner = _corner_of(path)
    if corner is None:
        raise FormatError("an SRTM tile is called after its south-western corner, such as N47E008.hgt")
    data = _bytes_of(path, 2 * max(TILE_SIDES) ** 2)
    side = next((side for side in TILE_SIDES if 2 * side * side == len(data)), None)
    if side is None:
        sizes = " or ".join(f"{2 * side * side}" for side in TILE_SIDES)
        raise FormatError(f"{len(data)} bytes: an SRTM tile has {sizes}")
    measured = np.frombuffer(data, ">i2").reshape(side, side)[::-1]
    heights_m = measured.astype(np.float32)
    heights_m[measured == NOT_MEASURED] = np.nan
    step_deg = 1.0 / (side - 1)
    return ElevationGrid(float(corner[0]), float(corner[1]), step_deg, step_deg, _plausible(heights_m))


def _bytes_of(path: Path, most_bytes: int) -> bytes:
    data = data_of(path, most_bytes)
    if len(data) > most_bytes:
        raise FormatError(f"larger than {most_bytes >> 20} MB")
    return data


def _ascii_grid(path: Path) -> ElevationGrid:
    lines = _bytes_of(path, MAX_ASCII_BYTES).decode("ascii", "replace").splitlines()
    head: dict[str, float] = {}
    for number, line in enumerate(lines, 1):
        words = line.split()
        if len(words) != 2 or words[0].lower() not in ASCII_KEYS:
            break
        try:
            head[words[0].lower()] = float(words[1])
        except ValueError:
            raise FormatError(f"line {number}: {words[0]} is not a number") from None
        if not math.isfinite(head[words[0].lower()]) and words[0].lower() != "nodata_value":
            raise FormatError(f"line {number}: {words[0]} is not a finite number")
    missing = {"ncols", "nrows", "cellsize"} - head.keys()
    if missing or not any(f"xll{end}" in head and f"yll{end}" in head for end in ("corner", "center")):
        raise FormatError("line 1: no ESRI ASCII grid (ncols, nrows, xllcorner, yllcorner, cellsize)")
    columns, rows, step_deg = int(head["ncols"]), int(head["nrows"]), head["cellsize"]
    if min(columns, rows) < 2 or columns * rows > MAX_POINTS:
        raise FormatError(f"{rows} x {columns} points: 2 x 2 to {MAX_POINTS} in all")
    # A corner is that of the first cell; its height belongs to the middle of the cell.
    shift_deg = step_deg / 2 if "xllcorner" in head else 0.0
    end = "corner" if "xllcorner" in head else "center"
    west_deg, south_deg = head[f"xll{end}"] + shift_deg, head[f"yll{end}"] + shift_deg
    is_degrees = -90 <= south_deg <= south_deg + (rows - 1) * step_deg <= 90 and -180 <= west_deg < 360
    if not (is_degrees and 0 < step_deg <= 1 and (columns - 1) * step_deg <= 360):
        raise FormatError("its corner and cell size are no degrees: convert it to WGS84 (gdalwarp -t_srs EPSG:4326)")
    heights_m = _ascii_heights(lines[len(head) :], rows, columns)
    heights_m[heights_m == head.get("nodata_value", -9999.0)] = np.nan
    return ElevationGrid(south_deg, west_deg, step_deg, step_deg, _plausible(heights_m[::-1]))


def _ascii_heights(lines: list[str], rows: int, columns: int) -> Heights:
    try:
        values = np.loadtxt(lines, dtype=np.float32, ndmin=2, comments=None)
    except ValueError as error:
        raise FormatError(f"its heights: {clean(str(error), 150)}") from None
    if values.shape != (rows, columns):
        found = f"{values.shape[0]} rows of {values.shape[1]} heights"
        raise FormatError(f"{found}, {rows} rows of {columns} were announced")
    return values


def _plausible(heights_m: Heights) -> Heights:
    """Return the heights if they can be metres above sea level. Raises FormatError."""
    low_m, high_m = HEIGHT_RANGE_M
    with np.errstate(invalid="ignore"):
        wrong = (heights_m < low_m) | (heights_m > high_m)
    if wrong.any():
        raise FormatError(f"a height of {heights_m[wrong][0]:g} m: not metres above sea level, or damaged")
    return heights_m
