"""Path correlation: whether two paths bring the positions of one vehicle.

It decides where hardware id and boot clock do not: simulators and cheap boards have a common hardware id or none, and
one power switch gives two vehicles the same boot clock. An identical position at an identical boot time is a copy.
Otherwise positions must agree much better than the vehicle moved meanwhile. Two vehicles that stand side by side are
neither distinguished nor taken for one.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.mavlink.sources import Slot

DIFFERENT_VEHICLE_M = 15.0
"""Positions farther apart than GPS and two EKFs explain belong to two vehicles."""
MAX_AGREEMENT_M = 5.0
"""Positions farther apart than this are no evidence that the vehicles are the same."""
MIN_MATCHING_POSITIONS = 3
"""This many positions that are identical bit for bit, boot time included, prove a copy."""
MIN_MOVEMENT_RATIO, MIN_DIFFERENCE_M = 4.0, 0.5
"""The vehicle must have moved by this many times the largest difference of positions, taken as at least the second
value in metres."""
MAX_BOOT_DIFFERENCE_S = 3.0
"""Positions are compared only if their boot times differ by less."""
M_PER_DEG = 111_194.9
"""Metres per degree of latitude on a sphere of 6,371 km: exact enough over some metres."""


@dataclass(slots=True)
class PathCorrelation:
    """Result of comparing a path's positions with those of the vehicle so far."""

    same: bool | None = None
    """Whether they are of one vehicle; None while undecided."""
    first_values: tuple[float, ...] = ()
    """Values of the first GLOBAL_POSITION_INT that agreed; all later ones agreed, too. () if the last did not."""
    max_difference_m: float = MIN_DIFFERENCE_M
    """Largest difference of positions since `first_values`, metres."""

    def compare(self, ours: Slot | None, theirs: Slot | None) -> None:
        """Take the newest position of the vehicle and the newest of the path."""
        gap_m = unexplained_gap_m(ours, theirs)
        if theirs is None or math.isnan(gap_m):
            return
        values = theirs.values()
        if gap_m > MAX_AGREEMENT_M:
            self.same, self.first_values, self.max_difference_m = (
                (False if gap_m > DIFFERENT_VEHICLE_M else None),
                (),
                MIN_DIFFERENCE_M,
            )
        elif not self.first_values:
            self.same, self.first_values = None, values
        else:
            self.max_difference_m = max(self.max_difference_m, gap_m)
            self.same = distance_m(self.first_values, values) > MIN_MOVEMENT_RATIO * self.max_difference_m or None


def unexplained_gap_m(ours: Slot | None, theirs: Slot | None) -> float:
    """Return the metres between two positions less what was flown between them; NaN if not comparable."""
    if ours is None or theirs is None or not ours.raw or not theirs.raw:
        return math.nan
    a, b = ours.values(), theirs.values()
    apart_s = abs(a[0] - b[0]) / 1e3
    if apart_s > MAX_BOOT_DIFFERENCE_S or not (a[1] or a[2]) or not (b[1] or b[2]):
        return math.nan
    explained_m: float = max(_speed_m_s(a), _speed_m_s(b)) * apart_s
    return max(0.0, distance_m(a, b) - explained_m)


def distance_m(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Return the metres between two places.

    Each is given as the first values of GLOBAL_POSITION_INT: boot time, degrees * 1e7, millimetres above mean sea
    level.
    """
    north_m = (a[1] - b[1]) / 1e7 * M_PER_DEG
    east_deg = (a[2] - b[2]) / 1e7
    east_m = (east_deg + 180.0) % 360.0 - 180.0  # the short way at the date line
    east_m *= M_PER_DEG * math.cos(math.radians(a[1] / 1e7))
    return math.hypot(north_m, east_m, (a[3] - b[3]) / 1e3)


def _speed_m_s(values: tuple[float, ...]) -> float:
    return math.hypot(*values[5:8]) / 100
