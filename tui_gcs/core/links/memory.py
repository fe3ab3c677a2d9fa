"""Memory link: lock-step runs and tests exchange datagrams through it."""

from collections import deque

from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE, Link
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.sources import Address


class MemoryLink(Link):
    """A link in memory: what is injected is received; what is sent waits in `sent` for the simulated vehicles."""

    def __init__(self, name: str = "memory", *, spec: LinkSpec | None = None, stream: bool = False) -> None:
        """Begin empty; `spec` makes it a link of another network, a slow one or the like."""
        super().__init__(spec if spec is not None else LinkSpec(name, scheme="memory", place=""))
        self.stream = stream
        self.sent: deque[tuple[bytes, Address]] = deque()
        self._arrived: deque[tuple[bytes, Address]] = deque()

    def inject(self, data: bytes, address: Address) -> None:
        """Let a datagram arrive from `address`."""
        self._arrived.append((data, address))

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        count = min(len(self._arrived), MAX_DATAGRAMS_PER_RECEIVE)
        arrived = [self._arrived.popleft() for _ in range(count)]
        self.bytes_in += sum(len(data) for data, _ in arrived)
        return arrived

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`."""
        self.bytes_out += len(data)
        self.sent.append((data, to))

    def close(self) -> None:
        """Drop what has not been received."""
        self._arrived.clear()
