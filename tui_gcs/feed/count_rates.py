"""Rates from counters that only grow."""

import math
from collections import deque
from collections.abc import Hashable, Mapping
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)
WINDOW_S = 5.0
"""Rates are measured over this time: below 0.2 Hz a message is rather seen by its age."""


class CountRates(Generic[K]):
    """How fast each of many counters grew within the last `WINDOW_S`."""

    def __init__(self) -> None:
        """Begin without counts."""
        self._looks: deque[tuple[float, Mapping[K, int]]] = deque()

    def add(self, t_s: float, counts: Mapping[K, int]) -> None:
        """Take all counters as they were at `t_s`; time that runs backwards is that of another station."""
        if self._looks and t_s < self._looks[-1][0]:
            self._looks.clear()
        elif self._looks and t_s == self._looks[-1][0]:
            self._looks.pop()
        self._looks.append((t_s, counts))
        # One look before the window is kept, so that the whole window is covered.
        while len(self._looks) > 2 and self._looks[1][0] <= t_s - WINDOW_S:
            self._looks.popleft()

    def clear(self) -> None:
        """Forget all counts: after a pause rates are measured anew."""
        self._looks.clear()

    def of(self, key: K) -> float:
        """Return counts per second; NaN until it was counted twice, or where a counter began anew."""
        last_s, last = self._looks[-1] if self._looks else (math.nan, {})
        for first_s, first in self._looks:
            if key in first and first_s < last_s:
                grown = last.get(key, 0) - first[key]
                return grown / (last_s - first_s) if grown >= 0 else math.nan
        return math.nan
