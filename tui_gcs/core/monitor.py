"""What the fleet did, judged from telemetry: smallest separation and how far outside the area, since start.

Separation counts pairs that are closer than both limits allow: a pair 7 m apart in height is separated however close
it is on the map. So two figures are kept: the smallest horizontal distance of pairs that are not separated by height,
and the smallest 3-D distance of all.
"""

import math
from collections.abc import Iterable
from itertools import islice

from tui_gcs.core.flights import FlightBook
from tui_gcs.core.guard import GROUND_M, Guard
from tui_gcs.core.vehicle import Vehicle


class FleetMonitor:
    """Running extremes; they never get better."""

    def __init__(self, guard: Guard, book: FlightBook) -> None:
        """Judge by the guard's present limits and area."""
        self._guard = guard
        self._book = book
        self.min_separation_m = math.inf
        """Smallest 3-D distance of two airborne vehicles outside take-off and landing columns."""
        self.violations = 0
        """Samples in which a pair was closer than the limits in both directions."""
        self.outside_area_m = 0.0
        """Largest distance outside the operating area."""

    def watch(self, vehicles: Iterable[Vehicle]) -> None:
        """Take one sample."""
        flying = [v for v in vehicles if v.airborne and v.has_position()]
        for vehicle in flying:
            self.outside_area_m = max(self.outside_area_m, self._guard.outside_m(vehicle.position_m))
        free = [v for v in flying if v.position_m[2] > GROUND_M and not self._in_column(v)]
        limits = self._guard.limits
        places = sorted(v.position_m for v in free)
        for i, (x, y, z) in enumerate(places, 1):
            for other_x, other_y, other_z in islice(places, i, None):  # from west to east: soon too far to matter
                east_m = other_x - x
                if east_m > self.min_separation_m and east_m >= limits.separation_horizontal_m:
                    break
                level = math.hypot(east_m, other_y - y)
                upright = abs(other_z - z)
                self.min_separation_m = min(self.min_separation_m, math.hypot(level, upright))
                if level < limits.separation_horizontal_m and upright < limits.separation_vertical_m:
                    self.violations += 1

    def _in_column(self, vehicle: Vehicle) -> bool:
        flight = self._book.get(vehicle.id)
        return flight is not None and flight.in_own_column(vehicle)
