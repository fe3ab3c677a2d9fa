"""When the station itself stood still: its process was stopped, or its computer was busy with something else.

What it reads first after that is what came first: seconds old, and what came last was dropped. Flown with a real PX4
that was returning by its failsafe: after 19 s the station saw it in OFFBOARD, had it hold because "its planner is
silent", and so ended its return. So nothing is decided before vehicles have said how they are now.
"""

import math
from dataclasses import dataclass

PAUSE_S = 2.0
"""A planner that is silent for so long is not waited for any more; no more is this station. Set-points last 3 s."""
HEARS_FIRST_S = 1.5
"""Heartbeats, with the mode, come once a second."""


@dataclass
class StallDetector:
    """Asked in every tick."""

    lasted_s: float = 0.0
    """The newest pause."""
    _asked_s: float = math.inf
    _caught_up_s: float = math.inf

    @property
    def catches_up(self) -> bool:
        """Whether what is known of vehicles may be what was, before a pause."""
        return math.isfinite(self._caught_up_s)

    def is_over(self, now: float) -> bool:
        """True once after each pause, when the vehicles have been heard."""
        gap_s, self._asked_s = now - self._asked_s, now
        if gap_s > PAUSE_S:
            self.lasted_s, self._caught_up_s = gap_s, now + HEARS_FIRST_S
        if now < self._caught_up_s:
            return False
        self._caught_up_s = math.inf
        return True
