"""The UDP port of one simulated vehicle, which behaves as that of its autopilot in SITL."""

import socket
from typing import Self

from sitl.launch.process import LaunchError, why

Address = tuple[str, int]

# A station that stalls for a second sends all it has at once.
RECEIVE_BUFFER_BYTES = 1 << 20
MAX_DATAGRAM_BYTES = 2048


class VehiclePort:
    """One vehicle's socket. That of an ArduPilot is connected: it receives from its target only.

    PX4 receives from any address, but sends to one only: to `target` until the first datagram arrives, then for ever to
    the sender of that (docs/autopilots.md "Wire of PX4").
    """

    def __init__(self, target: Address, *, latches: bool) -> None:
        """Open the socket; `latches` is PX4's behaviour.

        Raises:
            LaunchError: The host is unknown, or no socket can be opened.
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
            raise LaunchError(f"--target {target[0]}:{target[1]}: {why(error)}") from error
        self._no_sender_yet = latches

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the socket; its port is free again."""
        self.socket.close()

    def receive(self) -> bytes | None:
        """Return one datagram; None when there is none."""
        while True:
            try:
                data, sender = self.socket.recvfrom(MAX_DATAGRAM_BYTES)
            except BlockingIOError:
                return None
            except ConnectionRefusedError:
                # ICMP reported that the port was closed to which an earlier datagram was sent.
                continue
            except OSError:
                return None
            if self._no_sender_yet:
                self._no_sender_yet, self._partner = False, sender
            return data

    def send(self, datagram: bytes) -> None:
        """Send to the partner. The datagram is lost, as over a radio, if no station listens or the buffer is full."""
        try:
            if self._latches:
                self.socket.sendto(datagram, self._partner)
            else:
                self.socket.send(datagram)
        except OSError:
            return


def _own_address(target: Address) -> str:
    """Return this machine's address on the way to `target`."""
    # Bound to this address only, so that other networks of this machine cannot reach a simulation.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(target)
        return str(probe.getsockname()[0])
