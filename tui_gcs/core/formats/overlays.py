"""Map overlays from GeoJSON, KML and KMZ files: points, lines and areas with a name, and nothing else of them.

The files come from anywhere. `bounded` limits size, depth and number of points, and refuses XML entities; names are
cleaned, and an error is one line with the file's name.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec

from tui_gcs.core.formats.bounded import data_of
from tui_gcs.core.formats.content import Drawing, FormatError

Kind = Literal["point", "line", "area"]


class OverlayError(Exception):
    """A file cannot be shown; the message is one line with its name and why."""


class Overlay(msgspec.Struct, frozen=True):
    """One shape to draw; places are (latitude, longitude) in degrees."""

    kind: Kind
    name: str
    places_deg: tuple[tuple[float, float], ...]


def load_overlay(path: Path) -> tuple[Overlay, ...]:
    """Read all overlays of a file.

    Raises:
        OverlayError: The file is not readable, too large, not a drawing, or without anything to draw.
    """
    # Imported here: it would take a tenth of the console's start, and is needed only with files.
    from tui_gcs.core.formats.file_types import read_file

    try:
        drawings = read_file(data_of(path)).drawings
    except FormatError as error:
        raise OverlayError(f"{path}: {error}") from None
    if not drawings:
        raise OverlayError(f"{path}: not an overlay: GeoJSON, KML or KMZ")
    return tuple(overlay for drawing in drawings for overlay in _overlays(drawing))


def _overlays(drawing: Drawing) -> Iterator[Overlay]:
    """Iterate over the parts of one drawing; each border of an area is one."""
    # The map draws borders, so a hole is one more border.
    for places in (drawing.places, *drawing.holes):
        yield Overlay(drawing.kind, drawing.name, tuple((lat, lon) for lat, lon, _ in places))
