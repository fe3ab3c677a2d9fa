"""UTM against a published coordinate, the length of the meridian, and the map of the zones."""

import math

import numpy as np
import pytest

from tui_gcs.core.geometry.local_frame import WGS84_A_M, WGS84_E2
from tui_gcs.core.geometry.utm import utm


def test_a_known_place() -> None:
    tower = utm(43.642567, -79.387139)  # CN Tower, Toronto: 17T 630084 4833439
    assert (tower.zone, tower.band) == (17, "T")
    assert tower.easting_m == pytest.approx(630084.0, abs=1.0)
    assert tower.northing_m == pytest.approx(4833439.0, abs=1.0)
    assert str(tower).startswith("17T 630084 48334")


@pytest.mark.parametrize("lat_deg", [-79.0, -33.0, 0.0, 52.0, 83.0])
def test_on_the_middle_of_a_zone_north_is_the_length_of_the_meridian(lat_deg: float) -> None:
    angles = np.linspace(0.0, math.radians(lat_deg), 20_001)
    curvature_m = WGS84_A_M * (1.0 - WGS84_E2) / (1.0 - WGS84_E2 * np.sin(angles) ** 2) ** 1.5
    arc_m = float(np.trapezoid(curvature_m, angles))
    found = utm(lat_deg, 3.0)
    assert found.easting_m == pytest.approx(500_000.0, abs=1e-6)
    assert found.northing_m == pytest.approx(0.9996 * arc_m + (10_000_000.0 if lat_deg < 0 else 0.0), abs=0.01)


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "zone"),
    [(60.0, 5.0, "32V"), (60.0, 2.0, "31V"), (78.0, 8.0, "31X"), (78.0, 10.0, "33X"), (-33.9, 151.2, "56H")],
)
def test_zones_and_their_exceptions(lat_deg: float, lon_deg: float, zone: str) -> None:
    found = utm(lat_deg, lon_deg)
    assert f"{found.zone}{found.band}" == zone


@pytest.mark.parametrize("place", [(85.0, 0.0), (-81.0, 0.0), (math.nan, 0.0), (0.0, math.inf), (0.0, 999.0)])
def test_nothing_where_there_is_no_utm(place: tuple[float, float]) -> None:
    assert utm(*place) is None


def test_the_last_meridian_is_in_the_last_zone() -> None:
    assert utm(10.0, 180.0).zone == 60
    assert utm(83.9, 20.0).band == "X"
