"""The plots screen of recorded flights, without a station."""

from pathlib import Path

from textual.app import ComposeResult

from tui_gcs.actions.action import SCREENS, action
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.feed.notices import Notice
from tui_gcs.feed.plots.flight_source import FlightPlotSource
from tui_gcs.feed.plots.plot_layout import WHOLE_FLIGHT
from tui_gcs.screens.plots.plot_screen import PlotScreen, PlotStateLine
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.live_line import LiveLine
from tui_gcs.widgets.basics.palette import Ink

READ_S = 0.25
APP_KEYS = (
    action("next_theme", "T", "", "colours: dark, night (red), day, high contrast", SCREENS),
    action("redraw", "ctrl+l", "", "write the whole screen again", SCREENS),
    action("show_help", "question_mark", "help", "all keys", SCREENS, 9),
    action("leave", "q", "leave", "the recordings stay as they are", SCREENS, 9),
)
"""The keys of the program that shows nothing else."""


class FlightPlotsScreen(PlotScreen):
    """Panes of values of recorded flights."""

    def __init__(
        self,
        source: FlightPlotSource,
        title: str,
        *,
        folder: Path | None = None,
        glyphs: GlyphSet = UNICODE,
        at_s: float | None = None,
    ) -> None:
        """Plot points of `source`, the logs called `title`; views are kept in `folder`, the cursor begins at `at_s`."""
        super().__init__(source, folder=folder, glyphs=glyphs)
        self._cursor_s = at_s
        self.flight = source
        self.plan.window = WHOLE_FLIGHT
        self._title = title
        self.title_line = PlotStateLine(glyphs=glyphs)
        self.live_line = LiveLine(glyphs=glyphs)
        self.live_line.display = False

    def compose(self) -> ComposeResult:
        """Compose the name of the flight, what flies meanwhile, the panes, the line below them and the footer."""
        yield self.title_line
        yield self.live_line
        yield from self.plot_widgets()
        yield FooterLine((*APP_KEYS, *self.ACTIONS), glyphs=self._glyphs)

    def on_mount(self) -> None:
        """Begin to read."""
        self.set_interval(READ_S, self.read_on)
        self.call_after_refresh(self.read_on)

    def show_live(self, news: Notice) -> None:
        """Show what flies meanwhile; the line is not there where nothing does."""
        self.live_line.display = bool(news.text)
        self.live_line.show(news)

    def read_on(self) -> None:
        """Read what is plotted and was not read yet."""
        if self.flight.is_reading and self.is_current:
            self.ask()
        whose = vehicles_words(self.flight.vehicles) if self.flight.vehicles else "no vehicles"
        doing = "reading …" if self.flight.is_reading else self.flight.error
        self.title_line.show(
            (" RECORDED ", Ink.REPLAY),
            (f"  {self._title}   {whose}   {self.source.time_words(self.flight.begin_s)} - ", Ink.TEXT),
            (f"{self.source.time_words(self.source.now_s)}   ", Ink.TEXT),
            (doing, Ink.CAUTION),
        )
