"""The last line: which vehicles commands are for, and the keys that do something now."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from tui_gcs.actions import APP, APP_ACTIONS, ConsoleAction, footer_actions
from tui_gcs.actions.action import on_screen
from tui_gcs.actions.keymap import with_keys
from tui_gcs.actions.replay_actions import REPLAY_ACTIONS, REPLAY_SCOPE
from tui_gcs.core.protocol.common import Phase
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated, SelectionChanged, StatusUpdated
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run

MAX_IDS_CELLS = 14
RELABELLED_WEIGHT = 10
WEIGHTS_ELSEWHERE = {
    "show_fly": 8,
    "select": 8,
    "detach": 6,
    "palette": 5,
    "show_menu": 3,
    "start_stop": 5,
    "orders": 5,
}
"""Weights on other screens than the fly screen: the way back comes first, what HOLD ALL and the help cover last."""

FLEET_SCREEN = "show_vehicles"
"""There, too, vehicles are ordered about."""


class FooterLine(LinesView):
    """One line of keys; with a feed it begins with the selection."""

    DEFAULT_CSS = "FooterLine { height: 1; dock: bottom; }"

    def __init__(
        self, actions: Sequence[ConsoleAction], *, glyphs: GlyphSet = UNICODE, feed: Feed | None = None, here: str = ""
    ) -> None:
        """Show these actions, with a feed only those that work now; `here` is the action that shows this screen."""
        super().__init__(glyphs=glyphs)
        self._actions = actions
        self._feed = feed
        self._typing = False
        self._here = here
        self._labels: Mapping[str, str] = {}
        self._phases: frozenset[Phase] = frozenset()
        """Phases of all vehicles, on which it depends what keys do."""

    def on_mount(self) -> None:
        """Subscribe to the feed, if there is one."""
        if self._feed is not None:
            self._feed.listen(self)

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Other keys may be valid now."""
        self.update_lines()

    def on_fleet_updated(self, message: FleetUpdated) -> None:
        """A vehicle may fly or hold now that did not."""
        # Frames come five times a second, and of all that is in them keys depend on phases only.
        phases = frozenset(message.frame.phase)
        if phases != self._phases:
            self._phases = phases
            self.update_lines()

    def on_selection_changed(self, _message: SelectionChanged) -> None:
        """Show which vehicles commands are for now."""
        self.update_lines()

    def relabel(self, labels: Mapping[str, str]) -> None:
        """Show these labels for actions by id, where a key does something else in the present view of the screen."""
        if labels != self._labels:
            self._labels = labels
            self.update_lines()

    def show_typing(self, typing: bool) -> None:
        """Show which keys work while a field has the focus: letters and Space go into it."""
        self._typing = typing
        self.update_lines()

    def _with_keys(self) -> list[ConsoleAction]:
        """The actions with the keys of the operator's keymap."""
        keymap = getattr(self.app, "keymap", {})
        status = self._feed.status if self._feed is not None else None
        replay = REPLAY_ACTIONS if status is not None and status.replay is not None else ()
        everywhere = [action for action in self._actions if action in APP_ACTIONS]
        others = [action for action in self._actions if action not in APP_ACTIONS]
        player = with_keys(replay, REPLAY_SCOPE, keymap)
        own = with_keys(others, self.app.current_mode, keymap)
        return [*player, *on_screen(with_keys(everywhere, APP, keymap), own), *own]

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        actions = self._with_keys()
        runs: list[Run] = []
        if self._feed is not None:
            runs = selection_runs(self._feed, self.glyphs)
            context = self._feed.action_context()
            actions = [
                replace(action, label=action.label_now(context)) if action.label_now is not None else action
                for action in actions
                if not action.is_hidden(context)
            ]
        if self._here:
            weights = {**WEIGHTS_ELSEWHERE, "orders": 8} if self._here == FLEET_SCREEN else WEIGHTS_ELSEWHERE
            actions = [
                replace(action, weight=weights.get(action.id, action.weight))
                for action in actions
                if action.id != self._here
            ]
        actions = [
            replace(action, label=self._labels[action.id], weight=RELABELLED_WEIGHT)
            if action.id in self._labels
            else action
            for action in actions
        ]
        if self._typing:
            actions = while_typing(actions)
        return [runs + _keys(actions, width - sum(len(text) for text, _ in runs))]


def selection_runs(feed: Feed, glyphs: GlyphSet) -> list[Run]:
    """The selected vehicles in few cells; for a console that may not command, that instead."""
    if feed.requests.read_only:
        return [(" read-only ", Ink.MUTED)]
    selected = feed.selection.ids
    if not selected:
        return [(" none selected ", Ink.MUTED)]
    text = ids(selected).replace(" ", ",")
    if len(text) > MAX_IDS_CELLS:
        text = f"{len(selected)} vehicles"
    return [(f" {glyphs.selected}{text} ", Ink.SELECTED)]


def _keys(actions: Sequence[ConsoleAction], width: int) -> list[Run]:
    runs: list[Run] = [(" ", Ink.MUTED)]
    for action in footer_actions(actions, width):
        runs += [(action.shown, Ink.BOLD), (f" {action.label}  ", Ink.MUTED)]
    return runs


def while_typing(actions: Sequence[ConsoleAction]) -> list[ConsoleAction]:
    """Actions that work while a field has the focus: HOLD ALL, keys with Ctrl, Tab and Esc."""
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
