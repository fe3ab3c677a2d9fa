"""What a map shows, and painting it into cells: lines as dots, then vehicles and words upon them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.protocol.common import Annotation, FleetFrame, VehicleRow
from tui_gcs.core.protocol.setup import TrafficRow
from tui_gcs.core.scenario.model import Round, TakeOffPlace
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import TOUR_INKS, Ink
from tui_gcs.widgets.fleet.vehicle_alarms import AlarmsByVehicle
from tui_gcs.widgets.map import map_scene
from tui_gcs.widgets.map.base_map_layer import BaseMapState, BaseMapTiles, draw_base_map
from tui_gcs.widgets.map.map_drawings import MapLine, MapWord, draw_lines, words_at
from tui_gcs.widgets.map.map_goals import draw_goals, goal_words
from tui_gcs.widgets.map.map_grid import draw_grid, scale_word
from tui_gcs.widgets.map.map_labels import Cells, VehicleLabels
from tui_gcs.widgets.map.map_layers import HIDDEN_AT_FIRST, Layer
from tui_gcs.widgets.map.map_pointer import Pointer, draw_pointer, pointer_words
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_teams import MapTeams
from tui_gcs.widgets.map.map_tracks import draw_tracks, track_words
from tui_gcs.widgets.map.map_trails import Trails
from tui_gcs.widgets.map.map_viewport import Viewport
from tui_gcs.widgets.map.traffic_layer import draw_overlays, overlay_words, traffic_words
from tui_gcs.widgets.map.uncertainty_disc import draw_uncertainty

ASCII_LETTERS = {
    Ink.CONTOUR: "_",
    Ink.BUILDING: "+",
    Ink.ROAD: "-",
    Ink.WATER: "w",
    Ink.GRID: "'",
    Ink.AREA: ".",
    Ink.OVERLAY: "~",
    Ink.PLAN: ":",
    **dict.fromkeys(TOUR_INKS, ":"),
    Ink.TRAIL: ",",
    Ink.NO_FLY: "x",
    Ink.DEFEND: "#",
    Ink.ATTACK: "=",
    Ink.EDITED: "*",
    Ink.WARNING: "?",
    Ink.TARGET: "o",
}
_LETTERS = np.array([ord(ASCII_LETTERS.get(ink, " ")) for ink in Ink], dtype=np.uint32)


@dataclass
class MapContent:
    """Everything that is drawn on a map, apart from the view."""

    glyphs: GlyphSet
    current: Round | None = None
    places: tuple[TakeOffPlace, ...] = ()
    origin: Origin | None = None
    frame: FleetFrame | None = None
    rows: list[VehicleRow] = field(default_factory=list)
    alarms: AlarmsByVehicle = field(default_factory=dict)
    silent_s: float = 0.0
    """How long the station has been silent; 0 while it is not."""
    pointer: Pointer | None = None
    elevation: Elevation | None = None
    """The heights of the ground, for the figures at the cursor; None where no terrain file was given."""
    base_map: BaseMapTiles | None = None
    """What is drawn under everything else; None where no base map was given."""
    hidden: frozenset[Layer] = HIDDEN_AT_FIRST
    overlays: tuple[Overlay, ...] = ()
    traffic: tuple[TrafficRow, ...] = ()
    annotations: dict[str, tuple[Annotation, ...]] = field(default_factory=dict)
    """What the planners draw, by team."""
    lines: Sequence[MapLine] = ()
    words: Sequence[MapWord] = ()
    """Lines and words that the screen has drawn: plans that vehicles hold, or shall hold."""
    teams: MapTeams = field(default_factory=MapTeams)
    """The teams of the vehicles and drawings."""
    selected: int | None = None
    edited_zone: str | None = None


class MapPainter:
    """Paints a `MapContent`; what does not move is painted once for each view and kept."""

    def __init__(self) -> None:
        self.trails = Trails()
        self._labels = VehicleLabels()
        self._background: DotRaster | None = None
        self._base: DotRaster | None = None
        """The base map in the present view."""
        self._base_of: object = None
        """Of which view and tiles that is."""
        self.base_map_state = BaseMapState.NO_FILE

    def forget_background(self) -> None:
        """Paint everything anew next time: the view or something that does not move has changed."""
        self._background = None

    def paint(self, content: MapContent, view: Viewport) -> Cells:
        """Return the cells of the map; what is written first keeps its cells."""
        hidden = content.hidden
        if self._background is None:
            self._background = _background(content, view)
            self._paint_base_map(content, view)
        # Drawing all zones anew takes ten times as long as the rest of a frame (docs/terminal.md C4).
        raster = self._background.copy()
        if Layer.TRAILS not in hidden:
            raster.plot(view.to_dots(self.trails.points_m()), Ink.TRAIL)
        if content.frame is not None and Layer.TRACKS not in hidden:
            draw_tracks(raster, view, content.frame.tracks, content.frame.t_s)
        if Layer.GOALS not in hidden:
            draw_goals(raster, view, content.rows)
        draw_uncertainty(raster, view, content.rows, content.silent_s)
        if content.pointer is not None:
            draw_pointer(raster, view, content.pointer)
        if self._base is not None:
            raster.under(self._base)
        cells = Cells(raster.codes(content.glyphs.dots, _LETTERS), raster.inks)
        if content.pointer is not None:
            for word in pointer_words(view, content.pointer, content.origin, content.glyphs, content.elevation):
                cells.write(word.column, word.row, word.text, word.ink)
        if content.frame is not None:
            # Vehicles before all words: what is written first keeps its cells.
            self._labels.draw(
                cells,
                view,
                content.rows,
                content.selected,
                content.alarms,
                content.glyphs,
                content.teams,
                lettered=Layer.TEAMS not in hidden,
            )
            if Layer.TRACKS not in hidden:
                for word in track_words(view, content.frame.tracks, content.frame.t_s):
                    cells.write_first_sign(word)
        if content.origin is not None and Layer.TRAFFIC not in hidden:
            for word in traffic_words(view, content.traffic, LocalFrame(content.origin)):
                cells.write_first_sign(word)
        for word in words_at(view, content.words, must=True) if Layer.ON_BOARD not in hidden else ():
            cells.write_first_sign(word)
        for word in _optional_words(content, view):
            cells.place(word)
        return cells

    def _paint_base_map(self, content: MapContent, view: Viewport) -> None:
        """Draw the base map's tiles that are there, or nothing, and note why."""
        tiles = content.base_map
        if tiles is None or content.origin is None or Layer.BASE_MAP in content.hidden:
            self._base = self._base_of = None
            self.base_map_state = BaseMapState.NO_FILE if tiles is None else BaseMapState.SHOWN
            return
        # Planners publish new tours every second: for these nothing of the base map is drawn anew.
        drawn = (view, content.origin, tiles, tiles.read_count)
        if drawn != self._base_of:
            self._base, self.base_map_state = draw_base_map(tiles, view, LocalFrame(content.origin), self)
            self._base_of = drawn


def _background(content: MapContent, view: Viewport) -> DotRaster:
    raster = DotRaster(view.columns, view.rows)
    if Layer.GRID not in content.hidden:
        draw_grid(raster, view)
    if Layer.OVERLAYS not in content.hidden and content.origin is not None:
        draw_overlays(raster, view, content.overlays, LocalFrame(content.origin))
    if content.current is not None:
        map_scene.draw_round(raster, view, content.current, content.edited_zone)
    if Layer.PLANS not in content.hidden:
        map_scene.draw_annotations(raster, view, content.annotations, content.teams)
    if Layer.ON_BOARD not in content.hidden:
        draw_lines(raster, view, content.lines)
    return raster


def _optional_words(content: MapContent, view: Viewport) -> list[map_scene.Word]:
    """Return the words that are written where there is room, the most important first."""
    hidden = content.hidden
    words = words_at(view, content.words, must=False) if Layer.ON_BOARD not in hidden else []
    if content.current is not None:
        words += map_scene.zone_words(view, content.current, content.edited_zone)
    if Layer.TEAMS not in hidden:
        words += map_scene.legend_words(content.teams, view.columns)
    if Layer.PLANS not in hidden:
        words += map_scene.annotation_words(view, content.annotations, content.glyphs)
    if Layer.GOALS not in hidden:
        words += goal_words(view, content.rows, content.glyphs)
    if Layer.PLACES not in hidden:
        words += map_scene.place_words(view, content.places, content.glyphs)
    if content.origin is not None and Layer.OVERLAYS not in hidden:
        words += overlay_words(view, content.overlays, LocalFrame(content.origin))
    return [*words, scale_word(view, content.glyphs)]
