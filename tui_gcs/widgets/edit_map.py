"""The map of the plan screen: while it has the keys, arrows and brackets change the edited shape."""

from collections.abc import Callable

from textual.binding import Binding
from textual.message import Message

from tui_gcs.core.zones import Shape
from tui_gcs.widgets.map_view import MapView
from tui_gcs.widgets.shape_edit import moved, sized, turned

STEP_M = 5.0
TURN_DEG = 5.0
GROW = 1.05
HEADING = "map"
EDIT_HEADING = "move: arrows [ ] { } Esc"


class EditMap(MapView):
    """Takes the focus only between `begin` and `end`, so that Tab goes through the forms alone."""

    BINDINGS = [
        Binding("left", "move(-1, 0)", "west", show=False),
        Binding("right", "move(1, 0)", "east", show=False),
        Binding("up", "move(0, 1)", "north", show=False),
        Binding("down", "move(0, -1)", "south", show=False),
        Binding("left_square_bracket", "turn(-1)", "turn left", show=False),
        Binding("right_square_bracket", "turn(1)", "turn right", show=False),
        Binding("left_curly_bracket", "size(-1)", "smaller", show=False),
        Binding("right_curly_bracket", "size(1)", "larger", show=False),
    ]

    class Reshaped(Message):
        """The operator wants the edited shape changed like this."""

        def __init__(self, change: Callable[[Shape], Shape]) -> None:
            super().__init__()
            self.change = change

    def begin(self) -> None:
        """Take the keys."""
        self.can_focus = True
        self.heading = EDIT_HEADING
        self.focus()

    def end(self) -> None:
        """Give them back."""
        self.can_focus = False
        self.heading = HEADING

    def on_blur(self) -> None:
        """The cursor went elsewhere."""
        self.end()

    def action_move(self, east: int, north: int) -> None:
        """One step."""
        self.post_message(self.Reshaped(lambda shape: moved(shape, east * STEP_M, north * STEP_M)))

    def action_turn(self, clockwise: int) -> None:
        """One step clockwise, or back."""
        self.post_message(self.Reshaped(lambda shape: turned(shape, clockwise * TURN_DEG)))

    def action_size(self, up: int) -> None:
        """A little larger, or smaller."""
        self.post_message(self.Reshaped(lambda shape: sized(shape, GROW**up)))
