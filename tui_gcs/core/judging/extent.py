"""The box in which a vehicle was, by its valid positions only."""

import math
from typing import NamedTuple

import msgspec

MAX_SPEED_M_S = 150.0
"""A change of position faster than this is a jump, not flight."""
SLACK_M = 50.0
SUSPECTS = 3
"""Positions behind a jump that must agree before any of them is believed (docs/threats.md B.6-100)."""
# Of latitude, on a sphere: exact enough for a box around a flight.
_METRES_PER_DEGREE = 111_320.0


class Extent(msgspec.Struct, frozen=True):
    """The box around all valid positions."""

    positions: int
    lat_min_deg: float
    lat_max_deg: float
    lon_min_deg: float
    lon_max_deg: float
    alt_amsl_min_m: float
    alt_amsl_max_m: float
    alt_rel_min_m: float | None = None
    """Above home; None if the log holds only raw GPS."""
    alt_rel_max_m: float | None = None


class Place(NamedTuple):
    """One position with its time. Heights in metres; `alt_rel_m` is None where the log has none."""

    wall_s: float
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    alt_rel_m: float | None = None


class ExtentCollector:
    """Takes positions in order of time and keeps the box around the believable ones."""

    def __init__(self) -> None:
        self._count = 0
        self._last: Place | None = None
        self._suspects: list[Place] = []
        self._low: list[float] = []
        self._high: list[float] = []

    def add(self, place: Place) -> None:
        """Take `place`: dropped if it is none on Earth (0, 0 before a fix), kept waiting if it jumped."""
        if not _is_valid(place):
            return
        # A single position far away is noise; only `SUSPECTS` that agree are believed.
        if self._last is None or _is_reachable(self._last, place):
            self._suspects.clear()
            self._take(place)
            return
        if self._suspects and not _is_reachable(self._suspects[-1], place):
            self._suspects.clear()
        self._suspects.append(place)
        if len(self._suspects) >= SUSPECTS:
            for suspect in self._suspects:
                self._take(suspect)
            self._suspects.clear()

    def result(self) -> Extent | None:
        """The box, None if there was no valid position."""
        if not self._count:
            return None
        return Extent(self._count, *(n for pair in zip(self._low, self._high, strict=True) for n in pair))

    def _take(self, place: Place) -> None:
        self._last = place
        self._count += 1
        values = [value for value in place[1:] if value is not None]
        self._low = [min(pair) for pair in zip(self._low or values, values, strict=True)]
        self._high = [max(pair) for pair in zip(self._high or values, values, strict=True)]


def _is_valid(place: Place) -> bool:
    """Whether `place` is on Earth and not the 0, 0 that autopilots send before a fix."""
    return (place.lat_deg, place.lon_deg) != (0.0, 0.0) and abs(place.lat_deg) <= 90 and abs(place.lon_deg) <= 180


def _is_reachable(here: Place, there: Place) -> bool:
    """Whether a vehicle at `here` can be `there` in the time between."""
    north_m = (there.lat_deg - here.lat_deg) * _METRES_PER_DEGREE
    east_deg = (there.lon_deg - here.lon_deg + 180) % 360 - 180
    east_m = east_deg * _METRES_PER_DEGREE * math.cos(math.radians(here.lat_deg))
    return math.hypot(north_m, east_m) <= SLACK_M + MAX_SPEED_M_S * max(0.0, there.wall_s - here.wall_s)
