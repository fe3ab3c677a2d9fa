"""Questions that the same key, pressed once more, answers with yes: for ten seconds, and only about what was asked."""

import math

from tui_gcs.core.base.clock import Clock

EXPIRES_S = 10.0


class SecondPress:
    """The one question that waits, if any."""

    def __init__(self, clock: Clock) -> None:
        """Nothing waits."""
        self._clock = clock
        self._asked = ""
        self._until_s = -math.inf

    def answers(self, what: str) -> bool:
        """Whether this key press is the second one about `what`; if not, the question begins to wait for it."""
        if self._asked == what and self._clock.now() < self._until_s:
            return True
        self._asked, self._until_s = what, self._clock.now() + EXPIRES_S
        return False

    def forget(self) -> None:
        """Something else was done."""
        self._asked = ""

    @property
    def is_over(self) -> bool:
        """Whether a question waited too long."""
        return bool(self._asked) and self._clock.now() >= self._until_s
