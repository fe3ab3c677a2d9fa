"""Requests leave in the order in which they were given, though each has a thread and none waits for another's answer.

A link that lags delivers many keys at once: of *resume* and *hold*, given a millisecond apart, the hold must be last.
"""

import threading
from dataclasses import dataclass, field

MAX_WAIT_S = 0.2
"""A request waits this long at most for the one before it to be sent, which normally takes less than a millisecond."""


@dataclass(frozen=True)
class RequestTicket:
    """One request's place in the sequence."""

    previous: threading.Event | None
    """Set when the request before this one is sent, or will not be sent; None for the first request."""
    sent: threading.Event = field(default_factory=threading.Event)
    """Set when this request is sent, or will not be sent."""

    def wait(self) -> None:
        """Block the calling thread until the request before this one is sent, for at most `MAX_WAIT_S`."""
        if self.previous is not None:
            self.previous.wait(MAX_WAIT_S)


class RequestSequence:
    """Issues tickets in the order of the calls, all on one thread."""

    def __init__(self) -> None:
        self._last: threading.Event | None = None

    def next_ticket(self) -> RequestTicket:
        """Return the ticket of the request that is given now."""
        ticket = RequestTicket(self._last)
        self._last = ticket.sent
        return ticket
