"""One key after the other: a key is handled when everything that the one before it leads to is on the screen.

Textual gives a key to the screen on top and looks for its binding only when the screen did not want it. Meanwhile the
next key, of a slow link that delivers several at once, would go to the same screen: the letter behind the one that
opens a menu, the digit behind the one that asks for a round.
"""

from collections import deque
from typing import Any

from textual.events import Key, Paste
from textual.message import Message
from textual.message_pump import MessagePump
from textual.screen import Screen

TypedKey = tuple[Key | Paste, float]
"""What was typed, and when, in seconds of the console's clock."""

MAX_KEY_S = 0.5
"""A screen that takes longer for a key, or has ended with it, does not hold up the next one."""


class KeyHandled(Message):
    """Follows a key from the focused widget up to the app, where it shows that the key was handled completely.

    It comes twice: behind the key, and behind the messages that the key made a field and its form post.
    """

    def __init__(self, turn: int, target: MessagePump | None = None, screen: Screen[Any] | None = None) -> None:
        """Follow the key of a turn; `target` is where the second pass begins, None in the second pass.

        A key that opened another screen than `screen` is handled when that one is drawn and has its focus.
        """
        super().__init__()
        # Bubbling up the same way as the key, it arrives when every widget on that way has handled the key.
        self.turn = turn
        self.target = target
        self.screen = screen


class KeyQueue:
    """Keys that wait behind the one that is being handled."""

    def __init__(self) -> None:
        self._waiting: deque[TypedKey] = deque()
        self._turn = 0
        self._is_handling = False

    def add(self, typed: TypedKey) -> None:
        """Add the newest key."""
        self._waiting.append(typed)

    def next(self) -> TypedKey | None:
        """Take the oldest key that waits; None while one is being handled."""
        return self._waiting.popleft() if self._waiting and not self._is_handling else None

    def begin(self) -> int:
        """A key is given to a screen now; return the number of its turn."""
        self._turn, self._is_handling = self._turn + 1, True
        return self._turn

    def end(self, turn: int) -> bool:
        """The key of this turn was handled, or takes too long; return whether the next one may go."""
        was_handling, self._is_handling = self._is_handling, self._is_handling and turn != self._turn
        return was_handling and not self._is_handling

    @property
    def is_idle(self) -> bool:
        """Whether everything typed was handled."""
        return not self._waiting and not self._is_handling

    @property
    def held_up_by(self) -> int:
        """The turn for which others wait; 0 if none waits."""
        return self._turn if self._is_handling and self._waiting else 0
