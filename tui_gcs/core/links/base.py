"""What every link is to the station: bytes in with their sender, bytes out to an address."""

from abc import ABC, abstractmethod

from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.sources import Address

MAX_DATAGRAMS_PER_RECEIVE = 2048
"""One `receive` takes at most this many, so that a flood on one link cannot starve the others."""
MAX_BYTES_PER_RECEIVE = 32 * 1024
"""One `receive` takes not much more than this: a datagram of 64 KiB may be 5,000 frames. At 200 calls a second it is
6.5 MB/s."""


class Link(ABC):
    """A link to vehicles. Nothing here ever blocks, and after opening nothing raises. Counters only grow."""

    stream = False
    """Whether `receive` gives raw chunks of byte streams, not datagrams of whole frames."""

    is_closed = False
    """Whether an operator has closed it: then its error is no trouble."""

    def __init__(self, spec: LinkSpec) -> None:
        """Begin with `spec`, the description that the operator gave."""
        self.spec = spec
        self.name = spec.name
        self.error = ""
        """Why the link does not work at present; "" if it does."""
        self.partners: list[Address] = []
        """Addresses that get our heartbeat unasked: the one partner of a point-to-point link; [] where we listen."""
        self.bytes_in = self.bytes_out = 0
        """Payload bytes received, and handed to the system."""
        self.send_refused = 0
        """Frames that could not be sent, or were dropped before they left."""
        self.refused_clients = 0
        """Clients that a server link turned away because all its places were taken."""

    @property
    def kernel_drops(self) -> int:
        """Datagrams that the system dropped because they were not read in time; 0 where it does not count them."""
        return 0

    @abstractmethod
    def receive(self) -> list[tuple[bytes, Address]]:
        """Return what has arrived, each with its sender; bounded per call. Also reconnects.

        A stream link returns chunks as they come, cut anywhere. b"" means that the sender's stream ends or (re)starts
        here: what is held back of it must be dropped.
        """

    @abstractmethod
    def send(self, data: bytes, to: Address) -> None:
        """Send one frame. A frame that cannot be sent now is dropped and counted: services repeat."""

    def filenos(self) -> list[int]:
        """Return descriptors for select: one of them is readable when `receive` has something; [] if there is none."""
        return []

    @abstractmethod
    def close(self) -> None:
        """Close the link. Nothing is received or sent any more."""


def reason(error: Exception) -> str:
    """Return why the system refused, in one line of plain text."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
