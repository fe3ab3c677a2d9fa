"""How much background work a planner is granted on a computer that is too busy for all of it.

Iterations are counted, not timed, so that a rehearsal is the same every time. In the air a slow or busy computer would
turn them into late steps, and three of those cost the team a hold and its worker. Eight real PX4s on two shared cores
did that at each change of round; so a live worker gives up search, not slots. What is granted in a step is still
being done when the next one comes, and makes that one late, too: halving was too slow for a computer that got four
times as busy.
"""

from dataclasses import dataclass

SLOW_SHARE = 0.5
"""A step that takes more than this share of its period gets less to do next time; a late one nothing."""
RECOVERY = 0.05
FEW = 0.25
"""With less than this share of the work it is told."""


@dataclass
class Pace:
    """Halves the work after a slow step, stops it after a late one, gives it back little by little."""

    share: float = 1.0

    def took(self, step_s: float, period_s: float) -> bool:
        """A step took so long; true if from now on there is so little background work that it should be told."""
        before = self.share
        if step_s > period_s:
            self.share = 0.0
        elif step_s > SLOW_SHARE * period_s:
            self.share /= 2
        else:
            self.share = min(1.0, self.share + RECOVERY)
        return self.share < FEW <= before
