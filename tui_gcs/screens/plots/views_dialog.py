"""The list of saved views: Enter shows one, Del removes it."""

from textual import events

from tui_gcs.feed.plots.plot_layout import PlotViews
from tui_gcs.screens.common.text_dialog import TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink


class ViewsDialog(TextDialog[str]):
    """The result is the name of the chosen view, or ""."""

    title_text = "saved views"

    def __init__(self, views: PlotViews, glyphs: GlyphSet) -> None:
        """List `views`."""
        super().__init__(glyphs)
        self._views = views
        self._at = 0
        self._report = ""

    def on_key(self, event: events.Key) -> None:
        """Choose by arrows and Enter, remove by Del, leave by Esc."""
        event.stop()
        names = self._views.names
        self._report = ""
        if event.key == "escape":
            self.finish("")
            return
        if event.key == "enter" and names:
            self.finish(names[self._at])
            return
        if event.key in ("down", "up"):
            self._at += 1 if event.key == "down" else -1
        elif event.key == "delete" and names:
            self._report = self._views.remove(names[self._at])
        self._at = max(0, min(self._at, len(self._views.names) - 1))
        self.redraw()

    def body(self) -> list[Line]:
        """Return the names, and the keys."""
        names = self._views.names
        room = max(1, self.room - 2)
        first = max(0, self._at - room + 1)
        lines: list[Line] = [
            [(f" {self.glyphs.selected if at == self._at else ' '} {name}", Ink.BOLD if at == self._at else Ink.TEXT)]
            for at, name in enumerate(names[first : first + room], start=first)
        ]
        if not names:
            lines = [[("no view is saved yet: W saves what is shown", Ink.MUTED)]]
        if self._report:
            lines.append([(self._report, Ink.CAUTION)])
        return [*lines, [(" Esc = close ", Ink.SELECTED), ("   Enter = show it   Del = remove it", Ink.MUTED)]]
