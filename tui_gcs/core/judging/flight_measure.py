"""What a whole flight keeps to: operating area, altitude band, separation, and landing where each vehicle took off."""

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.flight.flights import COLUMN_M
from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.judging.result_check import ResultCheck, at_least, at_most
from tui_gcs.core.motion.separation import least_separation
from tui_gcs.core.protocol.common import Phase, Vec3, VehicleRow
from tui_gcs.core.scenario.model import Limits, OperatingArea

GROUND_M = 2.0
"""Altitude band and separation count from this height on."""


class FlightMeasure:
    """Measures all vehicles of teams, from the first frame to the last."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.flew: set[int] = set()
        """Vehicles that were in the air."""
        self._area: OperatingArea | None = None
        self._fence = shapely.Polygon()
        self._separation = math.inf
        """The least max(horizontal / limit, vertical / limit) over all airborne pairs; 1 is the limit."""
        self._outside_m = 0.0
        self._band_m = 0.0
        self._places: dict[int, Vec3] = {}
        """Where each vehicle stood before it took off."""
        self._landed_at: dict[int, Vec3] = {}

    def begin_round(self, area: OperatingArea) -> None:
        """From now on this area has to be kept to."""
        self._area, self._fence = area, polygon_of(area.shape)
        shapely.prepare(self._fence)

    def on_rows(self, rows: list[VehicleRow]) -> None:
        """Measure one fleet frame: the rows of all vehicles of teams."""
        for row in rows:
            if row.armed and row.position_m[2] > GROUND_M:
                self.flew.add(row.id)
            elif not row.armed and row.id in self.flew:
                self._landed_at[row.id] = row.position_m
            elif not row.armed:
                self._places[row.id] = row.position_m
        self._measure_region([r for r in rows if r.armed and r.position_m[2] > GROUND_M])

    def _measure_region(self, flying: list[VehicleRow]) -> None:
        if self._area is not None:
            area, places = self._area, _places(flying)
            outside = places[~shapely.intersects_xy(self._fence, places[:, 0], places[:, 1]), :2]
            if len(outside):
                self._outside_m = max(self._outside_m, *shapely.distance(self._fence, shapely.points(outside)).tolist())
            for z in [row.position_m[2] for row in flying if row.phase is Phase.FLYING]:
                self._band_m = max(self._band_m, area.alt_min_m - z, z - area.alt_max_m)
        free = _places([row for row in flying if not self._in_own_column(row)])
        self._separation = min(self._separation, least_separation(free, self._limits))

    def _in_own_column(self, row: VehicleRow) -> bool:
        place = self._places.get(row.id)
        # In its own column a vehicle may be near others: they stand side by side.
        vertical = row.phase in (Phase.TAKEOFF, Phase.LANDING, Phase.ARMING)
        return vertical and place is not None and math.dist(place[:2], row.position_m[:2]) <= COLUMN_M

    def region_checks(self) -> list[ResultCheck]:
        """The checks of separation, area and altitude band."""
        return [
            self._separation_check(),
            at_most("outside operating area, m", self._outside_m, 0.0),
            at_most("outside altitude band, m", max(self._band_m, 0.0), 0.0),
        ]

    def landing_checks(self, expected: list[int], landing_error_max_m: float) -> list[ResultCheck]:
        """The checks that the `expected` vehicles landed, and near where they took off."""
        missing = [v for v in expected if v not in self._landed_at]
        misses = [math.dist(self._landed_at[v][:2], self._places[v][:2]) for v in expected if v not in missing]
        return [
            at_most("not landed and disarmed", float(len(missing)), 0.0),
            at_most("landing error, m", max(misses, default=None), landing_error_max_m),
        ]

    def _separation_check(self) -> ResultCheck:
        """The check of separation; it holds without a value where no two vehicles flew at once."""
        name, alone = "separation, x limit", not math.isfinite(self._separation)
        if alone and self.flew:
            return ResultCheck(name, True, None, 1.0, "no two vehicles were in the air at once")
        return at_least(name, None if alone else self._separation, 1.0)


def _places(rows: list[VehicleRow]) -> NDArray[np.float64]:
    return np.array([row.position_m for row in rows], dtype=float).reshape(-1, 3)
