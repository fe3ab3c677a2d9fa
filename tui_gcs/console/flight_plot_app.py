"""The program of `tui-gcs plot`: the plots of recorded flights, and nothing else."""

from pathlib import Path
from typing import ClassVar

from textual.binding import BindingType

from tui_gcs.actions import ActionContext, bindings
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
        ansi_color: bool | None = None,
    ) -> None:
        """Plot points of `source` in the panes of `layout`; views are kept in `folder`."""
        super().__init__(ansi_color=ansi_color)
        if theme:
            self.display_theme = theme
        self.glyphs = glyphs
        self.plots = FlightPlotsScreen(source, title, folder=folder, glyphs=glyphs)
        self._first_layout = layout

    def on_mount(self) -> None:
        """Show the screen."""
        self.push_screen(self.plots)
        self.plots.show_layout(self._first_layout)

    def action_show_help(self) -> None:
        """Show all keys."""
        self.push_screen(HelpDialog((*FlightPlotsScreen.ACTIONS, *APP_KEYS), ActionContext(), self.glyphs))

    def action_leave(self) -> None:
        """End the program; the flights stay as they are."""
        self.exit()
