"""Altitude monitor: compares the height that a vehicle reports with its GPS's height since take-off.

Learned with a real ArduCopter whose barometer was 20 m off from one moment to the next: its EKF doubted that for 10 s,
then believed it and reported nothing more. As it kept the height that it read, it sank by 20 m, which the map did not
show. A GPS height is less accurate than a barometer's, but rarely wrong by as much as that: in 80 flights of real
autopilots with simulated sensors the two differed by less than 3 m.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from tui_gcs.core.fleet.telemetry import struct_reader
from tui_gcs.core.fleet.vehicle import Vehicle

# Message id, and GPS_FIX_TYPE_3D_FIX: below it the receiver has no height.
GPS_RAW_INT, MIN_FIX = 24, 3
_GPS = struct_reader("16xi8xB9xI")
"""Height above mean sea level (mm), kind of fix, and vertical accuracy (mm; 0 if not reported) of GPS_RAW_INT."""
MAX_DIFFERENCE_M, HYSTERESIS_M = 12.0, 3.0
"""One of the two heights is wrong when they differ by 12 m more than the reported GPS accuracy. The finding is cleared
when they differ by 3 m less than that."""
NO_REFERENCE_MARGIN_M = 10.0
"""Added for a vehicle that was never seen on the ground. Both autopilots start with the height of their GPS there."""
DEFAULT_GPS_ERROR_M = 5.0
"""Assumed for a GPS that does not report its vertical accuracy."""
MIN_DURATION_S = 3.0
"""The difference must last this long."""
MAX_GPS_AGE_S = 1.5
"""An older GPS height is not compared: the vehicle may have climbed since."""
CHECK_S = 1.0
"""Heights are compared this often."""


class AltitudeMonitor:
    """Compares once a second the two heights of every vehicle; `off_m` is the finding."""

    def __init__(self) -> None:
        self._next_s = -math.inf
        self._ground_difference_m: dict[int, float] = {}
        """Reported height less GPS height when the vehicle was on the ground, metres, by vehicle."""
        self._since_s: dict[int, float] = {}
        self._off_m: dict[int, float] = {}

    def look(self, vehicles: Iterable[Vehicle], now: float) -> None:
        """Compare the heights of all vehicles, at most once per `CHECK_S`."""
        if now >= self._next_s - 1e-9:
            self._next_s = now + CHECK_S
            for vehicle in vehicles:
                self._compare(vehicle, now)

    def _compare(self, vehicle: Vehicle, now: float) -> None:
        difference = self._difference_m(vehicle, now)
        if not vehicle.telemetry.airborne:
            self._off_m.pop(vehicle.id, None)
            self._since_s.pop(vehicle.id, None)
            if difference is not None:
                self._ground_difference_m[vehicle.id] = difference[0]
            return
        if difference is None:
            return
        ground_m = self._ground_difference_m.get(vehicle.id)
        off_m, error_m = difference[0] - (ground_m or 0.0), difference[1]
        limit_m = MAX_DIFFERENCE_M + error_m - (HYSTERESIS_M if vehicle.id in self._off_m else 0.0)
        limit_m += NO_REFERENCE_MARGIN_M if ground_m is None else 0.0
        if abs(off_m) <= limit_m:
            self._off_m.pop(vehicle.id, None)
            self._since_s.pop(vehicle.id, None)
        elif now - self._since_s.setdefault(vehicle.id, now) >= MIN_DURATION_S - 1e-9:
            self._off_m[vehicle.id] = off_m

    def _difference_m(self, vehicle: Vehicle, now: float) -> tuple[float, float] | None:
        """Return reported height less GPS height and the uncertainty of that, metres; None if not comparable now."""
        slot = vehicle.path.slots.get(GPS_RAW_INT)
        if slot is None or not slot.raw or now - min(slot.t_s, vehicle.telemetry.position_s) > MAX_GPS_AGE_S:
            return None
        alt_mm, fix_type, accuracy_mm = _GPS(slot)
        if fix_type < MIN_FIX or not alt_mm:
            return None
        apart_m = vehicle.telemetry.alt_amsl_m - alt_mm / 1e3
        # Between the two heights the vehicle may have climbed.
        moved_m = MAX_GPS_AGE_S * abs(vehicle.telemetry.velocity_m_s[2])
        error_m = accuracy_mm / 1e3 or DEFAULT_GPS_ERROR_M
        return (apart_m, error_m + moved_m) if math.isfinite(apart_m + moved_m) else None

    def off_m(self, vehicle: int) -> float:
        """Return by how many metres the reported height exceeds the GPS height, if that is too much; else 0."""
        return self._off_m.get(vehicle, 0.0)

    def memory(self, flying: Iterable[int]) -> dict[str, float]:
        """Return what a restarted station needs for the vehicles in the air, as JSON values."""
        return {
            str(vehicle): round(self._ground_difference_m[vehicle], 1)
            for vehicle in flying
            if vehicle in self._ground_difference_m
        }

    def recall(self, held: Mapping[str, Any]) -> None:
        """Continue from what `memory` returned before a restart."""
        self._ground_difference_m |= {int(vehicle): float(ground_m) for vehicle, ground_m in held.items()}
