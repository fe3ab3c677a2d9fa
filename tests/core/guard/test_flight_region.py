"""Where vehicles may be: area, no-fly zones with and without heights, margins, errors. The square of `guard_rig`."""

import numpy as np
import pytest

from tests.core.rigs.guard_rig import L_SHAPE, POND, SQUARE
from tui_gcs.core.geometry.zones import Rectangle, Role, Shape, Zone
from tui_gcs.core.guard.flight_region import FlightRegion, band_miss_m
from tui_gcs.core.scenario.model import OperatingArea

BOX = Rectangle(centre_m=(100.0, 100.0), width_m=40.0, height_m=40.0)


def walls(*no_fly: Zone, margin_m: float = 0.0, shape: Shape = SQUARE) -> FlightRegion:
    return FlightRegion(OperatingArea(shape, 20.0, 90.0), no_fly, margin_m)


def closed(low_m: float | None, high_m: float | None) -> Zone:
    return Zone(name="tower", role=Role.NO_FLY, shape=BOX, alt_min_m=low_m, alt_max_m=high_m)


def out(w: FlightRegion, *place: float, error_m: float = 0.0) -> float:
    inside = (30.0, 30.0, 40.0)
    reported = w.outside_m(np.array([inside, place]), error_m)
    assert reported[0] == 0.0, "each by itself"
    return float(reported[1])


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
    assert out(walls(), 199.8, 100.0, 40.0, error_m=0.5) == pytest.approx(0.3)
    assert out(walls(), 190.0, 100.0, 40.0, error_m=12.0) == pytest.approx(2.0)
    assert out(walls(), 204.0, 100.0, 40.0, error_m=12.0) == pytest.approx(16.0)
    tower = walls(closed(None, 70.0))
    assert out(tower, 77.0, 100.0, 40.0, error_m=2.0) == 0.0
    assert out(tower, 77.0, 100.0, 40.0, error_m=5.0) == pytest.approx(2.0)
    assert out(tower, 85.0, 100.0, 40.0, error_m=5.0) == pytest.approx(10.0)


def clear(w: FlightRegion, *places: tuple[float, float, float]) -> bool:
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
    assert clear(walls(shape=L_SHAPE), corner, (60.009, 100.0, 40.0)), "that is no way"
    assert not clear(walls(shape=L_SHAPE), corner, (60.011, 100.0, 40.0))


def test_ways_are_judged_each_for_itself() -> None:
    through, past = [(10.0, 100.0, 45.0), (190.0, 100.0, 45.0)], [(10.0, 10.0, 40.0), (190.0, 10.0, 40.0)]
    over = [(10.0, 100.0, 60.0), (190.0, 100.0, 60.0)]
    assert walls(POND).are_clear(np.array([through, past])).tolist() == [False, True]
    assert walls(closed(40.0, 50.0)).are_clear(np.array([over, through])).tolist() == [True, False]


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


def test_without_a_word_positions_are_right() -> None:
    assert walls().outside_m(np.array([[199.9999, 100.0, 40.0]])).tolist() == [0.0]


def test_each_place_may_be_wrong_by_its_own_error() -> None:
    places = np.array([[190.0, 100.0, 40.0], [190.0, 100.0, 40.0], [204.0, 100.0, 40.0], [100.0, 100.0, 40.0]])
    assert walls().outside_m(places, np.array([7.0, 12.0, 0.0, 99.0])).tolist() == pytest.approx([0.0, 2.0, 4.0, 0.0])


# ---------------------------------------------------------------- boxes


def holds(
    w: FlightRegion, low: tuple[float, float, float], high: tuple[float, float, float], error_m: float = 0.0
) -> bool:
    return bool(w.hold(np.array([low]), np.array([high]), np.array([error_m]))[0])


def test_a_box_is_inside_only_as_a_whole() -> None:
    assert holds(walls(), (10.0, 20.0, 40.0), (190.0, 180.0, 50.0))
    assert not holds(walls(), (10.0, 20.0, 40.0), (190.0, 201.0, 50.0))
    assert not holds(walls(shape=L_SHAPE), (50.0, 50.0, 40.0), (70.0, 70.0, 40.0)), "its corner is outside"
    assert holds(walls(shape=L_SHAPE), (40.0, 50.0, 40.0), (59.0, 190.0, 40.0))
    assert not holds(walls(POND), (50.0, 50.0, 40.0), (150.0, 150.0, 40.0)), "the pond is in its middle"


@pytest.mark.parametrize(("low", "high"), [((10.0, 50.0), (50.0, 90.0)), ((50.0, 10.0), (90.0, 50.0))])
def test_with_its_error_on_all_sides(low: tuple[float, float], high: tuple[float, float]) -> None:
    for sign in (1.0, -1.0):
        box = sorted([low[0] if sign > 0 else 200.0 - high[0], high[0] if sign > 0 else 200.0 - low[0]])
        side = sorted([low[1] if sign > 0 else 200.0 - high[1], high[1] if sign > 0 else 200.0 - low[1]])
        for error_m, inside in ((9.0, True), (11.0, False)):
            assert holds(walls(), (box[0], side[0], 40.0), (box[1], side[1], 40.0), error_m) is inside


def test_a_box_above_or_below_a_zone_with_heights_is_inside() -> None:
    tower = walls(closed(40.0, 50.0))
    for low, high, inside in ((50.0, 60.0, True), (30.0, 40.0, True), (49.0, 60.0, False), (30.0, 41.0, False)):
        assert holds(tower, (90.0, 90.0, low), (110.0, 110.0, high)) is inside
    assert holds(tower, (10.0, 10.0, 45.0), (50.0, 50.0, 45.0)), "beside it"


# ---------------------------------------------------------------- band


def test_how_far_outside_of_the_band() -> None:
    area = OperatingArea(SQUARE, 20.0, 90.0)
    assert band_miss_m(area, np.array([10.0, 20.0, 50.0, 90.0, 93.0])).tolist() == [10.0, 0.0, 0.0, 0.0, 3.0]
