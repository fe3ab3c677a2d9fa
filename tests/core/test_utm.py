"""UTM against published coordinates."""

import math

import pytest

from tui_gcs.core.utm import utm


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "text"),
    [
        (43.642567, -79.387139, "17T 630084 4833439"),  # CN Tower
        (-33.8568, 151.2153, "56H 334873 6252266"),  # Sydney
        (0.0, 3.0, "31N 500000 0"),
        (60.0, 5.0, "32V 276979 6658080"),  # Norway's wide zone
        (78.0, 8.0, "31X 616057 8661016"),  # Svalbard
    ],
)
def test_known_places(lat_deg: float, lon_deg: float, text: str) -> None:
    found = utm(lat_deg, lon_deg)
    zone, east, north = text.split()
    assert f"{found.zone}{found.band}" == zone
    assert found.easting_m == pytest.approx(float(east), abs=2.0)
    assert found.northing_m == pytest.approx(float(north), abs=2.0)


@pytest.mark.parametrize("place", [(85.0, 0.0), (-81.0, 0.0), (math.nan, 0.0), (0.0, math.inf), (0.0, 999.0)])
def test_nothing_where_there_is_no_utm(place: tuple[float, float]) -> None:
    assert utm(*place) is None


def test_the_last_meridian_is_in_the_last_zone() -> None:
    assert utm(10.0, 180.0).zone == 60
    assert utm(83.9, 20.0).band == "X"
