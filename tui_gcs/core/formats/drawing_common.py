"""What KML and GeoJSON have in common: coordinates, borders, and the checks of a drawing."""

import math

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import Drawing, FormatError, Place

MAX_POINTS = 100_000
"""The most points of one file."""
MAX_NAME_CELLS = 40
"""The most characters of a name, and of a property."""
HEIGHTS = "heights"
"""The property by which our own files give what heights are above: these formats have no "above home"."""


def ring(places: list[Place]) -> tuple[Place, ...]:
    """Return a border without its last point, if that repeats the first."""
    return tuple(places[:-1] if len(places) > 3 and places[0][:2] == places[-1][:2] else places)


def number(text: object) -> float:
    """Convert a coordinate. Raises FormatError."""
    try:
        # bool is an int in Python.
        value = float(text) if isinstance(text, int | float | str) and not isinstance(text, bool) else math.nan
    except (ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise FormatError(f"{clean(str(text), 20)!r} is no coordinate")
    return value


def checked(drawing: Drawing) -> Drawing:
    """Return the drawing if it has enough points and all of them are on earth. Raises FormatError."""
    for count, places in ((least_points(drawing.kind), drawing.places), *((3, hole) for hole in drawing.holes)):
        if len(places) < count or (drawing.kind == "point" and len(places) != 1):
            raise FormatError(f"a {drawing.kind} with {len(places)} points")
        for lat_deg, lon_deg, _ in places:
            if abs(lat_deg) > 90 or abs(lon_deg) > 180:
                raise FormatError(f"latitude {lat_deg:g}, longitude {lon_deg:g}: no place on earth")
    return drawing


def least_points(kind: str) -> int:
    """How many points a drawing of that kind needs."""
    return {"point": 1, "line": 2, "area": 3}[kind]


def points_of(drawing: Drawing) -> int:
    """How many points a drawing has, holes included."""
    return len(drawing.places) + sum(map(len, drawing.holes))
