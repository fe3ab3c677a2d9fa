"""Array types, constants and one helper that all physics of the simulator uses."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GRAVITY_M_S2 = 9.80665


def no_longer(vectors: Array, size: float) -> Array:
    """Return (n, 2) vectors, shortened to at most `size`."""
    length = np.hypot(vectors[:, 0], vectors[:, 1])
    limited: Array = vectors * np.minimum(1.0, size / np.maximum(length, 1e-9))[:, None]
    return limited
