"""Position jump monitor: vehicles whose reported position jumps, so that it is wrong before or after the jump.

Learned with a real ArduCopter whose GPS was 67 m off from one moment to the next: it reported "GPS Glitch" for 10 s,
then believed it, reported "Glitch cleared", and its planner led it on, 67 m beside what the map showed. The same holds
for a height after a jump of the barometer.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import NOWHERE, Vec3

MIN_JUMP_M = 10.0
"""A position farther than this from where its own speed takes it is a jump. Corrections of filters are smaller (RTK
found: 1 m)."""
MAX_ACCEL_M_S2 = 4.0
"""The speed may change by this much between two positions."""
MAX_GAP_S = 2.5
"""Positions farther apart in time are not compared."""


@dataclass(slots=True)
class _Last:
    """The newest position of one vehicle and its jumps in this flight."""

    boot_ms: int
    place_m: Vec3
    velocity_m_s: Vec3
    off_m: Vec3 = (0.0, 0.0, 0.0)
    """Sum of its jumps since take-off, ENU metres."""
    jumped_ms: int = 0
    """Boot time of its last jump, ms."""


class PositionJumpMonitor:
    """Compares the newest position of each flying vehicle with the one before, several times a second."""

    def __init__(self) -> None:
        self._last: dict[int, _Last] = {}
        self._recalled: dict[int, _Last] = {}
        """What the station knew before a restart, until the vehicle is heard."""

    def look(self, vehicles: Iterable[Vehicle]) -> list[tuple[Vehicle, float]]:
        """Return the vehicles that jumped since the last look, each with the length of the jump in metres.

        A jump back is returned, too: `off_m` is 0 then. Vehicles that landed or were replaced are forgotten.
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
            # A smaller boot time is another boot, or another vehicle: nothing to compare with.
            if before is not None and fix[0] >= before.boot_ms:
                now.off_m, now.jumped_ms = before.off_m, before.jumped_ms
                jump = _jump_of(before, now) if before is not recalled else None
                if jump is not None:
                    now.off_m, now.jumped_ms = _plus(before.off_m, jump), fix[0]
                    jumped.append((vehicle, math.hypot(*jump)))
            last[vehicle.id] = now
        self._last = last
        return jumped

    def off_m(self, vehicle: int) -> float:
        """Return how far its position is off by jumps of this flight, metres; 0 if it has not jumped or jumped back."""
        return math.hypot(*self.off(vehicle))

    def off(self, vehicle: int) -> Vec3:
        """Return the same as a vector: east, north, up."""
        last = self._last.get(vehicle)
        return (0.0, 0.0, 0.0) if last is None or _is_back(last.off_m) else last.off_m

    def memory(self) -> list[dict[str, Any]]:
        """Return what a restarted station needs: which vehicles jumped how far, and when."""
        known = self._recalled | self._last
        return [
            {"vehicle": vehicle, "off_m": last.off_m, "jumped_ms": last.jumped_ms}
            for vehicle, last in sorted(known.items())
            if not _is_back(last.off_m)
        ]

    def recall(self, held: Iterable[dict[str, Any]]) -> None:
        """Continue from what `memory` returned.

        Vehicles that landed or booted since are forgotten when they are heard.
        """
        for item in held:
            x, y, z = map(float, item["off_m"])
            jumped_ms = int(item["jumped_ms"])
            self._recalled[int(item["vehicle"])] = _Last(jumped_ms, NOWHERE, NOWHERE, (x, y, z), jumped_ms)


def _jump_of(before: _Last, now: _Last) -> Vec3 | None:
    """Return the vector from the position that its speed led to, to the reported one; None if that is no jump."""
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
