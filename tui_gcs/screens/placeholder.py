"""A screen that is not there yet says so."""

from textual.app import ComposeResult
from textual.screen import Screen
from textual.widgets import Static

from tui_gcs.actions import APP_ACTIONS
from tui_gcs.feed import Feed
from tui_gcs.widgets.footer import FooterLine
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.top_lines import TopLines


class PlaceholderScreen(Screen[None]):
    """Top lines, one sentence, keys."""

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        """For this feed."""
        super().__init__()
        self._feed = feed
        self._glyphs = glyphs

    def compose(self) -> ComposeResult:
        """Top lines, sentence, footer."""
        yield TopLines(self._feed, glyphs=self._glyphs)
        yield Static("this screen is not part of this version", markup=False)
        yield FooterLine(APP_ACTIONS, glyphs=self._glyphs, feed=self._feed)
