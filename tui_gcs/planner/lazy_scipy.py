"""The few things we take from scipy, imported on first use.

Importing scipy costs 0.4 s of CPU, and forms that only want to know a planner's parameters import its module.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Indices = NDArray[np.int64]


def nearest(points: Floats, places: Floats) -> tuple[Floats, Indices]:
    """For each of `places` (n, 2) the distance to the nearest of `points` (m, 2), and which that is."""
    from scipy.spatial import cKDTree

    away, which = cKDTree(points, balanced_tree=False, compact_nodes=False).query(places)
    return away, which


def paired(cost: Floats) -> Indices:
    """The column for each row of a square cost matrix that makes the sum least."""
    from scipy.optimize import linear_sum_assignment

    columns: Indices = linear_sum_assignment(cost)[1]
    return columns


def sparse(rows: Indices, columns: Indices, values: Floats, shape: tuple[int, int]) -> Any:
    """A matrix in compressed rows. Its products do not depend on the number of threads."""
    from scipy.sparse import csr_array

    return csr_array((values, (rows, columns)), shape=shape)


def matched(cost: Floats) -> list[tuple[int, int]]:
    """Row and column of the pairs that make the sum least, as many as the shorter side of any cost matrix."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(cost)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def warm_up() -> None:
    """Import now, not in a step that has little time."""
    paired(np.zeros((1, 1)))
    nearest(np.zeros((1, 2)), np.zeros((1, 2)))
