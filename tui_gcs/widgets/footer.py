"""The keys that are valid now, from the action tables."""

from collections.abc import Sequence
from dataclasses import replace

from tui_gcs.actions import Action, footer_actions
from tui_gcs.core.messages import RunPhase, StationStatus
from tui_gcs.feed import Feed, StatusUpdated
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.strips import Run


class FooterLine(LinesView):
    """One line of keys."""

    DEFAULT_CSS = "FooterLine { height: 1; dock: bottom; }"

    def __init__(self, actions: Sequence[Action], *, glyphs: GlyphSet = UNICODE, feed: Feed | None = None) -> None:
        """For these actions; with a feed only those that do something now."""
        super().__init__(glyphs=glyphs)
        self._actions = actions
        self._feed = feed

    def on_mount(self) -> None:
        """Follow what the fleet does."""
        if self._feed is not None:
            self._feed.listen(self)

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Other keys may be valid now."""
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        status = self._feed.status if self._feed is not None else None
        runs: list[Run] = [(" ", Ink.MUTED)]
        for action in footer_actions(valid_now(self._actions, status), width):
            runs += [(action.shown, Ink.BOLD), (f" {action.label}  ", Ink.MUTED)]
        return [runs]


def valid_now(actions: Sequence[Action], status: StationStatus | None) -> list[Action]:
    """Without the actions that do nothing in this phase, and with the label that says what will happen."""
    if status is None:
        return list(actions)
    hidden = set()
    if status.run is RunPhase.IDLE:
        hidden.add("return_and_land")
    if status.run is not RunPhase.HOLD:
        hidden.add("enter")
    else:
        hidden.add("start_stop")
    label = "start" if status.run is RunPhase.IDLE else "HOLD"
    shown = (replace(action, label=label) if action.id == "start_stop" else action for action in actions)
    return [action for action in shown if action.id not in hidden]
