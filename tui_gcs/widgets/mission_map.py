"""The map of the missions screen: everybody's ways, the edited plan with its numbers, fences, rally points, conflicts.

While it has the keys, arrows move the edited item or the cursor; else they belong to the list of items.
"""

import numpy as np
from textual import events
from textual.binding import Binding
from textual.message import Message

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.findings import fence_regions
from tui_gcs.core.plan import PlanKind
from tui_gcs.widgets.map_drawings import MapLine, MapWord
from tui_gcs.widgets.map_view import MapView
from tui_gcs.widgets.mission_editor import MissionEditor
from tui_gcs.widgets.palette import Ink

STEP_M, FAR_STEPS = 5.0, 10
WAY_DASH = (3.0, 3.0)
FENCE_DASH = (5.0, 3.0)
MOST_NUMBERS = 60
"""More are not written beside the way; every item is there when it is chosen."""
HEADING = "map"
ITEM_HEADING, WHOLE_HEADING = "moving the item: arrows, Esc", "moving ALL items: arrows, Esc"
CURSOR_HEADING = "cursor: arrows, + adds, Esc"


class MissionMap(MapView):
    """Takes the focus only while it moves something, so that Tab goes through the forms alone."""

    BINDINGS = [
        Binding("left", "move(-1, 0)", "west", show=False),
        Binding("right", "move(1, 0)", "east", show=False),
        Binding("up", "move(0, 1)", "north", show=False),
        Binding("down", "move(0, -1)", "south", show=False),
        Binding("shift+left", "move(-10, 0)", "far west", show=False),
        Binding("shift+right", "move(10, 0)", "far east", show=False),
        Binding("shift+up", "move(0, 10)", "far north", show=False),
        Binding("shift+down", "move(0, -10)", "far south", show=False),
    ]

    class Moved(Message):
        """The edited item, or all of them, so many metres on."""

        def __init__(self, east_m: float, north_m: float) -> None:
            super().__init__()
            self.east_m, self.north_m = east_m, north_m

    class Clicked(Message):
        """A place was clicked; `reach_m` is how far from it something may be that was meant."""

        def __init__(self, place_m: tuple[float, float], reach_m: float) -> None:
            super().__init__()
            self.place_m, self.reach_m = place_m, reach_m

    def begin(self, heading: str) -> None:
        """Take the keys."""
        self.can_focus = True
        self.heading = heading
        self.focus()

    def end(self) -> None:
        """Give them back."""
        self.can_focus = False
        self.heading = HEADING
        self.show_cursor(False)

    def on_blur(self) -> None:
        """The operator went elsewhere."""
        self.end()

    def action_move(self, east: int, north: int) -> None:
        """One step, or ten."""
        if self.cursor_m is not None:
            self.move_cursor(east, -north)
        else:
            self.post_message(self.Moved(east * STEP_M, north * STEP_M))

    def on_click(self, event: events.Click) -> None:
        """The item under the pointer, or a place for the one that is moved."""
        offset = event.get_content_offset(self)
        if offset is not None:
            place = self.cell_to_world(offset.x, offset.y)
            self.post_message(self.Clicked(place, 8.0 * self.view.m_per_dot))


def drawings(editor: MissionEditor) -> tuple[list[MapLine], list[MapWord]]:
    """What the map shows of a draft; the edited vehicle's plan last, so that it lies on top."""
    look, edited = editor.forecast, editor.vehicle
    lines: list[MapLine] = []
    words: list[MapWord] = []
    for vehicle in editor.draft.vehicles:
        points = look.way(vehicle).corners_m
        if vehicle != edited and len(points):
            lines.append(MapLine(points[:, :2], Ink.PLAN, dash=WAY_DASH))
            words.append(MapWord(_middle(points), str(vehicle), Ink.MUTED))
    own = look.draft.of(edited)
    for inside, region in fence_regions(own.fence, look.frame):
        border = np.array(region.exterior.coords)
        lines.append(MapLine(border, Ink.OVERLAY if inside else Ink.NO_FLY, dash=FENCE_DASH if inside else (1.0, 0.0)))
    points = look.way(edited).corners_m
    if len(points):
        lines.append(MapLine(points[:, :2], Ink.EDITED))
    words += [*_numbers(editor), MapWord(look.member(edited).home.place_m, "H", Ink.EDITED)]
    if editor.kind is not PlanKind.RALLY:
        words += [MapWord(place, "R", Ink.ADVISORY) for i in own.rally if (place := editor.place_m(i)) is not None]
    for conflict in look.conflicts:
        sign, ink = ("!", Ink.WARNING) if conflict.together else ("^", Ink.CAUTION)
        words.append(MapWord(conflict.place_m, f"{sign}{conflict.first}-{conflict.second}", ink, must=True))
    return lines, words


def _numbers(editor: MissionEditor) -> list[MapWord]:
    """Items of the edited kind by number: the edited one always, some of many others."""
    items: Items = editor.items
    letter = {PlanKind.MISSION: "", PlanKind.FENCE: "f", PlanKind.RALLY: "R"}[editor.kind]
    step = max(1, len(items) // MOST_NUMBERS)
    words = []
    for i in sorted({*range(0, len(items), step), editor.index}):
        place = editor.place_m(items[i]) if i < len(items) else None
        if place is not None:
            chosen = i == editor.index
            words.append(MapWord(place, f"{letter}{i + 1}", Ink.SELECTED if chosen else Ink.EDITED, must=chosen))
    return words


def _middle(points: np.ndarray) -> tuple[float, float]:
    x, y = points[len(points) // 2][:2]
    return float(x), float(y)
