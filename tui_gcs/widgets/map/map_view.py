"""The map widget: operating area, zones, tours, trails and vehicles, in braille, quarter blocks or ASCII.

It uses Textual's line API and compares each picture with the one before: only rows that changed are written again.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from rich.style import Style
from textual import events
from textual.geometry import Region
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.protocol.common import Annotation, FleetFrame, Freshness
from tui_gcs.core.protocol.setup import TrafficRow
from tui_gcs.core.scenario.model import Round, TakeOffPlace
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet, next_dots
from tui_gcs.widgets.basics.strips import cells_to_strip
from tui_gcs.widgets.fleet.vehicle_alarms import AlarmsByVehicle
from tui_gcs.widgets.map import map_scene
from tui_gcs.widgets.map.base_map_layer import BaseMapState, BaseMapTiles
from tui_gcs.widgets.map.map_drawings import MapLine, MapWord
from tui_gcs.widgets.map.map_labels import Cells
from tui_gcs.widgets.map.map_layers import Layer
from tui_gcs.widgets.map.map_painter import MapContent, MapPainter
from tui_gcs.widgets.map.map_pointer import Pointer
from tui_gcs.widgets.map.map_teams import teams_of
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y, Viewport

FOLLOW_MIDDLE = 0.25
"""A followed vehicle may move within this fraction of the view about the centre before the map moves."""


class MapView(Widget):
    """A map of the present round and the fleet; it draws state and decides nothing.

    Setters may be called at any time and repaint only what changed. `view` converts between metres and the cells of the
    widget's content, (0, 0) top left.
    """

    DEFAULT_CSS = framed("MapView")

    class CursorShown(Message):
        """The cursor is shown, or hidden, since now."""

        def __init__(self, shown: bool) -> None:
            super().__init__()
            self.shown = shown

    def __init__(self, *, glyphs: GlyphSet = UNICODE, classes: str | None = None) -> None:
        """An empty map; `glyphs` decides between braille and ASCII."""
        self._strips: dict[int, Strip] = {}
        self._base: Style | None = None
        super().__init__(classes=classes)
        self.view = Viewport()
        self.content = MapContent(glyphs)
        self._painter = MapPainter()
        self._cells: Cells | None = None
        self._follow = False
        self._fitted = True
        self._flown_m: map_scene.Bounds | None = None
        """The box of all places where vehicles were seen while no round is shown."""
        self._heading = "map"
        self._title = ""
        self.set_class(not glyphs.unicode, "-ascii")

    def set_scenario(
        self, current: Round | None, places: Sequence[TakeOffPlace] = (), origin: Origin | None = None
    ) -> None:
        """Show this round and these take-off places; the view fits them again unless the operator moved it."""
        content = self.content
        new = (current, tuple(places), origin)
        if new == (content.current, content.places, content.origin):
            return
        content.current, content.places, content.origin = new
        if self._fitted:
            self._fit_view()
        self._redraw(background=True)

    def set_fleet(
        self, frame: FleetFrame | None, alarms: AlarmsByVehicle, *, known: bool = True, silent_s: float = 0.0
    ) -> None:
        """Show this fleet frame; `known` false (station silent for `silent_s`): every vehicle is drawn as lost."""
        content = self.content
        content.frame, content.rows, content.alarms = frame, frame.rows() if frame is not None else [], alarms
        content.silent_s = 0.0 if known else silent_s
        if not known:
            content.rows = [row._replace(freshness=Freshness.LOST) for row in content.rows]
        if frame is not None:
            self._painter.trails.update(frame.t_s, content.rows)
            self._keep_in_view()
            self._fit_places_flown()
        self._redraw(background=self._find_teams())

    def set_annotations(self, annotations: Mapping[str, Sequence[Annotation]]) -> None:
        """Show what the planners draw, by team."""
        new = {team: tuple(drawings) for team, drawings in annotations.items()}
        if new != self.content.annotations:
            self.content.annotations = new
            self._find_teams()
            self._redraw(background=True)

    def _find_teams(self) -> bool:
        """Take the teams of what is shown; returns whether they are others than before."""
        teams = teams_of(self.content.rows, self.content.annotations)
        if teams.names == self.content.teams.names:
            return False
        self.content.teams = teams
        return True

    def set_drawings(self, lines: Sequence[MapLine], words: Sequence[MapWord]) -> None:
        """Show lines and words of the screen: plans that vehicles hold, or shall hold."""
        self.content.lines, self.content.words = tuple(lines), tuple(words)
        self._redraw(background=True)

    def set_overlays(self, overlays: Sequence[Overlay]) -> None:
        """Show drawings from files, under everything else."""
        self.content.overlays = tuple(overlays)
        self._redraw(background=True)

    def set_base_map(self, tiles: BaseMapTiles | None) -> None:
        """Show this base map under everything else, as its tiles are read."""
        self.content.base_map = tiles
        if tiles is not None:
            tiles.listen(self._on_tile)
        self._redraw(background=True)

    def _on_tile(self) -> None:
        """A tile was read, on a thread of its own."""
        if self.is_attached and self.content.base_map is not None:
            self.call_later(self._show_tile)

    def _show_tile(self) -> None:
        """Repaint at once, or, behind another screen, when this one is shown again: a repaint would delay a key."""
        if self.is_attached and self.screen.is_current:
            self._redraw(background=True)
        else:
            self._painter.forget_background()

    @property
    def base_map_state(self) -> BaseMapState:
        """Why the base map is shown or not."""
        return self._painter.base_map_state

    def set_traffic(self, traffic: Sequence[TrafficRow]) -> None:
        """Show other aircraft, as transponders report them."""
        if tuple(traffic) != self.content.traffic:
            self.content.traffic = tuple(traffic)
            self._redraw()

    @property
    def selected(self) -> int | None:
        """System id of the selected vehicle."""
        return self.content.selected

    @selected.setter
    def selected(self, vehicle: int | None) -> None:
        if vehicle != self.content.selected:
            self.content.selected = vehicle
            self._keep_in_view()
            self._redraw()

    @property
    def edited_zone(self) -> str | None:
        """Name of the zone that is drawn as being edited."""
        return self.content.edited_zone

    @edited_zone.setter
    def edited_zone(self, name: str | None) -> None:
        if name != self.content.edited_zone:
            self.content.edited_zone = name
            self._redraw(background=True)

    @property
    def heading(self) -> str:
        """First words of the border title, e.g. "map" or "map  editing: north field"."""
        return self._heading

    @heading.setter
    def heading(self, text: str) -> None:
        self._heading = text
        self._retitle()

    @property
    def glyphs(self) -> GlyphSet:
        """The characters that the map is drawn with."""
        return self.content.glyphs

    def toggle_layer(self, layer: Layer) -> bool:
        """Show or hide a layer; return whether it is shown now."""
        self.content.hidden ^= {layer}
        self._redraw(background=True)
        return layer not in self.content.hidden

    def next_dots(self) -> str:
        """Draw dots in another way, for fonts without braille; return its name."""
        self.content.glyphs = replace(self.content.glyphs, dots=next_dots(self.content.glyphs.dots))
        self._redraw(background=True)
        return self.content.glyphs.dots

    @property
    def cursor_m(self) -> tuple[float, float] | None:
        """ENU metres of the cursor; None while it is not shown."""
        return self.content.pointer.at_m if self.content.pointer is not None else None

    def show_cursor(self, on: bool = True) -> None:
        """Show the cursor at the selected vehicle, or in the middle if that is out of view; or hide cursor and mark."""
        content = self.content
        content.pointer = None
        if on:
            rows = (row.position_m[:2] for row in content.rows if row.id == content.selected)
            place = next(rows, self.view.centre_m)
            cell = self.view.world_to_cell(*place)
            content.pointer = Pointer(place if self.view.contains(cell) else self.view.centre_m)
        self.post_message(self.CursorShown(on))
        self._redraw()

    def move_cursor(self, columns: int, rows: int) -> None:
        """Move the cursor right and down by cells; at the edge the view goes with it."""
        pointer = self.content.pointer
        if pointer is None:
            return
        cell = self.view.world_to_cell(*pointer.at_m)
        if cell is None:
            return
        column, row = cell[0] + columns, cell[1] + rows
        self.content.pointer = replace(pointer, at_m=self.view.cell_to_world(column, row))
        out = (
            min(column, 0) + max(column - self.view.columns + 1, 0),
            min(row, 0) + max(row - self.view.rows + 1, 0),
        )
        # A view that follows a vehicle would take the cursor out of view again.
        if out != (0, 0):
            self._follow, self._fitted = False, False
            self._set_view(self.view.panned(*out))
        self._redraw()

    def mark(self) -> None:
        """Measure from the cursor's place; a second time at the same place ends measuring."""
        pointer = self.content.pointer
        if pointer is not None:
            there = pointer.mark_m == pointer.at_m
            self.content.pointer = replace(pointer, mark_m=None if there else pointer.at_m)
            self._redraw()

    def pan(self, dx: float, dy: float) -> None:
        """Move the view by fractions of itself: +1 is one whole view right (east) or up (north)."""
        self._follow, self._fitted = False, False
        self._set_view(self.view.panned(round(dx * self.view.columns), -round(dy * self.view.rows)))

    def centre_on(self, place_m: tuple[float, float]) -> None:
        """Centre the view on a place at the same scale."""
        self._follow, self._fitted = False, False
        self._set_view(replace(self.view, centre_m=place_m))

    def zoom(self, factor: float) -> None:
        """Scale the view; factors above 1 are closer."""
        self._fitted = False
        self._set_view(self.view.zoomed(factor))
        self._keep_in_view()

    def fit(self) -> None:
        """Show everything, and keep it in view as the round changes."""
        self._follow, self._fitted = False, True
        self._fit_view()
        self._redraw(background=True)

    def follow(self, on: bool) -> None:
        """Keep the selected vehicle near the middle, or stop that."""
        self._follow = on
        if on:
            self._fitted = False
        self._keep_in_view()
        self._retitle()

    @property
    def following(self) -> bool:
        """Whether the view follows the selected vehicle."""
        return self._follow

    def on_resize(self, _event: events.Resize) -> None:
        """Paint at the new size."""
        columns, rows = self.content_size
        self.view = Viewport(self.view.centre_m, self.view.m_per_dot, max(columns, 1), max(rows, 1))
        if self._fitted:
            self._fit_view()
        self._redraw(background=True)

    def notify_style_update(self) -> None:
        """Drop all strips: colours have changed."""
        super().notify_style_update()
        self._strips.clear()
        self._base = None

    def render_line(self, y: int) -> Strip:
        """Return one row of the picture."""
        strip = self._strips.get(y)
        if strip is None:
            base = self._base = self._base or self.rich_style  # kept: computing it costs more than the row
            if self._cells is None or y >= self._cells.codes.shape[0]:
                return Strip.blank(self.size.width, base)
            strip = self._strips[y] = cells_to_strip(self._cells.codes[y], self._cells.inks[y], base)
        return strip

    def _set_view(self, view: Viewport) -> None:
        if view != self.view:
            self.view = view
            self._redraw(background=True)

    def _fit_view(self) -> None:
        box = map_scene.round_bounds(self.content.current, self.content.places)
        if box is not None:
            self.view = self.view.fitted(box)
        elif self._flown_m is not None:
            self.view = self.view.fitted(map_scene.with_margin(self._flown_m))

    def _fit_places_flown(self) -> None:
        """Without a round, as in a replay, fit the view to where vehicles have been, each time that one leaves it."""
        content = self.content
        if content.current is not None or content.places:
            return
        self._flown_m = map_scene.bounds_with(self._flown_m, [row.position_m for row in content.rows])
        if self._fitted and self._flown_m is not None and not self.view.holds(self._flown_m):
            self._fit_view()
            self._redraw(background=True)

    def _keep_in_view(self) -> None:
        """Centre on the followed vehicle once it leaves the middle of the view."""
        frame, selected = self.content.frame, self.content.selected
        if not self._follow or frame is None or selected not in frame.ids:
            return
        x_m, y_m, _ = frame.position_m[frame.ids.index(selected)]
        # A vehicle without a position has NaN: the view stays where it is.
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            return
        column, row = self.view.to_dots((x_m, y_m))[0] / (DOTS_X * self.view.columns, DOTS_Y * self.view.rows)
        if abs(column - 0.5) > FOLLOW_MIDDLE or abs(row - 0.5) > FOLLOW_MIDDLE:
            self._set_view(Viewport((x_m, y_m), self.view.m_per_dot, self.view.columns, self.view.rows))

    def _redraw(self, *, background: bool = False) -> None:
        """Paint the picture and have the changed rows written; `background` also repaints what does not move."""
        if background:
            self._painter.forget_background()
            self._retitle()
        if not self.is_attached or self.content_size.area == 0:
            return
        cells = self._painter.paint(self.content, self.view)
        old, self._cells = self._cells, cells
        if old is None or old.codes.shape != cells.codes.shape:
            self._strips.clear()
            self.refresh()
            return
        # Textual writes a dirty region whole, equal or not: only the changed part of a row is refreshed
        # (docs/terminal.md B2).
        changed = (old.codes != cells.codes) | (old.inks != cells.inks)
        for y in np.flatnonzero(changed.any(axis=1)):
            self._strips.pop(int(y), None)
            columns = np.flatnonzero(changed[y])
            first, last = int(columns[0]), int(columns[-1])
            self.refresh(Region(first, int(y), last - first + 1, 1))

    def _retitle(self) -> None:
        content = self.content
        scale = f"{self.view.m_per_dot:.3g} m/dot"
        parts = [self._heading, scale if content.current is not None or content.frame is not None else ""]
        if content.origin is not None and self.view.columns >= 60:
            parts.append(_degrees(content.origin))
        is_following = self._follow and content.selected is not None
        parts += [f"follow {content.selected}" if is_following else "", content.glyphs.north]
        title = "  ".join(part for part in parts if part)
        if title != self._title:
            self._title = title
            set_title(self, title)


def _degrees(origin: Origin) -> str:
    """Return where (0, 0) lies."""
    north, east = "NS"[origin.lat_deg < 0], "EW"[origin.lon_deg < 0]
    return f"{abs(origin.lat_deg):.4f} {north} {abs(origin.lon_deg):.4f} {east}"
