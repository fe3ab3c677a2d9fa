"""How well the vehicles of a team kept their slots: how far they were from them, how early or late on a course."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tui_gcs.core.motion.tracking_error import MIN_SPEED_M_S
from tui_gcs.core.protocol.common import VehicleRow

TOO_SLOW_M_S = 1.5 * MIN_SPEED_M_S
"""Where no vehicle is as fast as this, no course was as fast as `MIN_SPEED_M_S`, from which on a lag is measured."""


@dataclass
class SlotKeeping:
    """The distances and lags of one team in its measured time."""

    # A list of all distances was 30 MB a round with 250 vehicles.
    off_cm: Counter[int] = field(default_factory=Counter)
    """How often a vehicle was so many centimetres off its slot."""
    off_max_m: float = math.nan
    lag_max_s: float = math.nan
    fastest_m_s: float = math.nan

    def take(self, flying: Sequence[VehicleRow]) -> None:
        """Count where the vehicles are now."""
        off_m = [row.slot_error_m for row in flying if math.isfinite(row.slot_error_m)]
        self.off_cm.update(round(100.0 * each) for each in off_m)
        self.off_max_m = _larger(self.off_max_m, off_m)
        self.lag_max_s = _larger(self.lag_max_s, [abs(row.lag_s) for row in flying if math.isfinite(row.lag_s)])
        self.fastest_m_s = _larger(self.fastest_m_s, [math.hypot(*row.velocity_m_s) for row in flying])

    @property
    def stands(self) -> bool:
        """Whether the vehicles hover or are so slow that none of them can be told to be early or late."""
        return math.isnan(self.lag_max_s) and self.fastest_m_s < TOO_SLOW_M_S

    @property
    def off_p95_m(self) -> float:
        """The distance from their slots that vehicles kept for 95 % of the time, in whole centimetres; NaN if none."""
        seen, wanted = 0, 0.95 * self.off_cm.total()
        for off_cm, count in sorted(self.off_cm.items()):
            seen += count
            if seen >= wanted:
                return off_cm / 100.0
        return math.nan


def _larger(most: float, values: Sequence[float]) -> float:
    return float(np.fmax(most, max(values, default=math.nan)))
