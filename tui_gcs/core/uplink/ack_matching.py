"""Matches each COMMAND_ACK to the copy of an order that it answers: the order under way, or an older one.

A COMMAND_ACK names only the command. On slow links, and where frames are duplicated, it may arrive after its order is
over. Three facts tell the two apart: no answer is quicker than the round trip; a vehicle answers in the order in which
it was asked, so ACKs that older copies still lack come first; and on a link that duplicates frames, where counting is
of no use, an ACK that may belong to an older copy is taken for that.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.uplink.actions import VehicleAction

RoundTrips = tuple[float, float]
"""Shortest and longest measured round trip time, seconds."""
MIN_TRIP_SHARE = 0.8
"""Share of the shortest round trip before which no answer can come; the rest allows for errors of the measurement."""
PATIENCE_FACTOR, PATIENCE_S = 1.3, 0.2
"""After the longest round trip times the first, plus the second, no answer is expected any more."""
UNMEASURED: RoundTrips = (0.0, 0.3)
"""Used until a vehicle has answered a TIMESYNC: within the 0.6 s after which a copy is repeated (`RetryClass.SET`)."""
DOUBLING_MEMORY_S = 60.0
"""For this long after one answer too many the link counts as one that duplicates frames."""
MAX_COPIES = 32
"""Copies remembered of one command: those of a stop in 10 s, and those before it."""


@dataclass
class _Copy:
    action: VehicleAction
    sent_s: float
    answered: int = 0

    @property
    def is_owed(self) -> bool:
        """Whether an ACK of it has not come yet."""
        return self.answered < (2 if self.action.double_ack else 1)


class AckMatcher:
    """Remembers the copies that were sent, and how many ACKs each still lacks."""

    def __init__(self) -> None:
        self.round_trips: Callable[[int], RoundTrips | None] = lambda vehicle: None
        """Measured round trip times of a vehicle; None where there are none."""
        self._copies: dict[tuple[int, int], deque[_Copy]] = {}
        """By vehicle and command, in the order in which they were sent."""
        self._surplus_s: dict[tuple[int, int], float] = {}
        """When more ACKs than were owed came last, by vehicle and command."""

    def patience_s(self, vehicle: int) -> float:
        """How long an answer of `vehicle` may still come; a copy that is repeated sooner is wasted."""
        return PATIENCE_FACTOR * self._trips(vehicle)[1] + PATIENCE_S

    def sent(self, action: VehicleAction, now: float) -> None:
        """Note that a copy of `action` left."""
        if action.command is not None:
            copies = self._copies.setdefault((action.vehicle, action.command), deque(maxlen=MAX_COPIES))
            copies.append(_Copy(action, now))

    def is_older(
        self, vehicle: int, command: int, action: VehicleAction | None, now: float, *, last: bool = True
    ) -> bool:
        """Note that an ACK came; whether it answers an order before `action`, which is the one under way.

        Args:
            vehicle: Id of the vehicle that answered.
            command: The MAV_CMD that it names.
            action: The action under way with that command, None if there is none.
            now: When it came.
            last: Whether the copy that it answers is owed no further ACK; not after IN_PROGRESS.
        """
        key = (vehicle, command)
        copies = self._copies.get(key, deque())
        # No answer to these can come any more.
        while copies and now - copies[0].sent_s > self.patience_s(vehicle):
            copies.popleft()
        older = [copy for copy in copies if copy.action is not action]
        too_soon = action is not None and now - action.first_s < MIN_TRIP_SHARE * self._trips(vehicle)[0]
        owed = next((copy for copy in (older if too_soon else copies) if copy.is_owed), None)
        if owed is not None and last:
            owed.answered += 1
        elif owed is None and copies:
            self._surplus_s[key] = now
        doubled = now - self._surplus_s.get(key, -math.inf) < DOUBLING_MEMORY_S
        return bool(older) and (too_soon or doubled or (owed is not None and owed.action is not action))

    def _trips(self, vehicle: int) -> RoundTrips:
        return self.round_trips(vehicle) or UNMEASURED
