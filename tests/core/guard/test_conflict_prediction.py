"""Predicted separation: who will come too close is told in time, and nobody who will not."""

import numpy as np
import pytest

from tests.core.rigs.rig import scenario
from tui_gcs.core.guard.conflict_prediction import PredictedConflict, predicted_conflicts
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.motion.course import PositionTarget

LIMITS = scenario().limits
EAST, WEST = (5.0, 0.0, 0.0), (-5.0, 0.0, 0.0)


def drifting(vehicle: int, place: tuple[float, float, float], velocity: tuple[float, float, float]) -> VehicleState:
    return VehicleState(vehicle, place, velocity)


def found(*sights: VehicleState) -> list[PredictedConflict]:
    return list(predicted_conflicts(list(sights), LIMITS, 0.0))


def test_two_that_fly_at_each_other_are_named_with_when_and_how_near() -> None:
    (pair,) = found(drifting(3, (0.0, 0.0, 30.0), EAST), drifting(5, (80.0, 4.0, 31.0), WEST))
    assert (pair.one, pair.other) == (3, 5)
    assert pair.in_s == pytest.approx((80 - np.sqrt(LIMITS.separation_horizontal_m**2 - 16)) / 10, abs=0.25)
    assert pair.level_m == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize(
    ("place", "velocity"),
    [
        ((80.0, 4.0, 37.0), WEST),  # a layer above
        ((80.0, 30.0, 30.0), WEST),  # beside
        ((80.0, 4.0, 30.0), EAST),  # away
        ((80.0, 4.0, 1.0), WEST),  # on the ground
        ((5.0, 0.0, 30.0), WEST),  # too close already: that is told otherwise
    ],
)
def test_who_will_not_come_too_close_is_not_named(place: tuple[float, float, float], velocity: object) -> None:
    assert found(drifting(3, (0.0, 0.0, 30.0), EAST), drifting(5, place, velocity)) == []  # type: ignore[arg-type]


def test_who_will_stop_in_time_is_not_named() -> None:
    """What it was told to do counts, not where it points."""
    stops = VehicleState(3, (0.0, 0.0, 30.0), EAST, MotionModel.FOLLOWS, PositionTarget((20.0, 0.0, 30.0), 5.0))
    assert found(stops, drifting(5, (45.0, 0.0, 30.0), (0.0, 0.0, 0.0))) == []
    assert found(drifting(3, (0.0, 0.0, 30.0), EAST), drifting(5, (45.0, 0.0, 30.0), (0.0, 0.0, 0.0)))
