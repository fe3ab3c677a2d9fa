"""The newest events of the journal, newest first."""

import time
from collections.abc import Sequence

from rich.cells import cell_len

from tui_gcs.core.protocol.common import EventClass, JournalEvent
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import clock
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.shown_keys import cut_mark
from tui_gcs.widgets.basics.strips import Run, cut_before

TAGS = {EventClass.CONNECTION: "connection", EventClass.SENSOR: "sensor", EventClass.PROCESSING: "processing"}
"""The three classes of error; other events need no tag."""
SHORT_TAGS = {EventClass.CONNECTION: "con", EventClass.SENSOR: "sen", EventClass.PROCESSING: "pro"}
ELSEWHERE = (EventClass.ALARM, EventClass.CONSOLE)
"""Classes of events that the second line shows, and the journal screen."""
WIDE = 100


class EventLines(LinesView):
    """A panel with as many of the newest events as fit."""

    DEFAULT_CSS = framed("EventLines")

    _events: Sequence[JournalEvent] = ()
    _mission_offset_s = float("nan")
    _principal = ""

    def show(self, events: Sequence[JournalEvent], mission_offset_s: float, principal: str = "") -> None:
        """Show these (oldest first); `mission_offset_s` added to `t_s` gives mission time, NaN shows wall time.

        `principal` is this console: its own events have the source "you".
        """
        self._events, self._mission_offset_s, self._principal = events, mission_offset_s, principal
        set_title(self, "events")
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        shown = [event for event in self._events if event.cls not in ELSEWHERE]
        newest = shown[-height:][::-1] if height > 0 else []
        whole = cut_mark(self, "show_journal", "J")
        return [event_line(event, width, self._mission_offset_s, self._principal, whole) for event in newest]


def severity_mark(severity: int) -> tuple[str, Ink]:
    """Glyph and ink of a MAV_SEVERITY (docs/terminal.md D7)."""
    if severity <= 2:
        return "!", Ink.WARNING
    if severity <= 4:
        return "^", Ink.CAUTION
    if severity == 5:
        return "i", Ink.ADVISORY
    return " ", Ink.TEXT


def event_time(event: JournalEvent, mission_offset_s: float) -> str:
    """Mission time once there is one, else UTC hours and minutes."""
    mission_s = event.t_s + mission_offset_s
    if mission_s >= 0.0:  # NaN is not
        return clock(mission_s)[2:]
    return time.strftime("%H:%MZ", time.gmtime(event.wall_s)) if event.wall_s == event.wall_s else "--:--"


def event_line(
    event: JournalEvent, width: int, mission_offset_s: float, principal: str = "", cut_mark: str = " …"
) -> list[Run]:
    """Time, severity, source, class of error, text; what is too long ends with `cut_mark`."""
    mark, ink = severity_mark(event.severity)
    tags = TAGS if width >= WIDE else SHORT_TAGS
    tag = tags.get(event.cls, "")
    source = "you" if principal and event.source == principal else event.source
    tag_text = f"{tag:<{12 if width >= WIDE else 4}}"
    runs = [
        (f"{event_time(event, mission_offset_s):<6} ", Ink.MUTED),
        (f"{mark} ", ink),
        (f"{source[:14]:<{14 if width >= WIDE else 10}} ", Ink.TEXT),
        (tag_text, Ink.MUTED),
    ]
    room = width - sum(cell_len(text) for text, _ in runs)
    if cell_len(event.text) <= room:
        return [*runs, (event.text, ink)]
    return [*runs, (cut_before(event.text, room, cut_mark), ink), (cut_mark, Ink.MUTED)]
