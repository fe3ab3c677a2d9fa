"""The local frame."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.geometry.local_frame import LocalFrame, Origin, bearing_deg, distance_m, from_straight_m

FIELD = LocalFrame(Origin(52.0720, -0.6280, 110.0))


def test_a_degree_is_as_long_as_the_ellipsoid_says() -> None:
    # Length of a degree at 45 N on WGS84: 111 131.75 m north, 78 846.81 m east (the usual series in latitude).
    frame = LocalFrame(Origin(45.0, 7.0, 0.0))
    assert frame.north_m_per_deg == pytest.approx(111_131.75, abs=0.5)
    assert frame.east_m_per_deg == pytest.approx(78_846.81, abs=0.5)


def test_origin_is_zero_and_axes_point_east_and_north() -> None:
    assert FIELD.to_enu(52.0720, -0.6280) == (0.0, 0.0)
    x_m, y_m = FIELD.to_enu(52.0730, -0.6270)
    assert x_m == pytest.approx(68.6, abs=0.1)
    assert y_m == pytest.approx(111.3, abs=0.1)


@given(st.floats(-1000, 1000), st.floats(-1000, 1000), st.floats(-89, 89), st.floats(-180, 180))
def test_round_trip_at_1_km_is_exact_to_a_millimetre(x_m, y_m, lat_deg, lon_deg) -> None:
    frame = LocalFrame(Origin(lat_deg, lon_deg, 0.0))
    back = frame.to_enu(*frame.to_geodetic(x_m, y_m))
    assert back == pytest.approx((x_m, y_m), abs=1e-3)


def test_arrays_go_through_as_floats_do() -> None:
    lat_deg, lon_deg = FIELD.to_geodetic(np.array([0.0, 300.0]), np.array([0.0, 200.0]))
    assert (lat_deg[1], lon_deg[1]) == FIELD.to_geodetic(300.0, 200.0)
    x_m, y_m = FIELD.to_enu(lat_deg, lon_deg)
    assert np.allclose(x_m, [0, 300])
    assert np.allclose(y_m, [0, 200])


def test_the_antimeridian_is_no_edge() -> None:
    frame = LocalFrame(Origin(-17.0, 179.9999, 0.0))
    x_m, _ = frame.to_enu(-17.0, -179.9999)
    assert 0 < x_m < 30
    assert frame.to_geodetic(x_m, 0.0)[1] == pytest.approx(-179.9999)


def test_distance_and_bearing() -> None:
    assert distance_m((0, 0), (30, 40)) == 50
    assert [bearing_deg((0, 0), p) for p in ((0, 1), (1, 0), (0, -1), (-1, 0))] == [0, 90, 180, 270]
    assert (bearing_deg((10, 20), (10, 21)), bearing_deg((10, 20), (9, 20))) == (0, 270)


def test_how_far_a_place_is_from_a_straight_ends_at_its_ends() -> None:
    places = ((5.0, 3.0), (-3.0, 4.0), (13.0, -4.0), (10.0, 0.0))
    assert [from_straight_m(place, (0.0, 0.0), (10.0, 0.0)) for place in places] == [3.0, 5.0, 5.0, 0.0]
    assert from_straight_m((3.0, 4.0), (0.0, 0.0), (0.0, 0.0)) == 5.0, "a straight without length is a point"
    assert from_straight_m((7.0, 1.0), (0.0, 0.0), (6.0, 8.0)) == pytest.approx(5.0), "3-4-5, across the grid"
    assert from_straight_m((17.0, 21.0), (10.0, 20.0), (16.0, 28.0)) == pytest.approx(5.0), "wherever it lies"
    assert from_straight_m((0.5, 0.0), (0.0, 0.0), (0.5, 0.0)) == 0.0, "half a metre is one, too"
