"""A value over time in bounded memory: the newest points as they came, older ones thinned out.

Thinning keeps the lowest and the highest of each four points, so that a spike of one point stays visible however old it
is. A NaN is a gap: nothing was known then.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FINE_POINTS = 2048
"""At least so many of the newest points are kept as they came: 6.8 minutes at 5 Hz."""
COARSE_POINTS = 4096
"""At most so many thinned points. With the newest ones that is at most 128 KiB for one series."""
MAX_ABS = 1e150
"""A larger number counts as this one, so that differences and squares of values are finite."""


def thinned(times_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return half as many points: the lowest and the highest of each four in order of time; fewer than four are kept.

    Four points without any value give two gaps.
    """
    whole = len(times_s) // 4 * 4
    fours = values[:whole].reshape(-1, 4)
    lowest = np.where(np.isnan(fours), np.inf, fours).argmin(axis=1)
    highest = np.where(np.isnan(fours), -np.inf, fours).argmax(axis=1)
    # Where all are equal both would be the same point.
    highest = np.where(highest == lowest, 3 - lowest, highest)
    kept = np.sort(np.stack([lowest, highest], axis=1), axis=1)
    kept = (kept + np.arange(len(fours))[:, None] * 4).ravel()
    kept = np.concatenate([kept, np.arange(whole, len(times_s))])
    return times_s[kept], values[kept]


class TimeSeries:
    """The points of one value, oldest first; times are seconds of one clock and do not run backwards."""

    def __init__(self) -> None:
        """Begin without points."""
        self._coarse = (np.empty(0), np.empty(0))
        self._fine = np.empty((2, 2 * FINE_POINTS))
        self._count = 0
        self._thinnings = 0
        """How often each of the coarse points was thinned."""

    def __len__(self) -> int:
        return len(self._coarse[0]) + self._count

    @property
    def last_s(self) -> float:
        """The time of the newest point; minus infinity without any."""
        if self._count:
            return float(self._fine[0, self._count - 1])
        return float(self._coarse[0][-1]) if len(self._coarse[0]) else -np.inf

    @property
    def last(self) -> float:
        """The newest value; NaN without any."""
        if self._count:
            return float(self._fine[1, self._count - 1])
        return float(self._coarse[1][-1]) if len(self._coarse[1]) else np.nan

    def clear(self) -> None:
        """Forget all points."""
        self._coarse, self._count, self._thinnings = (np.empty(0), np.empty(0)), 0, 0

    def add(self, t_s: float, value: float) -> None:
        """Add a point. A time before the newest one is that of another clock: the points before are forgotten.

        A second point of the same time is left out; infinite values count as not known.
        """
        if t_s <= self.last_s:
            if t_s == self.last_s:
                return
            self.clear()
        if self._count == self._fine.shape[1]:
            self._make_room()
        self._fine[:, self._count] = t_s, safe_values(np.array([value]))[0]
        self._count += 1

    def extend(self, times_s: Floats, values: Floats) -> None:
        """Add points that come behind those that are there."""
        for t_s, value in zip(times_s.tolist(), values.tolist(), strict=True):
            self.add(t_s, value)

    def _make_room(self) -> None:
        """Move the older half of the fine points to the coarse ones."""
        times_s, values = self._fine[0, :FINE_POINTS].copy(), self._fine[1, :FINE_POINTS].copy()
        for _ in range(self._thinnings):
            times_s, values = thinned(times_s, values)
        coarse = np.concatenate([self._coarse[0], times_s]), np.concatenate([self._coarse[1], values])
        if len(coarse[0]) > COARSE_POINTS:
            coarse = thinned(*coarse)
            self._thinnings += 1
        self._coarse = coarse
        self._fine[:, :FINE_POINTS] = self._fine[:, FINE_POINTS:].copy()
        self._count = FINE_POINTS

    def points(self, from_s: float = -np.inf, to_s: float = np.inf) -> tuple[Floats, Floats]:
        """Return (times, values) within a span, with one point before it so that a line enters it."""
        times_s = np.concatenate([self._coarse[0], self._fine[0, : self._count]])
        values = np.concatenate([self._coarse[1], self._fine[1, : self._count]])
        first = max(0, int(np.searchsorted(times_s, from_s)) - 1)
        last = int(np.searchsorted(times_s, to_s, side="right"))
        return times_s[first:last], values[first:last]


def safe_values(values: Floats) -> Floats:
    """Return values that can be drawn: infinite ones are gaps, huge ones are cut to `MAX_ABS`."""
    return np.clip(np.where(np.isfinite(values), values, np.nan), -MAX_ABS, MAX_ABS)


def value_at(times_s: Floats, values: Floats, t_s: float) -> float:
    """Return the newest value at a time; NaN before the first point."""
    at = int(np.searchsorted(times_s, t_s, side="right")) - 1
    return float(values[at]) if at >= 0 else float("nan")
