"""The map of the plan screen: the edited shape is moved, turned, sized and changed corner by corner.

By keys while the map has them, and by pointer at any time: a drag of a corner moves it, of the inside all of it, with
Ctrl or the right button it turns; a double click adds a corner.
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
"""Less than half a step: what keys have drawn to something they can move away again."""
WHOLE_HEADING = "moving all: arrows [ ] { } n Esc"
CORNER_HEADING = "corner: arrows n + Del Esc"
SNAP_HEADING = "snapping"
MOST_MARKS = 200


@dataclass(frozen=True)
class Drag:
    """What the pointer holds, and how all was when it took hold."""

    step: str
    start_m: Point
    shape: Shape
    change: Callable[[Shape, Point, Point], Shape]
    """Of the shape, from where to where."""


class EditMap(DraftMap):
    """Knows the edited shape as it is shown; what becomes of a change is judged elsewhere."""

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
        """The operator wants this shape; changes of the same `step` in a row are one."""

        def __init__(self, shape: Shape, step: str) -> None:
            super().__init__()
            self.shape, self.step = shape, step

    _shape: Shape | None = None
    _allowed = True
    _border = Border.AS_LARGE
    _others: tuple[Shape, ...] = ()
    _corner: int | None = None
    """The chosen one; None: the shape as a whole."""
    _snaps = False
    _drag: Drag | None = None
    _drags = 0
    _unheard = 0
    """Wishes that the screen has not dealt with yet: until then the shape is as it was wished."""
    _has_dragged = False

    def show_edited(
        self, shape: Shape, others: tuple[Shape, ...], *, allowed: bool, border: Border = Border.AS_LARGE
    ) -> None:
        """The edited shape, what it may be drawn to, whether it may be as it is, and what corners must keep of it."""
        self._border = border
        if not self._unheard and (shape, others, allowed) != (self._shape, self._others, self._allowed):
            self._shape, self._others, self._allowed = shape, others, allowed
            self._draw_edited()

    def acknowledge(self) -> None:
        """The screen has dealt with one more wish."""
        self._unheard -= 1

    def begin(self, heading: str = WHOLE_HEADING) -> None:
        """Take the keys, for the shape as a whole."""
        self._corner = None
        super().begin(heading)
        self._retell()

    def on_blur(self) -> None:
        """No corner is chosen any more."""
        self._corner = None
        self._draw_edited()

    def on_focus(self) -> None:
        """Corners are shown, once it is known to have the focus."""
        self.call_after_refresh(self._draw_edited)

    @property
    def snap(self) -> Snap:
        """What corners are drawn to now."""
        return Snap(self._others, STEP_M) if self._snaps else Snap()

    # ------------------------------------------------------------ keys

    def action_move(self, east: int, north: int) -> None:
        """So many steps: the chosen corner, or all."""
        if self._shape is None:
            return
        way = (east * STEP_M, north * STEP_M)
        if self._corner is None:
            self._reshape(self._carried(self._shape, way, KEY_REACH_M), "moved")
            return
        x, y = self._corners[self._corner]
        point = self.snap.point((x + way[0], y + way[1]), KEY_REACH_M)
        self._reshape(with_corner_at(self._shape, self._corner, point), f"corner {self._corner}")
        self._see(point)

    def action_turn(self, clockwise: int) -> None:
        """One step clockwise, or back."""
        if self._shape is not None:
            self._reshape(turned(self._shape, clockwise * TURN_DEG), "turned")

    def action_size(self, up: int) -> None:
        """A little larger, or smaller."""
        if self._shape is not None:
            self._reshape(sized(self._shape, GROW**up), "sized")

    def action_corner(self, by: int) -> None:
        """The next corner; behind the last one all of them."""
        count = len(self._corners)
        at = (count if self._corner is None else self._corner) + by
        self._corner = None if at % (count + 1) == count else at % (count + 1)
        if self._corner is not None:
            self._see(self._corners[self._corner])
        self._retell()

    def action_add_corner(self) -> None:
        """Behind the chosen one, or the last one."""
        if self._shape is not None:
            at = len(self._corners) - 1 if self._corner is None else self._corner
            shape, self._corner = with_corner_after(as_polygon(self._shape, self._border), at)
            self._reshape(shape, f"{len(shape.vertices_m)} corners")

    def action_delete_corner(self) -> None:
        """The chosen one; without one the key means the zone."""
        if self._shape is None or self._corner is None:
            raise SkipAction
        shape = without_corner(self._shape, self._corner)
        if shape is not None:
            self._corner = min(self._corner, len(shape.vertices_m) - 1)
            self._reshape(shape, f"{len(shape.vertices_m)} corners")

    def action_snap(self) -> None:
        """On, or off."""
        self._snaps = not self._snaps
        self._retell()

    # ------------------------------------------------------------ pointer

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of a corner, or of all."""
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
        """What a drag from `place` does."""
        inside = bool(contains(shape, [place])[0])
        near = [(math.dist(corner, place), i) for i, corner in enumerate(self._corners)]
        distance_m, corner = min(near, default=(math.inf, 0))
        at_corner = distance_m <= self._reach_m
        if turns:
            return (
                (lambda shape, start, now: turned(shape, turn_deg(shape, start, now))) if inside or at_corner else None
            )
        if at_corner:
            return lambda shape, _start, now: with_corner_at(shape, corner, self.snap.point(now, self._reach_m))
        if inside:
            return lambda shape, start, now: self._carried(shape, (now[0] - start[0], now[1] - start[1]), self._reach_m)
        return None

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Whatever is held goes along."""
        place = self._place(event)
        if self._drag is not None and place is not None:
            self._has_dragged = True
            self._reshape(self._drag.change(self._drag.shape, self._drag.start_m, place), self._drag.step)

    def on_mouse_up(self, _event: events.MouseUp) -> None:
        """Let go."""
        if self._drag is not None:
            self._drag = None
            self.release_mouse()

    def on_click(self, event: events.Click) -> None:
        """A double click adds a corner; the end of a drag means nothing more."""
        place = self._place(event)
        if self._has_dragged:
            event.prevent_default()
        elif event.chain == 2 and place is not None and self._shape is not None:
            event.prevent_default()
            shape, self._corner = with_corner_near(as_polygon(self._shape, self._border), place)
            self._reshape(shape, f"{len(shape.vertices_m)} corners")

    def _place(self, event: events.MouseEvent) -> Point | None:
        offset = event.get_content_offset_capture(self)
        return self.view.cell_to_world(offset.x, offset.y) if offset is not None else None

    # ------------------------------------------------------------ what is shown

    @property
    def _corners(self) -> list[Point]:
        return corners_m(self._shape) if self._shape is not None else []

    @property
    def _reach_m(self) -> float:
        return REACH_DOTS / 2.0 * self.view.m_per_dot

    def _carried(self, shape: Shape, way: Point, reach_m: float) -> Shape:
        new = moved(shape, *way)
        return moved(new, *self.snap.shift(new, reach_m))

    def _reshape(self, shape: Shape, step: str) -> None:
        """Go on with it at once: the next key may be here before the answer."""
        self._shape = shape
        self._unheard += 1
        self.post_message(self.Reshaped(shape, step))

    def _see(self, point: Point) -> None:
        """Have it in view."""
        if not self.view.contains(self.view.world_to_cell(*point)):
            self.centre_on(point)

    def _retell(self) -> None:
        heading = WHOLE_HEADING if self._corner is None else CORNER_HEADING
        self.heading = f"{SNAP_HEADING}, {heading}" if self._snaps else heading
        self._draw_edited()

    def _draw_edited(self) -> None:
        """Corners while they can be chosen; in red what may not be so."""
        lines, words = [], []
        if self._shape is not None and not self._allowed:
            lines.append(MapLine(np.array(outline_m(self._shape)), Ink.WARNING, closed=True))
        if self.has_focus:
            for i, corner in enumerate(self._corners[:MOST_MARKS]):
                chosen = i == self._corner
                sign, ink = (self.glyphs.cursor, Ink.SELECTED) if chosen else (self.glyphs.bullet, Ink.EDITED)
                words.append(MapWord(corner, sign, ink, must=True))
        self.set_drawings(lines, words)
