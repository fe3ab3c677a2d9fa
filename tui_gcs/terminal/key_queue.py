"""One key after the other: a key is looked at when all that the one before it leads to is on the screen.

Textual hands a key to the screen that is on top and looks for its binding only when that has not wanted it; meanwhile
the next key, of a slow link that delivers several at once, would go to the same screen: the letter behind the one that
opens a menu, the digit behind the one that asks for a round.
"""

from collections import deque
from typing import Any

from textual.events import Key, Paste
from textual.message import Message
from textual.message_pump import MessagePump
from textual.screen import Screen

Typed = tuple[Key | Paste, float]
"""What was typed, and when: seconds of the console's clock."""

LONGEST_S = 0.5
"""A screen that takes so long for a key, or has ended with it, holds up no others."""


class KeyHandled(Message):
    """Follows a key on its way from the widget that has the cursor up to the app: there, all of it was handled.

    It comes twice: behind the key, and behind what that made a field and its form say.
    """

    def __init__(self, turn: int, target: MessagePump | None = None, screen: Screen[Any] | None = None) -> None:
        """Behind the key of this turn.

        `target`: where it begins the second time, None if this is that. A key that opened another screen than `screen`
        is done when that is drawn and has its cursor.
        """
        super().__init__()
        self.turn = turn
        self.target = target
        self.screen = screen


class KeyQueue:
    """What waits behind the key that is being handled."""

    def __init__(self) -> None:
        """Nothing was typed yet."""
        self._waiting: deque[Typed] = deque()
        self._turn = 0
        self._is_taken = False

    def add(self, typed: Typed) -> None:
        """The newest one."""
        self._waiting.append(typed)

    def next(self) -> Typed | None:
        """The oldest one that waits, if none is being handled."""
        return self._waiting.popleft() if self._waiting and not self._is_taken else None

    def begin(self) -> int:
        """A key is handed to a screen; gives the number of its turn."""
        self._turn, self._is_taken = self._turn + 1, True
        return self._turn

    def end(self, turn: int) -> bool:
        """All of it was handled, or it takes too long; whether that is news."""
        was_taken, self._is_taken = self._is_taken, self._is_taken and turn != self._turn
        return was_taken and not self._is_taken

    @property
    def is_idle(self) -> bool:
        """Whether everything typed was handled."""
        return not self._waiting and not self._is_taken

    @property
    def held_up(self) -> int:
        """The turn that others wait for; 0: none waits."""
        return self._turn if self._is_taken and self._waiting else 0
