"""Whose a COMMAND_ACK is: of the order under way, or of one before it with the same command.

It names only the command, and where the way is long or frames are doubled, ACKs arrive after their order is over.
Three things tell them apart: nothing is answered sooner than the way there and back takes; a vehicle answers in the
order in which it was asked, so what older copies are still owed comes first; and on a link that doubles frames, where
nobody can count, an ACK that may be an older copy's is taken for that.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.uplink.actions import VehicleAction

Trips = tuple[float, float]
"""Shortest and longest measured time there and back, seconds."""
SURELY = 0.8
"""Of the shortest time there and back: no answer is quicker. The rest is for what a measurement is off by."""
SLACK, SLACK_S = 1.3, 0.2
"""After so much more than the longest time there and back no answer comes any more."""
UNMEASURED: Trips = (0.0, 0.3)
"""Until a vehicle has answered a TIMESYNC: within the 0.6 s after which a copy is sent again (`Retry.SET`)."""
DOUBLED_S = 60.0
"""For so long after one answer too many the link is taken for one that doubles frames."""
MAX_COPIES = 32
"""Remembered of one command: a stop's of 10 s, and those before it."""


@dataclass
class _Copy:
    action: VehicleAction
    sent_s: float
    answered: int = 0

    @property
    def is_owed(self) -> bool:
        """Whether an ACK of it did not come yet."""
        return self.answered < (2 if self.action.double_ack else 1)


class AckMatcher:
    """Copies that were sent, and how many ACKs they are owed."""

    def __init__(self) -> None:
        """Nothing was sent."""
        self.trips: Callable[[int], Trips | None] = lambda vehicle: None
        """Measured times of a vehicle; None where there are none."""
        self._copies: dict[tuple[int, int], deque[_Copy]] = {}
        """By vehicle and command, in the order in which they were sent."""
        self._doubled_s: dict[tuple[int, int], float] = {}
        """When more ACKs came last than were owed, by the same."""

    def patience_s(self, vehicle: int) -> float:
        """For how long an answer of `vehicle` may still come; a copy that is repeated sooner is so for nothing."""
        return SLACK * self._trips(vehicle)[1] + SLACK_S

    def sent(self, action: VehicleAction, now: float) -> None:
        """A copy of `action` left."""
        if action.command is not None:
            copies = self._copies.setdefault((action.vehicle, action.command), deque(maxlen=MAX_COPIES))
            copies.append(_Copy(action, now))

    def is_older(
        self, vehicle: int, command: int, action: VehicleAction | None, now: float, *, last: bool = True
    ) -> bool:
        """Note that an ACK came; whether it is not `action`'s (the one under way) but that of one before it.

        Args:
            vehicle: Who answered.
            command: The MAV_CMD that it names.
            action: What is under way with that command, None if nothing is.
            now: When it came.
            last: Whether the copy that it answers is owed no further ACK; not after IN_PROGRESS.
        """
        key = (vehicle, command)
        copies = self._copies.get(key, deque())
        while copies and now - copies[0].sent_s > self.patience_s(vehicle):
            copies.popleft()
        older = [copy for copy in copies if copy.action is not action]
        too_soon = action is not None and now - action.first_s < SURELY * self._trips(vehicle)[0]
        owed = next((copy for copy in (older if too_soon else copies) if copy.is_owed), None)
        if owed is not None and last:
            owed.answered += 1
        elif owed is None and copies:
            self._doubled_s[key] = now
        doubled = now - self._doubled_s.get(key, -math.inf) < DOUBLED_S
        return bool(older) and (too_soon or doubled or (owed is not None and owed.action is not action))

    def _trips(self, vehicle: int) -> Trips:
        return self.trips(vehicle) or UNMEASURED
