"""Round trip time estimator: how long to wait for an answer, learnt from earlier answers as TCP does (RFC 6298)."""

FIRST_WAIT_S, SLOW_FIRST_WAIT_S = 0.5, 1.5
MIN_WAIT_S, SLOW_MIN_WAIT_S, MAX_WAIT_S = 0.15, 0.6, 3.0
"""First, shortest and longest wait for an answer; the SLOW ones are for telemetry radios.

Shorter ones make no sense: a station reads its links every few milliseconds, and ArduPilot serves files every 12 ms.
"""
BACK_OFF = 1.5


class RttEstimator:
    """A smoothed round trip time and its spread."""

    def __init__(self, *, slow: bool = False) -> None:
        """`slow`: over a telemetry radio, the first and shortest waits are longer."""
        self._mean_s: float | None = None
        self._spread_s = 0.0
        self._least_s = SLOW_MIN_WAIT_S if slow else MIN_WAIT_S
        self.wait_s = SLOW_FIRST_WAIT_S if slow else FIRST_WAIT_S
        """After this long without an answer a question is repeated."""

    def add_sample(self, seconds: float) -> None:
        """Learn from a question that was sent once and was answered after `seconds`."""
        if self._mean_s is None:
            self._mean_s, self._spread_s = seconds, seconds / 2
        else:
            self._spread_s += (abs(seconds - self._mean_s) - self._spread_s) / 4
            self._mean_s += (seconds - self._mean_s) / 8
        self.wait_s = min(MAX_WAIT_S, max(self._least_s, self._mean_s + 4 * self._spread_s))

    def wait_after(self, tries: int) -> float:
        """How long to wait after a question was sent for the `tries`-th time."""
        return float(min(MAX_WAIT_S, self.wait_s * BACK_OFF ** (tries - 1)))

    def add_loss(self) -> None:
        """Wait longer from now on, because an answer did not come, until one comes at the first try."""
        self.wait_s = min(MAX_WAIT_S, self.wait_s * BACK_OFF)
