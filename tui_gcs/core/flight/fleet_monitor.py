"""Fleet monitor: the smallest separation and the largest distance outside the area since the start, from telemetry.

Separation counts pairs that are closer than both limits: a pair 7 m apart in height is separated however close it is on
the map. So two figures are kept: how often a pair was closer than both limits, where a position that is known to be
degraded may be anywhere within its error, and the smallest 3-D distance of all, by the positions as reported.
"""

import math
from collections.abc import Iterable
from itertools import islice

import numpy as np

from tui_gcs.core.fleet.integrity.position_error import WARNING_M
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.separation_check import GROUND_M
from tui_gcs.core.protocol.common import Vec3

Place = tuple[float, float, float, float, int]
"""x, y, z in ENU metres, by how many metres x and y may be wrong beyond what the limits allow for, and the vehicle's
id."""
MAX_ERROR_M = 100.0
"""Without any fix: the autopilot reckons on for some seconds, or has something better than GPS."""


class FleetMonitor:
    """Running extremes; they never get better."""

    def __init__(self, guard: Guard, flights: FlightTable) -> None:
        """Judge by the guard's present limits and area."""
        self._guard = guard
        self._flights = flights
        self.min_separation_m = math.inf
        """Smallest 3-D distance of two airborne vehicles outside take-off and landing columns."""
        self.violations = 0
        """Samples in which a pair was closer than the limits in both directions."""
        self.outside_area_m = 0.0
        """Largest distance outside the operating area."""
        self._close: dict[tuple[int, int], float] = {}

    def take_close(self) -> dict[tuple[int, int], float]:
        """Pairs closer than both limits since this was last asked, and how many metres apart on the map they were."""
        close, self._close = self._close, {}
        return close

    def look(self, vehicles: Iterable[Vehicle]) -> None:
        """Take one sample of all vehicles."""
        flying = [v for v in vehicles if v.telemetry.airborne and v.telemetry.has_position()]
        if flying:
            self._measure_outside([v.telemetry.position_m for v in flying])
        away = [v for v in flying if v.telemetry.position_m[2] > GROUND_M and not self._in_column(v)]
        self._measure_pairs([(*v.telemetry.position_m, error_m(v), v.id) for v in away])

    def _measure_outside(self, places: list[Vec3]) -> None:
        self.outside_area_m = max(self.outside_area_m, float(self._guard.outside_walls_m(np.array(places)).max()))

    def _measure_pairs(self, places: list[Place]) -> None:
        """Sorted along the direction in which they are spread farther, so that few neighbours are near enough."""
        across = _spread(places, 0) < _spread(places, 1)
        if across:
            places = [(y, x, z, error, vehicle_id) for x, y, z, error, vehicle_id in places]
        places.sort()
        limits = self._guard.limits
        horizontal_m, vertical_m = limits.separation_horizontal_m, limits.separation_vertical_m
        least_m = self.min_separation_m
        doubtful_m = horizontal_m + 2 * max((place[3] for place in places), default=0.0)
        reach_m = max(least_m, doubtful_m)
        for i, (x, y, z, error, vehicle_id) in enumerate(places, 1):
            for other_x, other_y, other_z, other_error, other in islice(places, i, None):
                along_m = other_x - x
                if along_m > reach_m:  # and so are all that follow
                    break
                across_m = abs(other_y - y)
                if across_m > reach_m:
                    continue
                level = math.hypot(along_m, across_m)
                upright = abs(other_z - z)
                distance_m = math.hypot(level, upright)
                if distance_m < least_m:
                    least_m = distance_m
                    reach_m = max(least_m, doubtful_m)
                if level - error - other_error < horizontal_m and upright < vertical_m:
                    self.violations += 1
                    pair = (min(vehicle_id, other), max(vehicle_id, other))
                    self._close[pair] = min(level, self._close.get(pair, level))
        self.min_separation_m = least_m

    def _in_column(self, vehicle: Vehicle) -> bool:
        flight = self._flights.get(vehicle.id)
        return flight is not None and flight.in_own_column(vehicle)


def error_m(vehicle: Vehicle) -> float:
    """By how much its position may be wrong beyond what the limits allow for: 0 for ordinary GPS."""
    reported_m = vehicle.integrity.position_error_m
    return min(reported_m, MAX_ERROR_M) if reported_m > WARNING_M else 0.0


def _spread(places: list[Place], axis: int) -> float:
    values = [place[axis] for place in places]
    return max(values, default=0.0) - min(values, default=0.0)
