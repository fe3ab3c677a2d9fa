"""Vehicles whose height may be wrong: compared with what their GPS says of it since they took off.

Flown with a real ArduCopter whose barometer was 20 m off from one moment to the next: its EKF doubted that for 10 s,
then believed it, said no more, and as it kept to the height that it read it sank by 20 m, which the map did not show.
A GPS knows heights worse than a barometer, but seldom by so much: in 80 flights of real autopilots (with simulated
sensors) the two parted by less than 3 m.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from tui_gcs.core.fleet.telemetry import struct_reader
from tui_gcs.core.fleet.vehicle import Vehicle

GPS_RAW_INT, MIN_FIX = 24, 3
_GPS = struct_reader("16xi8xB9xI")
"""Height above mean sea level (mm), kind of fix, and how well it knows its height (mm; 0: it does not say)."""
MAX_DIFFERENCE_M, HYSTERESIS_M = 12.0, 3.0
"""The two heights so far apart, and what its GPS says of its own accuracy: one of them is wrong."""
NO_REFERENCE_MARGIN_M = 10.0
"""More for one that was never seen on the ground: both autopilots begin with their GPS's height there."""
DEFAULT_GPS_ERROR_M = 5.0
"""A GPS that does not say how good its height is."""
MIN_DURATION_S = 3.0
MAX_GPS_AGE_S = 1.5
"""An older height of a GPS is not compared: it may have climbed since."""
CHECK_S = 1.0


class AltitudeMonitor:
    """Looks once a second at those who fly, and at those who may soon."""

    def __init__(self) -> None:
        """Nobody is known."""
        self._next_s = -math.inf
        self._base_m: dict[int, float] = {}
        """What a vehicle says of its height, less what its GPS says, when it was on the ground."""
        self._since_s: dict[int, float] = {}
        self._off_m: dict[int, float] = {}

    def look(self, vehicles: Iterable[Vehicle], now: float) -> None:
        """Compare the two heights of everybody, if that is due."""
        if now >= self._next_s - 1e-9:
            self._next_s = now + CHECK_S
            for vehicle in vehicles:
                self._compare(vehicle, now)

    def _compare(self, vehicle: Vehicle, now: float) -> None:
        apart = self._apart_m(vehicle, now)
        if not vehicle.telemetry.airborne:
            self._off_m.pop(vehicle.id, None)
            self._since_s.pop(vehicle.id, None)
            if apart is not None:
                self._base_m[vehicle.id] = apart[0]
            return
        if apart is None:
            return
        base_m = self._base_m.get(vehicle.id)
        off_m, error_m = apart[0] - (base_m or 0.0), apart[1]
        limit_m = MAX_DIFFERENCE_M + error_m - (HYSTERESIS_M if vehicle.id in self._off_m else 0.0)
        limit_m += NO_REFERENCE_MARGIN_M if base_m is None else 0.0
        if abs(off_m) <= limit_m:
            self._off_m.pop(vehicle.id, None)
            self._since_s.pop(vehicle.id, None)
        elif now - self._since_s.setdefault(vehicle.id, now) >= MIN_DURATION_S - 1e-9:
            self._off_m[vehicle.id] = off_m

    def _apart_m(self, vehicle: Vehicle, now: float) -> tuple[float, float] | None:
        """How much higher it says it is than its GPS does, and how well that knows; None if that cannot be told now."""
        slot = vehicle.path.slots.get(GPS_RAW_INT)
        if slot is None or not slot.raw or now - min(slot.t_s, vehicle.telemetry.position_s) > MAX_GPS_AGE_S:
            return None
        alt_mm, fix_type, accuracy_mm = _GPS(slot)
        if fix_type < MIN_FIX or not alt_mm:
            return None
        apart_m = vehicle.telemetry.alt_amsl_m - alt_mm / 1e3
        moved_m = MAX_GPS_AGE_S * abs(vehicle.telemetry.velocity_m_s[2])
        error_m = accuracy_mm / 1e3 or DEFAULT_GPS_ERROR_M
        return (apart_m, error_m + moved_m) if math.isfinite(apart_m + moved_m) else None

    def off_m(self, vehicle: int) -> float:
        """How much higher it says it is than its GPS does, if that is too much to be right; 0 if not."""
        return self._off_m.get(vehicle, 0.0)

    # ---------------------------------------------------------------- over a restart of the station

    def memory(self, flying: Iterable[int]) -> dict[str, float]:
        """What the next start must know of those in the air."""
        return {str(vehicle): round(self._base_m[vehicle], 1) for vehicle in flying if vehicle in self._base_m}

    def recall(self, held: Mapping[str, Any]) -> None:
        """Go on from what `memory` gave."""
        self._base_m |= {int(vehicle): float(base_m) for vehicle, base_m in held.items()}
