"""The map of an editing screen: arrows move what is edited, or the cursor, and clicks are posted as messages."""

from textual import events
from textual.binding import Binding
from textual.message import Message

from tui_gcs.widgets.map.map_view import MapView

STEP_M, FAR_STEPS = 5.0, 10
REACH_DOTS = 8.0
"""A click selects the nearest item within this many dots of the map."""
HEADING = "map"


class DraftMap(MapView):
    """A map that can have the focus only between `begin` and `end`, so that Tab visits only the forms."""

    BINDINGS = [
        Binding("left", "move(-1, 0)", "west", show=False),
        Binding("right", "move(1, 0)", "east", show=False),
        Binding("up", "move(0, 1)", "north", show=False),
        Binding("down", "move(0, -1)", "south", show=False),
        Binding("shift+left", f"move(-{FAR_STEPS}, 0)", "far west", show=False),
        Binding("shift+right", f"move({FAR_STEPS}, 0)", "far east", show=False),
        Binding("shift+up", f"move(0, {FAR_STEPS})", "far north", show=False),
        Binding("shift+down", f"move(0, -{FAR_STEPS})", "far south", show=False),
    ]

    class Moved(Message):
        """Arrows moved what is edited by this much."""

        def __init__(self, east_m: float, north_m: float) -> None:
            super().__init__()
            self.east_m, self.north_m = east_m, north_m

    class Clicked(Message):
        """A place was clicked; something within `reach_m` of it may have been meant."""

        def __init__(self, place_m: tuple[float, float], reach_m: float) -> None:
            super().__init__()
            self.place_m, self.reach_m = place_m, reach_m

    def begin(self, heading: str) -> None:
        """Take the keys, with this heading."""
        self.can_focus = True
        self.heading = heading
        self.screen.set_focus(self)  # at once, not later as `focus` does: the next key is meant for the map

    def end(self) -> None:
        """Give the keys back, and hide the cursor."""
        self.can_focus = False
        self.heading = HEADING
        self.show_cursor(False)

    def on_blur(self) -> None:
        """Give the keys back when the operator goes elsewhere."""
        self.end()

    def action_move(self, east: int, north: int) -> None:
        """Move the cursor, or post that what is edited moves."""
        if self.cursor_m is not None:
            self.move_cursor(east, -north)
        else:
            self.post_message(self.Moved(east * STEP_M, north * STEP_M))

    def on_click(self, event: events.Click) -> None:
        """Post the place that was clicked."""
        offset = event.get_content_offset(self)
        if offset is not None:
            place = self.view.cell_to_world(offset.x, offset.y)
            self.post_message(self.Clicked(place, REACH_DOTS * self.view.m_per_dot))
