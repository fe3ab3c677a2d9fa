"""Questions that are confirmed by `y`: whether something is meant that the station refuses until it is."""

from collections.abc import Sequence

from textual import events

from tui_gcs.core.base.clock import Clock
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import wrapped

EXPIRES_S = 60.0
"""A question that is not answered in this time is void: the vehicles may have taken off meanwhile."""


class ConfirmDialog(TextDialog[bool]):
    """`y` means yes, Esc no; a question that is not answered in time is void."""

    def __init__(self, title: str, glyphs: GlyphSet, clock: Clock) -> None:
        super().__init__(glyphs)
        self.title_text = title
        self._clock, self._deadline_s = clock, clock.now() + EXPIRES_S

    def on_mount(self) -> None:
        """Close when time is up."""
        super().on_mount()
        self.set_interval(1.0, self._check_time)

    def _check_time(self) -> None:
        if self._clock.now() >= self._deadline_s:
            self.lapse(False, "it was not answered in time")

    def on_key(self, event: events.Key) -> None:
        """Take `y` or Esc; Enter, which is pressed by habit, does nothing."""
        event.stop()
        self._check_time()
        if event.key == "escape":
            self.finish(False)
        elif event.character in ("y", "Y"):
            self.finish(True)


class SureDialog(ConfirmDialog):
    """Shows the reasons; `y` does it all the same, Esc leaves it."""

    def __init__(self, title: str, reasons: Sequence[str], does: str, glyphs: GlyphSet, clock: Clock) -> None:
        """Ask `title`; `does` is the word for what `y` does."""
        super().__init__(title, glyphs, clock)
        self._reasons, self._does = reasons, does

    def body(self) -> list[Line]:
        """Return the reasons and the keys."""
        lines: list[Line] = [[(part, Ink.CAUTION)] for why in self._reasons for part in wrapped(why, LINE_CELLS)]
        return [*lines, [], [(" Esc = leave it ", Ink.SELECTED), (f"   y = {self._does}", Ink.BOLD)]]
