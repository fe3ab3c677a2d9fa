"""What an intent takes of a vehicle's battery."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tui_gcs.core.motion.power import most_use_pct_s, use_pct_s
from tui_gcs.core.protocol.common import Intent
from tui_gcs.core.scenario.model import VehicleClass

Legs = list[tuple[float, float]]
"""Durations in seconds, each with the speed in m/s that is flown meanwhile."""


@dataclass(frozen=True)
class Energy:
    """What is known of one vehicle's battery. Unknown numbers are NaN."""

    kind: VehicleClass
    battery_pct: float
    battery_left_s: float
    """Flight time until it is empty, in hover or at the speed limit, where it uses more."""
    home_s: float
    """How long the way home and the landing take."""

    def cost_pct(self, intent: Intent, here_m: ArrayLike, t_s: float, duration_s: float | None) -> float:
        """Return which share of the battery the vehicle at `here_m` (x, y, z) uses for an intent, in percent, or NaN.

        Raises:
            ValueError: the intent has no end and `duration_s` is None.
        """
        if intent.kind == "return":
            # A landing is slow: the way home is taken at the greatest use.
            hovers = use_pct_s(self.kind, 0.0) >= most_use_pct_s(self.kind)
            legs = [(self.home_s, 0.0 if hovers else self.kind.speed_m_s)]
        else:
            legs = _legs(intent, here_m, self.kind.speed_m_s, t_s, duration_s)
        if duration_s is not None:
            legs = _cut(legs, duration_s)
        if not self.battery_left_s > 0.0:
            return math.nan
        # The charge lasts `battery_left_s` at the greatest use: this corrects the model by what was measured.
        measured = self.battery_pct / (self.battery_left_s * most_use_pct_s(self.kind))
        return measured * sum(seconds * use_pct_s(self.kind, speed_m_s) for seconds, speed_m_s in legs)


def _legs(intent: Intent, here_m: ArrayLike, limit_m_s: float, t_s: float, duration_s: float | None) -> Legs:
    """Return what is flown until the intent ends. Raises ValueError where it has no end and no duration is given."""
    if intent.kind == "goto" and intent.position_m is not None:
        speed_m_s = intent.speed_m_s or limit_m_s
        return [(float(np.linalg.norm(np.subtract(intent.position_m, here_m))) / speed_m_s, speed_m_s)]
    if intent.kind == "velocity" and intent.velocity_m_s is not None:
        return [(intent.valid_s, float(np.linalg.norm(intent.velocity_m_s)))]
    if intent.kind == "trajectory" and len(intent.positions_m):
        steps_m = np.linalg.norm(np.diff(np.asarray(intent.positions_m, dtype=float), axis=0), axis=1)
        gone = max(math.floor((t_s - intent.t0_s) / intent.dt_s), 0)
        waits: Legs = [(max(intent.t0_s - t_s, 0.0), 0.0)]
        return waits + [(intent.dt_s, float(step_m) / intent.dt_s) for step_m in steps_m[gone:]]
    if duration_s is None:
        raise ValueError(f"{intent.kind} has no end: give a duration")
    return [(duration_s, (intent.speed_m_s or limit_m_s) if intent.kind == "orbit" else 0.0)]


def _cut(legs: Legs, duration_s: float) -> Legs:
    """Return the legs of the first `duration_s`; a vehicle that has arrived hovers for the rest."""
    cut, left_s = Legs(), duration_s
    for seconds, speed_m_s in [*legs, (math.inf, 0.0)]:
        cut.append((min(seconds, left_s), speed_m_s))
        left_s -= cut[-1][0]
        if left_s <= 0.0:
            break
    return cut
