"""What every link is to the station: bytes in with where they came from, bytes out to there."""

from typing import Protocol

Address = tuple[str, int] | str
"""Where a datagram came from, and where an answer to that sender goes."""

MAX_DATAGRAMS_PER_RECEIVE = 2048
"""One `receive` takes at most this many, so that a flood on one link cannot starve the others."""


class LinkError(Exception):
    """A link cannot be opened: one line with what, why and what to do."""


class Link(Protocol):
    """A way to vehicles. Nothing here ever blocks, and after opening nothing raises."""

    name: str
    """The link as the operator wrote it, e.g. "udpin:127.0.0.1:14550"."""
    error: str
    """Why the link does not work just now; empty if it does."""

    def receive(self) -> list[tuple[bytes, Address]]:
        """What has arrived: datagrams (TCP: one frame each), each with its sender."""
        ...

    def send(self, data: bytes, to: Address) -> None:
        """Send one datagram. What cannot be sent now is dropped and told in `error`: services repeat."""
        ...

    def fileno(self) -> int | None:
        """For an event loop: readable when `receive` has something; None if there is no descriptor now."""
        ...

    def close(self) -> None:
        """Let go of the port."""
        ...
