"""Bypass columns: places beside a vehicle that is blocked, where it can change its height past the others."""

import math
from collections.abc import Sequence

from tui_gcs.core.geometry.local_frame import from_straight_m
from tui_gcs.core.guard.motion_prediction import VehicleState
from tui_gcs.core.guard.separation_check import SPARE_M, SPARE_UP_M
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits

RINGS, BEARINGS = (1.2, 2.0, 3.0, 4.5), 16
"""Distances of the candidates in multiples of the separation to be kept, and number of directions."""

Place = tuple[float, float]


def bypass_columns(
    here_m: Vec3,
    layer_m: float,
    home_m: Place,
    others: Sequence[VehicleState],
    taken_m: Sequence[Place],
    limits: Limits,
) -> list[Vec3]:
    """Places at the height of `here_m` whose column of air up or down to `layer_m` is free, the best first.

    Best is where the way home at that layer is free as well, and short. `taken_m`: columns that others are about to
    use.
    """
    wide_m = limits.separation_horizontal_m + SPARE_M
    high_m = limits.separation_vertical_m + SPARE_UP_M
    x, y, z = here_m
    low, high = min(z, layer_m) - high_m, max(z, layer_m) + high_m
    between = [other for other in others if low < other.position_m[2] < high]
    beside = [other for other in others if abs(other.position_m[2] - layer_m) < high_m]
    found: list[tuple[bool, float, Vec3]] = []
    for ring in RINGS:
        for k in range(BEARINGS):
            angle = 2 * math.pi * k / BEARINGS
            place = (x + ring * wide_m * math.cos(angle), y + ring * wide_m * math.sin(angle))
            free = all(math.dist(place, other.position_m[:2]) >= wide_m + other.error_m for other in between)
            if free and all(math.dist(place, other) >= wide_m for other in taken_m):
                clear = all(
                    from_straight_m(other.position_m[:2], place, home_m) >= wide_m + other.error_m for other in beside
                )
                found.append((not clear, math.dist(here_m[:2], place) + math.dist(place, home_m), (*place, z)))
    return [place for *_, place in sorted(found)]
