"""The question to which time of a recording to go."""

from textual import events

from tui_gcs.actions.replay_times import HELP, ReplayTimeError, played_time_s
from tui_gcs.core.protocol.common import StationStatus
from tui_gcs.screens.common.text_dialog import TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

MAX_LENGTH = 20


class TimeDialog(TextDialog[float | None]):
    """Ends with played seconds since the beginning; None if the operator left it."""

    title_text = "go to"

    def __init__(self, glyphs: GlyphSet, status: StationStatus) -> None:
        """Read the time as it is meant at the moment of this status."""
        super().__init__(glyphs)
        self._status = status
        self._text = ""
        self._why = ""

    def body(self) -> list[Line]:
        """See `TextDialog.body`."""
        return [
            [("time  ", Ink.MUTED), (f"{self._text}_", Ink.BOLD)],
            [(self._why or HELP, Ink.CAUTION if self._why else Ink.MUTED)],
            [],
            [(" Enter = go ", Ink.SELECTED), ("   Esc leaves", Ink.MUTED)],
        ]

    def on_key(self, event: events.Key) -> None:
        """Take letters of the time, Enter and Esc."""
        event.stop()
        if event.key == "escape":
            self.finish(None)
        elif event.key == "enter":
            try:
                self.finish(played_time_s(self._text, self._status))
            except ReplayTimeError as error:
                self._why = str(error)
        elif event.key == "backspace":
            self._text, self._why = self._text[:-1], ""
        elif event.character is not None and event.is_printable:
            self._text, self._why = (self._text + event.character)[:MAX_LENGTH], ""
        self.redraw()
