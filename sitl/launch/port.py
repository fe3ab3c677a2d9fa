"""The UDP port of one simulated vehicle, in the manner of its autopilot."""

import socket
from typing import Self

from sitl.launch.process import LaunchError

Address = tuple[str, int]

RECEIVE_BUFFER_BYTES = 1 << 20
MAX_DATAGRAM_BYTES = 2048


class Port:
    """A socket of its own. ArduPilot hears nobody but its partner.

    PX4 obeys everybody, but answers only one: `target`, until the first datagram comes; then for ever who sent that.
    """

    def __init__(self, target: Address, *, latches: bool) -> None:
        """Open it.

        Raises:
            LaunchError: Unknown host, no socket.
        """
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._latches = latches
        self._partner = target
        try:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
            self.socket.setblocking(False)
            if latches:
                self.socket.bind((_own_address(target), 0))
            else:
                self.socket.connect(target)
        except (OSError, UnicodeError) as error:
            self.socket.close()
            why = getattr(error, "strerror", None) or error
            raise LaunchError(f"--target {target[0]}:{target[1]}: {why}") from error
        self._unheard = latches

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give it back."""
        self.socket.close()

    def receive(self) -> bytes | None:
        """One datagram; None when there is none."""
        while True:
            try:
                data, sender = self.socket.recvfrom(MAX_DATAGRAM_BYTES)
            except BlockingIOError:
                return None
            except ConnectionRefusedError:
                continue  # the echo of an earlier send nobody heard
            except OSError:
                return None
            if self._unheard:
                self._unheard, self._partner = False, sender
            return data

    def send(self, datagram: bytes) -> None:
        """Send to the partner; lost if nobody listens (yet) or the buffer is full, as by a radio."""
        try:
            if self._latches:
                self.socket.sendto(datagram, self._partner)
            else:
                self.socket.send(datagram)
        except OSError:
            return


def _own_address(target: Address) -> str:
    """The address of this machine on the way to `target`: strangers elsewhere need not hear of a simulation."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(target)
        return str(probe.getsockname()[0])
