"""Which cells descent judges: those at the edge of the swept band, however the tour moved since it last looked."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.planner.patrol.tour_smoothing import _CoverageCost

CELLS_M = np.stack(np.meshgrid(np.arange(0.0, 120.0, 5.0), np.arange(0.0, 120.0, 5.0)), axis=-1).reshape(-1, 2)
RADIUS_M = 14.0


def ring(radius_m: float) -> np.ndarray:
    angles = np.arange(60) * (2.0 * math.pi / 60)
    return 60.0 + radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 12.0), min_size=1, max_size=5), st.integers(0, 2**32 - 1))
def test_a_tour_that_moved_is_judged_as_one_that_was_always_there(moves_m: list[float], seed: int) -> None:
    rng = np.random.default_rng(seed)
    tour, watched = ring(40.0), _CoverageCost(CELLS_M, RADIUS_M)
    watched.look(tour)
    for move_m in moves_m:
        tour = tour + move_m * rng.normal(0.0, 1.0, tour.shape)
        watched.look(tour)
    fresh = _CoverageCost(CELLS_M, RADIUS_M)
    fresh.look(tour)
    missed_m2, slope = watched.missing(tour)
    assert missed_m2 == fresh.missing(tour)[0]
    assert np.array_equal(slope, fresh.missing(tour)[1])
