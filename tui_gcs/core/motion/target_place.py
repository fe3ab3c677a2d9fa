"""Target places: places as operators and files name them, turned into what autopilots need. Pure, no I/O.

A place is named in degrees or in ENU metres of the scenario, its height above the vehicle's own home or above mean sea
level. `core/firmware` needs ENU metres with z above that home; some commands need the height above mean sea level. The
conversion depends on the home of one vehicle: where that is not known, or contradicts itself, there is no such place
for the vehicle, and nothing is flown.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.common import Vec3

HOME_TOLERANCE_M = 10.0
"""The height of home by the vehicle's position and by HOME_POSITION may differ by this much: two filters estimate
them."""
MIN_ALT_M, MAX_ALT_M = -1_000.0, 20_000.0
"""Limits of any meaningful height: below the Dead Sea's shore, above what any of our vehicles flies."""
NO_PLACE_DEG = 1e-6
"""Nearer to latitude 0, longitude 0 a place counts as unset; ArduPilot takes it for "here"."""


class AltitudeReference(StrEnum):
    """What a height is counted from."""

    HOME = "home"
    """The vehicle's own home."""
    SEA = "sea"
    """Mean sea level, as MAVLink has it (AMSL)."""


class PlaceError(ValueError):
    """Why a place cannot be used for a vehicle: one line for the operator."""


@dataclass(frozen=True)
class HomeHeight:
    """Height of one vehicle's home above mean sea level."""

    amsl_m: float = NAN
    problem: str = ""
    """Why it cannot be relied on."""


@dataclass(frozen=True)
class TargetPlace:
    """A place on Earth, as an operator or a file names it.

    Raises:
        PlaceError: there is no such place.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float
    above: AltitudeReference

    def __post_init__(self) -> None:
        """Check that the numbers are a place."""
        if not all(map(math.isfinite, (self.lat_deg, self.lon_deg, self.alt_m))):
            raise PlaceError("a place needs finite numbers")
        if abs(self.lat_deg) > 90 or abs(self.lon_deg) > 180:
            raise PlaceError(f"there is no latitude {self.lat_deg:g}, longitude {self.lon_deg:g}")
        if abs(self.lat_deg) < NO_PLACE_DEG and abs(self.lon_deg) < NO_PLACE_DEG:
            raise PlaceError("latitude 0, longitude 0 is an unset place")
        if not MIN_ALT_M <= self.alt_m <= MAX_ALT_M:
            raise PlaceError(f"a height is {MIN_ALT_M:.0f} to {MAX_ALT_M:.0f} m")

    @staticmethod
    def local(frame: LocalFrame, point_m: Vec3, above: AltitudeReference = AltitudeReference.HOME) -> "TargetPlace":
        """A place that is named in ENU metres of the scenario."""
        if not all(map(math.isfinite, point_m)):
            raise PlaceError("a place needs finite numbers")
        lat_deg, lon_deg = frame.to_geodetic(point_m[0], point_m[1])
        return TargetPlace(float(lat_deg), float(lon_deg), point_m[2], above)

    def amsl_m(self, home: HomeHeight) -> float:
        """Its height above mean sea level, for a vehicle with that home; raises `PlaceError`."""
        return self.alt_m if self.above is AltitudeReference.SEA else self.alt_m + _relied_on(home)

    def above_home_m(self, home: HomeHeight) -> float:
        """Its height above the home of a vehicle; raises `PlaceError`."""
        return self.alt_m if self.above is AltitudeReference.HOME else self.alt_m - _relied_on(home)

    def point_m(self, frame: LocalFrame, home: HomeHeight) -> Vec3:
        """ENU metres, z above the vehicle's home: what `core/firmware` flies to. Raises `PlaceError`."""
        x_m, y_m = frame.to_enu(self.lat_deg, self.lon_deg)
        return float(x_m), float(y_m), self.above_home_m(home)


def home_height(vehicle: Vehicle) -> HomeHeight:
    """The height of a vehicle's home, from its newest position, which carries both heights in one message.

    Its HOME_POSITION must agree with that.
    """
    by_position_m, by_home_m = vehicle.telemetry.alt_amsl_m - vehicle.telemetry.alt_rel_m, vehicle.telemetry.home_amsl_m
    if not math.isfinite(by_position_m):
        return HomeHeight(problem="the height of its home is not known")
    if vehicle.telemetry.home_m is None or not math.isfinite(by_home_m):
        return HomeHeight(problem="it has not reported its home position yet")
    if abs(by_position_m - by_home_m) > HOME_TOLERANCE_M:
        text = f"its home is at {by_home_m:.0f} m by HOME_POSITION, at {by_position_m:.0f} m by its position"
        return HomeHeight(problem=f"heights contradict each other: {text}")
    return HomeHeight(by_position_m)


def _relied_on(home: HomeHeight) -> float:
    if home.problem or not math.isfinite(home.amsl_m):
        raise PlaceError(home.problem or "the height of its home is not known")
    return home.amsl_m
