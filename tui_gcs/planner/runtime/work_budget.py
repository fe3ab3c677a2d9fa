"""Limits background work of a planner on a computer that is too busy for all of it.

Iterations are counted, not timed, so that a rehearsal gives the same result every time. On a slow or busy computer the
same number would make steps late in flight, and three late steps in a row cost the team a hold and its worker. So a
worker in flight gives up background search first.
"""

from dataclasses import dataclass

SLOW_SHARE = 0.5
"""A step that takes more than this share of its period halves the work of the next one; a late step stops it."""
RECOVERY = 0.05
"""Share of the full work that each quick step gives back."""
REPORTED_SHARE = 0.25
"""The operator is notified when the work stays below this share."""
REPORTED_STEPS = 10
"""... for so many steps. The work is back after five steps behind a late one, and every start of a fleet has one."""


@dataclass
class WorkBudget:
    """Halves the background work after a slow step, stops it after a late one, and restores it step by step."""

    share: float = 1.0
    low_steps: int = 0
    """Steps in a row after which the work was below `REPORTED_SHARE`."""

    def took(self, step_s: float, period_s: float) -> bool:
        """Record how long a step took. Return True once the work stays below `REPORTED_SHARE`."""
        # Work granted in one step still runs when the next one comes and makes that one late, too. With eight real PX4s
        # on two shared cores, halving alone was too slow for a computer that got four times as busy.
        if step_s > period_s:
            self.share = 0.0
        elif step_s > SLOW_SHARE * period_s:
            self.share /= 2
        else:
            self.share = min(1.0, self.share + RECOVERY)
        self.low_steps = self.low_steps + 1 if self.share < REPORTED_SHARE else 0
        return self.low_steps == REPORTED_STEPS
