"""Separation of vehicles as a share of the limits: beside each other or one above the other."""

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.scenario.model import Limits

MIN_LIMIT_M = 1e-9
"""A limit of 0 is replaced by this: all vehicles are far enough apart then."""


@lru_cache(maxsize=64)
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Row indices of the one and of the other vehicle of all pairs."""
    one, other = np.triu_indices(count, 1)
    return one, other


def least_separation(position_m: NDArray[np.floating[Any]], limits: Limits) -> float:
    """Separation of the two nearest of (n, 3) places, in multiples of the limit; infinite for fewer than two.

    A place that contains NaN is left out.
    """
    one, other = _pairs(len(position_m))
    apart = np.abs(position_m[one] - position_m[other])
    beside = np.hypot(apart[:, 0], apart[:, 1]) / max(limits.separation_horizontal_m, MIN_LIMIT_M)
    above = apart[:, 2] / max(limits.separation_vertical_m, MIN_LIMIT_M)
    return float(np.fmin.reduce(np.maximum(beside, above), initial=math.inf))
