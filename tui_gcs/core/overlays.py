"""Drawings for the map from GeoJSON, KML and KMZ files: points, lines and areas with a name, and nothing else of them.

The files come from anywhere: `core/formats` limits their size, depth and number of points, and refuses XML entities;
names are cleaned, and what is wrong is one line with the file's name.
"""

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec

from tui_gcs.core.formats.bounded import MOST_BYTES
from tui_gcs.core.formats.content import Drawing, FormatError
from tui_gcs.core.formats.files import read_file

Kind = Literal["point", "line", "area"]


class OverlayError(Exception):
    """A file cannot be shown: one line with its name and why."""


class Overlay(msgspec.Struct, frozen=True):
    """One thing to draw: places are (latitude, longitude) in degrees."""

    kind: Kind
    name: str
    places_deg: tuple[tuple[float, float], ...]


def load_overlay(path: Path) -> tuple[Overlay, ...]:
    """All that a file draws.

    Raises:
        OverlayError: not readable, too large, not a drawing, or without anything to draw.
    """
    try:
        drawings = read_file(_data(path)).drawings
    except FormatError as error:
        raise OverlayError(f"{path}: {error}") from None
    if not drawings:
        raise OverlayError(f"{path}: not an overlay: GeoJSON, KML or KMZ")
    return tuple(overlay for drawing in drawings for overlay in _overlays(drawing))


def _data(path: Path) -> bytes:
    try:
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):  # a pipe or a device never ends
                raise OverlayError(f"{path}: not a file")
            return file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise OverlayError(f"{path}: {error.strerror if isinstance(error, OSError) else error}") from None


def _overlays(drawing: Drawing) -> Iterator[Overlay]:
    """The parts of one drawing; of an area each border is one."""
    for places in (drawing.places, *drawing.holes):
        yield Overlay(drawing.kind, drawing.name, tuple((lat, lon) for lat, lon, _ in places))
