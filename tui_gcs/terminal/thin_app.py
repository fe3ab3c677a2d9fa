"""An app that writes little, and never waits for a terminal that does not read.

The painter writes only the cells that changed. A terminal that keeps up with nothing gets no pictures at all, and a
whole new one as soon as it reads again; the event loop never waits for it (facts/terminal.md B4).
"""

import contextlib
import io
from collections.abc import Sequence
from typing import Any

from rich.console import Console, RenderableType
from textual.app import App, ScreenStackError
from textual.driver import Driver
from textual.drivers.linux_driver import LinuxDriver
from textual.filter import LineFilter
from textual.screen import Screen

from tui_gcs.terminal.cell_painter import CellPainter, themed
from tui_gcs.terminal.input_driver import NonBlockingDriver, lagging
from tui_gcs.terminal.themes import THEMES

LOOK_AGAIN_S = 0.2


class DiffApp(App[None]):
    """Textual's app with the painter and the patient driver."""

    def __init__(self, *, ansi_color: bool | None = None) -> None:
        """See `App`."""
        super().__init__(ansi_color=ansi_color)
        self._painter = CellPainter()
        self._behind = False

    def get_driver_class(self) -> type[Driver]:
        """The Unix driver that knows whether the terminal keeps up."""
        driver = super().get_driver_class()
        return NonBlockingDriver if driver is LinuxDriver else driver

    def _display(self, screen: Screen[Any], renderable: RenderableType | None) -> None:
        """Textual's way to the terminal, by way of the painter."""
        if self._behind or lagging(self._driver):
            if not self._behind:
                self._behind = True
                self.set_timer(LOOK_AGAIN_S, self._catch_up)
            return
        super()._display(screen, self._painter.thin(renderable))

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Textual's filters fit colours to the terminal, line by line; the painter does that, cell by changed cell.

        Without colours they do what remains.
        """
        return super().get_line_filters() if self.no_color else ()

    def _set_pointer_shape(self, shape: str) -> None:
        """No shapes of a mouse pointer: an OSC sequence at every change of screens, and not every terminal eats it."""

    def _catch_up(self) -> None:
        """What was not written is on no screen: begin anew once the terminal reads."""
        if lagging(self._driver):
            self.set_timer(LOOK_AGAIN_S, self._catch_up)
            return
        self._behind = False
        self.redraw()

    @property
    def display_theme(self) -> str:
        """Name of the theme in which everything is drawn; set it to one of `THEMES`."""
        return self._painter.theme.name

    @display_theme.setter
    def display_theme(self, name: str) -> None:
        self._painter.theme = THEMES[name]
        self.redraw()

    def export_screenshot(self, *, title: str | None = None, simplify: bool = False) -> str:
        """The screen as SVG in the theme that is on; Textual's own would always be dark."""
        console = Console(
            width=self.size.width, file=io.StringIO(), force_terminal=True, color_system="truecolor", record=True
        )
        update = self.screen._compositor.render_update(
            full=True, screen_stack=self._background_screens, simplify=simplify
        )
        console.print(themed(update, self._painter.theme))
        svg = console.export_svg(title=title or self.title)
        return svg.replace("<svg ", '<svg xml:space="preserve" ', 1)  # some programs drop blanks otherwise

    def action_next_theme(self) -> None:
        """Change to the next theme."""
        names = list(THEMES)
        self.display_theme = names[(names.index(self.display_theme) + 1) % len(names)]

    def action_redraw(self) -> None:
        """Write every cell again, for an operator who sees rubbish."""
        self.redraw()

    def redraw(self) -> None:
        """Write every cell again: the terminal may show anything (a resize, a message of another program)."""
        self._painter.forget()
        with contextlib.suppress(ScreenStackError):  # the app is closing, or has not begun
            self.screen.refresh()
