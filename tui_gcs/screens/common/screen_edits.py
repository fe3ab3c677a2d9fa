"""The base of what a list screen does at the station: its surroundings, and the report of the last key."""

from collections.abc import Callable
from typing import Any

from textual.screen import Screen

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.row_copies import below_report, copy_text
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run

MAX_REPORT = 400


class ScreenEdits:
    """Sends the requests of a screen, and keeps the report of the last one."""

    def __init__(self, host: Screen[Any], feed: Feed, clock: Clock, glyphs: GlyphSet, show: Callable[[], None]) -> None:
        """Work for the screen `host`; `show` is called whenever `report` has changed."""
        self._host, self._feed, self._clock, self._glyphs, self._show = host, feed, clock, glyphs, show
        self.report: tuple[Run, ...] = ()
        """Lines about the last key, the worst first."""

    def say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Report what became of a key in one line."""
        self.report = ((clean(text, MAX_REPORT), ink),)
        self._show()

    def say_copied(self, text: str, ink: Ink) -> None:
        """Report what was copied below the lines of the key before, without those of earlier copies."""
        self.report = below_report(self.report, text, ink)
        self._show()

    def copy_path(self, path: str) -> None:
        """Send the path of a file to the terminal's clipboard, and report it."""
        self.say_copied(*copy_text(self._host.app, path, path))
