"""The keys that are valid now, from the action tables."""

from collections.abc import Sequence

from tui_gcs.actions import Action, footer_actions
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink


class FooterLine(LinesView):
    """One line of keys."""

    DEFAULT_CSS = "FooterLine { height: 1; dock: bottom; }"

    def __init__(self, actions: Sequence[Action], *, glyphs: GlyphSet = UNICODE) -> None:
        """For these actions."""
        super().__init__(glyphs=glyphs)
        self._actions = actions

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        runs = [(" ", Ink.MUTED)]
        for action in footer_actions(self._actions, width):
            runs += [(action.shown, Ink.BOLD), (f" {action.label}  ", Ink.MUTED)]
        return [runs]
