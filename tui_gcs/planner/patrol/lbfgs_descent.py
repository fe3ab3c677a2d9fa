"""Limited-memory BFGS descent (Nocedal & Wright, Numerical Optimization, algorithms 7.4 and 7.5).

scipy's version calls threaded LAPACK for tiny systems, which takes four times as long on a busy machine. Here the cost
may also change a little on the way without losing the estimated curvature.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Cost = Callable[[Floats], tuple[float, Floats]]

MEMORY = 8
"""Steps that the estimate of the curvature uses."""
ENOUGH_DECREASE = 1e-4
"""Constant of the Armijo condition."""
MAX_BACKTRACKS = 12
"""A step is halved at most so many times before the descent ends."""
FIRST_MOVE = 2.0
"""Length of the first step along the steepest coordinate, in the unit of the variables (metres)."""


THREADED = 8192
"""For longer vectors OpenBLAS starts threads, which wait for each other for milliseconds on a busy computer."""


def _dot(a: Floats, b: Floats) -> float:
    return float(np.einsum("i,i->", a, b)) if len(a) > THREADED else float(a @ b)


class LbfgsDescent:
    """A point that moves down a cost."""

    def __init__(self, start: Floats) -> None:
        self.x = np.array(start, dtype=float)
        self._pairs: deque[tuple[Floats, Floats, float]] = deque(maxlen=MEMORY)

    def run(self, cost: Cost, iterations: int) -> bool:
        """Descend `cost` by at most `iterations` steps. Return False if no step improves it any more."""
        value, slope = cost(self.x)
        for _ in range(iterations):
            way = self._way(slope)
            down = _dot(way, slope)
            if down >= 0.0:
                self._pairs.clear()
                way, down = -slope, -_dot(slope, slope)
            length = 1.0 if self._pairs else FIRST_MOVE / max(float(np.abs(slope).max()), 1e-12)
            for _ in range(MAX_BACKTRACKS):
                x = self.x + length * way
                new_value, new_slope = cost(x)
                if new_value <= value + ENOUGH_DECREASE * length * down:
                    break
                length *= 0.5
            else:
                if not self._pairs:
                    return False
                self._pairs.clear()  # the estimate fails where the nearest point of a cell changes
                continue
            moved, turned = x - self.x, new_slope - slope
            product = _dot(moved, turned)
            if product > 1e-10:
                self._pairs.append((moved, turned, product))
            self.x, value, slope = x, new_value, new_slope
        return True

    def _way(self, slope: Floats) -> Floats:
        """Return the descent direction: the estimated inverse Hessian times the slope (two-loop recursion)."""
        way, shares = -slope, []
        for moved, turned, product in reversed(self._pairs):
            share = _dot(moved, way) / product
            way -= share * turned
            shares.append(share)
        if self._pairs:
            _, turned, product = self._pairs[-1]
            way *= product / _dot(turned, turned)
        for (moved, turned, product), share in zip(self._pairs, reversed(shares), strict=True):
            way += (share - _dot(turned, way) / product) * moved
        return way
