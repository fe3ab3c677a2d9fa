"""Adapts the speed of a tour when vehicles cannot follow it, in strong wind or with a heavy load.

An aircraft's drag is not known beforehand, and autopilots seldom report the wind. So the speed is found by trial:
slower after a vehicle was too far from its slot for some seconds, faster again after half a minute on the slots. If
that fails, it is the air or the load and not what one vehicle met once: the next trial waits for five minutes, and each
later one twice as long.
"""

import math
from collections.abc import Container
from dataclasses import dataclass

import msgspec

# Real ArduCopters, against 3 m/s of wind, used all the 30 degrees they may lean at 8 m/s and were 8 m beside their
# tour. At 6 m/s they were 0.6 m beside it.
OFF_COURSE_M, OFF_COURSE_S = 0.5, 3.0
"""A cross-track error this much larger than planned, for this long in all, is too large: places are missed."""
FORGOTTEN = 0.05
"""Seconds off course that are forgotten for each second on course."""
SLOWER = 0.85
"""Factor of one step: a quarter less acceleration, and as much less drag."""
MIN_SHARE = 0.5
"""The tour is never flown slower than this share of its speed."""
FIRST_TRY_S = 30.0
"""After this long on the slots a faster step is tried for the first time.

Eight real ArduCopters in still air slowed to 85 %, because one that had just joined was 3 m beside its way, and stayed
slow for the whole round: 300 s were waited, and idleness was 1.81 x the ideal instead of 1.50 x.
"""
TRY_S, MAX_TRY_S = 300.0, 2400.0
"""After a faster step has failed the next one waits for the first; the time doubles with each failure up to the
second."""
GOOD_STEP_S = 10.0
"""Resolution of the good time that is handed on: the station writes it down whenever it has changed."""
SETTLES_S = 6.0
"""After a step the error is ignored for this long, so that late vehicles can catch up."""
CHANGE_PER_S = 0.1
"""Change of the speed per second as a share of the tour's speed: 0.8 m/s² at 8 m/s."""
MAX_GAP_S, MAX_PAUSE_S = 1.0, 2.0
"""A single gap between looks counts for at most the first. After the second the vehicles were without plans, too: real
ArduCopters had braked meanwhile, and were off course for reasons other than wind."""


@dataclass
class SpeedAdaptation:
    """The speed at which a tour is flown. Field names are stored in snapshots."""

    share: float = 1.0
    """Present share of the tour's own speed."""
    wanted: float = 1.0
    """The share that `share` moves to."""
    beside_s: float = 0.0
    good_s: float = 0.0
    try_s: float = FIRST_TRY_S
    tried: bool = False
    """The last step was a faster one, and has not lasted for `TRY_S` yet."""
    judged_s: float = -math.inf
    stepped_s: float = -math.inf
    slowed_by: int = 0
    """The vehicle that was off course when the last slower step was made; 0 for none."""

    def handed_on(self) -> bytes:
        """Return what is still true for another tour in the same air; b"" while nothing was learnt.

        It changes rarely.
        """
        good_s = self.good_s // GOOD_STEP_S * GOOD_STEP_S if self.wanted < 1.0 else 0.0
        after = SpeedAdaptation(self.wanted, self.wanted, good_s=good_s, try_s=self.try_s, tried=self.tried)
        return msgspec.msgpack.encode(after) if after != SpeedAdaptation() else b""

    def judge(self, t_s: float, off_m: float) -> float:
        """Take the worst vehicle's cross-track error beyond the planned one, `off_m`; NaN if no vehicle is on a slot.

        Return the time since the last call, as far as it counts.
        """
        if MAX_PAUSE_S < t_s - self.judged_s < math.inf:
            self.stepped_s = t_s
        gap_s = min(max(t_s - self.judged_s, 0.0), MAX_GAP_S)
        self.judged_s = t_s
        if not math.isfinite(off_m) or t_s < self.stepped_s + SETTLES_S:
            return gap_s
        if off_m > OFF_COURSE_M:
            self.beside_s, self.good_s = self.beside_s + gap_s, 0.0
        else:
            self.beside_s, self.good_s = max(0.0, self.beside_s - FORGOTTEN * gap_s), self.good_s + gap_s
        if self.tried and self.good_s >= TRY_S:
            # It has succeeded: what slows the tour after this is another thing.
            self.tried, self.try_s = False, FIRST_TRY_S
        if self.beside_s >= OFF_COURSE_S and self.wanted > MIN_SHARE:
            self.try_s = min(max(2.0 * self.try_s, TRY_S), MAX_TRY_S) if self.tried else self.try_s
            self._step(t_s, max(MIN_SHARE, self.wanted * SLOWER), tried=False)
        elif self.good_s >= self.try_s and self.wanted < 1.0:
            self._step(t_s, min(1.0, self.wanted / SLOWER), tried=True)
        return gap_s

    def blame(self, before: float, vehicle: int, owners: Container[int]) -> None:
        """Remember the vehicle that caused a step down from the share `before`.

        Once that one has no slot any more, the next look tries faster.

        `vehicle` is the one that is farthest off course now, `owners` are those with slots.
        """
        if self.wanted < before:
            self.slowed_by = vehicle
        elif self.slowed_by and self.slowed_by not in owners:
            self.slowed_by, self.good_s = 0, self.try_s

    def news(self, before: float) -> list[str]:
        """Return the operator's note if the wanted share was `before` until now."""
        if self.wanted == before:
            return []
        why = "vehicles are beside their slots: wind, load?" if self.wanted < before else "they keep up: faster again"
        return [f"tour flown at {100.0 * self.wanted:.0f} % of its speed: {why}"]

    @property
    def metrics(self) -> dict[str, float]:
        """The share of the speed in percent; empty at full speed."""
        return {"tempo_pct": 100.0 * self.share} if self.share < 1.0 else {}

    def _step(self, t_s: float, wanted: float, tried: bool) -> None:
        self.wanted, self.tried, self.stepped_s = wanted, tried, t_s
        self.beside_s = self.good_s = 0.0

    def advance(self, gap_s: float) -> float:
        """Move towards the wanted share; return the factor by which the speed changes now."""
        before, most = self.share, CHANGE_PER_S * gap_s
        self.share += min(max(self.wanted - self.share, -most), most)
        return self.share / before


def from_inherited(data: bytes) -> SpeedAdaptation:
    """Return what `handed_on` gave. Raises ValueError for anything else."""
    tempo = msgspec.msgpack.decode(data, type=SpeedAdaptation)
    in_limits = MIN_SHARE <= tempo.wanted <= 1.0 and tempo.good_s >= 0.0 and FIRST_TRY_S <= tempo.try_s <= MAX_TRY_S
    if not in_limits or tempo.handed_on() != data:
        raise ValueError("this is no tempo")
    return tempo
