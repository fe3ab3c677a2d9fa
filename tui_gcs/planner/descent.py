"""Limited-memory BFGS descent (Nocedal & Wright, Numerical Optimization, algorithms 7.4 and 7.5).

Our own 40 lines because scipy's calls threaded LAPACK for tiny systems, which costs four times as much on a busy
machine, and because the result must not depend on the number of threads.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Cost = Callable[[Floats], tuple[float, Floats]]

MEMORY = 10
ENOUGH_DECREASE = 1e-4
SHRINKS = 12
FIRST_MOVE = 2.0
"""Length of the first step along the steepest coordinate, in the unit of the variables (metres)."""


def descend(cost: Cost, start: Floats, iterations: int) -> tuple[Floats, float]:
    """The best point found and its cost after `iterations` steps from `start`, fewer if nothing gets better."""
    x = np.array(start, dtype=float)
    value, slope = cost(x)
    pairs: deque[tuple[Floats, Floats, float]] = deque(maxlen=MEMORY)
    for _ in range(iterations):
        way = -_scaled(slope, pairs)
        down = _dot(way, slope)
        if down >= 0.0:
            pairs.clear()
            way, down = -slope, -_dot(slope, slope)
        length = 1.0 if pairs else FIRST_MOVE / max(float(np.abs(slope).max()), 1e-12)
        for _ in range(SHRINKS):
            new_x = x + length * way
            new_value, new_slope = cost(new_x)
            if new_value <= value + ENOUGH_DECREASE * length * down:
                break
            length *= 0.5
        else:
            if not pairs:
                return x, value
            pairs.clear()  # the estimate misled us, as it does where the nearest point of a cell changes
            continue
        moved, turned = new_x - x, new_slope - slope
        product = _dot(moved, turned)
        if product > 1e-10:
            pairs.append((moved, turned, product))
        x, value, slope = new_x, new_value, new_slope
    return x, value


def _scaled(slope: Floats, pairs: deque[tuple[Floats, Floats, float]]) -> Floats:
    """The inverse Hessian's estimate times the slope: the two-loop recursion."""
    way, shares = slope.copy(), []
    for moved, turned, product in reversed(pairs):
        share = _dot(moved, way) / product
        way -= share * turned
        shares.append(share)
    if pairs:
        _, turned, product = pairs[-1]
        way *= product / _dot(turned, turned)
    for (moved, turned, product), share in zip(pairs, reversed(shares), strict=True):
        way += (share - _dot(turned, way) / product) * moved
    return way


def _dot(a: Floats, b: Floats) -> float:
    return float((a * b).sum())
