"""What does not move on a map: operating area, zones, take-off places, and the drawings of planners.

These differ without colour, too: the area has long dashes, a zone to defend one line, to attack two, a no-fly zone is
hatched; labels name them.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import shapely

from tui_gcs.core.geometry.zones import Role, Shape, Zone, bounds, outline_m
from tui_gcs.core.protocol.common import Annotation, Vec3
from tui_gcs.core.scenario.model import Round, TakeOffPlace
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster, Points
from tui_gcs.widgets.map.map_teams import MapTeams
from tui_gcs.widgets.map.map_viewport import Viewport

AREA_DASH = (7.0, 4.0)
LEGEND_GAP = 2
"""Cells between two names of teams."""
ATTACK_GAP_DOTS = 2.5
ROLE_INKS = {Role.DEFEND: Ink.DEFEND, Role.ATTACK: Ink.ATTACK, Role.NO_FLY: Ink.NO_FLY}
ROLE_WORDS = {Role.DEFEND: "DEFEND", Role.ATTACK: "ATTACK", Role.NO_FLY: "NO-FLY"}
MAX_FITTED_M = 100_000.0
"""No view is fitted to a vehicle farther than this from the origin: its position cannot be right."""
MARGIN_SHARE = 0.25
MIN_MARGIN_M = 20.0
"""A view that is fitted to where vehicles have been is at least this much larger on each side."""
Bounds = tuple[float, float, float, float]


class Word(NamedTuple):
    """Text on the map at (column, row); it may reach out of the view."""

    column: int
    row: int
    text: str
    ink: Ink


def draw_round(raster: DotRaster, view: Viewport, current: Round, edited_zone: str | None) -> None:
    """Draw the operating area and all zones."""
    raster.polyline(_dots(view, current.area.shape), Ink.AREA, closed=True, dash=AREA_DASH)
    for zone in current.zones:
        draw_zone(raster, view, zone, edited=zone.name == edited_zone)


def draw_zone(raster: DotRaster, view: Viewport, zone: Zone, *, edited: bool) -> None:
    """Draw a zone in the line style of its role; white while it is edited."""
    ink = Ink.EDITED if edited else ROLE_INKS[zone.role]
    outline = _dots(view, zone.shape)
    raster.polyline(outline, ink, closed=True)
    if zone.role is Role.NO_FLY:
        raster.hatch(outline, ink)
    if zone.role is Role.ATTACK:
        for ring in _inset(outline, ATTACK_GAP_DOTS):
            raster.polyline(ring, ink, closed=True)


def zone_words(view: Viewport, current: Round, edited_zone: str | None) -> list[Word]:
    """Return role and name above each zone, and the name of the operating area inside its lower edge."""
    words = []
    for zone in current.zones:
        min_x, _, max_x, max_y = bounds(zone.shape)
        cell = view.world_to_cell((min_x + max_x) / 2.0, max_y)
        if cell is not None:
            text = f"{ROLE_WORDS[zone.role]} {zone.name}"
            ink = Ink.EDITED if zone.name == edited_zone else ROLE_INKS[zone.role]
            words.append(Word(cell[0] - len(text) // 2, cell[1] - 1, text, ink))
    min_x, min_y, max_x, _ = bounds(current.area.shape)
    cell = view.world_to_cell((min_x + max_x) / 2.0, min_y)
    if cell is not None:
        words.append(Word(cell[0] - len("operating area") // 2, cell[1] - 1, "operating area", Ink.AREA))
    return words


def place_words(view: Viewport, places: Sequence[TakeOffPlace], glyphs: GlyphSet) -> list[Word]:
    """Return a cross for each take-off place."""
    cells = [view.world_to_cell(*place.place_m) for place in places]
    return [Word(*cell, glyphs.place, Ink.PLACE) for cell in cells if cell is not None]


def draw_annotations(
    raster: DotRaster, view: Viewport, drawings: Mapping[str, Sequence[Annotation]], teams: MapTeams
) -> None:
    """Draw tours and areas of the planners, each team's in its colour and dash."""
    for team, annotations in drawings.items():
        ink, dash = teams.tour(team)
        for drawing in annotations:
            points = view.to_dots(np.array(drawing.points_m, dtype=np.float64).reshape(-1, 2))
            if drawing.kind in ("polyline", "polygon"):
                raster.polyline(points, ink, closed=drawing.kind == "polygon", dash=dash)


def annotation_words(view: Viewport, drawings: Mapping[str, Sequence[Annotation]], glyphs: GlyphSet) -> list[Word]:
    """Return markers and texts of the planners."""
    words = []
    for annotations in drawings.values():
        for drawing in annotations:
            if drawing.kind not in ("marker", "text") or not drawing.points_m:
                continue
            cell = view.world_to_cell(*drawing.points_m[0])
            text = drawing.text if drawing.kind == "text" else glyphs.marker + drawing.text
            if cell is not None and text:
                words.append(Word(*cell, text, Ink.PLAN))
    return words


def legend_words(teams: MapTeams, columns: int) -> list[Word]:
    """Return the teams' names in their colours, side by side in the first row, as many as fit."""
    words: list[Word] = []
    column = 0
    for name in teams.names:
        if column + len(name) > columns:
            break
        words.append(Word(column, 0, name, teams.vehicle_ink(name)))
        column += len(name) + LEGEND_GAP
    return words


def round_bounds(current: Round | None, places: Sequence[TakeOffPlace]) -> Bounds | None:
    """Return the box around area, zones and take-off places, which the view is fitted to."""
    boxes: list[Bounds] = [(*place.place_m, *place.place_m) for place in places]
    if current is not None:
        boxes += [bounds(current.area.shape), *(bounds(zone.shape) for zone in current.zones)]
    # A place that is not finite would fit the view to nothing.
    boxes = [box for box in boxes if np.isfinite(box).all()]
    if not boxes:
        return None
    low = np.array(boxes)[:, :2].min(axis=0)
    high = np.array(boxes)[:, 2:].max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def bounds_with(box: Bounds | None, places_m: Sequence[Vec3]) -> Bounds | None:
    """Return `box`, or a new one, grown so that these places are inside; those that cannot be right are left out."""
    xy = np.array([place[:2] for place in places_m], dtype=np.float64).reshape(-1, 2)
    xy = xy[np.isfinite(xy).all(axis=1) & (np.abs(xy) <= MAX_FITTED_M).all(axis=1)]
    if box is not None:
        xy = np.vstack([xy, [box[:2], box[2:]]])
    if not len(xy):
        return None
    (west, south), (east, north) = xy.min(axis=0), xy.max(axis=0)
    return float(west), float(south), float(east), float(north)


def with_margin(box: Bounds) -> Bounds:
    """Return the box grown by a quarter of its size on each side: the view then need not move again at once."""
    side_m = max(MARGIN_SHARE * max(box[2] - box[0], box[3] - box[1]), MIN_MARGIN_M)
    return box[0] - side_m, box[1] - side_m, box[2] + side_m, box[3] + side_m


def _dots(view: Viewport, shape: Shape) -> Points:
    return view.to_dots(np.array(outline_m(shape), dtype=np.float64))


def _inset(outline: Points, distance: float) -> list[Points]:
    """Return the outline moved inwards; empty if nothing is left or the polygon is not simple."""
    if not np.isfinite(outline).all():
        return []
    shape = shapely.Polygon(outline)
    # A polygon that crosses itself cannot be moved inwards; it is being edited.
    if not shape.is_valid:
        return []
    smaller = shape.buffer(-distance, join_style="mitre")
    parts = smaller.geoms if isinstance(smaller, shapely.MultiPolygon) else [smaller]
    return [np.array(part.exterior.coords)[:-1] for part in parts if not part.is_empty]
