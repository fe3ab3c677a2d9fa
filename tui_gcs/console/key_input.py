"""Keys before any screen gets them: chords for all vehicles, the line of a selection, one after the other."""

import math
import time
from collections.abc import Awaitable, Callable

from textual import events
from textual.screen import ModalScreen, Screen
from textual.widgets import Input

from tui_gcs.actions.action import human
from tui_gcs.console.commands import CommandController, action_named
from tui_gcs.console.idle_garbage import IdleGarbage
from tui_gcs.console.order_results import OrderResults
from tui_gcs.console.parts import ConsoleParts
from tui_gcs.console.selection_entry import SelectionEntry
from tui_gcs.core.protocol.common import RunPhase
from tui_gcs.feed.notices import Severity
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.terminal.key_queue import MAX_KEY_S, KeyHandled, KeyQueue

CHORD_S = 3.0
"""The second key of a chord must come this soon after `!`."""
CHORDS = {"h": "hold_all", "r": "return_all", "l": "land_all"}
"""The command of each chord, by its second key."""
CHORD_HELP = "! ALL but piloted:  h HOLD   r return   l land here    (Esc: no)"
GUARD_S = 0.7
"""Eye and hand take this long to notice that a question closed; each key that was kept back adds as much."""
MAX_GUARD_S = 3.0
"""A key that is held down is a key again after this long."""
MODIFIERS = frozenset(
    f"{side}_{name}" for side in ("left", "right") for name in ("shift", "control", "alt", "super", "hyper", "meta")
) | {"caps_lock", "num_lock", "scroll_lock", "iso_level3_shift", "iso_level5_shift"}
"""Keys that terminals with the kitty protocol report by themselves."""


class KeyChord:
    """`!` then `h`, `r` or `l`: all hold, return or land. Any other key behind `!` is not lost."""

    def __init__(self) -> None:
        self._prefix: events.Key | None = None
        self._until_s = 0.0

    def is_waiting(self, now_s: float) -> bool:
        """Whether `!` was pressed and its second key is still awaited."""
        return self._prefix is not None and now_s <= self._until_s

    def press(self, key: events.Key, now_s: float) -> tuple[str, list[events.Key]]:
        """Take a key, pressed at a time in seconds; return the command it gives or "", and keys to handle as usual."""
        held, self._prefix = self._prefix, None
        if held is not None and now_s <= self._until_s:
            if key.character is not None and key.character.lower() in CHORDS:
                return CHORDS[key.character.lower()], []
            if key.key == "escape":
                return "", []
        if key.character == "!":
            self._prefix, self._until_s = key, now_s + CHORD_S
            return "", [held] if held is not None else []
        return "", [held, key] if held is not None else [key]


class KeyGuard:
    """Keeps back keys that were meant for a question which closed by itself. Times are seconds of one clock.

    When a question expires while the operator types `y`, the key must not reach what is below it. Keys that stop
    vehicles are never kept back: the caller asks only about others.
    """

    def __init__(self) -> None:
        self._until_s = self._ends_s = -math.inf
        self.why = ""
        """Why the newest question closed."""

    def begin(self, why: str, now_s: float) -> None:
        """A question has just closed by itself."""
        self.why = why
        self._until_s, self._ends_s = now_s + GUARD_S, now_s + MAX_GUARD_S

    def keeps_back(self, pressed_s: float) -> bool:
        """Whether a key pressed then was meant for the question; call it once for each key."""
        if pressed_s >= min(self._until_s, self._ends_s):
            return False
        self._until_s = max(self._until_s, pressed_s + GUARD_S)
        return True


class KeyInput:
    """Takes every key of the console. A chord is carried out at once; other keys go to screens one after the other."""

    def __init__(
        self,
        parts: ConsoleParts,
        commands: CommandController,
        results: OrderResults,
        entry: SelectionEntry,
        garbage: IdleGarbage,
        pass_on: Callable[[events.Event], Awaitable[None]],
        on_change: Callable[[], None],
    ) -> None:
        """Give keys to screens by `pass_on`; `on_change` is called when the prompt may have changed."""
        self._parts = parts
        self._commands = commands
        self._results = results
        self._entry = entry
        self._garbage = garbage
        self._pass_on = pass_on
        self._on_change = on_change
        self._chord = KeyChord()
        self._guard = KeyGuard()
        self._key_queue = KeyQueue()
        self.chord_help = CHORD_HELP
        """What is shown after `!`."""

    @property
    def is_idle(self) -> bool:
        """Whether everything typed was handled."""
        return self._key_queue.is_idle

    @property
    def prompt(self) -> str:
        """What waits for the next key, for the second line; empty if nothing does."""
        return self.chord_help if self._chord.is_waiting(self._parts.clock.now()) else self._entry.prompt

    @property
    def awaits_chord(self) -> bool:
        """Whether `!` was pressed and its second key is still awaited."""
        return self._chord.is_waiting(self._parts.clock.now())

    async def take(self, event: events.Key | events.Paste) -> None:
        """Take a key or a paste from the terminal."""
        now_s = self._parts.clock.now()
        if isinstance(event, events.Paste):
            self._key_queue.add((event, now_s))
            await self._handle_waiting()
            return
        if event.key in MODIFIERS:  # some terminals report Shift itself: it is part of the key that comes with it
            return
        self._garbage.note_key(now_s)
        # A console that was busy still takes the key as of when it was pressed, which decides what it was meant for.
        pressed_s = now_s - max(0.0, time.monotonic() - event.time)
        was_waiting = self._chord.is_waiting(pressed_s)
        command, keys = self._chord.press(event, pressed_s)
        if was_waiting or self._chord.is_waiting(now_s):
            self._on_change()
        # At once, before keys that wait for a slow screen: a chord is the last resort.
        if command:
            self._commands.by_name[command]()
        for key in keys:
            self._key_queue.add((key, pressed_s))
        await self._handle_waiting()

    async def on_handled(self, message: KeyHandled) -> None:
        """Take the next key when fields have posted what the last one made of them, and its screen has the focus."""
        target, app = message.target, self._parts.app
        if target is not None and target.post_message(KeyHandled(message.turn, None, message.screen)):
            return
        if message.screen is not None and app.screen_stack and app.screen is not message.screen:
            app.screen.call_after_refresh(app.call_later, self._end_turn, message.turn)
        else:
            app.call_later(self._end_turn, message.turn)

    def note_closed(self, why: str) -> None:
        """A question has closed by itself: keys that come now were still meant for it."""
        self._guard.begin(why, self._parts.clock.now())

    async def _handle_waiting(self) -> None:
        app = self._parts.app
        while (typed := self._key_queue.next()) is not None:
            event, pressed_s = typed
            if isinstance(event, events.Key) and (self._keeps_back(event, pressed_s) or self._enters(event)):
                continue
            turn, target, screen = self._key_queue.begin(), app.focused or app.screen, app.screen
            await self._pass_on(event)
            # A widget that was removed by the key takes no messages: the turn ends here.
            if not target.post_message(KeyHandled(turn, target, screen)):
                self._key_queue.end(turn)
        if held_up_by := self._key_queue.held_up_by:
            app.set_timer(MAX_KEY_S, lambda: app.post_message(KeyHandled(held_up_by)))

    async def _end_turn(self, turn: int) -> None:
        if self._key_queue.end(turn):
            await self._handle_waiting()

    def _keeps_back(self, key: events.Key, pressed_s: float) -> bool:
        """Whether the key was meant for a question that had just closed by itself; the operator is notified."""
        if self._stops(key) or not self._guard.keeps_back(pressed_s):
            return False
        shown = key.character if key.is_printable and key.key != "space" else human(key.key)
        text = f"{shown} NOT TAKEN, a question had just closed: {self._guard.why}"
        self._parts.notice(text, Severity.CAUTION)
        return True

    def _stops(self, key: events.Key) -> bool:
        """Whether the key holds all vehicles now."""
        status = self._parts.feed.status
        if status is None or status.run is RunPhase.IDLE or self._is_text():
            return False
        bound = self._parts.app.screen.active_bindings.get(key.key)
        return bound is not None and bound.binding.action.removeprefix("app.") == action_named("start_stop").call

    def _enters(self, key: events.Key) -> bool:
        """Whether the key went into the line of a selection, or closed the table of results."""
        if isinstance(self._parts.app.screen, ModalScreen) or self._is_text():
            return False
        if not self._entry.is_open and key.key == "escape" and self._results.close():
            return True
        return self._entry.press(key)

    def _is_text(self) -> bool:
        """Whether keys are letters now: of a field, or of something that a screen reads itself."""
        app = self._parts.app
        return isinstance(app.focused, Input) or is_typing(app.screen)


def is_typing(screen: Screen[object]) -> bool:
    """Whether a screen reads keys as letters itself."""
    typed = getattr(screen, "typed", None)
    return isinstance(typed, TypedWords) and typed.is_typing
