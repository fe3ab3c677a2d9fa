"""What KML and GeoJSON have in common: coordinates, borders, and what a drawing must be."""

import math

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import Drawing, FormatError, Place

MAX_POINTS = 100_000
"""Of one file."""
NAME_MAX = 40
"""Cells of a name, and of what a file says of a drawing."""
HEIGHTS = "heights"
"""What our own files say their heights are above: these formats cannot say "above home"."""


def ring(places: list[Place]) -> tuple[Place, ...]:
    """A border without its last point, where that is the first again."""
    return tuple(places[:-1] if len(places) > 3 and places[0][:2] == places[-1][:2] else places)


def number(text: object) -> float:
    """A coordinate. Raises FormatError."""
    try:
        value = float(text) if isinstance(text, int | float | str) and not isinstance(text, bool) else math.nan
    except (ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise FormatError(f"{clean(str(text), 20)!r} is no coordinate")
    return value


def checked(drawing: Drawing) -> Drawing:
    """The drawing, if it has points enough and all of them are on earth. Raises FormatError."""
    for count, places in ((least_points(drawing.kind), drawing.places), *((3, hole) for hole in drawing.holes)):
        if len(places) < count or (drawing.kind == "point" and len(places) != 1):
            raise FormatError(f"a {drawing.kind} with {len(places)} points")
        for lat_deg, lon_deg, _ in places:
            if abs(lat_deg) > 90 or abs(lon_deg) > 180:
                raise FormatError(f"latitude {lat_deg:g}, longitude {lon_deg:g}: no place on earth")
    return drawing


def least_points(kind: str) -> int:
    """How many points such a drawing needs."""
    return {"point": 1, "line": 2, "area": 3}[kind]


def points_of(drawing: Drawing) -> int:
    """How many points it has, holes included."""
    return len(drawing.places) + sum(map(len, drawing.holes))
