"""Up-ways: whether what this station sends over a path arrives at the vehicle that is heard there.

A transmitter that failed, or a wrong port, leaves the way down alive: the vehicle is shown as ever, and no order
reaches it. Requests for the vehicle's time (TIMESYNC) are the probes. That a path is dead is decided by probability:
so many requests in a row would all have been lost by chance less often than once in `1 / MAX_CHANCE` times.
"""

import math
from collections import deque
from dataclasses import dataclass, field

from tui_gcs.core.fleet.fleet import frame_counts
from tui_gcs.core.fleet.identity.path import Path

MAX_CHANCE = 1e-6
"""With a request every 5 s a vehicle has a false alarm in two months, whatever the loss: a million requests."""
MIN_MISSED = 3
"""However good the link, fewer missing answers than this are never taken for a dead up-way."""
ANSWER_S = 4.0
"""An answer that has not come after this time is missing."""
HEARD_S = 3.0
"""A missing answer counts only if the vehicle was heard over the path this short a time before."""
FORGET_S = 60.0
"""A request older than this is not waited for any more."""
MAX_OUTCOMES = 60
"""How many requests of the past the share of missing answers is taken from."""
MAX_SHARE = 0.9
"""A larger share is not told from a dead up-way: 132 missing answers in a row are the most that is waited for."""


@dataclass
class _TimeRequest:
    sent_s: float
    missed: bool = False


@dataclass
class UpWay:
    """The requests over one path, and what their answers say of its way up."""

    path: Path
    """Its `up_way_dead` is set when so many answers are missing that it is no chance, until the next answer."""
    missed: int = 0
    """How many answers in a row are missing."""
    asked_s: float = -math.inf
    """When the newest request was sent."""
    _requests: dict[int, _TimeRequest] = field(default_factory=dict)
    """Requests that were not answered, by their ts1."""
    _outcomes: deque[bool] = field(default_factory=lambda: deque(maxlen=MAX_OUTCOMES))
    """Whether requests were answered, up to the newest answer."""
    _counts: tuple[int, int] = (0, 0)
    """Frames received and lost over the path at the newest answer."""

    def ask(self, ts1: int, now: float) -> None:
        """A request with this ts1 leaves now."""
        self._requests[ts1], self.asked_s = _TimeRequest(now), now

    def answer(self, ts1: int) -> float | None:
        """An answer came, over whichever path. Return when its request was sent; None if it was not sent here."""
        request = self._requests.pop(ts1, None)
        if request is None:
            return None
        # One that came late counts as missing in the share all the same: it is no use for an order.
        self._outcomes += [False] * self.missed + [True]
        self.missed, self.path.up_way_dead = 0, False
        self._counts = frame_counts(self.path)
        return request.sent_s

    def settle(self, now: float) -> None:
        """Count the requests whose answers are missing now."""
        for ts1, request in list(self._requests.items()):
            if now - request.sent_s > FORGET_S:
                del self._requests[ts1]
            elif not request.missed and now - request.sent_s >= ANSWER_S:
                request.missed = True
                # While the vehicle is not heard either, its answer may have been lost on the way down.
                self.missed += now - self.path.last_heard_s <= HEARD_S
                if self.missed >= missing_for_certain(self.chance_of_missing()):
                    self.path.up_way_dead = True

    def chance_of_missing(self) -> float:
        """The probability that one answer is missing although the up-way lives, 0…1.

        The way up is taken to lose as many frames as the way down since the newest answer. If it is worse, more answers
        were missing in the past, so the larger of the two counts.
        """
        frames, lost = (new - old for new, old in zip(frame_counts(self.path), self._counts, strict=True))
        # Laplace's estimate: nothing lost of few frames is no proof of a link without loss.
        loss = (lost + 1) / (frames + lost + 2)
        both_ways = 1.0 - (1.0 - loss) ** 2
        # One standard deviation more: the share of 60 is known no better than that.
        missed = self._outcomes.count(False)
        in_the_past = (missed + math.sqrt(missed) + both_ways) / (len(self._outcomes) + 1)
        return min(MAX_SHARE, max(both_ways, in_the_past))


def missing_for_certain(chance: float) -> int:
    """How many answers in a row are missing by chance less often than `MAX_CHANCE`, if one is with `chance`."""
    return max(MIN_MISSED, math.ceil(math.log(MAX_CHANCE) / math.log(chance)))
