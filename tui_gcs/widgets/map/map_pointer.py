"""The map's cursor: its place in degrees, metres and UTM, and distance and bearing from a mark."""

from dataclasses import dataclass

import numpy as np

from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin, bearing_deg, distance_m
from tui_gcs.core.geometry.utm import utm
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.number_text import packed
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

MEASURE_DASH = (2.0, 2.0)


@dataclass(frozen=True)
class Pointer:
    """The place of the cursor, and the mark that is measured from; ENU metres."""

    at_m: tuple[float, float]
    mark_m: tuple[float, float] | None = None


def draw_pointer(raster: DotRaster, view: Viewport, pointer: Pointer) -> None:
    """Draw the line that is measured."""
    if pointer.mark_m is not None:
        raster.polyline(view.to_dots(np.array([pointer.mark_m, pointer.at_m])), Ink.EDITED, dash=MEASURE_DASH)


def pointer_words(
    view: Viewport, pointer: Pointer, origin: Origin | None, glyphs: GlyphSet, elevation: Elevation | None = None
) -> list[Word]:
    """Return the signs of cursor and mark, and their figures for the lowest rows."""
    words = []
    for place, sign in ((pointer.at_m, glyphs.cursor), (pointer.mark_m, glyphs.marker)):
        cell = view.world_to_cell(*place) if place is not None else None
        if cell is not None and view.contains(cell):
            words.append(Word(*cell, sign, Ink.SELECTED))
    texts = pointer_texts(pointer, origin, glyphs, elevation)
    lines = packed((text[: view.columns] for text in texts), view.columns)
    # In the lowest rows they cover the least.
    words += [Word(0, view.rows - len(lines) + row, line, Ink.BOLD) for row, line in enumerate(lines)]
    return words


def pointer_texts(
    pointer: Pointer, origin: Origin | None, glyphs: GlyphSet, elevation: Elevation | None = None
) -> list[str]:
    """Return the figures in pieces that are not broken over lines; with `elevation` also the ground below.

    Heights of the ground are above mean sea level, and relative to the ground at the origin, above which layers are.
    """
    east_m, north_m = pointer.at_m
    texts = [f"E {east_m:.0f} N {north_m:.0f} m"]
    if origin is not None:
        lat_deg, lon_deg = LocalFrame(origin).to_geodetic(east_m, north_m)
        texts.insert(0, degrees(lat_deg, lon_deg))
        grid = utm(lat_deg, lon_deg)
        texts += [str(grid)] if grid is not None else []
        if elevation is not None:
            texts.append(ground_text(elevation, (lat_deg, lon_deg), origin))
    if pointer.mark_m is not None:
        direction = bearing_deg(pointer.mark_m, pointer.at_m)
        metres = distance_m(pointer.mark_m, pointer.at_m)
        texts.append(f"from {glyphs.marker}: {metres:.1f} m {direction:03.0f}{glyphs.degree.strip()}")
    return texts


def ground_text(elevation: Elevation, place_deg: tuple[float, float], origin: Origin) -> str:
    """Format the height of the ground at a place; that it is unknown where the terrain file does not reach."""
    ground_m = elevation.place_amsl_m(*place_deg)
    if ground_m is None:
        return "ground unknown"
    at_origin_m = elevation.place_amsl_m(origin.lat_deg, origin.lon_deg)
    relative = "" if at_origin_m is None else f" ({ground_m - at_origin_m:+.0f} to origin)"
    return f"ground {ground_m:.0f} m{relative}"


def degrees(lat_deg: float, lon_deg: float) -> str:
    """Format a position to five decimals, which is about a metre."""
    return f"{abs(lat_deg):.5f} {'NS'[lat_deg < 0]} {abs(lon_deg):.5f} {'EW'[lon_deg < 0]}"
