"""The base of the screens with a map: keys for view, cursor, measuring and layers, and the traffic around the fleet.

These keys change what is seen, and nothing else.
"""

from operator import attrgetter

from textual import work
from textual.message import Message
from textual.screen import Screen

from tui_gcs.actions.places import PlaceReferences
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import bounds
from tui_gcs.core.scenario.model import Round
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StatusUpdated
from tui_gcs.widgets.map.map_layers import Layer
from tui_gcs.widgets.map.map_view import MapView

PAN = 0.125
"""One key press moves the map by this fraction of the view."""
ZOOM = 2.0**0.5
TRAFFIC_PERIOD_S = 2.0


class MapScreen(Screen[None]):
    """Binds the actions of a map, and asks the station for traffic while the screen is shown."""

    class ResumeRequested(Message):
        """Enter was pressed: the operator wants the planner to go on."""

    feed: Feed
    map_view: MapView
    _traffic_s = float("-inf")

    def on_status_updated(self, message: StatusUpdated) -> None:
        """Ask for traffic every `TRAFFIC_PERIOD_S`. Textual calls this in addition to the subclass's handler."""
        t_s = message.status.t_s
        # A station that was restarted begins to count again: its time may be before that of the last request.
        if self.is_current and not 0.0 <= t_s - self._traffic_s < TRAFFIC_PERIOD_S:
            self._traffic_s = t_s
            self._ask_traffic()

    @work(group="traffic", exclusive=True, exit_on_error=False)
    async def _ask_traffic(self) -> None:
        self.map_view.set_traffic(await self.feed.traffic())

    def action_part(self, path: str, *arguments: object) -> None:
        """Have a part of the screen carry out an action: `transfers.upload` is that method of `self.transfers`."""
        attrgetter(path)(self)(*arguments)

    def action_pan(self, right: int, down: int) -> None:
        """Move the map, or its cursor, by one step."""
        if self.map_view.cursor_m is not None:
            self.map_view.move_cursor(right, down)
        else:
            self.map_view.pan(right * PAN, -down * PAN)

    def action_zoom(self, steps: int) -> None:
        """Show less of the map, larger (1), or more of it, smaller (-1)."""
        self.map_view.zoom(ZOOM**steps)

    def action_follow(self) -> None:
        """Follow the selected vehicle, or stop following."""
        self.map_view.follow(not self.map_view.following)

    def action_cursor(self) -> None:
        """Show the cursor, or hide it."""
        self.map_view.show_cursor(self.map_view.cursor_m is None)

    def action_measure(self) -> None:
        """Measure from the cursor; the first press only shows it."""
        if self.map_view.cursor_m is None:
            self.map_view.show_cursor()
        self.map_view.mark()

    def action_grid(self) -> None:
        """Show the grid, or hide it."""
        self.map_view.toggle_layer(Layer.GRID)

    def action_layers(self) -> None:
        """Open the list of layers."""
        from tui_gcs.screens.common.layers_dialog import LayersDialog  # when first asked for

        self.app.push_screen(LayersDialog(self.map_view))


def present_round(feed: Feed) -> Round | None:
    """Return the round that the station is in, as far as the feed knows it."""
    if feed.scenario is None:
        return None
    rounds = feed.scenario.scenario.rounds
    # The status may be of a scenario that has not arrived here yet: its index may be out of range.
    index = feed.status.round_index if feed.status is not None else 0
    return rounds[index] if 0 <= index < len(rounds) else None


def place_references(feed: Feed, cursor_m: tuple[float, float] | None) -> PlaceReferences:
    """Return what a typed place may be relative to now: vehicles, zones of the round, the cursor in ENU metres."""
    frame, scenario, present = feed.frame, feed.scenario, present_round(feed)
    middles = {}
    for zone in present.zones if present is not None else ():
        x0, y0, x1, y1 = bounds(zone.shape)
        middles[zone.name] = ((x0 + x1) / 2, (y0 + y1) / 2)
    rows = {row.id: row for row in frame.rows()} if frame is not None else {}
    return PlaceReferences(rows, middles, LocalFrame(scenario.scenario.origin) if scenario else None, cursor_m)
