"""Zones as geometry."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.geometry.zones import (
    Circle,
    Polygon,
    Rectangle,
    area_m2,
    bounds,
    contains,
    outline_m,
    polygon_of,
)

L_SHAPE = Polygon(((90.0, 130.0), (230.0, 130.0), (230.0, 190.0), (160.0, 190.0), (160.0, 280.0), (90.0, 280.0)))


def test_circle_area_is_exact_and_its_polygon_close() -> None:
    circle = Circle((150.0, 200.0), 80.0)
    assert area_m2(circle) == pytest.approx(math.pi * 6400)
    assert polygon_of(circle).area == pytest.approx(area_m2(circle), rel=1e-3)
    assert bounds(circle) == (70.0, 120.0, 230.0, 280.0)


def test_rectangle_lies_east_and_north_at_heading_0() -> None:
    field = Rectangle((450.0, 200.0), 160.0, 120.0)
    assert outline_m(field) == [(370.0, 140.0), (530.0, 140.0), (530.0, 260.0), (370.0, 260.0)]
    assert area_m2(field) == 160 * 120


def test_rectangle_turns_clockwise() -> None:
    turned = Rectangle((0.0, 0.0), 20.0, 100.0, heading_deg=30.0)
    ahead = (40 * math.sin(math.radians(30)), 40 * math.cos(math.radians(30)))  # 40 m along compass 030
    mirrored = (-ahead[0], ahead[1])
    assert contains(turned, [ahead, mirrored]).tolist() == [True, False]
    assert area_m2(turned) == 2000


def test_polygon_area_and_inner_corner() -> None:
    assert area_m2(L_SHAPE) == 140 * 60 + 70 * 90
    assert contains(L_SHAPE, [(100, 140), (200, 250), (160, 190)]).tolist() == [True, False, True]
    assert bounds(L_SHAPE) == (90.0, 130.0, 230.0, 280.0)


@pytest.mark.parametrize("shape", [Circle((0.0, 0.0), 10.0), Rectangle((0.0, 0.0), 20.0, 20.0), L_SHAPE])
def test_contains_takes_one_none_and_many_points(shape) -> None:
    assert contains(shape, np.empty((0, 2))).shape == (0,)
    assert contains(shape, (1e4, 1e4)).tolist() == [False]
    assert contains(shape, np.full((1000, 2), 1e4)).sum() == 0


@given(st.floats(1, 500), st.floats(1, 500), st.floats(-360, 360))
def test_rectangle_area_does_not_depend_on_heading(width_m, height_m, heading_deg) -> None:
    turned = polygon_of(Rectangle((10.0, 20.0), width_m, height_m, heading_deg))
    assert turned.area == pytest.approx(width_m * height_m)
    assert (turned.centroid.x, turned.centroid.y) == pytest.approx((10, 20), abs=1e-6)
