"""The program of `tui-gcs plot`: the plots of recorded flights, and nothing else.

It may cover the console of a station: what flies meanwhile is on a line, and HOLD ALL holds that (`LiveWatch`).
"""

from pathlib import Path
from typing import ClassVar

from textual import events
from textual.binding import BindingType

from tui_gcs.actions import ActionContext, bindings
from tui_gcs.console.key_input import KeyChord
from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.feed.live_watch import LOOK_S, LiveWatch
from tui_gcs.feed.notices import NOTICE_S, Notice, Severity
from tui_gcs.feed.plots.flight_source import FlightPlotSource
from tui_gcs.feed.plots.plot_layout import PlotLayout
from tui_gcs.screens.common.help import HelpDialog
from tui_gcs.screens.plots.flight_plots_screen import APP_KEYS, FlightPlotsScreen
from tui_gcs.terminal.variant import TerminalApp
from tui_gcs.widgets.basics.glyphs import GlyphSet


class FlightPlotApp(TerminalApp):
    """Shows one screen until the operator leaves."""

    TITLE = "tui-gcs"
    ENABLE_COMMAND_PALETTE = False
    ALLOW_SELECT = False
    BINDINGS: ClassVar[list[BindingType]] = bindings(APP_KEYS)
    CSS = """
    Screen { background: #101418; color: #d8dee4; }
    ModalScreen { background: transparent; }
    """

    def __init__(
        self,
        source: FlightPlotSource,
        title: str,
        layout: PlotLayout,
        *,
        folder: Path | None = None,
        glyphs: GlyphSet,
        theme: str = "",
        beside: LiveWatch | None = None,
        clock: Clock | None = None,
        at_s: float | None = None,
    ) -> None:
        """Plot points of `source` in the panes of `layout`, with the cursor at `at_s`.

        Views are kept in `folder`, `beside` is what may fly.
        """
        super().__init__()
        if theme:
            self.display_theme = theme
        self.glyphs = glyphs
        self.plots = FlightPlotsScreen(source, title, folder=folder, glyphs=glyphs, at_s=at_s)
        self._first_layout = layout
        self._beside = beside
        self._clock = clock or MonotonicClock()
        self._chord = KeyChord()
        self._said = Notice("")
        """What became of the last chord, for a while."""

    def on_mount(self) -> None:
        """Show the screen."""
        self.push_screen(self.plots)
        self.plots.show_layout(self._first_layout)
        if self._beside is not None:
            self._beside.open()
            self.set_interval(LOOK_S, self.look_at_what_flies)

    def on_unmount(self) -> None:
        """Listen no more to what flies."""
        if self._beside is not None:
            self._beside.close()

    async def on_event(self, event: events.Event) -> None:
        """Give keys to the chord first, as in the console: no field or dialog can swallow HOLD ALL."""
        if self._beside is None or not isinstance(event, events.Key) or event.is_forwarded:
            await super().on_event(event)
            return
        command, keys = self._chord.press(event, self._clock.now())
        if command == "hold_all" and self._beside.kinds:
            self.run_worker(self._hold_what_flies(self._beside), group="hold", exit_on_error=False)
        elif command:
            self._say(Notice("nothing sent: plots", Severity.CAUTION))
        for key in keys:
            await super().on_event(key)

    def look_at_what_flies(self) -> None:
        """Show the worst news of it; ring for a new one."""
        if self._beside is None:
            return
        news = self._beside.news()
        if news.rings:
            self.bell()
        text = "  | ".join(filter(None, (self._said.text, news.line.text)))
        self.plots.show_live(Notice(text, max(self._said.level, news.line.level)))

    async def _hold_what_flies(self, beside: LiveWatch) -> None:
        self._say(Notice(f"HOLD ALL is sent to {beside.words}", Severity.CAUTION))
        self._say(await beside.hold_all())

    def _say(self, notice: Notice) -> None:
        self._said = notice
        self.set_timer(NOTICE_S, lambda: self._forget(notice))
        self.look_at_what_flies()

    def _forget(self, notice: Notice) -> None:
        if self._said is notice:
            self._said = Notice("")

    def action_show_help(self) -> None:
        """Show all keys."""
        self.push_screen(HelpDialog(APP_KEYS, ActionContext(), self.glyphs, FlightPlotsScreen.ACTIONS))

    def action_leave(self) -> None:
        """End the program; the flights stay as they are."""
        self.exit()
