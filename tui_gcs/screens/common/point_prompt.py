"""The question for a task of planners: a place, and what may be said about it; for every screen that adds tasks."""

import math
from collections.abc import Callable

from textual import on
from textual.message import Message

from tui_gcs.actions.places import PlaceReferences, PlaceTextError, destinations
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.points import MAX_POINT_NAME, NewPoint
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.map_screen import place_references
from tui_gcs.widgets.forms.prompt_bar import PromptBar

PROMPT = "task: place; name; priority; seconds ="


class PointPrompt(PromptBar):
    """Asks for `PLACE; NAME; PRIORITY; SECONDS`; posts the task, or in one line why there is none."""

    class Typed(Message):
        """A task was typed."""

        def __init__(self, point: NewPoint) -> None:
            super().__init__()
            self.point = point

    class Remark(Message):
        """Nothing is sent: why, or what is to be done first."""

        def __init__(self, text: str) -> None:
            super().__init__()
            self.text = text

    def __init__(self, feed: Feed, cursor: Callable[[], tuple[float, float] | None]) -> None:
        """Take places relative to what `feed` knows; `cursor` is that of the fly screen's map, in ENU metres."""
        super().__init__("point")
        self._feed, self._cursor = feed, cursor

    def ask_point(self) -> None:
        """Show the question; the cursor of the map is suggested while it is shown."""
        self.ask(PROMPT, "cursor" if self._cursor() is not None else "")

    @on(PromptBar.Answered)
    def _take(self, message: PromptBar.Answered) -> None:
        self.screen.set_focus(None)
        if message.text is None or not message.text.strip():
            return
        try:
            self.post_message(self.Typed(typed_point(message.text, place_references(self._feed, self._cursor()))))
        except ValueError as error:
            self.post_message(self.Remark(str(error)))


def typed_point(text: str, references: PlaceReferences) -> NewPoint:
    """Return the task that was typed: `PLACE; NAME; PRIORITY; SECONDS`; without a place it is the map's cursor.

    Raises ValueError with one line.
    """
    place, name, priority, seconds = ([part.strip() for part in text.split(";")] + ["", "", ""])[:4]
    if not place and references.cursor_m is not None:
        place = "cursor"  # what is suggested is replaced by the first letter that is typed
    if not place:
        raise PlaceTextError("a task needs a place: cursor, 450 200, v3 +10 0, zone NAME, 52.0720N 0.6280W")
    if place[0] in "+-" or place.casefold().startswith("home"):
        raise PlaceTextError("a place of its own, not one relative to each vehicle: v3 +10 0 is beside vehicle 3")
    east_m, north_m, _ = destinations(place, (0,), references).points_m[0]
    return NewPoint(
        clean(name, MAX_POINT_NAME),
        (east_m, north_m),
        _positive(priority, "priority") if priority else 1.0,
        _positive(seconds, "seconds") if seconds else math.inf,
    )


def _positive(text: str, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise PlaceTextError(f"{clean(text, 20)!r} is no {what}: a number above 0")
    return value
