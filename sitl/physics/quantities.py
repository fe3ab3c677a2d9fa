"""Array types, constants of nature, and what all physics of the simulation calculates with."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GRAVITY_M_S2 = 9.80665


def no_longer(vectors: Array, size: float) -> Array:
    """(n, 2) vectors, none longer than `size`."""
    length = np.hypot(vectors[:, 0], vectors[:, 1])
    limited: Array = vectors * np.minimum(1.0, size / np.maximum(length, 1e-9))[:, None]
    return limited
