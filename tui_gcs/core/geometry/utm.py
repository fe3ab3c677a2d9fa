"""UTM coordinates of WGS84 positions, for reading them out against a paper map.

Krueger's series to the third order in n (Karney, "Transverse Mercator with an accuracy of a few nanometers", 2011,
equations 7-11 and 35): better than a centimetre inside a zone.
"""

import math
from typing import NamedTuple

from tui_gcs.core.geometry.local_frame import WGS84_A_M

# WGS84. The series in the third flattening is Krueger's, to the third order: below a millimetre within a zone.
FLATTENING = 1.0 / 298.257223563
_N = FLATTENING / (2.0 - FLATTENING)
_RADIUS_M = WGS84_A_M / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_ALPHA = (
    _N / 2.0 - 2.0 * _N**2 / 3.0 + 5.0 * _N**3 / 16.0,
    13.0 * _N**2 / 48.0 - 3.0 * _N**3 / 5.0,
    61.0 * _N**3 / 240.0,
)
# The scale on the central meridian and the false coordinates are parts of the definition of UTM.
_SCALE = 0.9996
_FALSE_EAST_M, _FALSE_NORTH_M = 500_000.0, 10_000_000.0
# Nearer to the poles UTM is not defined.
LAT_MIN_DEG, LAT_MAX_DEG = -80.0, 84.0
_BANDS = "CDEFGHJKLMNPQRSTUVWXX"


class UtmPosition(NamedTuple):
    """A place in a UTM zone; `band` is the letter of its latitude."""

    zone: int
    band: str
    easting_m: float
    northing_m: float

    def __str__(self) -> str:
        return f"{self.zone}{self.band} {self.easting_m:.0f} {self.northing_m:.0f}"


def utm(lat_deg: float, lon_deg: float) -> UtmPosition | None:
    """Return the UTM position; None where UTM is not defined: near the poles, or for what is no position."""
    if not (LAT_MIN_DEG <= lat_deg <= LAT_MAX_DEG and -180.0 <= lon_deg <= 180.0):  # refuses NaN, too
        return None
    zone = _zone(lat_deg, lon_deg)
    lat = math.radians(lat_deg)
    lon = math.radians((lon_deg - (zone * 6.0 - 183.0) + 180.0) % 360.0 - 180.0)
    e = 2.0 * math.sqrt(_N) / (1.0 + _N)
    t = math.sinh(math.atanh(math.sin(lat)) - e * math.atanh(e * math.sin(lat)))
    xi = math.atan2(t, math.cos(lon))
    eta = math.asinh(math.sin(lon) / math.hypot(t, math.cos(lon)))
    east, north = eta, xi
    for order, alpha in enumerate(_ALPHA, 1):
        east += alpha * math.cos(2 * order * xi) * math.sinh(2 * order * eta)
        north += alpha * math.sin(2 * order * xi) * math.cosh(2 * order * eta)
    northing_m = _SCALE * _RADIUS_M * north + (_FALSE_NORTH_M if lat_deg < 0.0 else 0.0)
    return UtmPosition(zone, _BANDS[int((lat_deg + 80.0) // 8)], _FALSE_EAST_M + _SCALE * _RADIUS_M * east, northing_m)


def _zone(lat_deg: float, lon_deg: float) -> int:
    """Return the zone, with the exceptions for Norway and Svalbard."""
    if 56.0 <= lat_deg < 64.0 and 3.0 <= lon_deg < 12.0:
        return 32
    if lat_deg >= 72.0 and 0.0 <= lon_deg < 42.0:
        return 31 if lon_deg < 9.0 else 33 if lon_deg < 21.0 else 35 if lon_deg < 33.0 else 37
    return min(int((lon_deg + 180.0) // 6.0) + 1, 60)
