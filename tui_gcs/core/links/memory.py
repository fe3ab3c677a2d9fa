"""A link that exists in memory only: lock-step runs and tests hand datagrams over through it."""

from collections import deque

from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE, Address


class MemoryLink:
    """What is injected is received; what is sent waits in `sent` for who plays the vehicles."""

    def __init__(self, name: str = "memory") -> None:
        """A link with nothing on it."""
        self.name = name
        self.error = ""
        self.sent: deque[tuple[bytes, Address]] = deque()
        self._arrived: deque[tuple[bytes, Address]] = deque()

    def inject(self, data: bytes, address: Address) -> None:
        """A datagram arrives from `address`."""
        self._arrived.append((data, address))

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        count = min(len(self._arrived), MAX_DATAGRAMS_PER_RECEIVE)
        return [self._arrived.popleft() for _ in range(count)]

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`."""
        self.sent.append((data, to))

    def fileno(self) -> int | None:
        """There is no descriptor."""
        return None

    def close(self) -> None:
        """Forget what has not been received."""
        self._arrived.clear()
