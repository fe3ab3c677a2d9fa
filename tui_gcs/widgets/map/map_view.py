"""The map: operating area, zones, tours, trails and vehicles, in braille or ASCII.

Line API with its own picture of what is on the screen: only rows that changed are written again.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from rich.style import Style
from textual import events
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.protocol.common import Annotation, FleetFrame, Freshness, VehicleRow
from tui_gcs.core.protocol.setup import TrafficRow
from tui_gcs.core.scenario.model import Round, TakeOffPlace
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet, next_dots
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import cells_to_strip
from tui_gcs.widgets.fleet.vehicle_alarms import AlarmsByVehicle
from tui_gcs.widgets.map import map_scene
from tui_gcs.widgets.map.map_drawings import MapLine, MapWord, draw_lines, words_at
from tui_gcs.widgets.map.map_goals import draw_goals, goal_words
from tui_gcs.widgets.map.map_grid import draw_grid, scale_word
from tui_gcs.widgets.map.map_labels import Cells, VehicleLabels
from tui_gcs.widgets.map.map_layers import HIDDEN_AT_FIRST, Layer
from tui_gcs.widgets.map.map_pointer import Pointer, draw_pointer, pointer_words
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_tracks import draw_tracks, track_words
from tui_gcs.widgets.map.map_trails import Trails
from tui_gcs.widgets.map.map_viewport import Viewport
from tui_gcs.widgets.map.traffic_layer import draw_overlays, overlay_words, traffic_words
from tui_gcs.widgets.map.uncertainty_disc import draw_doubt

ASCII_LETTERS = {
    Ink.GRID: "'",
    Ink.AREA: ".",
    Ink.OVERLAY: "~",
    Ink.PLAN: ":",
    Ink.TRAIL: ",",
    Ink.NO_FLY: "x",
    Ink.DEFEND: "#",
    Ink.ATTACK: "=",
    Ink.EDITED: "*",
    Ink.WARNING: "?",
    Ink.TARGET: "o",
}
FOLLOW_MIDDLE = 0.25
"""A followed vehicle may move within this fraction of the view about the centre before the map moves."""
_LETTERS = np.array([ord(ASCII_LETTERS.get(ink, " ")) for ink in Ink], dtype=np.uint32)


class MapView(Widget):
    """A map of the present round and the fleet; draws state, decides nothing.

    Setters may be called at any time and repaint only what changed. `world_to_cell` and `cell_to_world` use cells of
    the widget's content, (0, 0) top left.
    """

    DEFAULT_CSS = """
    MapView { border: solid #4a5560; border-title-color: #d8dee4; }
    MapView.-ascii { border: ascii #4a5560; }
    """

    def __init__(self, *, glyphs: GlyphSet = UNICODE, classes: str | None = None) -> None:
        """An empty map; `glyphs` decides between braille and ASCII."""
        self._strips: dict[int, Strip] = {}
        self._base: Style | None = None
        super().__init__(classes=classes)
        self.view = Viewport()
        self._glyphs = glyphs
        self._round: Round | None = None
        self._places: tuple[TakeOffPlace, ...] = ()
        self._origin: Origin | None = None
        self._frame: FleetFrame | None = None
        self._rows: list[VehicleRow] = []
        self._alarms: AlarmsByVehicle = {}
        self._known = True
        self._silent_s = 0.0
        self._pointer: Pointer | None = None
        self._hidden: frozenset[Layer] = HIDDEN_AT_FIRST
        self._overlays: tuple[Overlay, ...] = ()
        self._traffic: tuple[TrafficRow, ...] = ()
        self._annotations: dict[str, tuple[Annotation, ...]] = {}
        self._drawn_lines: tuple[MapLine, ...] = ()
        self._drawn_words: tuple[MapWord, ...] = ()
        self._selected: int | None = None
        self._edited_zone: str | None = None
        self._follow = False
        self._fitted = True
        self._heading = "map"
        self._trails = Trails()
        self._labels = VehicleLabels()
        self._still: DotRaster | None = None
        self._cells: Cells | None = None
        self._title = ""
        self.set_class(not glyphs.unicode, "-ascii")

    # ------------------------------------------------------------ what is shown

    def set_scenario(
        self, current: Round | None, places: Sequence[TakeOffPlace] = (), origin: Origin | None = None
    ) -> None:
        """Show this round and these take-off places; the view fits them again unless the operator moved it."""
        new = (current, tuple(places), origin)
        if new == (self._round, self._places, self._origin):
            return
        self._round, self._places, self._origin = new
        if self._fitted:
            self._fit_view()
        self._redraw(still=True)

    def set_fleet(
        self, frame: FleetFrame | None, alarms: AlarmsByVehicle, *, known: bool = True, silent_s: float = 0.0
    ) -> None:
        """Show this fleet frame; `known` false (station silent for `silent_s`): every vehicle is drawn as lost."""
        self._frame, self._rows, self._alarms = frame, frame.rows() if frame is not None else [], alarms
        self._known, self._silent_s = known, 0.0 if known else silent_s
        if not known:
            self._rows = [row._replace(freshness=Freshness.LOST) for row in self._rows]
        if frame is not None:
            self._trails.update(frame.t_s, self._rows)
            self._keep_in_view()
        self._redraw()

    def set_annotations(self, annotations: Mapping[str, Sequence[Annotation]]) -> None:
        """Show what the planners draw, by team."""
        new = {team: tuple(drawings) for team, drawings in annotations.items()}
        if new != self._annotations:
            self._annotations = new
            self._redraw(still=True)

    def set_drawings(self, lines: Sequence[MapLine], words: Sequence[MapWord]) -> None:
        """Show these of the screen's own besides: plans that vehicles hold, or shall hold."""
        self._drawn_lines, self._drawn_words = tuple(lines), tuple(words)
        self._redraw(still=True)

    @property
    def selected(self) -> int | None:
        """System id of the selected vehicle."""
        return self._selected

    @selected.setter
    def selected(self, vehicle: int | None) -> None:
        if vehicle != self._selected:
            self._selected = vehicle
            self._keep_in_view()
            self._redraw()

    @property
    def edited_zone(self) -> str | None:
        """Name of the zone drawn as being edited."""
        return self._edited_zone

    @edited_zone.setter
    def edited_zone(self, name: str | None) -> None:
        if name != self._edited_zone:
            self._edited_zone = name
            self._redraw(still=True)

    @property
    def heading(self) -> str:
        """First words of the border title, e.g. "map" or "map  editing: north field"."""
        return self._heading

    @heading.setter
    def heading(self, text: str) -> None:
        self._heading = text
        self._retitle()

    def set_overlays(self, overlays: Sequence[Overlay]) -> None:
        """Show these drawings from files, drawn once for each view."""
        self._overlays = tuple(overlays)
        self._redraw(still=True)

    def set_traffic(self, traffic: Sequence[TrafficRow]) -> None:
        """Show these aircraft."""
        if tuple(traffic) != self._traffic:
            self._traffic = tuple(traffic)
            self._redraw()

    @property
    def glyphs(self) -> GlyphSet:
        """What it draws with."""
        return self._glyphs

    @property
    def hidden(self) -> frozenset[Layer]:
        """The layers that are not shown."""
        return self._hidden

    def toggle_layer(self, layer: Layer) -> bool:
        """Show or hide one; whether it is shown now."""
        self._hidden ^= {layer}
        self._redraw(still=True)
        return layer not in self._hidden

    def next_dots(self) -> str:
        """Draw dots another way, for fonts without braille; the name of the way."""
        self._glyphs = replace(self._glyphs, dots=next_dots(self._glyphs.dots))
        self._redraw(still=True)
        return self._glyphs.dots

    # ------------------------------------------------------------ cursor

    @property
    def cursor_m(self) -> tuple[float, float] | None:
        """ENU metres of the cursor; None while it is not shown."""
        return self._pointer.at_m if self._pointer is not None else None

    def show_cursor(self, on: bool = True) -> None:
        """Show the cursor: at the selected vehicle if it is in view, else in the middle. Or hide it, with its mark."""
        self._pointer = None
        if on:
            place = next((row.position_m[:2] for row in self._rows if row.id == self._selected), self.view.centre_m)
            cell = self.view.world_to_cell(*place)
            self._pointer = Pointer(place if self.view.contains(cell) else self.view.centre_m)
        self._redraw()

    def move_cursor(self, columns: int, rows: int) -> None:
        """So many cells right and down; the view goes with it."""
        if self._pointer is None:
            return
        cell = self.view.world_to_cell(*self._pointer.at_m)
        if cell is None:
            return
        column, row = cell[0] + columns, cell[1] + rows
        self._pointer = replace(self._pointer, at_m=self.view.cell_to_world(column, row))
        out = (
            min(column, 0) + max(column - self.view.columns + 1, 0),
            min(row, 0) + max(row - self.view.rows + 1, 0),
        )
        if out != (0, 0):
            self._follow, self._fitted = False, False
            self._set_view(self.view.panned(*out))
        self._redraw()

    def mark(self) -> None:
        """Measure from where the cursor is; from nowhere if it is on the mark."""
        if self._pointer is not None:
            there = self._pointer.mark_m == self._pointer.at_m
            self._pointer = replace(self._pointer, mark_m=None if there else self._pointer.at_m)
            self._redraw()

    # ------------------------------------------------------------ view

    def pan(self, dx: float, dy: float) -> None:
        """Move the view by fractions of itself: +1 is one whole view right (east) or up (north)."""
        self._follow, self._fitted = False, False
        self._set_view(self.view.panned(round(dx * self.view.columns), -round(dy * self.view.rows)))

    def centre_on(self, place_m: tuple[float, float]) -> None:
        """Have this place in the middle, at the same scale."""
        self._follow, self._fitted = False, False
        self._set_view(replace(self.view, centre_m=place_m))

    def zoom(self, factor: float) -> None:
        """Closer for factors above 1."""
        self._fitted = False
        self._set_view(self.view.zoomed(factor))
        self._keep_in_view()

    def fit(self) -> None:
        """Everything in view again, and so it stays as the round changes."""
        self._follow, self._fitted = False, True
        self._fit_view()
        self._redraw(still=True)

    def follow(self, on: bool) -> None:
        """Keep the selected vehicle near the middle."""
        self._follow = on
        if on:
            self._fitted = False
        self._keep_in_view()
        self._retitle()

    @property
    def following(self) -> bool:
        """Whether the view follows the selected vehicle."""
        return self._follow

    def world_to_cell(self, x_m: float, y_m: float) -> tuple[int, int] | None:
        """(column, row) of a point; may lie outside the view; None if it is not finite."""
        return self.view.world_to_cell(x_m, y_m)

    def cell_to_world(self, column: float, row: float) -> tuple[float, float]:
        """ENU metres of the middle of a cell."""
        return self.view.cell_to_world(column, row)

    # ------------------------------------------------------------ drawing

    def on_resize(self, event: events.Resize) -> None:
        """Take the new size."""
        columns, rows = self.content_size
        self.view = Viewport(self.view.centre_m, self.view.m_per_dot, max(columns, 1), max(rows, 1))
        if self._fitted:
            self._fit_view()
        self._redraw(still=True)

    def notify_style_update(self) -> None:
        """Colours changed: all strips are old."""
        super().notify_style_update()
        self._strips.clear()
        self._base = None

    def render_line(self, y: int) -> Strip:
        """One row of the picture."""
        strip = self._strips.get(y)
        if strip is None:
            base = self._base = self._base or self.rich_style  # costs more than the row
            if self._cells is None or y >= self._cells.codes.shape[0]:
                return Strip.blank(self.size.width, base)
            strip = self._strips[y] = cells_to_strip(self._cells.codes[y], self._cells.inks[y], base)
        return strip

    def _set_view(self, view: Viewport) -> None:
        if view != self.view:
            self.view = view
            self._redraw(still=True)

    def _fit_view(self) -> None:
        box = map_scene.round_bounds(self._round, self._places)
        if box is not None:
            self.view = self.view.fitted(box)

    def _keep_in_view(self) -> None:
        """Re-centre on the followed vehicle once it leaves the middle of the view."""
        if not self._follow or self._frame is None or self._selected not in self._frame.ids:
            return
        x_m, y_m, _ = self._frame.position_m[self._frame.ids.index(self._selected)]
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            return
        column, row = self.view.to_dots((x_m, y_m))[0] / (2.0 * self.view.columns, 4.0 * self.view.rows)
        if abs(column - 0.5) > FOLLOW_MIDDLE or abs(row - 0.5) > FOLLOW_MIDDLE:
            self._set_view(Viewport((x_m, y_m), self.view.m_per_dot, self.view.columns, self.view.rows))

    def _redraw(self, *, still: bool = False) -> None:
        """Make the picture anew and have the changed rows written; `still` also redraws what does not move."""
        if still:
            self._still = None
            self._retitle()
        if not self.is_attached or self.content_size.area == 0:
            return
        cells = self._picture()
        old, self._cells = self._cells, cells
        if old is None or old.codes.shape != cells.codes.shape:
            self._strips.clear()
            self.refresh()
            return
        changed = (old.codes != cells.codes) | (old.inks != cells.inks)
        for y in np.flatnonzero(changed.any(axis=1)):
            self._strips.pop(int(y), None)
            columns = np.flatnonzero(changed[y])
            first, last = int(columns[0]), int(columns[-1])
            self.refresh(Region(first, int(y), last - first + 1, 1))

    def _picture(self) -> Cells:
        view = self.view
        if self._still is None:
            self._still = DotRaster(view.columns, view.rows)
            if Layer.GRID not in self._hidden:
                draw_grid(self._still, view)
            if Layer.OVERLAYS not in self._hidden and self._origin is not None:
                draw_overlays(self._still, view, self._overlays, LocalFrame(self._origin))
            if self._round is not None:
                map_scene.draw_round(self._still, view, self._round, self._edited_zone)
            if Layer.PLANS not in self._hidden:
                map_scene.draw_annotations(self._still, view, self._annotations)
            if Layer.ON_BOARD not in self._hidden:
                draw_lines(self._still, view, self._drawn_lines)
        raster = self._still.copy()
        if Layer.TRAILS not in self._hidden:
            raster.plot(view.to_dots(self._trails.points_m()), Ink.TRAIL)
        if self._frame is not None and Layer.TRACKS not in self._hidden:
            draw_tracks(raster, view, self._frame.tracks, self._frame.t_s)
        if Layer.GOALS not in self._hidden:
            draw_goals(raster, view, self._rows)
        draw_doubt(raster, view, self._rows, self._silent_s)
        if self._pointer is not None:
            draw_pointer(raster, view, self._pointer)
        cells = Cells(raster.codes(self._glyphs.dots, _LETTERS), raster.inks)
        if self._pointer is not None:
            for word in pointer_words(view, self._pointer, self._origin, self._glyphs):
                cells.write(word.column, word.row, word.text, word.ink)
        if self._frame is not None:
            self._labels.draw(cells, view, self._rows, self._selected, self._alarms, self._glyphs)
            if Layer.TRACKS not in self._hidden:
                for word in track_words(view, self._frame.tracks, self._frame.t_s):
                    cells.must(word)
        if self._origin is not None and Layer.TRAFFIC not in self._hidden:
            for word in traffic_words(view, self._traffic, LocalFrame(self._origin)):
                cells.must(word)
        for word in words_at(view, self._drawn_words, must=True) if Layer.ON_BOARD not in self._hidden else ():
            cells.must(word)
        for word in self._still_words():
            cells.place(word)
        return cells

    def _still_words(self) -> list[map_scene.Word]:
        """What is written where there is room, the most important first."""
        view, hidden = self.view, self._hidden
        words = words_at(view, self._drawn_words, must=False) if Layer.ON_BOARD not in hidden else []
        if self._round is not None:
            words += map_scene.zone_words(view, self._round, self._edited_zone)
        if Layer.PLANS not in hidden:
            words += map_scene.annotation_words(view, self._annotations, self._glyphs)
        if Layer.GOALS not in hidden:
            words += goal_words(view, self._rows, self._glyphs)
        if Layer.PLACES not in hidden:
            words += map_scene.place_words(view, self._places, self._glyphs)
        if self._origin is not None and Layer.OVERLAYS not in hidden:
            words += overlay_words(view, self._overlays, LocalFrame(self._origin))
        return [*words, scale_word(view, self._glyphs)]

    def _retitle(self) -> None:
        scale = f"{self.view.m_per_dot:.3g} m/dot"
        parts = [self._heading, scale if self._round is not None or self._frame is not None else ""]
        if self._origin is not None and self.view.columns >= 60:
            parts.append(_degrees(self._origin))
        parts += [f"follow {self._selected}" if self._follow and self._selected is not None else "", self._glyphs.north]
        title = "  ".join(part for part in parts if part)
        if title != self._title:
            self._title = title
            set_title(self, title)


def _degrees(origin: Origin) -> str:
    """Where (0, 0) lies."""
    north, east = "NS"[origin.lat_deg < 0], "EW"[origin.lon_deg < 0]
    return f"{abs(origin.lat_deg):.4f} {north} {abs(origin.lon_deg):.4f} {east}"
