"""An app that writes only what changed, and never waits for a terminal that does not read."""

import io
from collections.abc import Sequence
from typing import Any

from rich.console import Console, RenderableType
from textual.app import App
from textual.driver import Driver
from textual.filter import LineFilter
from textual.screen import Screen

from tui_gcs.terminal.cell_painter import CellPainter, themed
from tui_gcs.terminal.plain_app import PlainApp
from tui_gcs.terminal.private.compositor import ScreenUpdates
from tui_gcs.terminal.private.driver import lagging, non_blocking

LOOK_AGAIN_S = 0.2


class DiffApp(PlainApp):
    """Textual's app with the cell painter and the driver that does not block.

    Private: `App._display`, through which every update goes to the terminal, `App._driver` and
    `App._set_pointer_shape`. Public hooks see widgets and lines, not the bytes that are written.
    """

    def __init__(self) -> None:
        """See `PlainApp`."""
        super().__init__()
        self._painter = CellPainter()
        self._behind = False

    def get_driver_class(self) -> type[Driver]:
        """See `App`; the Unix driver is replaced by one that does not block."""
        return non_blocking(super().get_driver_class())

    def _display(self, screen: Screen[Any], renderable: RenderableType | None) -> None:
        # A terminal that lags gets no pictures at all, and a whole new one as soon as it reads again.
        if self._behind or self.is_lagging:
            if not self._behind:
                self._behind = True
                self.set_timer(LOOK_AGAIN_S, self._catch_up)
            return
        super()._display(screen, self._painter.thin(renderable))

    def get_line_filters(self) -> Sequence[LineFilter]:
        """See `App`. Without colours Textual's filters remain; else the painter fits colours to the terminal.

        The filters work line by line, the painter only on cells that changed.
        """
        return App.get_line_filters(self) if self.no_color else ()

    def _set_pointer_shape(self, shape: str) -> None:
        # Textual would write an OSC sequence at every change of screens, and not every terminal swallows it.
        pass

    @property
    def is_lagging(self) -> bool:
        """See `PlainApp`."""
        return lagging(self._driver)

    def _catch_up(self) -> None:
        if self.is_lagging:
            self.set_timer(LOOK_AGAIN_S, self._catch_up)
            return
        self._behind = False
        self.redraw()

    def export_screenshot(self, *, title: str | None = None, simplify: bool = False) -> str:
        """The screen as SVG in the theme that is on; Textual's own would always be dark."""
        console = Console(
            width=self.size.width, file=io.StringIO(), force_terminal=True, color_system="truecolor", record=True
        )
        console.print(themed(ScreenUpdates.whole_screen(self, simplify=simplify), self._painter.theme))
        svg = console.export_svg(title=title or self.title)
        return svg.replace("<svg ", '<svg xml:space="preserve" ', 1)  # some programs drop blanks otherwise

    def redraw(self) -> None:
        """See `PlainApp`."""
        self._painter.theme = self.colours
        self._painter.forget()
        self.refresh_screen()
