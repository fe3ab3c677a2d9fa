"""Token bucket: limits how often something may happen, with a burst after a pause."""


class TokenBucket:
    """`burst` tokens at once, and `per_s` a second in the long run."""

    def __init__(self, per_s: float, burst: float, now: float) -> None:
        """The bucket is full at `now`."""
        self._per_s, self._burst = per_s, burst
        self._tokens, self._filled_s = burst, now

    def has_one(self, now: float) -> bool:
        """Return whether a token is left."""
        self._tokens = min(self._burst, self._tokens + self._per_s * (now - self._filled_s))
        self._filled_s = now
        return self._tokens >= 1.0

    def take(self) -> None:
        """Take a token; one that is not there is owed, and must come in before `has_one` is true again."""
        self._tokens -= 1.0
