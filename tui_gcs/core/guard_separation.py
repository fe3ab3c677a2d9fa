"""Whether vehicles that are foreseen keep apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.course import Samples
from tui_gcs.core.guard_motion import STEP_S, Flock, Mover
from tui_gcs.core.scenario import Limits

GROUND_M = 2.0
"""Below this height above home neither the band nor separation applies."""
SPARE_M, SPARE_UP_M = 0.5, 0.3
"""Kept beyond the limits, for what happens between two samples and for what is foreseen a little wrong."""
SAME = 1e-6
BETTER = 0.3
"""Shares of the limits: less is luck, of when samples are taken."""


@dataclass(frozen=True)
class Meeting:
    """Who comes too close, and when."""

    vehicle: int
    in_s: float


def meeting(me: Mover, flock: Flock, limits: Limits) -> Meeting | None:
    """The first vehicle that `me` gets too close to if it goes on, or brakes a moment later; None if there is none.

    Whom it gets too close to by braking now, too, does not count if it goes on no nearer: what leads apart passes.
    Who climbs or descends in its own column gives way to nobody, but others keep clear of it.
    """
    if me.sight.in_column or me.here_m[2] < GROUND_M:
        return None
    rows = _near(me, flock, limits)
    if not len(rows):
        return None
    wide = limits.separation_horizontal_m + SPARE_M + me.error_m + flock.error_m[rows][:, None]
    high = limits.separation_vertical_m + SPARE_UP_M
    first: Meeting | None = None
    for mine, theirs in (
        (me.goes_m, flock.goes_m[rows]),
        (me.late_m, flock.late_m[rows]),
        (me.late_m, flock.stops_m[rows]),
    ):
        apart = _apart(mine, theirs, wide, high)
        close = apart < 1.0
        for i in np.flatnonzero(close.any(axis=1)).tolist():
            width, other = wide[i : i + 1], theirs[i : i + 1]
            braking = _apart(me.stops_m, other, width, high)[0]
            if braking.min() < 1.0 and any(
                _is_no_worse(going, braking) for going in (apart[i], _apart(me.goes_m, other, width, high)[0])
            ):
                continue
            when_s = float(np.argmax(close[i])) * STEP_S
            if first is None or when_s < first.in_s:
                first = Meeting(int(flock.ids[rows[i]]), when_s)
    return first


def _near(me: Mover, flock: Flock, limits: Limits) -> NDArray[np.intp]:
    """Rows of others in the air whose box comes so near that it matters."""
    wide = limits.separation_horizontal_m + SPARE_M + me.error_m + float(flock.error_m.max(initial=0.0))
    reach = np.array([wide, wide, limits.separation_vertical_m + SPARE_UP_M])
    overlap = (flock.low_m < me.high_m + reach) & (flock.high_m > me.low_m - reach)
    others = (flock.ids != me.sight.id) & (flock.here_m[:, 2] >= GROUND_M)
    return np.flatnonzero(overlap.all(axis=1) & others)


def _apart(mine: Samples, theirs: Samples, wide_m: Samples, high_m: float) -> Samples:
    """(m, k) distance to m others, as the larger share of the two limits: below 1 is too close."""
    gap = theirs - mine
    return np.maximum(np.hypot(gap[..., 0], gap[..., 1]) / wide_m, np.abs(gap[..., 2]) / high_m)


def _is_no_worse(going: Samples, braking: Samples) -> bool:
    """Whether going on keeps the other farther away than braking; where both come about as near, up to that moment."""
    gained = float(going.min() - braking.min())
    until = int(braking.argmin()) + 1
    return gained > BETTER or (gained >= -SAME and bool(going[:until].mean() >= braking[:until].mean() - SAME))
