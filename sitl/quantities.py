"""Array types and constants of nature of the simulation."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GRAVITY_M_S2 = 9.80665
