"""Local frame: ENU metres about the scenario's origin, to and from WGS84 degrees.

Degrees are scaled by the radii of curvature of the WGS84 ellipsoid at the origin (meridian radius for north,
prime-vertical radius times cos(latitude) for east). The mapping is linear, so it round-trips exactly. Against true
distances it is off by about 2e-4 at 1 km from an origin at 52 degrees, and it is undefined at the poles.
"""

import math
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

WGS84_A_M = 6_378_137.0
"""Semi-major axis (NIMA TR8350.2)."""
WGS84_E2 = 6.694_379_990_14e-3
"""First eccentricity squared (NIMA TR8350.2)."""

Number = TypeVar("Number", float, NDArray[np.float64])


class Origin(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The WGS84 place of ENU (0, 0). ENU heights are metres above `ground_amsl_m`."""

    lat_deg: float
    lon_deg: float
    ground_amsl_m: float
    """Height of the scenario's ground above mean sea level, metres."""


class LocalFrame:
    """Converts degrees to ENU metres about `origin` and back. Takes floats and numpy arrays alike."""

    def __init__(self, origin: Origin) -> None:
        self.origin = origin
        lat_rad = math.radians(origin.lat_deg)
        w2 = 1.0 - WGS84_E2 * math.sin(lat_rad) ** 2
        meridian_m = WGS84_A_M * (1.0 - WGS84_E2) / w2**1.5
        prime_vertical_m = WGS84_A_M / math.sqrt(w2)
        self.north_m_per_deg = math.radians(meridian_m)
        self.east_m_per_deg = math.radians(prime_vertical_m * math.cos(lat_rad))

    def to_enu(self, lat_deg: Number, lon_deg: Number) -> tuple[Number, Number]:
        """Return (x east, y north) in metres; the short way round at the antimeridian."""
        return (
            _wrap_deg(lon_deg - self.origin.lon_deg) * self.east_m_per_deg,
            (lat_deg - self.origin.lat_deg) * self.north_m_per_deg,
        )

    def to_geodetic(self, x_m: Number, y_m: Number) -> tuple[Number, Number]:
        """Return (latitude, longitude) in degrees, longitude in [-180, 180)."""
        return (
            self.origin.lat_deg + y_m / self.north_m_per_deg,
            _wrap_deg(self.origin.lon_deg + x_m / self.east_m_per_deg),
        )


def distance_m(a_m: tuple[float, float], b_m: tuple[float, float]) -> float:
    """Return the horizontal distance of two ENU points, metres."""
    return math.hypot(b_m[0] - a_m[0], b_m[1] - a_m[1])


def from_straight_m(place_m: tuple[float, float], begin_m: tuple[float, float], end_m: tuple[float, float]) -> float:
    """Return the horizontal distance of an ENU point from the straight between two others, ends included, metres."""
    east, north = end_m[0] - begin_m[0], end_m[1] - begin_m[1]
    long2 = east * east + north * north
    share = ((place_m[0] - begin_m[0]) * east + (place_m[1] - begin_m[1]) * north) / long2 if long2 > 0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return distance_m(place_m, (begin_m[0] + share * east, begin_m[1] + share * north))


def bearing_deg(a_m: tuple[float, float], b_m: tuple[float, float]) -> float:
    """Return the compass direction from `a_m` to `b_m`: 0 north, clockwise, [0, 360)."""
    return math.degrees(math.atan2(b_m[0] - a_m[0], b_m[1] - a_m[1])) % 360.0


def _wrap_deg(angle_deg: Number) -> Number:
    return (angle_deg + 180.0) % 360.0 - 180.0
