"""The map of the plan screen: the edited shape is moved, turned, sized and changed corner by corner.

Keys work while the map has the focus, the pointer at any time: dragging a corner moves it, dragging the inside moves
the shape, with Ctrl or the right button it turns; a double click adds a corner.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from textual import events
from textual.actions import SkipAction
from textual.binding import Binding
from textual.message import Message

from tui_gcs.core.geometry.zones import Shape, contains, outline_m
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.drafts.draft_map import REACH_DOTS, STEP_M, DraftMap
from tui_gcs.widgets.map.map_drawings import MapLine, MapWord
from tui_gcs.widgets.plan.shape_corners import (
    Point,
    Snap,
    corners_m,
    turn_deg,
    with_corner_after,
    with_corner_at,
    with_corner_near,
    without_corner,
)
from tui_gcs.widgets.plan.shape_edit import Border, as_polygon, moved, sized, turned

TURN_DEG = 5.0
GROW = 1.05
KEY_REACH_M = STEP_M / 2.0 - 0.01
"""Keys snap to what is nearer than this: less than half a step, so that a key can move it away again."""
WHOLE_HEADING = "moving all: arrows [ ] { } n Esc"
CORNER_HEADING = "corner: arrows n + Del Esc"
SNAP_HEADING = "snapping"
MAX_MARKS = 200


@dataclass(frozen=True)
class Drag:
    """What the pointer holds, and the shape as it was when it was taken."""

    step: str
    start_m: Point
    shape: Shape
    change: Callable[[Shape, Point, Point], Shape]
    """Returns the shape that results from moving the pointer between two places."""


class EditMap(DraftMap):
    """Shows the edited shape, and posts those that the operator draws; whether one is allowed is decided elsewhere."""

    BINDINGS = [
        Binding("left_square_bracket", "turn(-1)", "turn left", show=False),
        Binding("right_square_bracket", "turn(1)", "turn right", show=False),
        Binding("left_curly_bracket", "size(-1)", "smaller", show=False),
        Binding("right_curly_bracket", "size(1)", "larger", show=False),
        Binding("n", "corner(1)", "next corner", show=False),
        Binding("N,shift+n", "corner(-1)", "previous corner", show=False),
        Binding("plus,insert", "add_corner", "one more corner", show=False),
        Binding("delete,backspace", "delete_corner", "one corner less", show=False),
        Binding("S,shift+s", "snap", "snap to corners, edges, grid", show=False),
    ]

    class Reshaped(Message):
        """The operator drew this shape; consecutive shapes of the same `step` are one undo step."""

        def __init__(self, shape: Shape, step: str) -> None:
            super().__init__()
            self.shape, self.step = shape, step

    _shape: Shape | None = None
    _allowed = True
    _border = Border.AS_LARGE
    _others: tuple[Shape, ...] = ()
    _corner: int | None = None
    """The chosen corner; None for the shape as a whole."""
    _snaps = False
    _drag: Drag | None = None
    _drags = 0
    _unacknowledged = 0
    """Number of posted shapes that the screen has not handled yet; until then the last posted shape is shown."""
    _has_dragged = False

    def show_edited(
        self, shape: Shape, others: tuple[Shape, ...], *, allowed: bool, border: Border = Border.AS_LARGE
    ) -> None:
        """Show the edited shape, and whether it is allowed.

        `others` are shapes to snap to; `border` is what a circle must keep when it gets corners.
        """
        self._border = border
        # While a posted shape is not handled, what the screen passes is older than what the operator has drawn.
        if not self._unacknowledged and (shape, others, allowed) != (self._shape, self._others, self._allowed):
            self._shape, self._others, self._allowed = shape, others, allowed
            self._draw_edited()

    def acknowledge(self) -> None:
        """Note that the screen has handled one posted shape."""
        self._unacknowledged -= 1

    def begin(self, heading: str = WHOLE_HEADING) -> None:
        """Take the keys, for the shape as a whole."""
        self._corner = None
        super().begin(heading)
        self._show_heading()

    def on_blur(self) -> None:
        """Deselect the corner when the focus is lost."""
        self._corner = None
        self._draw_edited()

    def on_focus(self) -> None:
        """Draw the corners, once the map has the focus."""
        # Textual sets `has_focus` only after this handler.
        self.call_after_refresh(self._draw_edited)

    @property
    def snap(self) -> Snap:
        """What corners snap to now."""
        return Snap(self._others, STEP_M) if self._snaps else Snap()

    def action_move(self, east: int, north: int) -> None:
        """Move the chosen corner, or the shape, by steps."""
        if self._shape is None:
            return
        offset_m = (east * STEP_M, north * STEP_M)
        if self._corner is None:
            self._reshape(self._carried(self._shape, offset_m, KEY_REACH_M), "moved")
            return
        x, y = self._corners[self._corner]
        point = self.snap.point((x + offset_m[0], y + offset_m[1]), KEY_REACH_M)
        self._reshape(with_corner_at(self._shape, self._corner, point), f"corner {self._corner}")
        self._bring_into_view(point)

    def action_turn(self, clockwise: int) -> None:
        """Turn the shape one step clockwise, or back."""
        if self._shape is not None:
            self._reshape(turned(self._shape, clockwise * TURN_DEG), "turned")

    def action_size(self, up: int) -> None:
        """Make the shape a little larger, or smaller."""
        if self._shape is not None:
            self._reshape(sized(self._shape, GROW**up), "sized")

    def action_corner(self, by: int) -> None:
        """Choose the next corner; after the last one the whole shape."""
        count = len(self._corners)
        at = (count if self._corner is None else self._corner) + by
        self._corner = None if at % (count + 1) == count else at % (count + 1)
        if self._corner is not None:
            self._bring_into_view(self._corners[self._corner])
        self._show_heading()

    def action_add_corner(self) -> None:
        """Add a corner after the chosen one, or at the end."""
        if self._shape is not None:
            at = len(self._corners) - 1 if self._corner is None else self._corner
            shape, self._corner = with_corner_after(as_polygon(self._shape, self._border), at)
            self._reshape(shape, f"{len(shape.vertices_m)} corners")

    def action_delete_corner(self) -> None:
        """Delete the chosen corner. Without one the key is the screen's, which deletes the zone."""
        if self._shape is None or self._corner is None:
            raise SkipAction
        shape = without_corner(self._shape, self._corner)
        if shape is not None:
            self._corner = min(self._corner, len(shape.vertices_m) - 1)
            self._reshape(shape, f"{len(shape.vertices_m)} corners")

    def action_snap(self) -> None:
        """Turn snapping on, or off."""
        self._snaps = not self._snaps
        self._show_heading()

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of a corner, or of the shape."""
        place = self._place(event)
        if place is None or self._shape is None or event.button not in (1, 3):
            return
        self._has_dragged = False
        held = self._held(self._shape, place, turns=event.ctrl or event.button == 3)
        if held is not None:
            self._drags += 1
            self._drag = Drag(f"drag {self._drags}", place, self._shape, held)
            self.capture_mouse()

    def _held(self, shape: Shape, place: Point, *, turns: bool) -> Callable[[Shape, Point, Point], Shape] | None:
        """Return what a drag from `place` does; None if nothing is held there."""
        inside = bool(contains(shape, [place])[0])
        near = [(math.dist(corner, place), i) for i, corner in enumerate(self._corners)]
        distance_m, corner = min(near, default=(math.inf, 0))
        at_corner = distance_m <= self._reach_m
        if turns:
            return (
                (lambda shape, start, now: turned(shape, turn_deg(shape, start, now))) if inside or at_corner else None
            )
        # Where a corner and the inside are both in reach, the corner is meant: it is the smaller target.
        if at_corner:
            return lambda shape, _start, now: with_corner_at(shape, corner, self.snap.point(now, self._reach_m))
        if inside:
            return lambda shape, start, now: self._carried(shape, (now[0] - start[0], now[1] - start[1]), self._reach_m)
        return None

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Change the shape as the pointer moves."""
        place = self._place(event)
        if self._drag is not None and place is not None:
            self._has_dragged = True
            self._reshape(self._drag.change(self._drag.shape, self._drag.start_m, place), self._drag.step)

    def on_mouse_up(self, _event: events.MouseUp) -> None:
        """Let go of what the pointer holds."""
        if self._drag is not None:
            self._drag = None
            self.release_mouse()

    def on_click(self, event: events.Click) -> None:
        """Add a corner by a double click. The click that ends a drag means nothing."""
        place = self._place(event)
        if self._has_dragged:
            # A click at the end of a drag would select another zone.
            event.prevent_default()
        elif event.chain == 2 and place is not None and self._shape is not None:
            event.prevent_default()
            shape, self._corner = with_corner_near(as_polygon(self._shape, self._border), place)
            self._reshape(shape, f"{len(shape.vertices_m)} corners")

    def _place(self, event: events.MouseEvent) -> Point | None:
        offset = event.get_content_offset_capture(self)
        return self.view.cell_to_world(offset.x, offset.y) if offset is not None else None

    @property
    def _corners(self) -> list[Point]:
        return corners_m(self._shape) if self._shape is not None else []

    @property
    def _reach_m(self) -> float:
        return REACH_DOTS / 2.0 * self.view.m_per_dot

    def _carried(self, shape: Shape, offset_m: Point, reach_m: float) -> Shape:
        new = moved(shape, *offset_m)
        return moved(new, *self.snap.shift(new, reach_m))

    def _reshape(self, shape: Shape, step: str) -> None:
        # The next key may come before the screen has handled this shape: it goes on from here.
        self._shape = shape
        self._unacknowledged += 1
        self.post_message(self.Reshaped(shape, step))

    def _bring_into_view(self, point: Point) -> None:
        if not self.view.contains(self.view.world_to_cell(*point)):
            self.centre_on(point)

    def _show_heading(self) -> None:
        heading = WHOLE_HEADING if self._corner is None else CORNER_HEADING
        self.heading = f"{SNAP_HEADING}, {heading}" if self._snaps else heading
        self._draw_edited()

    def _draw_edited(self) -> None:
        """Draw the corners while they can be chosen, and a shape that is not allowed in red."""
        lines, words = [], []
        if self._shape is not None and not self._allowed:
            lines.append(MapLine(np.array(outline_m(self._shape)), Ink.WARNING, closed=True))
        if self.has_focus:
            for i, corner in enumerate(self._corners[:MAX_MARKS]):
                chosen = i == self._corner
                sign, ink = (self.glyphs.cursor, Ink.SELECTED) if chosen else (self.glyphs.bullet, Ink.EDITED)
                words.append(MapWord(corner, sign, ink, must=True))
        self.set_drawings(lines, words)
