"""Shapes are changed by their corners, by keys or by pointer."""

import math

import pytest

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, area_m2
from tui_gcs.widgets.plan.shape_corners import (
    Snap,
    corners_m,
    turn_deg,
    with_corner_after,
    with_corner_at,
    with_corner_near,
    without_corner,
)
from tui_gcs.widgets.plan.shape_edit import turned

BOX = Rectangle((100.0, 100.0), 40.0, 20.0)
TRIANGLE = Polygon(((0.0, 0.0), (60.0, 0.0), (0.0, 60.0)))


def test_a_corner_of_a_polygon_goes_where_it_is_put() -> None:
    assert with_corner_at(TRIANGLE, 1, (70.004, 5.0)) == Polygon(((0.0, 0.0), (70.0, 5.0), (0.0, 60.0)))


def test_a_circle_goes_through_where_its_rim_is_put() -> None:
    circle = Circle((10.0, 0.0), 5.0)
    assert corners_m(circle) == [(15.0, 0.0)]
    assert with_corner_at(circle, 0, (10.0, 8.0)) == Circle((10.0, 0.0), 8.0)


@pytest.mark.parametrize("heading_deg", [0.0, 30.0, 200.0])
@pytest.mark.parametrize("index", range(4))
def test_a_rectangle_keeps_its_opposite_corner_and_its_heading(index: int, heading_deg: float) -> None:
    box = Rectangle((100.0, 100.0), 40.0, 20.0, heading_deg)
    opposite = corners_m(box)[(index + 2) % 4]
    x, y = corners_m(box)[index]
    new = with_corner_at(box, index, (x + 3.0, y + 4.0))
    assert isinstance(new, Rectangle) and new.heading_deg == heading_deg
    assert min(math.dist(opposite, corner) for corner in corners_m(new)) < 0.02
    assert min(math.dist((x + 3.0, y + 4.0), corner) for corner in corners_m(new)) < 0.02


def test_a_corner_more_and_a_corner_less() -> None:
    more, at = with_corner_after(BOX, 3)
    assert at == 4 and len(more.vertices_m) == 5 and area_m2(more) == area_m2(BOX)
    assert more.vertices_m[at] == (80.0, 100.0), "between the north-western corner and the first"
    assert without_corner(more, at) == Polygon(tuple(corners_m(BOX)))
    near, at = with_corner_near(TRIANGLE, (31.0, 35.0))
    assert at == 2 and near.vertices_m[2] == (31.0, 35.0)
    assert without_corner(TRIANGLE, 0) is None and without_corner(Circle((0.0, 0.0), 5.0), 0) is None


def test_turning_with_the_pointer_follows_it() -> None:
    angle = turn_deg(BOX, (120.0, 100.0), (100.0, 80.0))
    assert angle == pytest.approx(90.0)
    assert turned(BOX, angle) == Rectangle((100.0, 100.0), 40.0, 20.0, 90.0)


def test_what_is_moved_is_drawn_to_corners_then_edges_then_the_grid() -> None:
    snap = Snap((BOX, Circle((300.0, 100.0), 50.0)), 5.0)
    assert snap.point((121.0, 111.5), 2.0) == (120.0, 110.0)
    assert snap.point((121.0, 103.0), 2.0) == (120.0, 103.0)
    assert snap.point((251.0, 100.0), 2.0) == pytest.approx((250.0, 100.0), abs=0.05)
    assert snap.point((191.0, 103.0), 2.0) == (190.0, 105.0)
    assert Snap().point((191.0, 103.0), 2.0) == (191.0, 103.0)


def test_a_shape_that_is_moved_as_a_whole_is_drawn_by_its_nearest_corner() -> None:
    moved = Rectangle((141.5, 121.0), 40.0, 20.0)
    east, north = Snap((BOX,)).shift(moved, 2.0)
    assert (east, north) == pytest.approx((-1.5, -1.0))
    assert Snap((BOX,)).shift(Rectangle((500.0, 500.0), 40.0, 20.0), 2.0) == (0.0, 0.0)
