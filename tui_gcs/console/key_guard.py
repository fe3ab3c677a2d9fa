"""Keys that were meant for a question which closed by itself: for a moment they do nothing on the screen below it.

Who types `y` while a question expires, or while a vehicle changes, has not seen yet that it is gone. What stops
vehicles is never kept back: the app asks here only about other keys.
"""

import math

GUARD_S = 0.7
"""What eye and hand take to notice; every key that was kept back prolongs it by as much."""
MOST_S = 3.0
"""Not longer: a key that is held down is a key again."""


class KeyGuard:
    """The newest question that closed by itself. Times are seconds of one clock."""

    def __init__(self) -> None:
        """No question has closed."""
        self._until_s = self._ends_s = -math.inf
        self.why = ""
        """Why the newest one closed."""

    def begin(self, why: str, now_s: float) -> None:
        """A question has just closed by itself."""
        self.why = why
        self._until_s, self._ends_s = now_s + GUARD_S, now_s + MOST_S

    def keeps_back(self, pressed_s: float) -> bool:
        """Whether a key pressed then was meant for the question; asked once for each key."""
        if pressed_s >= min(self._until_s, self._ends_s):
            return False
        self._until_s = max(self._until_s, pressed_s + GUARD_S)
        return True
