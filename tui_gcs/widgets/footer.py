"""The keys that are valid now, from the action tables."""

from collections.abc import Sequence
from dataclasses import replace

from tui_gcs.actions import COMMAND, Action, footer_actions
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
        self._typing = False

    def on_mount(self) -> None:
        """Follow what the fleet does."""
        if self._feed is not None:
            self._feed.listen(self)

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Other keys may be valid now."""
        self.update_lines()

    def show_typing(self, typing: bool) -> None:
        """A field has the cursor (or no more): letters and Space go into it, and are not shown as keys."""
        self._typing = typing
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        actions, status = self._actions, None
        if self._feed is not None:
            status = self._feed.status
            if self._feed.read_only:  # a replay, or a station that is not ours to command
                actions = [action for action in actions if action.group != COMMAND]
        return [_keys(while_typing(actions) if self._typing else valid_now(actions, status), width)]


def _keys(actions: Sequence[Action], width: int) -> list[Run]:
    runs: list[Run] = [(" ", Ink.MUTED)]
    for action in footer_actions(actions, width):
        runs += [(action.shown, Ink.BOLD), (f" {action.label}  ", Ink.MUTED)]
    return runs


def while_typing(actions: Sequence[Action]) -> list[Action]:
    """What works while a field has the cursor: HOLD ALL, keys with Ctrl, Tab and Esc."""
    works = []
    for action in actions:
        held = [part for part in action.shown.split("/") if part.startswith("^")]
        if action.shown in ("!h", "Tab"):
            works.append(action)
        elif held:
            works.append(replace(action, shown=held[0]))
        elif action.shown == "Esc":
            works.append(replace(action, label="leave field", weight=9))
    return works


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
