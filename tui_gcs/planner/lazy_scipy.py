"""The few functions taken from scipy, imported on first use.

Importing scipy costs 0.4 s of CPU. The console's plan form imports a planner's module only to read its parameters, and
must not pay for that.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Indices = NDArray[np.int64]


def nearest(points: Floats, places: Floats) -> tuple[Floats, Indices]:
    """Return for each of `places` (n, 2) the distance to the nearest of `points` (m, 2), and that point's index."""
    from scipy.spatial import cKDTree

    # The tree is used once: without balancing it is built more quickly.
    away, which = cKDTree(points, balanced_tree=False, compact_nodes=False).query(places)
    return away, which


def min_cost_columns(cost: Floats) -> Indices:
    """Return the column for each row of a square cost matrix that minimises the sum of costs."""
    from scipy.optimize import linear_sum_assignment

    columns: Indices = linear_sum_assignment(cost)[1]
    return columns


def sparse(rows: Indices, columns: Indices, values: Floats, shape: tuple[int, int]) -> Any:
    """Return a matrix in compressed rows. Its products do not depend on the number of threads."""
    from scipy.sparse import csr_array

    return csr_array((values, (rows, columns)), shape=shape)


def min_cost_pairs(cost: Floats) -> list[tuple[int, int]]:
    """Return the (row, column) pairs with the smallest sum of costs, as many as the shorter side of the matrix."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(cost)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def warm_up() -> None:
    """Import scipy now, rather than in a step, which has little time."""
    min_cost_columns(np.zeros((1, 1)))
    nearest(np.zeros((1, 2)), np.zeros((1, 2)))
