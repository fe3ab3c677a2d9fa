"""Orders leave in the order in which they were given, though each has a thread and none waits for another's answer.

A link that lags brings many keys at once: of "go on" and "hold", given a millisecond apart, the hold must come last.
"""

import threading
from dataclasses import dataclass, field

LETS_GO_FIRST_S = 0.2
"""For so long at most an order waits until the one before it is on its way, which takes less than a millisecond."""


@dataclass(frozen=True)
class Turn:
    """One order's place in the row."""

    before: threading.Event | None
    """The one given before it is on its way, or will not be said."""
    gone: threading.Event = field(default_factory=threading.Event)
    """So is this one."""

    def wait(self) -> None:
        """Let the one before go first, unless it is stuck. On the thread that is going to say it."""
        if self.before is not None:
            self.before.wait(LETS_GO_FIRST_S)


class RequestSequence:
    """Hands out turns, on one thread."""

    def __init__(self) -> None:
        """Nobody is before the first."""
        self._last: threading.Event | None = None

    def next(self) -> Turn:
        """That of the order that is given now."""
        turn = Turn(self._last)
        self._last = turn.gone
        return turn
