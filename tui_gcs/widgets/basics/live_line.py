"""The line over a replay or recorded plots: what flies now, and the keys that go back and hold what flies."""

from rich.cells import cell_len

from tui_gcs.feed.notices import Notice, Severity
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.shown_keys import KEYS
from tui_gcs.widgets.basics.strips import cut

WIDE = 100
INKS = {Severity.WARNING: (Ink.ALARM, Ink.WARNING), Severity.CAUTION: (Ink.SELECTED_CAUTION, Ink.CAUTION)}
"""Inks of the tag and of the text."""


class LiveLine(LinesView):
    """One line; a long text is cut, never the keys."""

    DEFAULT_CSS = "LiveLine { height: 1; }"

    _news = Notice("")

    def show(self, news: Notice) -> None:
        """Show what is to be known of the stations that fly."""
        self._news = news
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        tag, text = INKS.get(self._news.level, (Ink.SELECTED, Ink.TEXT))
        mark = {Severity.WARNING: "! ", Severity.CAUTION: "^ "}.get(self._news.level, "")
        leave, hold = KEYS.get("detach", "q"), KEYS["hold_all"]
        wide = width >= WIDE
        keys = f"   {leave} goes back  {hold} HOLD ALL of this " if wide else f"  {leave} back  {hold} HOLDS this "
        now = f" {mark}NOW "
        room = width - cell_len(now + keys)
        words = cut(f" {self._news.text}", room)
        return [[(now, tag), (words, text), (" " * (room - cell_len(words)), text), (keys, Ink.BOLD)]]
