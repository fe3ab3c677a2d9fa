"""Reconnect timer: when a link tries again to reach a partner that is not there."""

from tui_gcs.core.base.clock import Clock

# The first try comes soon, for a program that was restarted; later ones seldom, for one that is gone.
FIRST_RETRY_S = 1.0
MAX_RETRY_S = 10.0


class ReconnectTimer:
    """Exponential back-off: at once, then 1, 2, 4, 8, 10, 10 … seconds after each failure."""

    def __init__(self, clock: Clock) -> None:
        """Begin with a try that is due now."""
        self._clock = clock
        self._next_s = clock.now()
        self._wait_s = FIRST_RETRY_S

    @property
    def due(self) -> bool:
        """Whether it is time to try."""
        return self._clock.now() >= self._next_s

    def failed(self, why: str) -> str:
        """Delay the next try longer than the last; return `why` with the time until then, for the operator."""
        wait_s = self._wait_s
        self._next_s = self._clock.now() + wait_s
        self._wait_s = min(2 * wait_s, MAX_RETRY_S)
        return f"{why}; next try in {wait_s:.0f} s"

    def worked(self) -> None:
        """Begin again with the shortest delay at the next failure, because the partner sent something."""
        self._wait_s = FIRST_RETRY_S
