"""When to try again to reach a partner that is not there."""

from tui_gcs.core.base.clock import Clock

FIRST_RETRY_S = 1.0
MAX_RETRY_S = 10.0


class ReconnectTimer:
    """At once, then 1, 2, 4, 8, 10, 10 … seconds after each failure."""

    def __init__(self, clock: Clock) -> None:
        """The first try is due now."""
        self._clock = clock
        self._next_s = clock.now()
        self._wait_s = FIRST_RETRY_S

    @property
    def due(self) -> bool:
        """Whether it is time to try."""
        return self._clock.now() >= self._next_s

    def failed(self, why: str) -> str:
        """The next try is later than the last one was; returns `why` with the time until then, for the operator."""
        wait_s = self._wait_s
        self._next_s = self._clock.now() + wait_s
        self._wait_s = min(2 * wait_s, MAX_RETRY_S)
        return f"{why}; next try in {wait_s:.0f} s"

    def worked(self) -> None:
        """The partner spoke: after the next failure begin again with the shortest wait."""
        self._wait_s = FIRST_RETRY_S
