"""Vehicles whose position jumps: before or after it they are not where they say, and nobody can tell which.

Flown with a real ArduCopter whose GPS was 67 m off from one moment to the next: it said "GPS Glitch" for 10 s, then
believed it, said "Glitch cleared", and its planner led it on, 67 m beside what the map showed. So a height, too, after
a jump of its barometer.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import NOWHERE, Vec3

MIN_JUMP_M = 10.0
"""Farther from where its own speed brings it: a jump. What filters correct in a step is less (RTK found: 1 m)."""
MAX_ACCEL_M_S2 = 4.0
"""Its speed may change so much between two positions."""
MAX_GAP_S = 2.5
"""After a longer gap nothing can be said."""


@dataclass(slots=True)
class _Last:
    boot_ms: int
    place_m: Vec3
    velocity_m_s: Vec3
    off_m: Vec3 = (0.0, 0.0, 0.0)
    """All that it jumped since it took off."""
    jumped_ms: int = 0
    """When it last did, by its boot clock."""


class PositionJumpMonitor:
    """Looks at the newest position of everybody who flies, some times a second."""

    def __init__(self) -> None:
        """Nobody flies."""
        self._last: dict[int, _Last] = {}
        self._recalled: dict[int, _Last] = {}
        """What the station before this one knew, until the vehicle is heard."""

    def look(self, vehicles: Iterable[Vehicle]) -> list[tuple[Vehicle, float]]:
        """Who jumped since the last look, and how far, in metres; also who jumped back, whose `off_m` is 0 now.

        Who is down, or another one by now, is forgotten.
        """
        jumped, last = [], {}
        for vehicle in vehicles:
            fix = vehicle.telemetry.fix
            if not (fix and vehicle.telemetry.has_position()):
                continue
            recalled = self._recalled.pop(vehicle.id, None)
            if not vehicle.telemetry.airborne:
                continue
            before = self._last.get(vehicle.id, recalled)
            now = _Last(fix[0], vehicle.telemetry.position_m, vehicle.telemetry.velocity_m_s)
            if before is not None and fix[0] >= before.boot_ms:
                now.off_m, now.jumped_ms = before.off_m, before.jumped_ms
                missed = _missed(before, now) if before is not recalled else None
                if missed is not None:
                    now.off_m, now.jumped_ms = _plus(before.off_m, missed), fix[0]
                    jumped.append((vehicle, math.hypot(*missed)))
            last[vehicle.id] = now
        self._last = last
        return jumped

    def off_m(self, vehicle: int) -> float:
        """How far it has jumped in this flight, and not back again; 0 if it has not."""
        return math.hypot(*self.off(vehicle))

    def off(self, vehicle: int) -> Vec3:
        """The same by direction: east, north, up."""
        last = self._last.get(vehicle)
        return (0.0, 0.0, 0.0) if last is None or _is_back(last.off_m) else last.off_m

    # ---------------------------------------------------------------- over a restart of the station

    def memory(self) -> list[dict[str, Any]]:
        """What the next start must know: who has jumped how far, and when."""
        known = self._recalled | self._last
        return [
            {"vehicle": vehicle, "off_m": last.off_m, "jumped_ms": last.jumped_ms}
            for vehicle, last in sorted(known.items())
            if not _is_back(last.off_m)
        ]

    def recall(self, held: Iterable[dict[str, Any]]) -> None:
        """Go on from what `memory` gave; who has landed or booted since is forgotten when it is heard."""
        for item in held:
            x, y, z = map(float, item["off_m"])
            jumped_ms = int(item["jumped_ms"])
            self._recalled[int(item["vehicle"])] = _Last(jumped_ms, NOWHERE, NOWHERE, (x, y, z), jumped_ms)


def _missed(before: _Last, now: _Last) -> Vec3 | None:
    """From where it would be by its own speed to where it says it is; None if that is no jump."""
    gap_s = (now.boot_ms - before.boot_ms) / 1000
    if gap_s > MAX_GAP_S:
        return None
    moved = (
        place - old - gap_s * (v + w) / 2
        for place, old, v, w in zip(now.place_m, before.place_m, before.velocity_m_s, now.velocity_m_s, strict=True)
    )
    x, y, z = moved
    return (x, y, z) if math.hypot(x, y, z) > MIN_JUMP_M + MAX_ACCEL_M_S2 * gap_s * gap_s else None


def _is_back(off_m: Vec3) -> bool:
    return math.hypot(*off_m) <= MIN_JUMP_M


def _plus(one: Vec3, other: Vec3) -> Vec3:
    x, y, z = (a + b for a, b in zip(one, other, strict=True))
    return x, y, z
