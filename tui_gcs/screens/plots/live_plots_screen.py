"""The plots screen of a console: live values of the station."""

from pathlib import Path

from textual.app import ComposeResult

from tui_gcs.actions import APP_ACTIONS
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StationBack
from tui_gcs.feed.plots.plot_source import LivePlotSource
from tui_gcs.feed.plots.value_recorder import ValueRecorder
from tui_gcs.screens.plots.plot_screen import PlotScreen
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.top_lines import TopLines

DRAW_S = 0.5
ASK_S = 0.25


class LivePlotsScreen(PlotScreen):
    """Panes of live values."""

    DIGITS_SELECT = True

    def __init__(
        self, feed: Feed, recorder: ValueRecorder, *, folder: Path | None = None, glyphs: GlyphSet = UNICODE
    ) -> None:
        """Plot what `recorder` records of the station of `feed`; views are kept in `folder`."""
        super().__init__(LivePlotSource(feed, recorder), folder=folder, glyphs=glyphs)
        self.feed = feed
        self.top_lines = TopLines(feed, glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Compose the top lines, the panes, the line below them and the footer."""
        yield self.top_lines
        yield from self.plot_widgets()
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_plots")

    def on_mount(self) -> None:
        """Begin to draw and to ask."""
        self.feed.listen(self)
        self.set_interval(DRAW_S, self.draw_on)
        self.set_interval(ASK_S, self.ask)

    def draw_on(self) -> None:
        """Draw what has come; a frozen picture stays."""
        if not self.is_frozen:
            self.show_all()

    def on_station_back(self, _message: StationBack) -> None:
        """Go on: the times of a station that was restarted may be others."""
        self._held = self._cursor_s = None
        self.show_all()
