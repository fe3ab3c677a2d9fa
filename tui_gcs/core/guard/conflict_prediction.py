"""Who will come too close to whom: what all vehicles do in the next seconds, as the guard foresees it.

The guard keeps what it steers apart; this looks at everybody, also at who is flown by a pilot, drifts or was vetoed,
and farther ahead, so that the operator hears of it while there is time to hold one of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tui_gcs.core.guard.course_samples import STEP_S
from tui_gcs.core.guard.motion_prediction import VehicleState, predict
from tui_gcs.core.guard.separation_check import GROUND_M
from tui_gcs.core.scenario.model import Limits

AHEAD_S = 10.0
TIMES_S = np.arange(0.0, AHEAD_S + STEP_S / 2, STEP_S)


@dataclass(frozen=True)
class PredictedConflict:
    """Two vehicles that will be closer than both limits."""

    one: int
    other: int
    in_s: float
    """Until that begins."""
    level_m: float
    """How far apart on the map they will then be at the least, within `AHEAD_S`."""


def predicted_conflicts(states: list[VehicleState], limits: Limits, now: float) -> Iterator[PredictedConflict]:
    """Pairs that will be too close and are not yet: that is another alarm."""
    states = [s for s in states if not s.in_column and s.position_m[2] >= GROUND_M]
    if len(states) < 2:
        return
    prediction = predict(states, limits, TIMES_S, now)
    wide_m, high_m = limits.separation_horizontal_m, limits.separation_vertical_m
    low, high = prediction.goes_m.min(axis=1), prediction.goes_m.max(axis=1)
    reach = np.array([wide_m, wide_m, high_m])
    near = ((low[:, None] < high[None] + reach) & (high[:, None] > low[None] - reach)).all(axis=2)
    ones, others = np.nonzero(np.triu(near, 1))
    gap = prediction.goes_m[ones] - prediction.goes_m[others]
    level_m = np.hypot(gap[..., 0], gap[..., 1])
    close = (level_m < wide_m) & (np.abs(gap[..., 2]) < high_m)
    for pair in np.flatnonzero(close.any(axis=1) & ~close[:, 0]).tolist():
        least_m = float(level_m[pair][close[pair]].min())
        in_s = float(TIMES_S[np.argmax(close[pair])])
        yield PredictedConflict(int(prediction.ids[ones[pair]]), int(prediction.ids[others[pair]]), in_s, least_m)
