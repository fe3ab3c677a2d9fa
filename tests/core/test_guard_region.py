"""Where vehicles may be: area, no-fly zones with and without heights, margins, errors. The square of `guard_rig`."""

import numpy as np
import pytest
from guard_rig import L_SHAPE, POND, SQUARE

from tui_gcs.core.guard_region import Walls, band_miss_m
from tui_gcs.core.scenario import OperatingArea
from tui_gcs.core.zones import Rectangle, Role, Shape, Zone

BOX = Rectangle(centre_m=(100.0, 100.0), width_m=40.0, height_m=40.0)


def walls(*no_fly: Zone, margin_m: float = 0.0, shape: Shape = SQUARE) -> Walls:
    return Walls(OperatingArea(shape, 20.0, 90.0), no_fly, margin_m)


def closed(low_m: float | None, high_m: float | None) -> Zone:
    return Zone(name="tower", role=Role.NO_FLY, shape=BOX, alt_min_m=low_m, alt_max_m=high_m)


def out(w: Walls, *place: float, error_m: float = 0.0) -> float:
    inside = (30.0, 30.0, 40.0)
    told = w.outside_m(np.array([inside, place]), error_m)
    assert told[0] == 0.0, "each by itself"
    return float(told[1])


def test_inside_and_how_far_outside() -> None:
    assert out(walls(), 199.0, 100.0, 40.0) == 0.0
    assert out(walls(), 203.0, 204.0, 40.0) == pytest.approx(5.0)
    assert out(walls(margin_m=5.0), 199.0, 100.0, 40.0) == pytest.approx(4.0)
    assert out(walls(shape=L_SHAPE), 63.0, 64.0, 40.0) == pytest.approx(3.0)


def test_a_no_fly_zone_without_heights_is_outside_at_every_height() -> None:
    for z in (0.0, 40.0, 500.0):
        assert out(walls(POND), 100.0, 115.0, z) == pytest.approx(5.0, abs=0.1)
    assert out(walls(POND), 100.0, 121.0, 40.0) == 0.0
    assert out(walls(POND, margin_m=5.0), 100.0, 121.0, 40.0) == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize(
    ("low", "high", "z", "depth"),
    [
        (None, 50.0, 45.0, 5.0),
        (None, 50.0, -10.0, 10.0),
        (None, 50.0, 51.0, 0.0),
        (40.0, None, 43.0, 3.0),
        (40.0, None, 39.0, 0.0),
        (40.0, None, 80.0, 10.0),
        (40.0, 50.0, 42.0, 2.0),
        (40.0, 50.0, 47.0, 3.0),
        (40.0, 50.0, 51.0, 0.0),
        (40.0, 50.0, 39.0, 0.0),
    ],
)
def test_one_with_heights_is_closed_between_them(low: float, high: float, z: float, depth: float) -> None:
    """10 m inside its western edge: out is wherever it is nearest."""
    assert out(walls(closed(low, high)), 90.0, 100.0, z) == pytest.approx(depth)
    assert out(walls(closed(low, high)), 79.0, 100.0, z) == 0.0


def test_the_margin_is_kept_in_height_too() -> None:
    tower = walls(closed(40.0, 50.0), margin_m=5.0)
    assert out(tower, 90.0, 100.0, 54.0) == pytest.approx(1.0)
    assert out(tower, 90.0, 100.0, 36.0) == pytest.approx(1.0)
    assert out(tower, 76.0, 100.0, 45.0) == pytest.approx(1.0)
    assert out(tower, 90.0, 100.0, 55.5) == out(tower, 90.0, 100.0, 34.5) == 0.0


def test_the_worst_of_several_counts() -> None:
    both = walls(POND, closed(None, 50.0))
    assert out(both, 100.0, 100.0, 40.0) == pytest.approx(20.0, abs=0.1), "the pond's"
    assert out(both, 82.0, 82.0, 40.0) == pytest.approx(2.0), "the tower's"
    assert out(both, 210.0, 100.0, 40.0) == pytest.approx(10.0)


def test_a_position_that_may_be_wrong_is_as_far_outside_as_it_may_be() -> None:
    assert out(walls(), 190.0, 100.0, 40.0, error_m=7.0) == 0.0
    assert out(walls(), 190.0, 100.0, 40.0, error_m=12.0) == pytest.approx(2.0)
    assert out(walls(), 204.0, 100.0, 40.0, error_m=12.0) == pytest.approx(16.0)
    tower = walls(closed(None, 70.0))
    assert out(tower, 77.0, 100.0, 40.0, error_m=2.0) == 0.0
    assert out(tower, 77.0, 100.0, 40.0, error_m=5.0) == pytest.approx(2.0)
    assert out(tower, 85.0, 100.0, 40.0, error_m=5.0) == pytest.approx(10.0)


def clear(w: Walls, *places: tuple[float, float, float]) -> bool:
    return bool(w.are_clear(np.array([places]))[0])


def test_the_straight_way() -> None:
    assert clear(walls(), (10.0, 10.0, 40.0), (190.0, 190.0, 40.0))
    assert not clear(walls(POND), (10.0, 100.0, 40.0), (190.0, 100.0, 40.0))
    assert clear(walls(POND), (10.0, 10.0, 40.0), (190.0, 10.0, 40.0))
    assert not clear(walls(shape=L_SHAPE), (30.0, 180.0, 40.0), (180.0, 30.0, 40.0))
    assert clear(walls(shape=L_SHAPE), (30.0, 180.0, 40.0), (30.0, 30.0, 40.0), (180.0, 30.0, 40.0))
    assert not clear(walls(shape=L_SHAPE), (30.0, 30.0, 40.0), (30.0, 180.0, 40.0), (180.0, 30.0, 40.0)), (
        "on the way on"
    )
    corner = (60.0, 100.0, 40.0)
    assert clear(walls(shape=L_SHAPE), corner, (60.005, 100.0, 40.0)), "that is no way"
    assert not clear(walls(shape=L_SHAPE), corner, (60.5, 100.0, 40.0))


@pytest.mark.parametrize(
    ("here_z", "there_z", "free"),
    [(60.0, 70.0, True), (30.0, 35.0, True), (45.0, 45.0, False), (30.0, 70.0, False), (70.0, 30.0, False)],
)
def test_the_way_over_or_under_a_zone_with_heights(here_z: float, there_z: float, *, free: bool) -> None:
    tower = walls(closed(40.0, 50.0))
    assert clear(tower, (10.0, 100.0, here_z), (190.0, 100.0, there_z)) is free
    assert clear(tower, (10.0, 10.0, here_z), (190.0, 10.0, there_z)), "past it"


def test_a_way_at_the_very_height_of_a_zones_end_is_clear() -> None:
    tower = walls(closed(40.0, 50.0))
    assert clear(tower, (10.0, 100.0, 50.0), (190.0, 100.0, 50.0))
    assert clear(tower, (10.0, 100.0, 40.0), (190.0, 100.0, 40.0))


def test_how_far_outside_of_the_band() -> None:
    area = OperatingArea(SQUARE, 20.0, 90.0)
    assert band_miss_m(area, np.array([10.0, 20.0, 50.0, 90.0, 93.0])).tolist() == [10.0, 0.0, 0.0, 0.0, 3.0]
