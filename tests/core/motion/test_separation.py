"""The nearest two decide: the better of what they have beside and above each other, in multiples of the limits."""

import math

import numpy as np
import pytest

from tui_gcs.core.motion.separation import least_separation
from tui_gcs.core.scenario.model import Limits

LIMITS = Limits(separation_horizontal_m=10.0, separation_vertical_m=5.0)


def test_it_is_the_better_of_beside_and_above() -> None:
    assert least_separation(np.array([[0.0, 0.0, 20.0], [5.0, 0.0, 27.0]]), LIMITS) == pytest.approx(1.4)
    assert least_separation(np.array([[0.0, 0.0, 20.0], [20.0, 0.0, 20.0]]), LIMITS) == pytest.approx(2.0)


def test_the_nearest_two_decide() -> None:
    places = np.array([[0.0, 0.0, 20.0], [5.0, 0.0, 27.0], [100.0, 0.0, 20.0]])
    assert least_separation(places, LIMITS) == pytest.approx(1.4)


def test_who_has_no_place_and_who_is_alone_is_near_to_nobody() -> None:
    assert least_separation(np.array([[0.0, 0.0, 20.0], [math.nan, 0.0, 20.0]]), LIMITS) == math.inf
    assert least_separation(np.zeros((1, 3)), LIMITS) == math.inf
    assert least_separation(np.zeros((0, 3)), LIMITS) == math.inf
