"""Detects that the station itself stood still: its process was stopped, or its computer was busy with something else.

After a stall the oldest frames are read first, and the newest were dropped: what is known of vehicles is seconds old.
So nothing is decided before each vehicle has been heard again.
"""

import math
from dataclasses import dataclass

PAUSE_S = 2.0
"""A longer gap between two ticks is a stall. A planner is waited for as long (`planner_monitor.SILENT_S`), and
ArduCopter follows its last velocity set-point for 3 s, so nothing has happened to vehicles before."""
HEARS_FIRST_S = 1.5
"""How long the station only listens after a stall; heartbeats, which carry the mode, come once a second."""


# Learned in a flight with a real PX4 that was returning by its failsafe: after a stall of 19 s the station saw it
# in OFFBOARD, had it hold because "its planner is silent", and so ended its return.
@dataclass
class StallDetector:
    """Measures the time between the station's ticks; `is_over` is called in each."""

    lasted_s: float = 0.0
    """Length of the newest stall."""
    _asked_s: float = math.inf
    _caught_up_s: float = math.inf

    @property
    def catches_up(self) -> bool:
        """Whether the station is still hearing from vehicles again after a stall: what it knows may be old."""
        return math.isfinite(self._caught_up_s)

    def is_over(self, now: float) -> bool:
        """Note a tick; True once after each stall, when the vehicles have been heard again."""
        gap_s, self._asked_s = now - self._asked_s, now
        if gap_s > PAUSE_S:
            self.lasted_s, self._caught_up_s = gap_s, now + HEARS_FIRST_S
        if now < self._caught_up_s:
            return False
        self._caught_up_s = math.inf
        return True
