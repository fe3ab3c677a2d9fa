"""Whether two ways bring the positions of one vehicle, where hardware id and boot clock do not tell.

Simulators and cheap boards have one hardware id or none, and one power switch gives two vehicles one boot clock. The
same position at the same time of the boot clock is a copy; else they must agree much better than the vehicle moved
meanwhile. Two that stand side by side are not told apart, and not taken for one.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.mavlink.sources import Slot

DIFFERENT_VEHICLE_M = 15.0
"""Positions farther apart than GPS and two EKFs explain are of two vehicles."""
MAX_AGREEMENT_M = 5.0
"""Farther apart than this they say nothing."""
MIN_MATCHING_POSITIONS = 3
"""So many positions that are the same to the last bit, boot time included."""
MIN_MOVEMENT_RATIO, MIN_DIFFERENCE_M = 4.0, 0.5
"""It must have moved by so many times what the positions differ by, taken for at least the second."""
MAX_BOOT_DIFFERENCE_S = 3.0
"""Positions whose boot times are farther apart are not compared."""
M_PER_DEG = 111_194.9
"""Of latitude, on a sphere of 6,371 km: good enough over some metres."""


@dataclass(slots=True)
class PathCorrelation:
    """What the positions of a path said so far, compared with those of the vehicle."""

    same: bool | None = None
    begun: tuple[float, ...] = ()
    """The values of the first position that agreed; all since did, too."""
    differed_m: float = MIN_DIFFERENCE_M
    """The most that they differed by since then."""

    def compare(self, ours: Slot | None, theirs: Slot | None) -> None:
        """Take the newest position of the vehicle and that of the path."""
        gap_m = unexplained_gap_m(ours, theirs)
        if theirs is None or math.isnan(gap_m):
            return
        values = theirs.values()
        if gap_m > MAX_AGREEMENT_M:
            self.same, self.begun, self.differed_m = (
                (False if gap_m > DIFFERENT_VEHICLE_M else None),
                (),
                MIN_DIFFERENCE_M,
            )
        elif not self.begun:
            self.same, self.begun = None, values
        else:
            self.differed_m = max(self.differed_m, gap_m)
            self.same = distance_m(self.begun, values) > MIN_MOVEMENT_RATIO * self.differed_m or None


def unexplained_gap_m(ours: Slot | None, theirs: Slot | None) -> float:
    """Distance between two positions in metres, less what the time between them explains; NaN if not comparable."""
    if ours is None or theirs is None or not ours.raw or not theirs.raw:
        return math.nan
    a, b = ours.values(), theirs.values()
    apart_s = abs(a[0] - b[0]) / 1e3
    if apart_s > MAX_BOOT_DIFFERENCE_S or not (a[1] or a[2]) or not (b[1] or b[2]):
        return math.nan
    explained_m: float = max(_speed_m_s(a), _speed_m_s(b)) * apart_s
    return max(0.0, distance_m(a, b) - explained_m)


def distance_m(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Metres between two places as in GLOBAL_POSITION_INT: boot time, degrees times 1e7, millimetres above sea."""
    north_m = (a[1] - b[1]) / 1e7 * M_PER_DEG
    east_deg = (a[2] - b[2]) / 1e7
    east_m = (east_deg + 180.0) % 360.0 - 180.0  # over the date line
    east_m *= M_PER_DEG * math.cos(math.radians(a[1] / 1e7))
    return math.hypot(north_m, east_m, (a[3] - b[3]) / 1e3)


def _speed_m_s(values: tuple[float, ...]) -> float:
    return math.hypot(*values[5:8]) / 100
