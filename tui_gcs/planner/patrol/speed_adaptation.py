"""A tour is flown slower where vehicles cannot keep up with it: in too much wind, with too much load.

Nobody knows an aircraft's drag beforehand, and autopilots seldom tell the wind: real ArduCopters, against 3 m/s of
wind, used all the 30 degrees they may lean at 8 m/s and were 8 m beside their tour; at 6 m/s they were 0.6 m beside it.
So it is tried: slower after somebody was too far from its slot for some seconds, faster again after a good while, and
after a longer one if that did not go well.
"""

import math
from dataclasses import dataclass

import msgspec

OFF_COURSE_M, OFF_COURSE_S = 0.5, 3.0
"""So much farther beside its way than was planned for, for so long in all, is too far: places are missed."""
FORGOTTEN = 0.05
"""Of a second beside the tour, for each second on it."""
SLOWER = 0.85
"""One step: a fourth less acceleration, and less drag by as much."""
MIN_SHARE = 0.5
TRY_S, MAX_TRY_S = 300.0, 2400.0
"""On the slots for so long, a step faster is tried; twice as long after one that failed."""
GOOD_STEP_S = 10.0
"""What is handed on counts so roughly: a station writes it down whenever it has changed."""
SETTLES_S = 6.0
"""After a step nothing is judged for so long: who is behind catches up first."""
CHANGE_PER_S = 0.1
"""The speed changes by this share of the tour's in a second: 0.8 m/s2 at 8 m/s."""
MAX_GAP_S, MAX_PAUSE_S = 1.0, 2.0
"""Nothing counts for longer than the first, though nobody looked; after the second nobody led the vehicles either: real
ArduCopters had braked meanwhile, and were not beside their way for any wind."""


@dataclass
class SpeedAdaptation:
    """How fast a tour is flown."""

    share: float = 1.0
    """Of its own speed, now."""
    wanted: float = 1.0
    """What `share` is going to be."""
    beside_s: float = 0.0
    good_s: float = 0.0
    try_s: float = TRY_S
    tried: bool = False
    """The last step was a faster one."""
    judged_s: float = -math.inf
    stepped_s: float = -math.inf

    def handed_on(self) -> bytes:
        """For another tour in the same air; b"" while nothing was learnt of it. Does not change with every step."""
        good_s = self.good_s // GOOD_STEP_S * GOOD_STEP_S if self.wanted < 1.0 else 0.0
        after = SpeedAdaptation(self.wanted, self.wanted, good_s=good_s, try_s=self.try_s, tried=self.tried)
        return msgspec.msgpack.encode(after) if after != SpeedAdaptation() else b""

    def judge(self, t_s: float, off_m: float) -> float:
        """`off_m`: how much farther beside its way than was planned for the worst vehicle is; NaN: nobody is on a slot.

        The time since the last judgement, as far as it counts.
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
        if self.beside_s >= OFF_COURSE_S and self.wanted > MIN_SHARE:
            self.try_s = min(2.0 * self.try_s, MAX_TRY_S) if self.tried else self.try_s
            self._step(t_s, max(MIN_SHARE, self.wanted * SLOWER), tried=False)
        elif self.good_s >= self.try_s and self.wanted < 1.0:
            self._step(t_s, min(1.0, self.wanted / SLOWER), tried=True)
        return gap_s

    def news(self, before: float) -> list[str]:
        """What is to be told if `before` was what was wanted until now."""
        if self.wanted == before:
            return []
        why = "vehicles are beside their slots: wind, load?" if self.wanted < before else "they keep up: faster again"
        return [f"tour flown at {100.0 * self.wanted:.0f} % of its speed: {why}"]

    @property
    def metrics(self) -> dict[str, float]:
        """Nothing at full speed."""
        return {"tempo_pct": 100.0 * self.share} if self.share < 1.0 else {}

    def _step(self, t_s: float, wanted: float, tried: bool) -> None:
        self.wanted, self.tried, self.stepped_s = wanted, tried, t_s
        self.beside_s = self.good_s = 0.0

    def advance(self, gap_s: float) -> float:
        """Nearer to what is wanted: by what the speed is to be multiplied now; 1.0 if it is right."""
        before, most = self.share, CHANGE_PER_S * gap_s
        self.share += min(max(self.wanted - self.share, -most), most)
        return self.share / before


def from_inherited(data: bytes) -> SpeedAdaptation:
    """What was `handed_on`. Raises ValueError if it was not."""
    tempo = msgspec.msgpack.decode(data, type=SpeedAdaptation)
    in_limits = MIN_SHARE <= tempo.wanted <= 1.0 and tempo.good_s >= 0.0 and TRY_S <= tempo.try_s <= MAX_TRY_S
    if not in_limits or tempo.handed_on() != data:
        raise ValueError("this is no tempo")
    return tempo
