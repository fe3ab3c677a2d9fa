"""A link that an operator has closed: it stays in the table of links, for its paths are known, and carries nothing."""

from tui_gcs.core.links.base import Link
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.sources import Address


class ClosedLink(Link):
    """Receives nothing, and counts what it does not send."""

    is_closed = True

    def __init__(self, spec: LinkSpec, by: str) -> None:
        """Stand for the link of `spec`; `by` closed it."""
        super().__init__(spec)
        self.error = f"closed by {by}"

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        return []

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`."""
        self.send_refused += 1

    def close(self) -> None:
        """There is nothing to close."""
